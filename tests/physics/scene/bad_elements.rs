//! Springs, dampers, given forces, motions and starts with something wrong: refused at their paths.

use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::features::{Feature, FeatureKind};
use chebclear::run::settings::Settings;
use chebclear::run::trajectory::simulate;
use chebclear::scene::loads::Load;
use chebclear::scene::parts::{Force, ForceFrame, Scene, Start};
use chebclear::scene::reader::read_scene;
use chebclear::scene::time_function::{Spline, TimeFunction};

use crate::support::compile;

pub(crate) const GOOD: &str = r#"{
  "ground": {"O": [0, 0], "W": [-1, 0]},
  "bodies": [
    {"name": "cart", "mass": 1, "inertia": 1},
    {"name": "arm", "mass": 1, "inertia": 1, "center_of_mass": [0.5, 0], "points": {"A": [0, 0], "B": [1, 0]}},
    {"name": "hand", "mass": 1, "inertia": 1, "points": {"A": [0, 0], "B": [1, 0]}, "angle": -1},
    {"name": "ring", "mass": 1, "inertia": 1}
  ],
  "joints": [
    {"type": "prismatic", "name": "rail", "a": "ground.O", "b": "cart", "axis": [1, 0]},
    {"type": "revolute", "name": "pivot", "a": "cart", "b": "arm.A"},
    {"type": "revolute", "name": "wrist", "a": "arm.B", "b": "hand.A"},
    {"type": "clearance_revolute", "name": "eye", "bearing": "hand.B", "journal": "ring", "journal_radius": 0.01,
     "clearance": 1e-3, "sliding": "surface", "contact": {"law": "hertz", "stiffness": 1e9}}
  ],
  "forces": [
    {"type": "spring", "name": "coil", "a": "ground.W", "b": "cart", "stiffness": 10, "length": 0.5, "damping": 1},
    {"type": "damper", "name": "dashpot", "a": "ground.W", "b": "arm.B", "damping": 2},
    {"type": "torsion_spring", "name": "twist", "a": "cart", "b": "arm", "stiffness": 3, "angle": 0.25, "damping": 4},
    {"type": "torsion_damper", "name": "drag", "a": "ground", "b": "hand", "damping": 5},
    {"type": "force", "name": "push", "point": "arm.B", "frame": "body",
     "x": {"function": "harmonic", "amplitude": 6, "angular_frequency": 7, "phase": 8, "mean": 9},
     "y": {"function": "polynomial", "coefficients": [10, 11]}},
    {"type": "torque", "name": "motor", "body": "hand", "reaction": "arm",
     "torque": {"function": "table", "points": [0, 1, 2], "values": [12, 13, 14]}}
  ],
  "drives": [{"type": "motion", "name": "shaker", "joint": "rail",
              "motion": {"function": "harmonic", "amplitude": 0.1, "angular_frequency": 15}}],
  "start": [
    {"type": "joint", "joint": "pivot", "position": 0.5, "velocity": 16},
    {"type": "body", "body": "hand", "angle": -0.75, "angular_velocity": 17},
    {"type": "clearance", "joint": "eye", "eccentricity": [1e-4, 2e-4], "rate": [0.125, 18]}
  ]
}"#;

#[test]
fn the_good_text_is_read_as_what_it_says() {
    let scene = read_scene(GOOD).unwrap();
    let harmonic = |amplitude, angular_frequency, phase, mean| TimeFunction::Harmonic {
        mean,
        amplitude,
        angular_frequency,
        phase,
    };
    let damper = |name: &str, a: &str, b: &str, stiffness, length, damping| Force::Spring {
        name: name.into(),
        a: a.into(),
        b: b.into(),
        stiffness,
        length,
        damping,
        tension: Load::NONE,
    };
    let torsion = |name: &str, a: &str, b: &str, stiffness, angle, damping| Force::TorsionSpring {
        name: name.into(),
        a: a.into(),
        b: b.into(),
        stiffness,
        angle,
        damping,
    };
    assert_eq!(
        scene.forces,
        [
            damper("coil", "ground.W", "cart", 10.0, 0.5, 1.0),
            damper("dashpot", "ground.W", "arm.B", 0.0, 0.0, 2.0),
            torsion("twist", "cart", "arm", 3.0, 0.25, 4.0),
            torsion("drag", "ground", "hand", 0.0, 0.0, 5.0),
            Force::Applied {
                name: "push".into(),
                point: "arm.B".into(),
                x: harmonic(6.0, 7.0, 8.0, 9.0).into(),
                y: TimeFunction::Polynomial(vec![10.0, 11.0]).into(),
                frame: ForceFrame::Body,
            },
            Force::Torque {
                name: "motor".into(),
                body: "hand".into(),
                reaction: "arm".into(),
                torque: TimeFunction::Table(Spline::new(&[0.0, 1.0, 2.0], &[12.0, 13.0, 14.0]).unwrap())
                    .into(),
            },
        ]
    );
    assert_eq!(scene.drives[0].motion(), harmonic(0.1, 15.0, 0.0, 0.0));
    assert_eq!(
        scene.start,
        [
            Start::Joint { joint: "pivot".into(), position: Some(0.5), velocity: Some(16.0) },
            Start::Body { body: "hand".into(), angle: Some(-0.75), angular_velocity: Some(17.0) },
            Start::Clearance { joint: "eye".into(), eccentricity: [1e-4, 2e-4], rate: [0.125, 18.0] },
        ]
    );
    assert_eq!(compile(&scene).degrees_of_freedom(), 5);
}

/// The only problem of the good text with one passage replaced.
fn only_problem(passage: &str, replacement: &str) -> String {
    assert_eq!(GOOD.matches(passage).count(), 1, "{passage}");
    let error = read_scene(&GOOD.replacen(passage, replacement, 1)).expect_err(replacement);
    assert_eq!(error.problems.len(), 1, "{error}");
    error.to_string()
}

#[test]
fn every_field_with_an_impossible_value_is_one_problem() {
    // Field, its good text, its path, unit, and whether it may be negative.
    for (good, path, unit, least) in [
        ("\"stiffness\": 10", "forces[0].stiffness", "N/m", Some(0.0)),
        ("\"length\": 0.5", "forces[0].length", "m", Some(0.0)),
        ("\"damping\": 1}", "forces[0].damping", "N s/m", Some(0.0)),
        ("\"damping\": 2", "forces[1].damping", "N s/m", Some(0.0)),
        ("\"stiffness\": 3", "forces[2].stiffness", "N m/rad", Some(0.0)),
        ("\"angle\": 0.25", "forces[2].angle", "rad", None),
        ("\"damping\": 4", "forces[2].damping", "N m s/rad", Some(0.0)),
        ("\"damping\": 5", "forces[3].damping", "N m s/rad", Some(0.0)),
        ("\"amplitude\": 6", "forces[4].x.amplitude", "N", None),
        ("\"angular_frequency\": 7", "forces[4].x.angular_frequency", "rad/s", None),
        ("\"phase\": 8", "forces[4].x.phase", "rad", None),
        ("\"mean\": 9", "forces[4].x.mean", "N", None),
        ("\"angular_frequency\": 15", "drives[0].motion.angular_frequency", "rad/s", None),
        ("\"position\": 0.5", "start[0].position", "rad or m", None),
        ("\"velocity\": 16", "start[0].velocity", "rad/s or m/s", None),
        ("\"angle\": -0.75", "start[1].angle", "rad", None),
        ("\"angular_velocity\": 17", "start[1].angular_velocity", "rad/s", None),
    ] {
        let (field, end) = (good.split(": ").next().unwrap(), if good.ends_with('}') { "}" } else { "" });
        for (value, told) in [("\"NaN\"", "NaN"), ("\"Infinity\"", "inf"), ("\"-Infinity\"", "-inf")] {
            let problem = only_problem(good, &format!("{field}: {value}{end}"));
            assert_eq!(problem, format!("{path}: must be a finite number [{unit}], got {told}"));
        }
        for wrong in ["\"much\"", "[1]", "true", "{}"] {
            let problem = only_problem(good, &format!("{field}: {wrong}{end}"));
            assert!(problem.starts_with(&format!("{path}: must be a number, got")), "{problem}");
        }
        let negative = GOOD.replacen(good, &format!("{field}: -1{end}"), 1);
        match least {
            Some(least) => {
                let problem = only_problem(good, &format!("{field}: -1{end}"));
                assert_eq!(problem, format!("{path}: must be >= {least} [{unit}], got -1"));
                assert!(read_scene(&GOOD.replacen(good, &format!("{field}: 0{end}"), 1)).is_ok());
            }
            None => assert!(read_scene(&negative).is_ok(), "{path} may be negative"),
        }
    }
}

#[test]
fn names_references_words_and_functions_are_checked() {
    for (passage, replacement, expected) in [
        // References.
        (
            "\"b\": \"cart\", \"stiffness\"",
            "\"b\": \"carts\", \"stiffness\"",
            "forces[0].b: unknown body \"carts\"; did you mean \"cart\"?",
        ),
        (
            "\"b\": \"cart\", \"stiffness\"",
            "\"b\": \"cart.C\", \"stiffness\"",
            "forces[0].b: unknown point \"C\" of \"cart\"",
        ),
        (
            "\"b\": \"arm.B\", \"damping\"",
            "\"b\": \"arm.C\", \"damping\"",
            "forces[1].b: unknown point \"C\" of \"arm\"",
        ),
        (
            "\"b\": \"cart\", \"stiffness\"",
            "\"b\": \"ground.O\", \"stiffness\"",
            "forces[0]: connects a body to itself",
        ),
        (
            "\"b\": \"arm\", \"stiffness\"",
            "\"b\": \"arms\", \"stiffness\"",
            "forces[2].b: unknown body \"arms\"",
        ),
        (
            "\"b\": \"arm\", \"stiffness\"",
            "\"b\": \"cart\", \"stiffness\"",
            "forces[2]: connects a body to itself",
        ),
        (
            "\"b\": \"hand\", \"damping\"",
            "\"b\": \"ground\", \"damping\"",
            "forces[3]: connects a body to itself",
        ),
        ("\"point\": \"arm.B\"", "\"point\": \"arm.D\"", "forces[4].point: unknown point \"D\" of \"arm\""),
        ("\"reaction\": \"arm\"", "\"reaction\": \"hand\"", "forces[5]: connects a body to itself"),
        (
            "\"body\": \"hand\", \"reaction\"",
            "\"body\": \"hnd\", \"reaction\"",
            "forces[5].body: unknown body \"hnd\"; did you mean \"hand\"?",
        ),
        // Names.
        ("\"name\": \"coil\"", "\"name\": \"\"", "forces[0].name: must be a non-empty name without a dot"),
        ("\"name\": \"coil\"", "\"name\": 3", "forces[0].name: must be a text, got 3"),
        ("\"name\": \"dashpot\"", "\"name\": \"coil\"", "forces[1].name: the name \"coil\" is already taken"),
        ("\"name\": \"coil\"", "\"name\": \"arm\"", "forces[0].name: the name \"arm\" is already taken"),
        ("\"name\": \"coil\"", "\"name\": \"pivot\"", "forces[0].name: the name \"pivot\" is already taken"),
        (
            "\"name\": \"shaker\"",
            "\"name\": \"motor\"",
            "drives[0].name: the name \"motor\" is already taken",
        ),
        (
            "\"name\": \"coil\"",
            "\"name\": \"energy\"",
            "forces[0].name: \"energy\" is the name of the outputs",
        ),
        (
            "\"name\": \"shaker\"",
            "\"name\": \"energy\"",
            "drives[0].name: \"energy\" is the name of the outputs",
        ),
        (
            "\"name\": \"ring\"",
            "\"name\": \"energy\"",
            "bodies[3].name: \"energy\" is the name of the outputs",
        ),
        (
            "\"name\": \"wrist\"",
            "\"name\": \"energy\"",
            "joints[2].name: \"energy\" is the name of the outputs",
        ),
        // Words.
        (
            "\"type\": \"damper\"",
            "\"type\": \"dampr\"",
            "forces[1].type: must be one of \"gravity\", \"spring\", \"damper\"",
        ),
        (
            "\"frame\": \"body\"",
            "\"frame\": \"world\"",
            "forces[4].frame: must be one of \"ground\", \"body\", got \"world\"",
        ),
        (
            "\"function\": \"polynomial\"",
            "\"function\": \"poly\"",
            "forces[4].y.function: must be one of \"polynomial\", \"harmonic\", \"table\"",
        ),
        (
            "\"type\": \"motion\"",
            "\"type\": \"move\"",
            "drives[0].type: must be one of \"speed\", \"motion\"",
        ),
        (
            "\"type\": \"clearance\"",
            "\"type\": \"gap\"",
            "start[2].type: must be one of \"joint\", \"body\", \"clearance\"",
        ),
        // Functions.
        ("\"coefficients\": [10, 11]", "\"coefficients\": []", "forces[4].y.coefficients: must not be empty"),
        ("\"coefficients\": [10, 11]", "\"coefficients\": 10", "forces[4].y.coefficients: must be a list"),
        (
            "\"coefficients\": [10, 11]",
            "\"coefficients\": [10, \"NaN\"]",
            "forces[4].y.coefficients[1]: must be a finite number [N / s^1], got NaN",
        ),
        (
            "\"coefficients\": [10, 11]",
            "\"coefficients\": [10, \"x\"]",
            "forces[4].y.coefficients[1]: must be a number",
        ),
        ("\"coefficients\": [10, 11]", "\"coefficient\": [10, 11]", "forces[4].y.coefficients: is missing"),
        (
            "\"y\": {\"function\": \"polynomial\", \"coefficients\": [10, 11]}",
            "\"y\": \"strong\"",
            "forces[4].y: must be a number, got \"strong\"",
        ),
        (
            "\"y\": {\"function\": \"polynomial\", \"coefficients\": [10, 11]}",
            "\"y\": \"NaN\"",
            "forces[4].y: must be a finite number [N], got NaN",
        ),
        (
            "\"points\": [0, 1, 2]",
            "\"points\": [0, 1]",
            "forces[5].torque.points: a table needs as many times as values",
        ),
        (
            "\"points\": [0, 1, 2]",
            "\"points\": [0, 2, 2]",
            "forces[5].torque.points: times must increase, got 2 [s] after 2 [s]",
        ),
        (
            "\"points\": [0, 1, 2]",
            "\"points\": [0, \"NaN\", 2]",
            "forces[5].torque.points: point 1 of a table must be finite",
        ),
        (
            "\"coefficients\": [10, 11]",
            "\"coefficients\": [\"x\"]",
            "forces[4].y.coefficients[0]: must be a number, got \"x\"",
        ),
        (
            "\"coefficients\": [10, 11]",
            "\"coefficients\": [\"NaN\"]",
            "forces[4].y.coefficients[0]: must be a finite number",
        ),
        (
            "\"values\": [12, 13, 14]",
            "\"values\": [12, \"x\", 14]",
            "forces[5].torque.values[1]: must be a number, got \"x\"",
        ),
        (
            "\"values\": [12, 13, 14]",
            "\"values\": [12, \"Infinity\", 14]",
            "forces[5].torque.points: point 1 of a table must be finite",
        ),
        // Drives and starts of the wrong joint.
        (
            "\"name\": \"shaker\", \"joint\": \"rail\"",
            "\"name\": \"shaker\", \"joint\": \"rails\"",
            "drives[0].joint: unknown joint \"rails\"; did you mean \"rail\"?",
        ),
        (
            "\"name\": \"shaker\", \"joint\": \"rail\"",
            "\"name\": \"shaker\", \"joint\": \"eye\"",
            "drives[0].joint: joint \"eye\" must be a revolute or prismatic joint without clearance",
        ),
        (
            "\"joint\": \"pivot\", \"position\"",
            "\"joint\": \"eye\", \"position\"",
            "start[0].joint: joint \"eye\" must be a revolute or prismatic",
        ),
        (
            "\"joint\": \"pivot\", \"position\"",
            "\"joint\": \"pivt\", \"position\"",
            "start[0].joint: unknown joint \"pivt\"; did you mean \"pivot\"?",
        ),
        (
            "\"joint\": \"pivot\", \"position\"",
            "\"joint\": \"rail\", \"position\"",
            "start[0].joint: the start of joint \"rail\" is prescribed by its drive \"shaker\"",
        ),
        (
            "\"body\": \"hand\", \"angle\"",
            "\"body\": \"ground\", \"angle\"",
            "start[1].body: ground does not move",
        ),
        (
            "\"body\": \"hand\", \"angle\"",
            "\"body\": \"foot\", \"angle\"",
            "start[1].body: unknown body \"foot\"",
        ),
        (
            "\"joint\": \"eye\"",
            "\"joint\": \"pivot\"",
            "start[2].joint: joint \"pivot\" must be a revolute joint with clearance",
        ),
        (
            "\"eccentricity\": [1e-4, 2e-4]",
            "\"eccentricity\": [1e-4, \"NaN\"]",
            "start[2].eccentricity[1]: must be a finite number [m]",
        ),
        (
            "\"eccentricity\": [1e-4, 2e-4]",
            "\"eccentricity\": 1e-4",
            "start[2].eccentricity: must be a pair of numbers",
        ),
        (
            "\"rate\": [0.125, 18]",
            "\"rate\": [0.125, \"Infinity\"]",
            "start[2].rate[1]: must be a finite number [m/s]",
        ),
        (
            "\"rate\": [0.125, 18]",
            "\"rates\": [0.125, 18]",
            "start[2].rates: unknown field; did you mean \"rate\"?",
        ),
    ] {
        let error = read_scene(&GOOD.replacen(passage, replacement, 1)).expect_err(replacement);
        assert!(GOOD.contains(passage), "{passage}");
        let problems: Vec<String> = error.problems.iter().map(ToString::to_string).collect();
        assert!(
            problems.iter().any(|problem| problem.starts_with(expected)),
            "{expected:?} in {problems:#?}"
        );
        // A missing field under another name, or a body that others refer to, is two problems; all else is
        // one.
        let two = replacement.starts_with("\"coefficient\"") || expected.starts_with("bodies");
        let told = if two { 2 } else { 1 };
        assert_eq!(problems.len(), told, "{problems:#?}");
    }
}

#[test]
fn all_problems_of_all_elements_are_told_at_once() {
    let text = GOOD
        .replacen("\"stiffness\": 10", "\"stiffness\": -10", 1)
        .replacen("\"damping\": 2", "\"damping\": \"hard\"", 1)
        .replacen("\"a\": \"cart\", \"b\": \"arm\"", "\"a\": \"carta\", \"b\": \"arm\"", 1)
        .replacen("\"amplitude\": 6", "\"amplitude\": \"NaN\"", 1)
        .replacen("\"points\": [0, 1, 2]", "\"points\": [0, 2, 1]", 1)
        .replacen("\"amplitude\": 0.1", "\"amplitud\": 0.1", 1)
        .replacen("\"joint\": \"pivot\", \"position\"", "\"joint\": \"nothing\", \"position\"", 1)
        .replacen("[1e-4, 2e-4]", "[1e-4]", 1);
    let error = read_scene(&text).unwrap_err();
    let paths: Vec<&str> = error.problems.iter().map(|problem| problem.path.as_str()).collect();
    for path in [
        "forces[0].stiffness", "forces[1].damping", "forces[2].a", "forces[4].x.amplitude",
        "forces[5].torque.points", "drives[0].motion.amplitude", "drives[0].motion.amplitud",
        "start[0].joint", "start[2].eccentricity",
    ] {
        assert_eq!(paths.iter().filter(|other| **other == path).count(), 1, "{path} in {paths:?}");
    }
    assert_eq!(paths.len(), 9, "{paths:?}");
}

fn good() -> Scene {
    read_scene(GOOD).unwrap()
}

fn refusal(scene: &Scene) -> String {
    Mechanism::compile(scene).map(|_| ()).expect_err("the scene is bad").to_string()
}

#[test]
fn starts_that_contradict_each_other_are_refused() {
    let mut twice = good();
    twice.start.push(twice.start[0].clone());
    assert!(refusal(&twice).starts_with("start[3].joint: the start of \"pivot\" is given twice"));
    // The hand's angle is that of the arm plus that of the wrist: all three may be given only if they agree.
    let wrist = |position, velocity| Start::Joint { joint: "wrist".into(), position, velocity };
    let with = |start: Start| {
        let mut scene = good();
        scene.start.push(start);
        scene
    };
    let problem = refusal(&with(wrist(Some(0.0), None)));
    assert!(problem.contains("cannot be assembled") && problem.contains("as the start says"), "{problem}");
    let problem = refusal(&with(wrist(None, Some(0.0))));
    assert!(problem.contains("the start contradicts itself or the drives"), "{problem}");
    let agreed = compile(&with(wrist(Some(-0.75 - 0.5), Some(1.0))));
    assert_eq!(agreed.degrees_of_freedom(), 5);
    let turned = compile(&with(wrist(Some(-0.75 - 0.5 + std::f64::consts::TAU), None)));
    // They agree up to full turns; those given for the joint itself are kept.
    let apart: Vec<f64> = turned.start.q.iter().zip(&agreed.start.q).map(|(a, b)| a - b).collect();
    let turns: f64 = apart.iter().sum::<f64>() / std::f64::consts::TAU;
    assert!((turns - 1.0).abs() < 1e-9, "{apart:?}");
    assert!(
        apart.iter().all(|gap| gap.abs() < 1e-9 || (gap - std::f64::consts::TAU).abs() < 1e-9),
        "{apart:?}"
    );
}

#[test]
fn springs_between_points_that_coincide_and_tables_that_are_too_short_are_refused() {
    let mut scene = good();
    let Force::Spring { a, b, .. } = &mut scene.forces[1] else { panic!("a damper") };
    (*a, *b) = ("arm.B".into(), "hand.A".into());
    let problem = refusal(&scene);
    assert!(problem.starts_with("forces: the two points of \"dashpot\" coincide at the start"), "{problem}");
    // A spring without length or damping needs no direction.
    let Force::Spring { stiffness, damping, .. } = &mut scene.forces[1] else { panic!("a damper") };
    (*stiffness, *damping) = (5.0, 0.0);
    compile(&scene);

    let mechanism = compile(&good());
    let refuse =
        |settings: &Settings| simulate(&mechanism, settings, &|_| true).map(|_| ()).unwrap_err().to_string();
    let problem = refuse(&Settings::new(2.5, 2));
    assert_eq!(
        problem,
        "settings.duration: the run from 0 to 2.5 [s] leaves the table of \"motor\", from 0 to 2 [s]"
    );
    let problem = refuse(&Settings { skip: 1.5, ..Settings::new(1.0, 2) });
    assert!(problem.contains("the run from 0 to 2.5 [s]"), "{problem}");
    let settings = Settings { skip: -1.0, ..Settings::new(1.0, 2) };
    assert_eq!(refuse(&settings), "settings.skip: must be a finite number >= 0 [s], got -1.0");
    let settings = Settings { cycles: 0, ..Settings::new(1.0, 2) };
    assert_eq!(refuse(&settings), "settings.cycles: must be a whole number >= 1 and <= 1000000, got 0");
    let feature = |kind, of: &str| Feature { kind, of: of.to_owned() };
    let features = vec![feature(FeatureKind::Peak, "arm.xx"), feature(FeatureKind::Wear, "pivot")];
    let problem = refuse(&Settings { features, ..Settings::new(1.0, 2) });
    assert!(problem.contains("settings.features[0].of: unknown output \"arm.xx\""), "{problem}");
    assert!(problem.contains("settings.features[1].of: unknown clearance joint \"pivot\""), "{problem}");
}
