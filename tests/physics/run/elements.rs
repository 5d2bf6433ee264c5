//! Springs, dampers, given forces and motions against closed forms.

use chebclear::run::settings::Method;
use chebclear::run::trajectory::{Settings, Trajectory, simulate};
use chebclear::scene::loads::Load;
use chebclear::scene::parts::{Body, Drive, Force, ForceFrame, JointKind, Point, Scene, Start};
use chebclear::scene::time_function::TimeFunction;

use crate::integrators::problems::driven_pendulum;
use crate::integrators::rodas6p::RODAS6P;
use crate::support::{body, compile, ideal, point};

const METHODS: [Method; 4] = [Method::Rodas4, Method::Rodas5P, Method::Dop853, Method::Adams];

fn run(scene: &Scene, duration: f64, samples: usize, method: Method, outputs: &[&str]) -> Trajectory {
    let settings = Settings {
        rtol: 1e-10,
        method,
        outputs: Some(outputs.iter().map(|&name| name.to_owned()).collect()),
        ..Settings::new(duration, samples)
    };
    let run = simulate(&compile(scene), &settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "done", "{}", run.message());
    run
}

/// Every output of every sample against `truth`, which gets the time; `scale` are the sizes of the outputs.
fn compare(scene: &Scene, duration: f64, outputs: &[&str], scale: &[f64], truth: impl Fn(f64) -> Vec<f64>) {
    for method in METHODS {
        let run = run(scene, duration, 41, method, outputs);
        for (&t, row) in run.t.iter().zip(run.values.chunks_exact(outputs.len())) {
            for ((name, value), (exact, scale)) in outputs.iter().zip(row).zip(truth(t).iter().zip(scale)) {
                assert!(
                    (value - exact).abs() < 1e-7 * scale,
                    "{method:?}: {name} at {t}: {value} instead of {exact}"
                );
            }
        }
    }
}

/// A cart of mass 2 kg on a rail along x.
fn cart(forces: Vec<Force>, start: Vec<Start>) -> Scene {
    Scene {
        ground: vec![point("wall", -1.0, 0.0)],
        bodies: vec![body("cart", 2.0, 0.3, [0.0, 0.0], Vec::new())],
        joints: vec![ideal("rail", "ground", "cart", rail())],
        forces,
        start,
        ..Scene::default()
    }
}

fn rail() -> JointKind {
    JointKind::Prismatic { axis: [1.0, 0.0], angle: 0.0 }
}

fn spring(stiffness: f64, length: f64, damping: f64) -> Force {
    Force::Spring {
        name: "spring".into(),
        a: "ground.wall".into(),
        b: "cart".into(),
        stiffness,
        length,
        damping,
        tension: Load::NONE,
    }
}

fn joint_start(joint: &str, position: f64, velocity: f64) -> Start {
    Start::Joint { joint: joint.into(), position: Some(position), velocity: Some(velocity) }
}

/// `m x'' + c x' + k x = 0` from (x0, v0): position and velocity.
fn free_oscillation(m: f64, c: f64, k: f64, x0: f64, v0: f64, t: f64) -> [f64; 2] {
    let (decay, square) = (c / (2.0 * m), k / m);
    let discriminant = square - decay * decay;
    if discriminant > 0.0 {
        let w = discriminant.sqrt();
        let (sine, cosine) = (w * t).sin_cos();
        let b = (v0 + decay * x0) / w;
        let fade = (-decay * t).exp();
        let x = fade * (x0 * cosine + b * sine);
        [x, -decay * x + fade * w * (b * cosine - x0 * sine)]
    } else {
        let w = (-discriminant).sqrt();
        let (fast, slow) = (-decay - w, -decay + w);
        let b = (v0 - fast * x0) / (slow - fast);
        let a = x0 - b;
        let (ea, eb) = ((fast * t).exp(), (slow * t).exp());
        [a * ea + b * eb, fast * a * ea + slow * b * eb]
    }
}

#[test]
fn spring_and_damper_oscillate_as_the_textbook_says() {
    // Undamped, weakly and overdamped; the spring rests at x = 0, one meter from the wall.
    for damping in [0.0, 3.0, 100.0] {
        let scene = cart(vec![spring(200.0, 1.0, damping)], vec![joint_start("rail", 0.1, -0.5)]);
        let outputs = ["cart.x", "cart.vx", "spring.length", "spring.lengthening", "spring.force"];
        compare(&scene, 2.0, &outputs, &[0.1, 1.0, 0.1, 1.0, 30.0], |t| {
            let [x, v] = free_oscillation(2.0, damping, 200.0, 0.1, -0.5, t);
            vec![x, v, 1.0 + x, v, 200.0 * x + damping * v]
        });
    }
}

#[test]
fn a_damper_alone_slows_a_cart_exponentially() {
    let damper = Force::Spring {
        name: "damper".into(),
        a: "cart".into(),
        b: "ground.wall".into(),
        stiffness: 0.0,
        length: 0.0,
        damping: 4.0,
        tension: Load::NONE,
    };
    let scene = cart(vec![damper], vec![joint_start("rail", 0.0, 1.5)]);
    let outputs = ["cart.vx", "damper.force", "energy.kinetic", "energy.damping_loss", "energy.balance"];
    compare(&scene, 2.0, &outputs, &[1.0, 1.0, 1.0, 1.0, 1.0], |t| {
        let v = 1.5 * (-2.0 * t).exp();
        vec![v, 4.0 * v, v * v, 2.25 - v * v, 0.0]
    });
}

/// A wheel of 0.5 kg m² on an axle.
fn wheel(forces: Vec<Force>, start: Vec<Start>) -> Scene {
    Scene {
        bodies: vec![body("wheel", 1.0, 0.5, [0.0, 0.0], Vec::new())],
        joints: vec![ideal("axle", "ground", "wheel", JointKind::Revolute)],
        forces,
        start,
        ..Scene::default()
    }
}

#[test]
fn torsion_spring_and_damper_oscillate_about_their_angle() {
    for (stiffness, damping) in [(8.0, 0.0), (8.0, 0.6), (8.0, 9.0), (0.0, 0.7)] {
        let torsion = Force::TorsionSpring {
            name: "coil".into(),
            a: "ground".into(),
            b: "wheel".into(),
            stiffness,
            angle: 0.4,
            damping,
        };
        let scene = wheel(vec![torsion], vec![joint_start("axle", 1.0, 2.0)]);
        let outputs = ["wheel.angle", "wheel.angular_velocity", "coil.angle", "coil.torque"];
        compare(&scene, 2.0, &outputs, &[1.0, 4.0, 1.0, 10.0], |t| {
            let [x, v] = free_oscillation(0.5, damping, stiffness, 0.6, 2.0, t);
            vec![0.4 + x, v, 0.4 + x, -stiffness * x - damping * v]
        });
    }
}

#[test]
fn a_torsion_spring_counts_full_turns() {
    // Wound up by three turns: it drives the wheel through them all and beyond.
    let wound = -6.0 * std::f64::consts::PI;
    let torsion = Force::TorsionSpring {
        name: "coil".into(),
        a: "wheel".into(),
        b: "ground".into(),
        stiffness: 2.0,
        angle: wound,
        damping: 0.0,
    };
    let scene = wheel(vec![torsion], vec![joint_start("axle", 0.0, 0.0)]);
    // The wheel's angle is that of the first body, so its rest is at -wound.
    compare(&scene, 4.0, &["wheel.angle", "energy.potential"], &[20.0, 400.0], |t| {
        let x = wound * (2.0 * t).cos();
        vec![x - wound, x * x]
    });
}

#[test]
fn a_harmonic_force_shakes_a_damped_oscillator() {
    let (m, c, k, amplitude, w, phase) = (2.0, 3.0, 200.0, 5.0, 7.0, 0.4);
    let shaker = Force::Applied {
        name: "shaker".into(),
        point: "cart".into(),
        x: TimeFunction::Harmonic { mean: 1.0, amplitude, angular_frequency: w, phase }.into(),
        y: TimeFunction::constant(3.0).into(),
        frame: ForceFrame::Ground,
    };
    let scene = cart(vec![spring(k, 1.0, c), shaker], vec![joint_start("rail", 0.0, 0.0)]);
    // Particular solution mean/k + P sin(wt + phase) + Q cos(wt + phase).
    let (real, imaginary) = (k - m * w * w, c * w);
    let size = real * real + imaginary * imaginary;
    let (p, q) = (amplitude * real / size, -amplitude * imaginary / size);
    let forced = |t: f64| {
        let (sine, cosine) = (w * t + phase).sin_cos();
        [1.0 / k + p * sine + q * cosine, w * (p * cosine - q * sine)]
    };
    compare(&scene, 3.0, &["cart.x", "cart.vx", "rail.reaction_y"], &[0.05, 0.3, 3.0], |t| {
        let [x0, v0] = forced(0.0);
        let [x, v] = free_oscillation(m, c, k, -x0, -v0, t);
        let [xf, vf] = forced(t);
        // The rail holds against the cross force.
        vec![x + xf, v + vf, -3.0]
    });
}

/// A free body that turns at `speed`.
fn floating(forces: Vec<Force>, points: Vec<Point>, center: [f64; 2], speed: f64) -> Scene {
    Scene {
        bodies: vec![Body { angle: 0.3, ..body("disc", 2.0, 0.5, center, points) }],
        forces,
        start: vec![Start::Body { body: "disc".into(), angle: Some(0.3), angular_velocity: Some(speed) }],
        ..Scene::default()
    }
}

#[test]
fn a_force_that_turns_with_a_body_moves_it_in_a_circle() {
    // At the center of mass it turns nothing: v' = F/m (cos, sin)(ω t + 0.3 + angle of the force).
    let thrust = Force::Applied {
        name: "thrust".into(),
        point: "disc.center_of_mass".into(),
        x: TimeFunction::constant(3.0).into(),
        y: TimeFunction::constant(-4.0).into(),
        frame: ForceFrame::Body,
    };
    let (w, direction) = (2.5, 0.3 + (-4.0_f64).atan2(3.0));
    let scene = floating(vec![thrust], Vec::new(), [0.2, -0.1], w);
    let start = run(&scene, 0.1, 2, Method::Rodas5P, &["disc.x", "disc.y", "disc.vx", "disc.vy"]);
    assert!(start.values[2..4].iter().all(|rate| rate.abs() < 1e-14), "it starts at rest");
    let outputs = ["disc.x", "disc.y", "disc.vx", "disc.vy", "disc.angle"];
    compare(&scene, 2.0, &outputs, &[1.0; 5], |t| {
        let radius = 2.5 / (w * w);
        let ((s, c), (s0, c0)) = ((w * t + direction).sin_cos(), direction.sin_cos());
        vec![
            start.values[0] + radius * (c0 - c - w * t * s0),
            start.values[1] + radius * (s0 - s + w * t * c0),
            radius * w * (s - s0),
            radius * w * (c0 - c),
            0.3 + w * t,
        ]
    });
}

#[test]
fn a_follower_force_off_the_center_turns_a_body_evenly() {
    // Arm (0.3, 0) and force (1, 2) in the body: torque 0.6 N m about the center.
    let thrust = Force::Applied {
        name: "thrust".into(),
        point: "disc.P".into(),
        x: TimeFunction::constant(1.0).into(),
        y: TimeFunction::constant(2.0).into(),
        frame: ForceFrame::Body,
    };
    let scene = floating(vec![thrust], vec![point("P", 0.3, 0.0)], [0.0, 0.0], 0.0);
    compare(&scene, 2.0, &["disc.angle", "disc.angular_velocity"], &[1.0, 1.0], |t| {
        vec![0.3 + 0.6 * t * t, 1.2 * t]
    });
}

#[test]
fn a_constant_torque_speeds_a_wheel_up_evenly_and_the_frame_feels_it() {
    let torque = |body: &str, reaction: &str| Force::Torque {
        name: "motor".into(),
        body: body.into(),
        reaction: reaction.into(),
        torque: TimeFunction::constant(3.0).into(),
    };
    let scene = wheel(vec![torque("wheel", "ground")], vec![joint_start("axle", 0.0, 0.0)]);
    compare(&scene, 2.0, &["wheel.angular_velocity", "energy.input"], &[6.0, 36.0], |t| {
        vec![6.0 * t, 3.0 * 3.0 * t * t]
    });
    // Between two wheels on one axle it turns both, each its own way.
    let mut scene = wheel(vec![torque("wheel", "frame")], Vec::new());
    scene.bodies.push(body("frame", 1.0, 2.0, [0.0, 0.0], Vec::new()));
    scene.joints.push(ideal("trunnion", "ground", "frame", JointKind::Revolute));
    compare(&scene, 2.0, &["wheel.angular_velocity", "frame.angular_velocity"], &[6.0, 1.5], |t| {
        vec![6.0 * t, -1.5 * t]
    });
}

/// A cart that a harmonic motion drives, with a pendulum of unit mass on a massless-like rod of unit length.
fn driven_cart(amplitude: f64, frequency: f64, pendulum: bool) -> Scene {
    let mut scene = cart(vec![Force::Gravity { acceleration: [0.0, -9.81] }], Vec::new());
    scene.drives.push(Drive::Motion {
        name: "drive".into(),
        joint: "rail".into(),
        motion: TimeFunction::Harmonic { mean: 0.1, amplitude, angular_frequency: frequency, phase: 0.5 },
    });
    if pendulum {
        scene.bodies.push(body("bob", 1.0, 0.25, [0.0, -1.0], Vec::new()));
        scene.joints.push(ideal("pivot", "cart", "bob", JointKind::Revolute));
        scene.start.push(joint_start("pivot", 1.0, 0.5));
    }
    scene
}

#[test]
fn a_driven_cart_needs_the_force_of_its_inertia() {
    let (amplitude, w) = (0.2, 6.0);
    let scene = driven_cart(amplitude, w, false);
    let outputs = [
        "rail.displacement", "rail.velocity", "rail.acceleration", "drive.force", "drive.power",
        "rail.reaction_x", "rail.reaction_y",
    ];
    compare(&scene, 1.0, &outputs, &[0.2, 1.2, 7.2, 15.0, 18.0, 15.0, 20.0], |t| {
        let (sine, cosine) = (w * t + 0.5).sin_cos();
        let (v, a) = (amplitude * w * cosine, -amplitude * w * w * sine);
        vec![0.1 + amplitude * sine, v, a, 2.0 * a, 2.0 * a * v, 2.0 * a, 2.0 * 9.81]
    });
}

#[test]
fn a_pendulum_on_a_driven_pivot_follows_its_equation() {
    // θ'' (I + m l²) = -m l (g sin θ + x_p'' cos θ), integrated by Rodas6P in 2000 equal steps.
    let scene = driven_cart(0.2, 6.0, true);
    let states = driven_pendulum().reference(2000);
    for method in METHODS {
        let run = run(&scene, 2.0, 41, method, &["bob.angle", "bob.angular_velocity"]);
        for (sample, row) in run.values.chunks_exact(2).enumerate() {
            let exact = &states[50 * sample];
            for k in 0..2 {
                let error = (row[k] - exact[k]).abs();
                assert!(error < 1e-7, "{method:?}: sample {sample}, {k}: off by {error:e}");
            }
        }
    }
    // The reference itself has converged.
    let half = driven_pendulum().equal_steps(RODAS6P, 1000, |_| {});
    assert!(crate::integrators::problems::distance(&half, &states[2000]) < 1e-11);
}
