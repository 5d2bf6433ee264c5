//! A run that goes on where another ended is that of a single run, within the error of that.

use chebclear::contact::normal::Latch;
use chebclear::contact::pair::Phase;
use chebclear::expression::curve::Curve;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::contacts::Contact;
use chebclear::run::restart::Restart;
use chebclear::run::settings::Method;
use chebclear::run::trajectory::{Settings, Trajectory, simulate, simulate_from};
use chebclear::scene::parts::{Body, Drive, Force, Joint, JointKind, Scene};
use chebclear::scene::time_function::TimeFunction;

use crate::support::{body, compile, ideal, point, slider_crank};

const METHODS: [Method; 4] = [Method::Rodas4, Method::Rodas5P, Method::Dop853, Method::Adams];

fn settings(method: Method, duration: f64, samples: usize) -> Settings {
    let outputs = ["energy.total", "energy.input", "energy.balance"].map(str::to_owned).to_vec();
    Settings { method, outputs: Some(outputs), ..Settings::new(duration, samples) }
}

fn link(name: &str, length: f64, angle: f64) -> Body {
    let points = vec![point("P", 0.0, 0.0), point("Q", length, 0.0)];
    Body { angle, ..body(name, length, length.powi(3), [0.5 * length, 0.0], points) }
}

/// A crank-rocker under gravity: released, or driven by a table, or by a torque by a table.
fn four_bar(drives: Vec<Drive>, forces: Vec<Force>) -> Scene {
    Scene {
        ground: vec![point("A", 0.0, 0.0), point("D", 0.3, 0.0)],
        bodies: vec![link("crank", 0.1, 0.4), link("coupler", 0.25, 0.6), link("rocker", 0.2, 1.8)],
        joints: vec![
            ideal("A", "ground.A", "crank.P", JointKind::Revolute),
            ideal("B", "crank.Q", "coupler.P", JointKind::Revolute),
            ideal("C", "coupler.Q", "rocker.Q", JointKind::Revolute),
            ideal("D", "ground.D", "rocker.P", JointKind::Revolute),
        ],
        forces: [vec![Force::Gravity { acceleration: [0.0, -9.81] }], forces].concat(),
        drives,
        start: Vec::new(),
        couplings: Vec::new(),
    }
}

fn table(duration: f64, size: f64) -> TimeFunction {
    let times: Vec<f64> = (0..=10).map(|k| duration * f64::from(k) / 10.0).collect();
    let values: Vec<f64> = times.iter().map(|t| 0.4 + size * (1.3 * t / duration * 10.0).sin()).collect();
    TimeFunction::Table(Curve::spline(&times, &values).unwrap())
}

/// Scenes with friction, loops, drives, tables; and how long they run.
fn scenes() -> Vec<(&'static str, Scene, f64)> {
    let motion = |motion| vec![Drive::Motion { name: "drive".into(), joint: "A".into(), motion }];
    let torque = |torque: TimeFunction| Force::Torque {
        name: "motor".into(),
        body: "crank".into(),
        reaction: "ground".into(),
        torque: torque.into(),
    };
    let mut by_table = slider_crank(false);
    by_table.drives = vec![Drive::Motion {
        name: "drive".into(),
        joint: "crank_bearing".into(),
        motion: table(0.015625, 3.0),
    }];
    let harmonic = |mean| TimeFunction::Harmonic { mean, amplitude: 0.5, angular_frequency: 9.0, phase: 0.1 };
    vec![
        ("clearance and friction", slider_crank(false), 0.015625),
        ("as printed", slider_crank(true), 0.015625),
        ("clearance, driven by a table", by_table, 0.015625),
        ("a free loop", four_bar(Vec::new(), Vec::new()), 1.0),
        ("a loop, torque by a table", four_bar(Vec::new(), vec![torque(table(1.0, 1.0))]), 1.0),
        ("a prescribed loop", four_bar(motion(TimeFunction::Polynomial(vec![0.4, 7.0])), Vec::new()), 1.0),
        (
            "a prescribed loop, from rest",
            four_bar(motion(TimeFunction::Polynomial(vec![0.4, 0.0, 3.0])), Vec::new()),
            1.0,
        ),
        ("a prescribed loop that swings", four_bar(motion(harmonic(0.4)), vec![torque(harmonic(1.0))]), 1.0),
        ("a prescribed loop by a table", four_bar(motion(table(1.0, 0.5)), Vec::new()), 1.0),
    ]
}

fn run(mechanism: &Mechanism, settings: &Settings) -> Trajectory {
    let run = simulate(mechanism, settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "done", "{}", run.message());
    run
}

fn go_on(mechanism: &Mechanism, from: &Trajectory, settings: &Settings) -> Trajectory {
    let text = from.restart.as_ref().expect("the run reached its end").to_json();
    let restart = Restart::from_json(&text).unwrap();
    assert_eq!(restart.to_json(), text, "through JSON");
    let run = simulate_from(mechanism, &restart, settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "done", "{}", run.message());
    run
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Largest difference of two ends, positions in units of the least clearance or of 1 m.
fn distance(a: &Trajectory, b: &Trajectory, unit: f64) -> f64 {
    let pairs = a.end.q.iter().zip(&b.end.q).map(|(a, b)| (a - b) / unit);
    let rates = a.end.v.iter().zip(&b.end.v).map(|(a, b)| a - b);
    pairs.chain(rates).map(f64::abs).fold(0.0, f64::max)
}

#[test]
fn two_runs_are_one_within_the_error_of_that() {
    for (name, scene, duration) in scenes() {
        let mechanism = compile(&scene);
        let tight = Settings { rtol: 1e-11, ..settings(Method::Rodas5P, duration, 2) };
        let truth = run(&mechanism, &tight);
        let unit = mechanism.slots.first().map_or(1.0, |joint| joint.law.clearance);
        for method in METHODS {
            let whole = run(&mechanism, &settings(method, duration, 5));
            // Impacts are chaotic: tolerances that differ by 1e-4 move an error by a factor of up to 18. So the
            // largest of a few counts.
            let error = (-1..=1)
                .map(|k| {
                    let near = settings(method, duration, 2);
                    let near = Settings { rtol: near.rtol * (1.0 + 1e-4 * f64::from(k)), ..near };
                    distance(&run(&mechanism, &near), &truth, unit)
                })
                .fold(0.0, f64::max);
            for part in [1.0 / 64.0, 0.375, 63.0 / 64.0] {
                let first = run(&mechanism, &settings(method, part * duration, 3));
                let second = go_on(&mechanism, &first, &settings(method, (1.0 - part) * duration, 4));
                assert_eq!(second.t[0], part * duration);
                assert_eq!(second.t[3], duration);
                for (end, start) in first.values[6..].iter().zip(&second.values[..3]) {
                    assert!((end - start).abs() <= 1e-9 * (end.abs() + 1.0), "the start is the end");
                }
                let what = format!("{name}, {method:?}, cut at {part}");
                let found = distance(&second, &truth, unit);
                println!("{what}: {found:.1e}, whole {error:.1e}");
                // Measured: 1.2 times at most.
                assert!(found < 4.0 * error + 1e-5, "{what}: {found:e} instead of {error:e}");
                let [whole_balance, balance] = [&whole, &second].map(|run| run.values[run.values.len() - 1]);
                let energy = whole.values[whole.values.len() - 3].abs();
                assert!((balance - whole_balance).abs() < 1e-4 * energy, "{what}: {balance} {whole_balance}");
                assert_eq!(first.events.len() + second.events.len(), whole.events.len(), "{what}: events");
            }
        }
    }
}

#[test]
fn contacts_of_the_parts_are_those_of_the_whole() {
    let mechanism = compile(&slider_crank(false));
    let duration = 0.015625;
    let whole = run(&mechanism, &settings(Method::Rodas5P, duration, 3));
    let mut across = 0;
    let (mut times, mut sizes) = (0.0_f64, 0.0_f64);
    for k in 1..64 {
        let part = f64::from(k) / 64.0;
        let first = run(&mechanism, &settings(Method::Rodas5P, part * duration, 3));
        let second = go_on(&mechanism, &first, &settings(Method::Rodas5P, (1.0 - part) * duration, 3));
        let ended: Vec<&Contact> =
            first.contacts.iter().filter(|contact| !contact.separation.is_nan()).collect();
        assert_eq!(ended.len() + second.contacts.len(), whole.contacts.len(), "cut at {part}");
        for (contact, of_whole) in second.contacts.iter().zip(&whole.contacts[ended.len()..]) {
            // Also where the contact, with its peak, began in the first part.
            let lasts =
                |contact: &Contact| if contact.separation.is_nan() { duration } else { contact.separation };
            times = times.max((contact.onset - of_whole.onset).abs());
            times = times.max((lasts(contact) - lasts(of_whole)).abs());
            sizes = sizes.max((contact.peak_force / of_whole.peak_force - 1.0).abs());
            sizes = sizes.max((contact.impact_velocity / of_whole.impact_velocity - 1.0).abs());
            across += usize::from(contact.onset < part * duration);
        }
    }
    println!("{across} contacts were cut: instants within {times:.1e} s, sizes within {sizes:.1e}");
    assert!(across > 30, "{across} contacts were cut");
    assert!(times < 1e-6 && sizes < 1e-2, "{times:e} s, {sizes:e}");
}

#[test]
fn samples_do_not_change_the_run_and_can_be_skipped_to() {
    for (name, scene, duration) in scenes() {
        let mechanism = compile(&scene);
        let whole = run(&mechanism, &settings(Method::Rodas5P, duration, 65));
        let few = run(&mechanism, &settings(Method::Rodas5P, duration, 2));
        assert_eq!(bits(&whole.end.q), bits(&few.end.q), "{name}");
        assert_eq!(whole.stats, few.stats, "{name}");
        let late = Settings { skip: 0.75 * duration, ..settings(Method::Rodas5P, 0.25 * duration, 17) };
        let late = run(&mechanism, &late);
        assert_eq!(late.t, whole.t[48..], "{name}");
        assert_eq!(bits(&late.values), bits(&whole.values[3 * 48..]), "{name}");
        assert_eq!(late.stats, whole.stats, "{name}");
    }
}

#[test]
fn an_end_fits_its_own_mechanism_only_and_a_failure_has_none() {
    let (first, other) = (compile(&slider_crank(false)), compile(&four_bar(Vec::new(), Vec::new())));
    let end = run(&first, &settings(Method::Rodas5P, 1e-3, 2)).restart.unwrap();
    let next = settings(Method::Rodas5P, 1e-3, 2);
    let problem = simulate_from(&other, &end, &next, &|_| true).map(|_| ()).unwrap_err().to_string();
    assert!(problem.starts_with("start: belongs to another mechanism"), "{problem}");
    let mut ideal_wrist = slider_crank(false);
    ideal_wrist.joints[3] = ideal("wrist", "rod.C", "slider", JointKind::Revolute);
    assert!(simulate_from(&compile(&ideal_wrist), &end, &next, &|_| true).is_err());
    // Other numbers in the same mechanism are the user's business: a parameter may change in mid run.
    let mut softer = slider_crank(false);
    let Joint::Clearance { contact, .. } = &mut softer.joints[3] else { panic!("clearance") };
    contact.stiffness *= 0.5;
    assert_eq!(simulate_from(&compile(&softer), &end, &next, &|_| true).unwrap().status.word(), "done");

    let mut few = settings(Method::Rodas5P, 0.01, 2);
    few.limits.max_steps = 100;
    let failed = simulate(&first, &few, &|_| true).unwrap();
    assert_eq!(failed.status.word(), "max_steps");
    assert!(failed.restart.is_none());
    let cancelled = simulate(&first, &settings(Method::Rodas5P, 0.01, 2), &|t| t < 1e-3).unwrap();
    assert!(cancelled.restart.is_none());
}

#[test]
fn a_damaged_end_is_refused_with_the_path() {
    let good =
        run(&compile(&slider_crank(false)), &settings(Method::Rodas5P, 1e-3, 2)).restart.unwrap().to_json();
    assert_eq!(Restart::from_json(&good).unwrap().to_json(), good);
    for (text, path) in [
        ("{", "start: is not valid JSON"),
        ("3", "start: invalid type"),
        (&good.replacen("\"turns\"", "\"turn\"", 1), "start.memory.turn: unknown field"),
        (&good.replacen("\"q\":[", "\"q\":[\"far\",", 1), "start.q[0]: invalid type"),
        (&good.replacen("\"time\":", "\"tme\":", 1), "start.tme: unknown field"),
    ] {
        let problem = Restart::from_json(text).unwrap_err().to_string();
        assert!(problem.starts_with(path), "{path:?} in {problem:?}");
    }
}

#[test]
fn an_end_with_numbers_that_no_run_ends_with_is_refused_with_every_problem() {
    let mechanism = compile(&slider_crank(false));
    let good = run(&mechanism, &settings(Method::Rodas5P, 1e-3, 2)).restart.unwrap();
    assert!(good.memory.phases.iter().any(|phase| matches!(phase, Phase::Contact { .. })));
    let mut bad = good.clone();
    bad.memory.turns[0] = 0.37;
    bad.memory.phases[0] = Phase::Contact {
        latch: Latch { hysteresis_factor: -2.0, ..Latch::default() },
        clipped: false,
        traction: None,
    };
    let work = bad.memory.work.as_mut().unwrap();
    work.damping = -1.0;
    work.contacts[0].wear = -1.0;
    let told: Vec<String> =
        Restart::from_json(&bad.to_json()).unwrap_err().problems.iter().map(ToString::to_string).collect();
    let expected = [
        "start.memory.turns[0]: must be a whole number of full turns, got 0.37",
        "start.memory.phases[0].Contact.latch.hysteresis_factor: must be >= 0 [s/m], got -2",
        "start.memory.work.damping: must be >= 0 [J], got -1",
        "start.memory.work.contacts[0].wear: must be >= 0 [N m], got -1",
    ];
    assert_eq!(told, expected);
    let refused =
        simulate_from(&mechanism, &bad, &settings(Method::Rodas5P, 1e-3, 2), &|_| true).unwrap_err();
    assert_eq!(refused.problems.len(), expected.len());
    bad.q[1] = f64::NAN;
    let refused = Restart::from_json(&bad.to_json()).unwrap_err();
    assert_eq!(refused.problems[0].path, "start.q[1]");
}
