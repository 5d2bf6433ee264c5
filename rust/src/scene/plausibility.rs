//! Plausibility of a scene: numbers that are possible but unlikely, mostly because of units other than SI and
//! radians.
//!
//! Each limit lies far outside the range of machines that have been built, so that a warning is nearly always
//! right.

use crate::numerics::accuracy::ROUNDING;
use std::f64::consts::{FRAC_PI_2, TAU};

use crate::error::Notice;
use crate::scene::parts::{
    Body, Drive, Ends, Force, GuideShape, Joint, JointKind, Scene, Start, same_points,
};
use crate::scene::time_function::TimeFunction;

/// Length [m] from which a body may be one in millimeters: parts of watches measure a few millimeters.
/// Half and twice change no warning of the tests.
const LONG: f64 = 2.0;
/// Mass over the cube of the length [kg/m³] below which no body of that length is rigid. Blades of wind
/// turbines have 0.04, fishing rods of carbon fiber 5e-4, booms that satellites unroll 2e-4; a crank in
/// millimeters has 1e-7 to 1e-5.
const LIGHT: f64 = 1e-4;
/// Length [m] above that of any rigid body: the longest ship measured 458.
/// Half and twice change no warning of the tests.
const LONGEST: f64 = 500.0;
/// Speed [m/s] at which every rotating part has burst: flywheels of carbon fiber reach 1400.
/// Half and twice change no warning of the tests.
const FASTEST: f64 = 2000.0;
/// Speed of the drive of a linkage [rad/s], ten thousand revolutions per minute, from which a round one may be in
/// revolutions per minute: 3000 rpm are 314 rad/s, and 3000 rad/s are reached by turbines alone.
const MANY: f64 = 1000.0;
/// Steps of speeds [rad/s] that are round as speeds in revolutions per minute are.
const ROUND_SPEED: f64 = 50.0;
/// Steps of usual speeds of motors [rpm].
const ROUND_RPM: f64 = 500.0;
/// Above the speed of usual motors [rpm].
const MOST_RPM: f64 = 10_000.0;
/// Radius [m] from which a journal may be one in millimeters. Half and twice change no warning of the tests.
const LARGE_JOURNAL: f64 = 0.1;
/// Implausible ratio of the radius of a journal to the reach of the bodies it joins, the distance to their
/// points and masses. An eccentric is far larger than its throw, but the rod on it is longer than its radius.
/// Half and twice change no warning of the tests.
const JOURNAL_OVER_REACH: f64 = 10.0;
/// Implausible ratio of the radial clearance to the radius of the journal: papers on joints with clearance go
/// up to 0.1. Half and twice change no warning of the tests.
const LOOSE: f64 = 0.3;
/// Range of the rounded acceleration of free fall on Earth in millimeters [mm/s²].
const FALL_IN_MILLIMETERS: [f64; 2] = [9.78e3, 9.84e3];
/// Range of numbers that may be degrees: smaller ones might be radians within two turns.
/// Half and twice change no warning of the tests.
const DEGREES: [f64; 2] = [10.0, 3600.0];

impl Scene {
    /// Warnings of numbers and units that look wrong, in a scene without problems; each with its path.
    pub fn implausible(&self) -> Vec<Notice> {
        let mut warnings = Vec::new();
        self.warn_of_lengths(&mut warnings);
        self.warn_of_joints(&mut warnings);
        self.warn_of_angles(&mut warnings);
        for (index, coupling) in self.couplings.iter().enumerate() {
            warnings.extend(coupling.implausible(self, &format!("couplings[{index}]"), LONG));
        }
        for (index, force) in self.forces.iter().enumerate() {
            if let Force::Gravity { acceleration: [x, y] } = force
                && let fall = x.hypot(*y)
                && (FALL_IN_MILLIMETERS[0]..=FALL_IN_MILLIMETERS[1]).contains(&fall)
            {
                let message = format!(
                    "{} m/s^2 is the acceleration of free fall in mm/s^2: it is in m/s^2, {}",
                    short(fall),
                    short(fall / 1e3)
                );
                let path = format!("forces[{index}].acceleration");
                warnings.push(Notice::of_field("free_fall", path, vec![("acceleration", fall)], message));
            }
        }
        warnings
    }

    /// Warns of bodies that are too light or too long, and of drives that are too fast for their size.
    fn warn_of_lengths(&self, warnings: &mut Vec<Notice>) {
        let lengths = || self.bodies.iter().map(Body::extent).enumerate();
        let Some((longest_body, longest)) = lengths().max_by(|(_, a), (_, b)| a.total_cmp(b)) else {
            return;
        };
        let is_light =
            |&(index, length): &(usize, f64)| length > LONG && self.is_light(&self.bodies[index], length);
        let light = lengths().filter(is_light).max_by(|(_, a), (_, b)| a.total_cmp(b));
        let (index, longest) = match light {
            Some(found) if longest <= LONGEST => found,
            _ => (longest_body, longest),
        };
        let body = &self.bodies[index];
        let path = format!("bodies[{index}].points");
        let millimeters =
            format!("lengths are in meters, {} mm are {}", short(longest), short(longest / 1e3));
        if longest > LONGEST {
            let message = format!(
                "{:?} spans {} m, more than any rigid body: {millimeters}",
                body.name,
                short(longest)
            );
            warnings.push(Notice::of_field("long_body", path, vec![("length", longest)], message));
        } else if light.is_some() {
            let message = format!(
                "{:?} spans {} m and has a mass of {} kg, lighter than anything rigid of that length: {millimeters}",
                body.name,
                short(longest),
                short(body.mass)
            );
            let numbers = vec![("length", longest), ("mass", body.mass)];
            warnings.push(Notice::of_field("light_body", path, numbers, message));
        } else {
            self.warn_of_speeds(longest, warnings);
        }
    }

    /// Whether a body of a length is lighter than anything rigid.
    fn is_light(&self, body: &Body, length: f64) -> bool {
        body.mass > 0.0 && body.mass < LIGHT * length.powi(3)
    }

    fn warn_of_speeds(&self, longest: f64, warnings: &mut Vec<Notice>) {
        // As many joints as bodies hold a tree; a linkage closes a loop with one more.
        let is_linkage = self.joints.len() > self.bodies.len();
        for (index, drive) in self.drives.iter().enumerate() {
            let Drive::Speed { speed, .. } = drive else { continue };
            let path = format!("drives[{index}].speed");
            if let Some(rpm) = in_rpm_of_rad(*speed) {
                let message = format!(
                    "{} rad/s is {} revolutions per minute, which is what {} revolutions per minute are in rad/s: was \
                     the speed converted twice, or given in rad/s?",
                    short(*speed),
                    short(speed * 60.0 / TAU),
                    short(rpm)
                );
                warnings.push(Notice::of_field("speed_twice", path, vec![("speed", *speed)], message));
            } else if is_linkage && speed.abs() >= MANY && speed % ROUND_SPEED == 0.0 {
                let message = format!(
                    "{} rad/s is {} revolutions per minute: speeds are in rad/s, {} revolutions per minute are {}",
                    short(*speed),
                    short(speed * 60.0 / TAU),
                    short(*speed),
                    short(speed * TAU / 60.0)
                );
                warnings.push(Notice::of_field("fast_drive", path, vec![("speed", *speed)], message));
            } else if speed.abs() * longest > FASTEST {
                let message = format!(
                    "{} rad/s moves a point at a distance of {} m with {} m/s, at which every rotor bursts: \
                     lengths are in meters and speeds in rad/s, {} revolutions per minute are {}",
                    short(*speed),
                    short(longest),
                    short(speed.abs() * longest),
                    short(*speed),
                    short(speed * TAU / 60.0)
                );
                let numbers = vec![("speed", *speed), ("distance", longest)];
                warnings.push(Notice::of_field("fast_drive", path, numbers, message));
            }
        }
    }

    /// Warns of journals that are larger than the bodies they join, of very large clearances and of duplicate
    /// joints.
    fn warn_of_joints(&self, warnings: &mut Vec<Notice>) {
        let ends: Vec<Ends> = self.joints.iter().map(|joint| self.ends(joint)).collect();
        for (index, joint) in self.joints.iter().enumerate() {
            self.warn_of_guide(index, joint, warnings);
            let Joint::Clearance { name, journal_radius, clearance, .. } = joint else { continue };
            let radius = *journal_radius;
            let reach = joint.references().into_iter().filter_map(|(_, reference)| self.reach(reference));
            if let Some((body, reach)) = reach.max_by(|(_, a), (_, b)| a.total_cmp(b))
                && radius > LARGE_JOURNAL
                && radius > JOURNAL_OVER_REACH * reach
            {
                let message = format!(
                    "the journal of {name:?}, of radius {radius} m, is far larger than the bodies it joins: {body:?} \
                     has its mass and its points within {} m; radii are in meters, {radius} mm are {}",
                    short(reach),
                    short(radius / 1e3)
                );
                let numbers = vec![("journal_radius", radius), ("reach", reach)];
                let path = format!("joints[{index}].journal_radius");
                warnings.push(Notice::of_field("large_journal", path, numbers, message));
            }
            if *clearance > LOOSE * radius {
                let message = format!(
                    "the clearance of {name:?}, {} m, is {} times the radius of its journal, {} m, far more than in \
                     any bearing; clearances are radial and in meters",
                    short(*clearance),
                    short(clearance / radius),
                    short(radius)
                );
                let numbers = vec![("clearance", *clearance), ("journal_radius", radius)];
                let path = format!("joints[{index}].clearance");
                warnings.push(Notice::of_field("large_clearance", path, numbers, message));
            }
            let twin = self.joints[..index].iter().zip(&ends).find(|(other, found)| {
                matches!(other, Joint::Clearance { .. }) && same_points(&ends[index], found)
            });
            if let Some((twin, _)) = twin {
                let path = format!("joints[{index}]");
                let message = format!(
                    "{name:?} joins the same two points as {:?}: both act, as two bearings beside each other do; \
                     remove one if it is a copy",
                    twin.name()
                );
                warnings.push(Notice::of_field("twin_joint", path, Vec::new(), message));
            }
        }
    }

    fn warn_of_guide(&self, index: usize, joint: &Joint, warnings: &mut Vec<Notice>) {
        let (what, clearance, size) = match joint {
            Joint::Guide { shape: GuideShape::Block { height, clearance, .. }, .. } => {
                ("height", *clearance, *height)
            }
            Joint::Guide { shape: GuideShape::Pin { radius, clearance }, .. } => {
                ("radius of its pin", *clearance, *radius)
            }
            _ => return,
        };
        if clearance > LOOSE * size {
            let message = format!(
                "the clearance of {:?}, {} m, is {} times the {what}, {} m, far more than in any guide; clearances \
                 are those of one side, in meters",
                joint.name(),
                short(clearance),
                short(clearance / size),
                short(size)
            );
            let numbers = vec![("clearance", clearance), ("size", size)];
            let path = format!("joints[{index}].clearance");
            warnings.push(Notice::of_field("large_clearance", path, numbers, message));
        }
    }

    /// Reach of a body from one of its points [m]: the distance to its mass, by the radius of gyration, or to
    /// another point. Infinite for ground.
    fn reach(&self, reference: &str) -> Option<(&str, f64)> {
        let end = self.attachment(reference).ok()?;
        let body = &self.bodies[end.body?];
        let gyration = if body.mass > 0.0 { (self.central_inertia(body) / body.mass).sqrt() } else { 0.0 };
        let distance = |point: [f64; 2]| (point[0] - end.position[0]).hypot(point[1] - end.position[1]);
        let points = body.points.iter().map(|point| distance(point.position));
        let reach = points.fold(distance(body.center_of_mass) + gyration, f64::max);
        Some((&body.name, reach))
    }

    /// Warns of angles beyond a turn that are round numbers in degrees; each number once, with all its paths.
    fn warn_of_angles(&self, warnings: &mut Vec<Notice>) {
        let mut found: Vec<(f64, f64, Vec<String>)> = Vec::new();
        for (path, angle) in self.angles() {
            let Some(degrees) = in_degrees(angle) else { continue };
            match found.iter_mut().find(|(known, ..)| *known == degrees) {
                Some((.., paths)) => paths.push(path),
                None => found.push((degrees, angle, vec![path])),
            }
        }
        for (degrees, angle, paths) in found {
            warnings.push(Notice::of_fields(
                "degrees",
                paths,
                vec![("angle", angle), ("degrees", degrees)],
                format!(
                    "{} rad is more than a turn, and a round number of degrees: angles are in radians, {degrees} degrees are {}",
                    short(angle),
                    short(degrees.to_radians())
                ),
            ));
        }
    }

    /// All angles of the scene [rad], with their paths.
    fn angles(&self) -> Vec<(String, f64)> {
        let mut angles = Vec::new();
        let mut add = |path: String, angle: f64| angles.push((path, angle));
        for (index, body) in self.bodies.iter().enumerate() {
            add(format!("bodies[{index}].angle"), body.angle);
        }
        for (index, joint) in self.joints.iter().enumerate() {
            if let Joint::Ideal {
                kind: JointKind::Prismatic { angle, .. } | JointKind::Fixed { angle },
                ..
            } = joint
            {
                add(format!("joints[{index}].angle"), *angle);
            }
        }
        for (index, force) in self.forces.iter().enumerate() {
            if let Force::TorsionSpring { angle, .. } = force {
                add(format!("forces[{index}].angle"), *angle);
            }
        }
        for (index, drive) in self.drives.iter().enumerate() {
            match drive {
                Drive::Speed { angle, .. } => add(format!("drives[{index}].angle"), *angle),
                Drive::Motion {
                    joint,
                    motion: TimeFunction::Harmonic { mean, amplitude, phase, .. },
                    ..
                } => {
                    add(format!("drives[{index}].motion.phase"), *phase);
                    if self.is_revolute(joint) {
                        add(format!("drives[{index}].motion.mean"), *mean);
                        add(format!("drives[{index}].motion.amplitude"), *amplitude);
                    }
                }
                Drive::Motion { joint, motion: TimeFunction::Polynomial(coefficients), .. }
                    if self.is_revolute(joint) =>
                {
                    let start = coefficients.first().copied().unwrap_or(0.0);
                    add(format!("drives[{index}].motion"), start);
                }
                Drive::Motion { .. } => {}
            }
        }
        for (index, start) in self.start.iter().enumerate() {
            match start {
                Start::Joint { joint, position: Some(angle), .. } if self.is_revolute(joint) => {
                    add(format!("start[{index}].position"), *angle);
                }
                Start::Body { angle: Some(angle), .. } => add(format!("start[{index}].angle"), *angle),
                _ => {}
            }
        }
        angles
    }

    fn is_revolute(&self, name: &str) -> bool {
        let found = self.joints.iter().find(|joint| joint.name() == name);
        matches!(found, Some(Joint::Ideal { kind: JointKind::Revolute, .. }))
    }
}

/// The round number of degrees that a number given in radians may be, also after the addition of quarter
/// turns (π/2), as for angles from a vertical instead of a horizontal.
fn in_degrees(angle: f64) -> Option<f64> {
    (-2..=2).find_map(|quarters| {
        let degrees = angle + f64::from(quarters) * FRAC_PI_2;
        let half = (2.0 * degrees).round() / 2.0;
        let round = (degrees - half).abs() <= ROUNDING * half.abs();
        (round && half.abs() >= DEGREES[0] && half.abs() <= DEGREES[1]).then_some(half)
    })
}

/// The round speed [rpm] whose number in rad/s a speed [rad/s] is in revolutions per minute, rounded to three to six
/// digits; `None` of most speeds.
fn in_rpm_of_rad(speed: f64) -> Option<f64> {
    let given = speed.abs() * 60.0 / TAU;
    let rpm = (given * 60.0 / TAU / ROUND_RPM).round() * ROUND_RPM;
    let radians = rpm * TAU / 60.0;
    // With as many digits as it was given with: 157, 157.1 or 157.08.
    let matches = |digits: i32| {
        let unit = 10.0_f64.powi(given.log10().floor() as i32 + 1 - digits);
        (given - (radians / unit).round() * unit).abs() <= ROUNDING * given
    };
    (rpm > 0.0 && rpm <= MOST_RPM && given.is_finite() && (3..=6).any(matches)).then_some(rpm)
}

/// A number to four digits in its shortest form.
pub(crate) fn short(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}
