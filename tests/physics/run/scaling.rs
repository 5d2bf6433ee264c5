//! Units are the user's choice: lengths, masses and times scaled by powers of two must give the
//! same results to the last bit, so nothing in the core may know an absolute size.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::expression::curve::Curve;
use chebclear::run::outputs::{column_names, further_column_names};
use chebclear::run::settings::{Method, Settings};
use chebclear::run::trajectory::{Trajectory, simulate};
use chebclear::scene::loads::Load;
use chebclear::scene::parts::{Drive, Force, ForceFrame, GuideShape, Joint, JointKind, Point, Scene, Start};
use chebclear::scene::time_function::TimeFunction;

use crate::support::{body, compile, ideal, loose, paper_friction, point, slider_crank, with_floor};

/// How many times larger the numbers of lengths, masses and times become.
#[derive(Clone, Copy, Debug)]
struct Units {
    length: f64,
    mass: f64,
    time: f64,
}

impl Units {
    const SAME: Units = Units { length: 1.0, mass: 1.0, time: 1.0 };

    fn speed(self) -> f64 {
        self.length / self.time
    }

    fn force(self) -> f64 {
        self.mass * self.speed() / self.time
    }

    fn energy(self) -> f64 {
        self.force() * self.length
    }

    /// A function of time whose value has the given factor.
    fn function(self, function: &TimeFunction, factor: f64) -> TimeFunction {
        match function {
            TimeFunction::Polynomial(coefficients) => {
                let powers = coefficients.iter().enumerate();
                TimeFunction::Polynomial(powers.map(|(k, c)| c * factor / self.time.powi(k as i32)).collect())
            }
            &TimeFunction::Harmonic { mean, amplitude, angular_frequency, phase } => TimeFunction::Harmonic {
                mean: mean * factor,
                amplitude: amplitude * factor,
                angular_frequency: angular_frequency / self.time,
                phase,
            },
            TimeFunction::Formula(_) => panic!("no formula is scaled"),
            TimeFunction::Table(_) => {
                let [start, end] = function.domain();
                let mut times = vec![start];
                while function.next_break(times[times.len() - 1]).is_finite() {
                    times.push(function.next_break(times[times.len() - 1]));
                }
                times.push(end);
                let values: Vec<f64> = times.iter().map(|&t| function.at(t)[0] * factor).collect();
                times.iter_mut().for_each(|t| *t *= self.time);
                TimeFunction::Table(Curve::spline(&times, &values).unwrap())
            }
        }
    }

    /// Factor of an output.
    fn of(self, column: &str) -> f64 {
        match column.rsplit_once('.').unwrap().1 {
            "x" | "y" | "eccentricity_x" | "eccentricity_y" | "eccentricity" | "penetration"
            | "displacement" | "offset" | "length" | "point_x" | "point_y" => self.length,
            "vx" | "vy" | "penetration_rate" | "sliding_velocity" | "velocity" | "lengthening" => {
                self.speed()
            }
            "ax" | "ay" | "acceleration" => self.speed() / self.time,
            "angular_velocity" => 1.0 / self.time,
            "angular_acceleration" => 1.0 / (self.time * self.time),
            "normal_force" | "friction_force" | "force" | "reaction_x" | "reaction_y" => self.force(),
            "torque" | "reaction_torque" | "wear" => self.energy(),
            "power" => self.energy() / self.time,
            _ if column.starts_with("energy.") || column.ends_with("_loss") => self.energy(),
            "angle" | "tilt" | "contact" => 1.0,
            other => panic!("output {other} has no unit"),
        }
    }

    fn scale(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        let move_points = |points: &mut [Point]| {
            for point in points {
                point.position = point.position.map(|x| x * self.length);
            }
        };
        move_points(&mut scene.ground);
        for body in &mut scene.bodies {
            body.mass *= self.mass;
            body.inertia *= self.mass * self.length * self.length;
            body.center_of_mass = body.center_of_mass.map(|x| x * self.length);
            move_points(&mut body.points);
        }
        for joint in &mut scene.joints {
            match joint {
                Joint::Ideal { kind: JointKind::Prismatic { axis, .. }, .. } => {
                    *axis = axis.map(|x| x * self.length);
                }
                Joint::Ideal { .. } => {}
                Joint::Clearance {
                    journal_radius,
                    clearance,
                    contact,
                    friction,
                    impact_velocity_floor,
                    ..
                } => {
                    *journal_radius *= self.length;
                    *clearance *= self.length;
                    self.scale_laws(contact, friction, impact_velocity_floor);
                }
                Joint::Guide {
                    axis, shape, face_length, contact, friction, impact_velocity_floor, ..
                } => {
                    *axis = axis.map(|x| x * self.length);
                    face_length.iter_mut().for_each(|size| *size *= self.length);
                    match shape {
                        GuideShape::Block { length, height, clearance, .. } => {
                            [length, height, clearance].into_iter().for_each(|size| *size *= self.length);
                        }
                        GuideShape::Pin { radius, clearance } => {
                            [radius, clearance].into_iter().for_each(|size| *size *= self.length);
                        }
                        GuideShape::Stop { radius } => *radius *= self.length,
                    }
                    self.scale_laws(contact, friction, impact_velocity_floor);
                }
            }
        }
        for force in &mut scene.forces {
            match force {
                Force::Gravity { acceleration } => {
                    *acceleration = acceleration.map(|g| g * (self.speed() / self.time));
                }
                Force::Spring { stiffness, length, damping, .. } => {
                    *stiffness *= self.force() / self.length;
                    *length *= self.length;
                    *damping *= self.force() / self.speed();
                }
                Force::Bushing { coefficients, .. } => {
                    let energy = self.energy();
                    let units =
                        [self.force() / self.length, self.force() / self.speed(), energy, energy * self.time];
                    coefficients.iter_mut().zip(units).for_each(|(coefficient, unit)| *coefficient *= unit);
                }
                Force::TorsionSpring { stiffness, damping, .. } => {
                    *stiffness *= self.energy();
                    *damping *= self.energy() * self.time;
                }
                Force::Applied { x, y, .. } => {
                    for component in [x, y] {
                        self.scale_load(component, self.force());
                    }
                }
                Force::Torque { torque, .. } => self.scale_load(torque, self.energy()),
            }
        }
        for drive in &mut scene.drives {
            match drive {
                Drive::Speed { speed, .. } => *speed /= self.time,
                // Of a revolute joint in these scenes.
                Drive::Motion { motion, .. } => *motion = self.function(motion, 1.0),
            }
        }
        for start in &mut scene.start {
            let Start::Clearance { eccentricity, rate, .. } = start else { panic!("only gaps are scaled") };
            *eccentricity = eccentricity.map(|x| x * self.length);
            *rate = rate.map(|v| v * self.speed());
        }
        scene
    }

    fn scale_laws(
        self,
        contact: &mut NormalLaw,
        friction: &mut Option<FrictionLaw>,
        impact_velocity_floor: &mut Option<f64>,
    ) {
        assert_eq!(contact.exponent, 1.5);
        // N/m^1.5; a power of four has an exact root.
        contact.stiffness *= self.force() / (self.length * self.length.sqrt());
        if let Some(FrictionLaw::ModifiedCoulomb { stick_slip_velocity, static_sliding_velocity, .. }) =
            friction
        {
            *stick_slip_velocity *= self.speed();
            *static_sliding_velocity *= self.speed();
        }
        if let Some(floor) = impact_velocity_floor {
            *floor *= self.speed();
        }
    }

    fn scale_load(self, load: &mut Load, unit: f64) {
        let Load::Time(function) = load else { panic!("only functions of time are scaled") };
        *function = self.function(function, unit);
    }

    fn run(self, scene: &Scene, duration: f64, method: Method) -> Trajectory {
        let mut settings = Settings::new(duration * self.time, 101);
        settings.method = method;
        let mechanism = compile(&self.scale(scene));
        settings.outputs = Some([column_names(&mechanism), further_column_names(&mechanism)].concat());
        simulate(&mechanism, &settings, &|_| true).unwrap()
    }
}

fn same_bits(base: &Trajectory, scaled: &Trajectory, units: Units, method: Method) {
    assert_eq!(base.columns, scaled.columns);
    let factors: Vec<f64> = base.columns.iter().map(|column| units.of(column)).collect();
    for (place, (expected, found)) in base.values.iter().zip(&scaled.values).enumerate() {
        let (row, k) = (place / factors.len(), place % factors.len());
        let expected = expected * factors[k];
        let column = &base.columns[k];
        assert!(
            expected.to_bits() == found.to_bits(),
            "{units:?}, {method:?}, sample {row}, {column}: {expected:e} became {found:e}"
        );
    }
    assert_eq!(base.events.len(), scaled.events.len());
    for (expected, found) in base.events.iter().zip(&scaled.events) {
        assert_eq!((expected.place, expected.kind), (found.place, found.kind));
        assert_eq!(expected.time * units.time, found.time);
        assert_eq!(expected.normal_velocity * units.speed(), found.normal_velocity);
    }
    let work = |run: &Trajectory| (run.stats.steps, run.stats.evaluations);
    assert_eq!(work(base), work(scaled));
}

/// Two floating bodies, a slider and a crank: angles and lengths mixed in one mass matrix.
fn mixed() -> Scene {
    let mut scene = slider_crank(false);
    scene.forces.push(Force::Gravity { acceleration: [0.5, -9.81] });
    scene.bodies.push(body("weight", 0.05, 2e-6, [0.003, -0.001], vec![point("hole", 0.01, 0.0)]));
    let elastic = NormalLaw { stiffness: 1e9, exponent: 1.5, damping: Damping::Elastic };
    scene.joints.push(loose("hook", ["weight.hole", "rod.B"], [4e-3, 1e-4], elastic, None));
    scene
}

/// The slider in a guide with play, and a stop that its crank passes every turn.
fn guided() -> Scene {
    let mut scene = slider_crank(false);
    let contact = NormalLaw { stiffness: 1e9, exponent: 1.5, damping: Damping::Elastic };
    let wrist = scene.joints.pop().expect("the mechanism has four joints");
    scene.joints.pop();
    let shape =
        GuideShape::Block { length: 0.04, height: 0.02, clearance: 1e-4, angle: 0.0, is_sleeve: false };
    let stop = GuideShape::Stop { radius: 3e-3 };
    let parts = [
        ("guide", "ground", "slider", [1.0, 0.0], shape, Some(paper_friction()), None),
        ("stop", "ground", "rod.center_of_mass", [0.3, 1.0], stop, None, Some(0.2)),
    ];
    scene.joints.push(wrist);
    scene.joints.extend(parts.map(|(name, a, b, axis, shape, friction, face_length)| Joint::Guide {
        name: name.to_owned(),
        a: a.to_owned(),
        b: b.to_owned(),
        axis,
        shape,
        face_length,
        contact: contact.clone(),
        friction,
        impact_velocity_floor: Some(1e-6),
    }));
    scene
}

/// Every element and a motion by a table, around the same mechanism.
fn elements() -> Scene {
    let times = [0.0, 0.003, 0.0042, 0.007, 0.01];
    let table =
        |values: &[f64]| TimeFunction::Table(Curve::spline(&times, values).expect("the points are good"));
    let harmonic = |amplitude| TimeFunction::Harmonic {
        mean: 0.7 * amplitude,
        amplitude,
        angular_frequency: 700.0,
        phase: 0.3,
    };
    let mut scene = mixed();
    scene.forces.extend([
        Force::Spring {
            name: "spring".into(),
            a: "ground".into(),
            b: "slider".into(),
            stiffness: 3e4,
            length: 0.15,
            damping: 30.0,
            tension: Load::NONE,
        },
        Force::TorsionSpring {
            name: "coil".into(),
            a: "crank".into(),
            b: "rod".into(),
            stiffness: 5.0,
            angle: 0.1,
            damping: 0.01,
        },
        Force::Applied {
            name: "load".into(),
            point: "slider".into(),
            x: table(&[0.0, 300.0, -100.0, 50.0, 10.0]).into(),
            y: TimeFunction::Polynomial(vec![10.0, -3e3, 1e6]).into(),
            frame: ForceFrame::Body,
        },
        Force::Torque {
            name: "motor".into(),
            body: "rod".into(),
            reaction: "crank".into(),
            torque: harmonic(2.0).into(),
        },
    ]);
    scene.drives = vec![Drive::Motion {
        name: "drive".into(),
        joint: "crank_bearing".into(),
        motion: table(&[0.0, 0.5, 0.8, 1.4, 2.1]),
    }];
    scene.start =
        vec![Start::Clearance { joint: "wrist".into(), eccentricity: [3e-6, -1e-5], rate: [0.02, 0.01] }];
    scene
}

/// The same without play: its drive prescribes everything.
fn prescribed() -> Scene {
    let mut scene = elements();
    scene.bodies.truncate(3);
    scene.joints.truncate(3);
    scene.joints.push(ideal("wrist", "rod.C", "slider", JointKind::Revolute));
    scene.start.clear();
    scene
}

#[test]
fn gate_10_results_do_not_depend_on_any_unit() {
    // The default floor of the impact velocity comes from the scales too.
    let mut default_floor = slider_crank(true);
    default_floor.joints[3] = with_floor(default_floor.joints[3].clone(), None);
    for (scene, duration) in
        [(default_floor, 0.01), (mixed(), 0.01), (elements(), 0.01), (guided(), 0.005), (prescribed(), 0.01)]
    {
        for method in [Method::Auto, Method::Rodas5P, Method::Dop853, Method::Adams] {
            let base = Units::SAME.run(&scene, duration, method);
            assert_eq!(base.status.word(), "done");
            assert!(!base.events.is_empty() || compile(&scene).slots.is_empty());
            for units in [
                Units { length: 1024.0, ..Units::SAME },
                Units { length: 1.0 / 256.0, ..Units::SAME },
                Units { mass: 2.0, ..Units::SAME },
                Units { mass: 1.0 / 2048.0, ..Units::SAME },
                Units { time: 512.0, ..Units::SAME },
                Units { time: 1.0 / 2.0, ..Units::SAME },
                Units { length: 1024.0, mass: 1.0 / 8.0, time: 32.0 },
            ] {
                same_bits(&base, &units.run(&scene, duration, method), units, method);
            }
        }
    }
}

#[test]
fn gate_10_results_in_decimal_units_differ_by_rounding_only() {
    // 3 ms with the first impacts: roundings, which no longer scale, have not grown far.
    let (scene, duration) = (slider_crank(true), 0.003);
    let base = Units::SAME.run(&scene, duration, Method::Rodas5P);
    for units in [
        Units { length: 1e3, mass: 1.0, time: 1.0 },
        Units { length: 1.0, mass: 1e-3, time: 1.0 },
        Units { length: 1.0, mass: 1.0, time: 1e6 },
        Units { length: 1e6, mass: 1e3, time: 1e-3 },
    ] {
        let scaled = units.run(&scene, duration, Method::Rodas5P);
        assert_eq!((base.status, base.events.len()), (scaled.status, scaled.events.len()));
        let width = base.columns.len();
        for (k, column) in base.columns.iter().enumerate() {
            // A pin transmits no torque, a guide no force along it, and energies balance: what is left is
            // rounding.
            let zeros = ["crank_pin.reaction_torque", "guide.reaction_x", "energy.balance"];
            if zeros.contains(&column.as_str()) {
                continue;
            }
            let of = |run: &Trajectory, factor: f64| -> Vec<f64> {
                run.values.iter().skip(k).step_by(width).map(|value| value / factor).collect()
            };
            let (expected, found) = (of(&base, 1.0), of(&scaled, units.of(column)));
            let size = expected.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            let error = expected.iter().zip(&found).fold(0.0_f64, |a, (b, c)| a.max((b - c).abs()));
            // The default tolerance, 1e-6, of which roundings are to be a small part.
            assert!(error <= 1e-7 * size, "{units:?}, {column}: {:e}", error / size);
        }
    }
}
