//! Closed loops of ideal joints, against closed forms and the Cartesian system.

use chebclear::dynamics::Dynamics;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::settings::Method;
use chebclear::run::trajectory::{Settings, Trajectory, simulate};
use chebclear::scene::parts::{Body, Drive, Force, Joint, JointKind, Scene, Start};
use chebclear::tree::elements::Closure;

use crate::support::{body, compile, ideal, point, slider_crank};

/// The paper's mechanism with an ideal wrist.
fn ideal_slider_crank() -> Scene {
    let mut scene = slider_crank(false);
    scene.joints[3] = ideal("wrist", "rod.C", "slider", JointKind::Revolute);
    scene
}

const GROUND: f64 = 0.3;
const CRANK: f64 = 0.1;
const COUPLER: f64 = 0.25;
const ROCKER: f64 = 0.2;

fn link(name: &str, length: f64, angle: f64) -> Body {
    let points = vec![point("P", 0.0, 0.0), point("Q", length, 0.0)];
    let mass = 2.0 * length;
    Body { angle, ..body(name, mass, mass * length * length / 12.0, [0.5 * length, 0.0], points) }
}

/// A Grashof four-bar; driven at `speed`, or free under gravity.
pub(crate) fn four_bar(speed: Option<f64>) -> Scene {
    let drive = |speed| Drive::Speed { name: "drive".into(), joint: "A".into(), speed, angle: 0.4 };
    Scene {
        ground: vec![point("A", 0.0, 0.0), point("D", GROUND, 0.0)],
        bodies: vec![link("crank", CRANK, 0.4), link("coupler", COUPLER, 0.6), link("rocker", ROCKER, 1.8)],
        joints: vec![
            ideal("A", "ground.A", "crank.P", JointKind::Revolute),
            ideal("B", "crank.Q", "coupler.P", JointKind::Revolute),
            ideal("C", "coupler.Q", "rocker.Q", JointKind::Revolute),
            ideal("D", "ground.D", "rocker.P", JointKind::Revolute),
        ],
        forces: vec![Force::Gravity { acceleration: [0.0, if speed.is_some() { 0.0 } else { -9.81 }] }],
        drives: speed.map(drive).into_iter().collect(),
        start: Vec::new(),
        couplings: Vec::new(),
    }
}

fn run(mechanism: &Mechanism, duration: f64, samples: usize, rtol: f64) -> Trajectory {
    let settings = Settings { rtol, ..Settings::new(duration, samples) };
    let run = simulate(mechanism, &settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "done", "{}", run.message());
    run
}

fn column(run: &Trajectory, name: &str) -> Vec<f64> {
    let place = run.columns.iter().position(|column| column == name).unwrap();
    run.values.chunks_exact(run.columns.len()).map(|row| row[place]).collect()
}

#[test]
fn gate_12_free_four_bar_keeps_its_energy_and_stays_closed() {
    let mechanism = compile(&four_bar(None));
    assert_eq!((mechanism.degrees_of_freedom(), mechanism.mobility()), (3, 1));
    let run = run(&mechanism, 3.0, 601, 1e-9);
    let mut energies = Vec::new();
    for k in 0..run.t.len() {
        let energy = mechanism.bodies.iter().map(|body| {
            let of = |quantity: &str| column(&run, &format!("{}.{quantity}", body.name))[k];
            0.5 * body.mass * (of("vx").powi(2) + of("vy").powi(2))
                + 0.5 * body.inertia * of("angular_velocity").powi(2)
                + body.mass * 9.81 * of("y")
        });
        energies.push(energy.sum::<f64>());
    }
    let swing = column(&run, "crank.angular_velocity").iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    assert!(swing > 1.0, "it moves");
    for energy in &energies {
        assert!((energy - energies[0]).abs() < 1e-7, "{energy} {}", energies[0]);
    }
    let mut dynamics = Dynamics::new(&mechanism);
    dynamics.move_to(3.0, &run.end.q, &run.end.v);
    let residual = |(gap, rate): (f64, f64), closure: &Closure| {
        let (a, b) = (dynamics.point(closure.a), dynamics.point(closure.b));
        ((b.position - a.position).norm().max(gap), (b.velocity - a.velocity).norm().max(rate))
    };
    let (gap, rate) = mechanism.closures.iter().fold((0.0, 0.0), residual);
    assert!(gap < 1e-14 && rate < 1e-12, "{gap:e} m, {rate:e} m/s");
    assert!(run.largest_projection < 1e-9);
}

/// Largest gap [m] and gap rate [m/s] of the joints that close the loop, one of which is cut, over the
/// samples of a run.
fn residuals(mechanism: &Mechanism, duration: f64, rtol: f64, method: Method) -> (f64, f64, Trajectory) {
    let ends = ["crank.Q", "coupler.P", "coupler.Q", "rocker.Q", "rocker.P"];
    let outputs = ends.iter().flat_map(|end| ["x", "y", "vx", "vy"].map(|name| format!("{end}.{name}")));
    let settings =
        Settings { rtol, method, outputs: Some(outputs.collect()), ..Settings::new(duration, 1001) };
    let run = simulate(mechanism, &settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "done", "{}", run.message());
    let (mut gap, mut rate) = (0.0_f64, 0.0_f64);
    for row in run.values.chunks_exact(20) {
        for (a, b) in
            [(&row[..4], &row[4..8]), (&row[8..12], &row[12..16]), (&row[16..], &[GROUND, 0.0, 0.0, 0.0])]
        {
            gap = gap.max((a[0] - b[0]).hypot(a[1] - b[1]));
            rate = rate.max((a[2] - b[2]).hypot(a[3] - b[3]));
        }
    }
    (gap, rate, run)
}

#[test]
fn gate_12_ten_thousand_revolutions_do_not_open_the_loop() {
    let speed = 40.0;
    let mechanism = compile(&four_bar(Some(speed)));
    let (gap, rate, _) = residuals(&mechanism, 1e4 * std::f64::consts::TAU / speed, 1e-6, Method::Auto);
    assert!(gap <= 1e-15 && rate <= 1e-13, "{gap:e} m, {rate:e} m/s");
}

#[test]
fn gate_12_an_integrated_loop_stays_closed_and_counts_its_turns() {
    // Set off by hand and left alone, without gravity: it turns on with the energy it was given.
    let mut scene = four_bar(None);
    scene.forces.clear();
    scene.start = vec![Start::Joint { joint: "A".into(), position: Some(0.4), velocity: Some(40.0) }];
    let mechanism = compile(&scene);
    let (gap, rate, run) = residuals(&mechanism, 100.0, 1e-8, Method::Auto);
    assert!(gap <= 1e-14 && rate <= 1e-11, "{gap:e} m, {rate:e} m/s");
    let turns = run.end.q[0] / std::f64::consts::TAU;
    assert!(turns > 400.0, "the crank made {turns} turns");
    assert!((mechanism.start.v[0] - 40.0).abs() < 1e-12);
}

#[test]
fn gate_12_samples_inside_the_steps_close_the_loop_whatever_the_tolerance() {
    let mechanism = compile(&four_bar(None));
    for (method, most_steps) in [(Method::Dop853, 200), (Method::Auto, 700)] {
        let (gap, rate, run) = residuals(&mechanism, 3.0, 1e-3, method);
        assert!(run.stats.steps < most_steps, "the other samples lie inside a step: {}", run.stats.steps);
        assert!(gap <= 1e-14 && rate <= 1e-12, "{method:?}: {gap:e} m, {rate:e} m/s");
    }
}

#[test]
fn redundant_joints_are_named() {
    // A parallelogram with a third, parallel crank.
    let mut scene = four_bar(Some(1.0));
    scene.bodies = vec![link("left", 0.1, 1.0), link("bar", 0.3, 0.0), link("right", 0.1, 1.0)];
    scene.bodies[1].points.push(point("M", 0.15, 0.0));
    scene.bodies.push(link("middle", 0.1, 1.0));
    scene.ground.push(point("M", 0.15, 0.0));
    scene.joints = vec![
        ideal("A", "ground.A", "left.P", JointKind::Revolute),
        ideal("B", "left.Q", "bar.P", JointKind::Revolute),
        ideal("C", "bar.Q", "right.Q", JointKind::Revolute),
        ideal("D", "ground.D", "right.P", JointKind::Revolute),
        ideal("E", "ground.M", "middle.P", JointKind::Revolute),
        ideal("F", "middle.Q", "bar.M", JointKind::Revolute),
    ];
    scene.drives = vec![Drive::Speed { name: "drive".into(), joint: "A".into(), speed: 1.0, angle: 1.0 }];
    let error = Mechanism::compile(&scene).unwrap_err().to_string();
    assert!(error.contains("\"F\"") && error.contains("redundant"), "{error}");
}

#[test]
fn gate_04_a_drive_through_a_dead_center_is_a_typed_error() {
    // Crank longer than the rod: the slider-crank jams where the rod stands on the guide.
    let mut scene = ideal_slider_crank();
    scene.bodies[1].points[1] = point("C", 0.03, 0.0);
    let mechanism = compile(&scene);
    let settings = Settings::new(0.06, 601);
    let run = simulate(&mechanism, &settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "singular_mechanism");
    let jam = (0.03_f64 / 0.05).asin() / (2000.0 * std::f64::consts::PI / 30.0);
    assert!((run.time - jam).abs() < 1e-9, "{} {jam}", run.time);
    assert!(run.values.last().unwrap().is_nan());
    let Joint::Ideal { name, .. } = &scene.joints[3] else { unreachable!() };
    assert_eq!(name, "wrist");
}
