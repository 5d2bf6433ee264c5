//! Forces, torques and motions by tables: steps end on every point, and the motion is the spline integrated twice.

use chebclear::expression::curve::Curve;
use chebclear::run::settings::Method;
use chebclear::run::trajectory::{Settings, Trajectory, simulate, simulate_from};
use chebclear::scene::parts::{Drive, Force, ForceFrame, JointKind, Scene};
use chebclear::scene::time_function::TimeFunction;

use crate::support::{Random, body, compile, ideal, point};

const METHODS: [Method; 5] = [Method::Auto, Method::Adams, Method::Dop853, Method::Rodas4, Method::Rodas5P];
const RTOL: f64 = 1e-6;
/// Largest error of a run, in tolerances of 1 m or 1 rad.
const ALLOWED: f64 = 10.0;
const MASS: f64 = 0.5;

/// Times from 0 to the end of a run, with points as tables have them.
fn times(kind: usize, random: &mut Random, duration: f64) -> Vec<f64> {
    let count = 5 + random.index(60);
    let even = |k: usize| k as f64 / (count - 1) as f64;
    let mut parts: Vec<f64> = match kind {
        0 => (0..count).map(even).collect(),
        1 => (0..count).map(|k| (even(k) * 1e6).round() / 1e6).collect(),
        2 => (0..count).map(|_| random.unit()).collect(),
        3 => (0..count).map(|k| 10f64.powf(-8.0 * even(k))).collect(),
        _ => (0..count).map(|_| random.unit()).filter(|part| (0.01..0.99).contains(part)).collect(),
    };
    parts.extend([0.0, 1.0]);
    let mut times: Vec<f64> = parts.iter().map(|part| part * duration).collect();
    times.sort_by(f64::total_cmp);
    if kind == 4 {
        // Every third point has a neighbor a few roundings behind it, or at the distance of one of the duration.
        for k in (3..times.len() - 3).step_by(3) {
            let behind =
                if random.unit() < 0.5 { times[k].next_up() } else { times[k] + f64::EPSILON * duration };
            times.push(behind);
        }
        times.sort_by(f64::total_cmp);
    }
    times.dedup();
    times
}

/// The pieces of the spline from its second derivatives at all points: value, slope and higher coefficients.
fn pieces(times: &[f64], values: &[f64]) -> Vec<[f64; 4]> {
    let n = times.len();
    let h: Vec<f64> = times.windows(2).map(|t| t[1] - t[0]).collect();
    let secant: Vec<f64> = (0..n - 1).map(|k| (values[k + 1] - values[k]) / h[k]).collect();
    let (first, last) = (h[0] / h[1], h[n - 2] / h[n - 3]);
    let (mut lower, mut diagonal, mut upper, mut bend) =
        (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for k in 1..n - 1 {
        (lower[k], diagonal[k], upper[k]) = (h[k - 1], 2.0 * (h[k - 1] + h[k]), h[k]);
        bend[k] = 6.0 * (secant[k] - secant[k - 1]);
    }
    // The first and the last inner point are none: the second derivatives go on as a line.
    diagonal[1] += h[0] * (1.0 + first);
    upper[1] -= h[0] * first;
    diagonal[n - 2] += h[n - 2] * (1.0 + last);
    lower[n - 2] -= h[n - 2] * last;
    for k in 2..n - 1 {
        let factor = lower[k] / diagonal[k - 1];
        diagonal[k] -= factor * upper[k - 1];
        bend[k] -= factor * bend[k - 1];
    }
    bend[n - 2] /= diagonal[n - 2];
    for k in (1..n - 2).rev() {
        bend[k] = (bend[k] - upper[k] * bend[k + 1]) / diagonal[k];
    }
    bend[0] = bend[1] + first * (bend[1] - bend[2]);
    bend[n - 1] = bend[n - 2] + last * (bend[n - 2] - bend[n - 3]);
    (0..n - 1)
        .map(|k| {
            let slope = secant[k] - h[k] * (2.0 * bend[k] + bend[k + 1]) / 6.0;
            [values[k], slope, 0.5 * bend[k], (bend[k + 1] - bend[k]) / (6.0 * h[k])]
        })
        .collect()
}

/// The integral of the spline and the integral of that, from 0 to `t`.
fn integrals(times: &[f64], pieces: &[[f64; 4]], t: f64) -> [f64; 2] {
    let (mut once, mut twice) = (0.0, 0.0);
    for (ends, [a, b, c, d]) in times.windows(2).zip(pieces).filter(|(ends, _)| ends[0] < t) {
        let x = t.min(ends[1]) - ends[0];
        twice += once * x + x * x * (a / 2.0 + x * (b / 6.0 + x * (c / 12.0 + x * d / 20.0)));
        once += x * (a + x * (b / 2.0 + x * (c / 3.0 + x * d / 4.0)));
    }
    [once, twice]
}

/// A mass in a guide that a force pushes, or a rotor with a torque.
fn pushed(is_rotor: bool, load: TimeFunction) -> Scene {
    let (kind, force) = if is_rotor {
        let torque = Force::Torque {
            name: "motor".into(),
            body: "part".into(),
            reaction: "ground".into(),
            torque: load.into(),
        };
        (JointKind::Revolute, torque)
    } else {
        let push = Force::Applied {
            name: "push".into(),
            point: "part".into(),
            x: load.into(),
            y: TimeFunction::constant(0.0).into(),
            frame: ForceFrame::Ground,
        };
        (JointKind::Prismatic { axis: [1.0, 0.0], angle: 0.0 }, push)
    };
    Scene {
        ground: vec![point("O", 0.0, 0.0)],
        bodies: vec![body("part", MASS, MASS, [0.0, 0.0], vec![point("O", 0.0, 0.0)])],
        joints: vec![if is_rotor {
            ideal("joint", "ground.O", "part.O", kind)
        } else {
            ideal("joint", "ground", "part", kind)
        }],
        forces: vec![force],
        ..Scene::default()
    }
}

/// A mass that slides on a base, which is moved: seen from the ground it keeps its speed.
fn carried(motion: TimeFunction) -> Scene {
    let along = || JointKind::Prismatic { axis: [1.0, 0.0], angle: 0.0 };
    Scene {
        bodies: ["base", "part"].map(|name| body(name, MASS, MASS, [0.0, 0.0], Vec::new())).to_vec(),
        joints: vec![ideal("rail", "ground", "base", along()), ideal("guide", "base", "part", along())],
        drives: vec![Drive::Motion { name: "drive".into(), joint: "rail".into(), motion }],
        ..Scene::default()
    }
}

fn settings(method: Method, duration: f64, output: &str) -> Settings {
    Settings { rtol: RTOL, method, outputs: Some(vec![output.to_owned()]), ..Settings::new(duration, 23) }
}

fn check(run: &Trajectory, case: &str, truth: impl Fn(f64) -> f64) {
    assert_eq!(run.status.word(), "done", "{case}: {}", run.message());
    for (&t, value) in run.t.iter().zip(&run.values) {
        let error = (value - truth(t)).abs();
        assert!(error <= ALLOWED * RTOL, "{case}: {value} at {t}, off by {error:e}");
    }
}

#[test]
fn no_point_of_a_table_ends_a_run_and_the_motion_is_the_spline_integrated() {
    let mut random = Random(30);
    for index in 0..400 {
        let kind = index % 5;
        let duration = 10f64.powf(random.within(-6.0, 6.0));
        let times = times(kind, &mut random, duration);
        let [slow, fast] = [random.within(1.0, 9.0), random.within(9.0, 40.0)];
        let shape = |t: &f64| (slow * t / duration).sin() + 0.4 * (fast * t / duration).sin();
        let values: Vec<f64> = times.iter().map(shape).collect();
        for what in 0..3 {
            // The mass moves by about 1 m, the rotor by about 1 rad.
            let scale = if what == 2 { 1.0 } else { MASS / (duration * duration) };
            let values: Vec<f64> = values.iter().map(|value| scale * value).collect();
            let pieces = pieces(&times, &values);
            let load = TimeFunction::Table(Curve::spline(&times, &values).unwrap());
            let (scene, output) = match what {
                0 => (pushed(false, load), "part.x"),
                1 => (pushed(true, load), "part.angle"),
                _ => (carried(load), "part.x"),
            };
            let mechanism = compile(&scene);
            for method in METHODS {
                let case = format!("table {index} of kind {kind}, scene {what}, {method:?}");
                let run = simulate(&mechanism, &settings(method, duration, output), &|_| true).unwrap();
                match what {
                    2 => check(&run, &case, |t| values[0] + pieces[0][1] * t),
                    _ => check(&run, &case, |t| integrals(&times, &pieces, t)[1] / MASS),
                }
            }
        }
    }
}

#[test]
fn a_run_goes_on_at_a_point_of_a_table_or_a_rounding_beside_it() {
    let times: Vec<f64> = (0..=100).map(|k| (f64::from(k) * 1e4).round() / 1e6).collect();
    let values: Vec<f64> = times.iter().map(|t| 50.0 * (7.0 * t).sin() + 20.0 * (31.0 * t).sin()).collect();
    let pieces = pieces(&times, &values);
    let mechanism = compile(&pushed(false, TimeFunction::Table(Curve::spline(&times, &values).unwrap())));
    for method in METHODS {
        for point in [1, 13, 37, 58, 99] {
            for end in [times[point].next_down(), times[point], times[point].next_up(), times[point] + 3e-3] {
                let case = format!("{method:?}, restarted at {end:?}");
                let first = simulate(&mechanism, &settings(method, end, "part.x"), &|_| true).unwrap();
                check(&first, &case, |t| integrals(&times, &pieces, t)[1] / MASS);
                let start = first.restart.expect("the run reached its end");
                let rest = settings(method, 1.0 - end, "part.x");
                let second = simulate_from(&mechanism, &start, &rest, &|_| true).unwrap();
                check(&second, &case, |t| integrals(&times, &pieces, t)[1] / MASS);
            }
        }
    }
}
