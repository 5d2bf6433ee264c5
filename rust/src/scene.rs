//! The scene: what the user wrote, and whether it makes sense.
//!
//! A [`Scene`] holds names and numbers only. [`Scene::check`] finds everything that is wrong
//! with it at once; whether the parts form a mechanism that can be assembled is decided when
//! it is compiled, in [`crate::mechanism`].

use crate::clearance::SlidingVelocity;
use crate::contact::{Damping, NormalLaw};
use crate::error::{Problem, SceneError};
use crate::friction::FrictionLaw;

/// The name of the fixed body every scene has.
pub const GROUND: &str = "ground";
/// The point every body has besides the user's: its centre of mass.
pub const CENTER_OF_MASS: &str = "center_of_mass";

/// A point with a name, in the frame of its body [m].
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Name, unique in its body.
    pub name: String,
    /// Position in the body frame [m].
    pub position: [f64; 2],
}

/// A rigid body.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name, unique in the scene.
    pub name: String,
    /// Mass [kg].
    pub mass: f64,
    /// Moment of inertia [kg m²] about the point `inertia_about`.
    pub inertia: f64,
    /// Centre of mass in the body frame [m].
    pub center_of_mass: [f64; 2],
    /// Name of the point the moment of inertia refers to.
    pub inertia_about: String,
    /// Named points of the body.
    pub points: Vec<Point>,
    /// Rough angle of the body frame [rad], from which the assembly starts.
    pub angle: f64,
}

/// How two bodies are joined without play.
#[derive(Clone, Debug, PartialEq)]
pub enum JointKind {
    /// The points coincide; the bodies turn.
    Revolute,
    /// Point b slides along the line through point a; the bodies do not turn.
    Prismatic {
        /// Direction of the line in the frame of body a; any length.
        axis: [f64; 2],
        /// Angle of body b relative to body a [rad].
        angle: f64,
    },
    /// The points coincide and the bodies do not turn.
    Fixed {
        /// Angle of body b relative to body a [rad].
        angle: f64,
    },
}

/// A joint between two points.
#[derive(Clone, Debug, PartialEq)]
pub enum Joint {
    /// A joint without play: a constraint.
    Ideal {
        /// Name, unique in the scene.
        name: String,
        /// Point on the first body, as `body.point`.
        a: String,
        /// Point on the second body.
        b: String,
        /// What the joint allows.
        kind: JointKind,
    },
    /// A revolute joint with clearance: a contact force.
    Clearance {
        /// Name, unique in the scene.
        name: String,
        /// Centre of the bearing, as `body.point`.
        bearing: String,
        /// Centre of the journal, as `body.point`.
        journal: String,
        /// Journal radius [m].
        journal_radius: f64,
        /// Radial clearance [m].
        clearance: f64,
        /// Normal-force law.
        contact: NormalLaw,
        /// Friction law, if any.
        friction: Option<FrictionLaw>,
        /// Convention of the sliding velocity.
        sliding: SlidingVelocity,
        /// Floor of the latched impact velocity [m/s]; `None`: from the scene's scales.
        impact_velocity_floor: Option<f64>,
    },
}

impl Joint {
    /// Name of the joint.
    pub fn name(&self) -> &str {
        match self {
            Joint::Ideal { name, .. } | Joint::Clearance { name, .. } => name,
        }
    }

    /// The two references with the names of their fields.
    fn references(&self) -> [(&'static str, &str); 2] {
        match self {
            Joint::Ideal { a, b, .. } => [("a", a), ("b", b)],
            Joint::Clearance { bearing, journal, .. } => [("bearing", bearing), ("journal", journal)],
        }
    }
}

/// A force on the bodies.
#[derive(Clone, Debug, PartialEq)]
pub enum Force {
    /// Uniform gravity.
    Gravity {
        /// Acceleration of free fall [m/s²].
        acceleration: [f64; 2],
    },
}

/// A prescribed motion of a joint.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// A revolute joint turning at constant speed.
    Speed {
        /// Name, unique in the scene.
        name: String,
        /// Name of the revolute joint.
        joint: String,
        /// Angular velocity of body b relative to body a [rad/s].
        speed: f64,
        /// Angle of body b relative to body a at time zero [rad].
        angle: f64,
    },
}

impl Drive {
    /// Name of the drive.
    pub fn name(&self) -> &str {
        let Drive::Speed { name, .. } = self;
        name
    }
}

/// What the user wrote.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Named points fixed to ground [m]; `ground` alone is the origin.
    pub ground: Vec<Point>,
    /// The moving bodies.
    pub bodies: Vec<Body>,
    /// The joints.
    pub joints: Vec<Joint>,
    /// The forces.
    pub forces: Vec<Force>,
    /// The prescribed motions.
    pub drives: Vec<Drive>,
}

/// A reference `body.point`, resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attachment {
    /// Index of the body; `None` is ground.
    pub body: Option<usize>,
    /// Position in the body frame [m].
    pub position: [f64; 2],
}

impl Scene {
    /// Resolves a reference such as `"rod.B"`, `"rod"` (origin of the body frame) or
    /// `"ground.O"`; the error says what is unknown and names the nearest known name.
    pub fn attachment(&self, reference: &str) -> Result<Attachment, String> {
        let (body_name, point_name) = match reference.split_once('.') {
            Some((body, point)) => (body, Some(point)),
            None => (reference, None),
        };
        let (body, points) = if body_name == GROUND {
            (None, &self.ground)
        } else {
            match self.bodies.iter().position(|body| body.name == body_name) {
                Some(index) => (Some(index), &self.bodies[index].points),
                None => {
                    let known = self.bodies.iter().map(|body| body.name.as_str()).chain([GROUND]);
                    return Err(format!("unknown body {body_name:?}{}", did_you_mean(body_name, known)));
                }
            }
        };
        let Some(point_name) = point_name else {
            return Ok(Attachment { body, position: [0.0, 0.0] });
        };
        if let Some(point) = points.iter().find(|point| point.name == point_name) {
            return Ok(Attachment { body, position: point.position });
        }
        if let (CENTER_OF_MASS, Some(index)) = (point_name, body) {
            return Ok(Attachment { body, position: self.bodies[index].center_of_mass });
        }
        let known = points.iter().map(|point| point.name.as_str()).chain(body.map(|_| CENTER_OF_MASS));
        Err(format!("unknown point {point_name:?} of {body_name:?}{}", did_you_mean(point_name, known)))
    }

    /// Moment of inertia of a body about its centre of mass [kg m²] (Steiner's theorem).
    pub fn central_inertia(&self, body: &Body) -> f64 {
        match body.points.iter().find(|point| point.name == body.inertia_about) {
            Some(point) if body.inertia_about != CENTER_OF_MASS => {
                let arm =
                    [point.position[0] - body.center_of_mass[0], point.position[1] - body.center_of_mass[1]];
                body.inertia - body.mass * (arm[0] * arm[0] + arm[1] * arm[1])
            }
            _ => body.inertia,
        }
    }

    /// Everything that is wrong with the numbers and names of the scene, in its order.
    pub fn check(&self) -> Result<(), SceneError> {
        let mut checker = Checker { problems: Vec::new() };
        checker.points("ground", &self.ground);
        if self.bodies.is_empty() {
            checker.add("bodies", "a scene needs at least one body");
        }
        for (index, body) in self.bodies.iter().enumerate() {
            self.check_body(&mut checker, &format!("bodies[{index}]"), index, body);
        }
        for (index, joint) in self.joints.iter().enumerate() {
            self.check_joint(&mut checker, &format!("joints[{index}]"), index, joint);
        }
        for (index, force) in self.forces.iter().enumerate() {
            let Force::Gravity { acceleration } = force;
            checker.finite_pair(&format!("forces[{index}].acceleration"), "m/s^2", acceleration);
        }
        for (index, drive) in self.drives.iter().enumerate() {
            self.check_drive(&mut checker, &format!("drives[{index}]"), index, drive);
        }
        checker.finish()
    }

    fn check_body(&self, checker: &mut Checker, path: &str, index: usize, body: &Body) {
        let earlier = self.bodies[..index].iter().any(|other| other.name == body.name);
        checker.name(&format!("{path}.name"), &body.name, earlier);
        if body.name == GROUND {
            checker.add(format!("{path}.name"), "\"ground\" is the name of the fixed body");
        }
        checker.positive(&format!("{path}.mass"), "kg", body.mass);
        checker.positive(&format!("{path}.inertia"), "kg m^2", body.inertia);
        checker.finite_pair(&format!("{path}.center_of_mass"), "m", &body.center_of_mass);
        checker.finite(&format!("{path}.angle"), "rad", body.angle);
        checker.points(&format!("{path}.points"), &body.points);
        let known = || body.points.iter().map(|point| point.name.as_str()).chain([CENTER_OF_MASS]);
        if !known().any(|name| name == body.inertia_about) {
            let hint = did_you_mean(&body.inertia_about, known());
            checker.add(
                format!("{path}.inertia_about"),
                format!("unknown point {:?} of {:?}{hint}", body.inertia_about, body.name),
            );
        } else if body.inertia > 0.0 && self.central_inertia(body) <= 0.0 {
            checker.add(
                format!("{path}.inertia"),
                format!(
                    "must be > mass * distance^2 to the centre of mass for a moment about {:?}, got {}: \
                     the moment about the centre of mass would be {:.3e} kg m^2",
                    body.inertia_about,
                    body.inertia,
                    self.central_inertia(body)
                ),
            );
        }
    }

    fn check_joint(&self, checker: &mut Checker, path: &str, index: usize, joint: &Joint) {
        let earlier = self.joints[..index].iter().any(|other| other.name() == joint.name());
        checker.name(&format!("{path}.name"), joint.name(), earlier);
        if self.bodies.iter().any(|body| body.name == joint.name()) {
            checker.add(
                format!("{path}.name"),
                format!("a body is also called {:?}: outputs could not tell them apart", joint.name()),
            );
        }
        let ends = joint.references().map(|(field, reference)| match self.attachment(reference) {
            Ok(end) => Some(end.body),
            Err(message) => {
                checker.add(format!("{path}.{field}"), message);
                None
            }
        });
        if let [Some(first), Some(second)] = ends
            && first == second
        {
            checker.add(path, "joins a body to itself: the two points must be on different bodies");
        }
        match joint {
            Joint::Ideal { kind: JointKind::Revolute, .. } => {}
            Joint::Ideal { kind: JointKind::Prismatic { axis, angle }, .. } => {
                checker.finite_pair(&format!("{path}.axis"), "-", axis);
                if *axis == [0.0, 0.0] {
                    checker.add(format!("{path}.axis"), "must not be the zero vector");
                }
                checker.finite(&format!("{path}.angle"), "rad", *angle);
            }
            Joint::Ideal { kind: JointKind::Fixed { angle }, .. } => {
                checker.finite(&format!("{path}.angle"), "rad", *angle);
            }
            Joint::Clearance {
                journal_radius,
                clearance,
                contact,
                friction,
                sliding: _,
                impact_velocity_floor,
                ..
            } => {
                checker.positive(&format!("{path}.journal_radius"), "m", *journal_radius);
                checker.positive(&format!("{path}.clearance"), "m", *clearance);
                checker.positive(&format!("{path}.contact.stiffness"), "N/m^exponent", contact.stiffness);
                checker.at_least(&format!("{path}.contact.exponent"), "-", contact.exponent, 1.0);
                match contact.damping {
                    Damping::Elastic => {}
                    Damping::LankaraniNikravesh { restitution } | Damping::Flores { restitution } => {
                        checker.fraction(&format!("{path}.contact.restitution"), restitution);
                    }
                    Damping::HuntCrossley { hysteresis_factor } => {
                        let path = format!("{path}.contact.hysteresis_factor");
                        checker.at_least(&path, "s/m", hysteresis_factor, 0.0);
                    }
                }
                if let Some(law) = friction {
                    checker.friction(&format!("{path}.friction"), law);
                }
                if let Some(floor) = impact_velocity_floor {
                    checker.positive(&format!("{path}.impact_velocity_floor"), "m/s", *floor);
                }
            }
        }
    }

    fn check_drive(&self, checker: &mut Checker, path: &str, index: usize, drive: &Drive) {
        let Drive::Speed { name, joint, speed, angle } = drive;
        let earlier = self.drives[..index].iter().any(|other| other.name() == name);
        let taken = self.bodies.iter().any(|body| body.name == *name)
            || self.joints.iter().any(|other| other.name() == name);
        checker.name(&format!("{path}.name"), name, earlier || taken);
        checker.finite(&format!("{path}.speed"), "rad/s", *speed);
        checker.finite(&format!("{path}.angle"), "rad", *angle);
        match self.joints.iter().find(|other| other.name() == joint) {
            Some(Joint::Ideal { kind: JointKind::Revolute, .. }) => {}
            Some(_) => checker.add(
                format!("{path}.joint"),
                format!("joint {joint:?} must be a revolute joint without clearance"),
            ),
            None => {
                let hint = did_you_mean(joint, self.joints.iter().map(Joint::name));
                checker.add(format!("{path}.joint"), format!("unknown joint {joint:?}{hint}"));
            }
        }
        let twice = self.drives[..index].iter().any(|Drive::Speed { joint: other, .. }| other == joint);
        if twice {
            checker.add(format!("{path}.joint"), format!("joint {joint:?} is driven twice"));
        }
    }
}

/// Collects problems; each method is one rule.
struct Checker {
    problems: Vec<Problem>,
}

impl Checker {
    fn add(&mut self, path: impl Into<String>, message: impl Into<String>) {
        self.problems.push(Problem::new(path, message));
    }

    fn finish(self) -> Result<(), SceneError> {
        if self.problems.is_empty() { Ok(()) } else { Err(SceneError { problems: self.problems }) }
    }

    fn finite(&mut self, path: &str, unit: &str, value: f64) -> bool {
        if !value.is_finite() {
            self.add(path, format!("must be a finite number [{unit}], got {value}"));
        }
        value.is_finite()
    }

    fn finite_pair(&mut self, path: &str, unit: &str, values: &[f64; 2]) {
        for (index, &value) in values.iter().enumerate() {
            self.finite(&format!("{path}[{index}]"), unit, value);
        }
    }

    fn positive(&mut self, path: &str, unit: &str, value: f64) {
        if self.finite(path, unit, value) && value <= 0.0 {
            self.add(path, format!("must be > 0 [{unit}], got {value}"));
        }
    }

    fn at_least(&mut self, path: &str, unit: &str, value: f64, least: f64) {
        if self.finite(path, unit, value) && value < least {
            self.add(path, format!("must be >= {least} [{unit}], got {value}"));
        }
    }

    fn fraction(&mut self, path: &str, value: f64) {
        if self.finite(path, "-", value) && !(value > 0.0 && value <= 1.0) {
            self.add(path, format!("must be > 0 and <= 1 [-], got {value}"));
        }
    }

    fn name(&mut self, path: &str, name: &str, taken: bool) {
        if name.is_empty() || name.contains('.') {
            self.add(path, format!("must be a non-empty name without a dot, got {name:?}"));
        }
        if taken {
            self.add(path, format!("the name {name:?} is already taken"));
        }
    }

    fn points(&mut self, path: &str, points: &[Point]) {
        for (index, point) in points.iter().enumerate() {
            let path = format!("{path}.{}", point.name);
            self.name(&path, &point.name, points[..index].iter().any(|other| other.name == point.name));
            self.finite_pair(&path, "m", &point.position);
        }
    }

    fn friction(&mut self, path: &str, law: &FrictionLaw) {
        let (static_coefficient, sliding_coefficient, stick_slip_velocity, static_sliding_velocity) =
            match *law {
                FrictionLaw::SmoothedCoulomb { coefficient, velocity } => {
                    self.at_least(&format!("{path}.coefficient"), "-", coefficient, 0.0);
                    return self.positive(&format!("{path}.velocity"), "m/s", velocity);
                }
                FrictionLaw::ModifiedCoulomb {
                    static_coefficient,
                    sliding_coefficient,
                    stick_slip_velocity,
                    static_sliding_velocity,
                } => (static_coefficient, sliding_coefficient, stick_slip_velocity, static_sliding_velocity),
            };
        self.at_least(&format!("{path}.static_coefficient"), "-", static_coefficient, 0.0);
        self.at_least(&format!("{path}.sliding_coefficient"), "-", sliding_coefficient, 0.0);
        self.positive(&format!("{path}.stick_slip_velocity"), "m/s", stick_slip_velocity);
        self.positive(&format!("{path}.static_sliding_velocity"), "m/s", static_sliding_velocity);
        if static_sliding_velocity <= stick_slip_velocity {
            self.add(
                format!("{path}.static_sliding_velocity"),
                format!(
                    "must be > stick_slip_velocity = {stick_slip_velocity} [m/s], got {static_sliding_velocity}"
                ),
            );
        }
    }
}

/// `"; did you mean ...?"` with the known name nearest to a wrong one, or nothing.
pub fn did_you_mean<'a>(wrong: &str, known: impl Iterator<Item = &'a str>) -> String {
    // A wrong case is the smallest of mistakes: "c" means "C" rather than "B".
    let by_case = |name: &str| edit_distance(&wrong.to_lowercase(), &name.to_lowercase());
    let nearest = known.map(|name| (by_case(name), edit_distance(wrong, name), name)).min();
    match nearest {
        // Up to half of the letters wrong is still recognisable; more is a different word.
        Some((distance, _, name)) if 2 * distance <= name.chars().count().max(wrong.chars().count()) => {
            format!("; did you mean {name:?}?")
        }
        _ => String::new(),
    }
}

/// Levenshtein distance: letters to insert, delete or replace.
fn edit_distance(first: &str, second: &str) -> usize {
    let second: Vec<char> = second.chars().collect();
    let mut row: Vec<usize> = (0..=second.len()).collect();
    for (i, a) in first.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in second.iter().enumerate() {
            let replaced = diagonal + usize::from(a != *b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[second.len()]
}
