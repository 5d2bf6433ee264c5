//! Units are the user's choice: lengths, masses and times scaled by powers of two must give the
//! same results to the last bit, so nothing in the core may know an absolute size.

use chebclear::contact::{Damping, NormalLaw};
use chebclear::friction::FrictionLaw;
use chebclear::scene::{Drive, Force, Joint, JointKind, Point, Scene};
use chebclear::settings::{Method, Settings};
use chebclear::trajectory::{Trajectory, simulate};

use crate::support::{body, compile, point, slider_crank};

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

    /// Factor of an output.
    fn of(self, column: &str) -> f64 {
        match column.split_once('.').unwrap().1 {
            "x" | "y" | "eccentricity_x" | "eccentricity_y" | "eccentricity" | "penetration" => self.length,
            "vx" | "vy" | "penetration_rate" | "sliding_velocity" => self.speed(),
            "ax" | "ay" => self.speed() / self.time,
            "angular_velocity" => 1.0 / self.time,
            "angular_acceleration" => 1.0 / (self.time * self.time),
            "normal_force" | "friction_force" => self.force(),
            "torque" => self.force() * self.length,
            "angle" | "contact" => 1.0,
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
                    assert_eq!(contact.exponent, 1.5);
                    // N/m^1.5; a power of four has an exact root.
                    contact.stiffness *= self.force() / (self.length * self.length.sqrt());
                    if let Some(FrictionLaw::ModifiedCoulomb {
                        stick_slip_velocity,
                        static_sliding_velocity,
                        ..
                    }) = friction
                    {
                        *stick_slip_velocity *= self.speed();
                        *static_sliding_velocity *= self.speed();
                    }
                    if let Some(floor) = impact_velocity_floor {
                        *floor *= self.speed();
                    }
                }
            }
        }
        for force in &mut scene.forces {
            let Force::Gravity { acceleration } = force else { panic!("only gravity is scaled") };
            *acceleration = acceleration.map(|g| g * (self.speed() / self.time));
        }
        for drive in &mut scene.drives {
            let Drive::Speed { speed, .. } = drive else { panic!("only speeds are scaled") };
            *speed /= self.time;
        }
        scene
    }

    fn run(self, scene: &Scene, duration: f64, method: Method) -> Trajectory {
        let mut settings = Settings::new(duration * self.time, 101);
        settings.method = method;
        simulate(&compile(&self.scale(scene)), &settings, &|_| true).unwrap()
    }
}

fn same_bits(scene: &Scene, duration: f64, units: Units) {
    for method in [Method::Auto, Method::Rodas5P, Method::Rodas4, Method::Dop853] {
        let base = Units::SAME.run(scene, duration, method);
        let scaled = units.run(scene, duration, method);
        assert_eq!(base.status.word(), "done");
        assert!(!base.events.is_empty());
        assert_eq!(base.columns, scaled.columns);
        let factors: Vec<f64> = base.columns.iter().map(|column| units.of(column)).collect();
        for (row, (expected, found)) in
            base.values.chunks_exact(factors.len()).zip(scaled.values.chunks_exact(factors.len())).enumerate()
        {
            for (k, factor) in factors.iter().enumerate() {
                let (expected, found) = (expected[k] * factor, found[k]);
                assert_eq!(
                    expected.to_bits(),
                    found.to_bits(),
                    "{units:?}, {method:?}, sample {row}, {}: {expected:e} became {found:e}",
                    base.columns[k]
                );
            }
        }
        assert_eq!(base.events.len(), scaled.events.len());
        for (expected, found) in base.events.iter().zip(&scaled.events) {
            assert_eq!((expected.joint, expected.kind), (found.joint, found.kind));
            assert_eq!(expected.time * units.time, found.time);
            assert_eq!(expected.normal_velocity * units.speed(), found.normal_velocity);
        }
        assert_eq!(base.stats.steps, scaled.stats.steps);
        assert_eq!(base.stats.evaluations, scaled.stats.evaluations);
    }
}

/// Two floating bodies, a slider and a crank: angles and lengths mixed in one mass matrix.
fn mixed() -> Scene {
    let mut scene = slider_crank(false);
    scene.forces.push(Force::Gravity { acceleration: [0.5, -9.81] });
    scene.bodies.push(body("weight", 0.05, 2e-6, [0.003, -0.001], vec![point("hole", 0.01, 0.0)]));
    scene.joints.push(Joint::Clearance {
        name: "hook".to_owned(),
        bearing: "weight.hole".to_owned(),
        journal: "rod.B".to_owned(),
        journal_radius: 4e-3,
        clearance: 1e-4,
        contact: NormalLaw { stiffness: 1e9, exponent: 1.5, damping: Damping::Elastic },
        friction: None,
        sliding: chebclear::clearance::SlidingVelocity::Surface,
        impact_velocity_floor: None,
    });
    scene
}

const FINER: Units = Units { length: 1024.0, mass: 1.0, time: 1.0 };
const COARSER: Units = Units { length: 1.0 / 256.0, mass: 1.0, time: 1.0 };
const HEAVIER: Units = Units { length: 1.0, mass: 2.0, time: 1.0 };
const LIGHTER: Units = Units { length: 1.0, mass: 1.0 / 2048.0, time: 1.0 };
const SLOWER: Units = Units { length: 1.0, mass: 1.0, time: 512.0 };
const FASTER: Units = Units { length: 1.0, mass: 1.0, time: 1.0 / 2.0 };
const ALL: Units = Units { length: 1024.0, mass: 1.0 / 8.0, time: 32.0 };

/// The default floor of the impact velocity comes from the scales too.
fn with_default_floor(mut scene: Scene) -> Scene {
    for joint in &mut scene.joints {
        if let Joint::Clearance { impact_velocity_floor, .. } = joint {
            *impact_velocity_floor = None;
        }
    }
    scene
}

#[test]
fn gate_10_results_do_not_depend_on_the_unit_of_length() {
    for units in [FINER, COARSER] {
        same_bits(&slider_crank(false), 0.01, units);
        same_bits(&with_default_floor(slider_crank(true)), 0.01, units);
        same_bits(&mixed(), 0.01, units);
    }
}

#[test]
fn gate_10_results_do_not_depend_on_the_unit_of_mass() {
    for units in [HEAVIER, LIGHTER] {
        same_bits(&slider_crank(false), 0.01, units);
        same_bits(&with_default_floor(slider_crank(true)), 0.01, units);
        same_bits(&mixed(), 0.01, units);
    }
}

#[test]
fn gate_10_results_do_not_depend_on_the_unit_of_time() {
    for units in [SLOWER, FASTER] {
        same_bits(&slider_crank(false), 0.01, units);
        same_bits(&with_default_floor(slider_crank(true)), 0.01, units);
        same_bits(&mixed(), 0.01, units);
    }
}

#[test]
fn gate_10_results_do_not_depend_on_any_unit() {
    same_bits(&with_default_floor(slider_crank(false)), 0.01, ALL);
    same_bits(&mixed(), 0.01, ALL);
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
