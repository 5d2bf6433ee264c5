//! Scenes with something wrong: refused at the path of the field, all at once, and with the nearest known name.

use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::features::{Feature, FeatureKind};
use chebclear::run::settings::{Settings, read_settings};
use chebclear::run::trajectory::simulate;
use chebclear::scene::parts::{Force, Scene, Start};
use chebclear::scene::reader::read_scene;
use serde_json::{Value, json};

use crate::scene::properties::places;
use crate::scene::scenes;
use crate::support::compile;
use std::collections::BTreeSet;
use std::f64::consts::TAU;

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

/// The JSON pointer of a path such as `forces[0].stiffness`.
fn pointer(path: &str) -> String {
    format!("/{}", path.replace(['[', '.'], "/").replace(']', ""))
}

/// A text with the value at a JSON pointer replaced, or left out by `null`.
fn changed(text: &str, pointer: &str, value: Value) -> String {
    let mut scene: Value = serde_json::from_str(text).unwrap();
    let (parent, field) = pointer.rsplit_once('/').unwrap();
    match scene.pointer_mut(parent).unwrap_or_else(|| panic!("no {parent}")) {
        Value::Array(items) => items[field.parse::<usize>().unwrap()] = value,
        Value::Object(fields) if value.is_null() => drop(fields.remove(field).expect("a field")),
        Value::Object(fields) => drop(fields.insert(field.to_owned(), value)),
        other => panic!("{pointer} in {other}"),
    }
    scene.to_string()
}

fn paths(text: &str) -> Vec<String> {
    read_scene(text).expect_err(text).problems.into_iter().map(|problem| problem.path).collect()
}

#[test]
fn gate_06_every_number_that_is_none_is_refused_at_its_path() {
    let mut count = 0;
    for text in [GOOD, scenes::GOOD] {
        let scene: Value = serde_json::from_str(text).unwrap();
        let mut numbers = Vec::new();
        places(&scene, "", &mut numbers);
        numbers.retain(|place| scene.pointer(place).is_some_and(Value::is_number));
        count += numbers.len();
        for place in numbers {
            for value in
                [json!("NaN"), json!("Infinity"), json!("-Infinity"), json!("much"), json!(true), json!({})]
            {
                let found = pointer(&paths(&changed(text, &place, value.clone()))[0]);
                // A table is judged as a whole, once all of its numbers are numbers.
                let is_table = found == "/forces/5/torque/points" && place.starts_with("/forces/5/torque");
                assert!(found == place || is_table, "{value} at {place}: {found}");
            }
        }
    }
    assert!(count > 80, "{count} numbers");
}

#[test]
fn gate_06_numbers_out_of_their_range_are_refused_at_their_path() {
    for (text, fields, refused, good) in [
        (
            GOOD,
            &[
                "forces[0].stiffness", "forces[0].length", "forces[0].damping", "forces[1].damping",
                "forces[2].stiffness", "forces[2].damping", "forces[3].damping",
            ][..],
            &[-1.0][..],
            &[0.0][..],
        ),
        (
            GOOD,
            &[
                "forces[2].angle",
                "forces[4].x.amplitude",
                "forces[4].x.angular_frequency",
                "forces[4].x.phase",
                "forces[4].x.mean",
                "drives[0].motion.angular_frequency",
                "start[0].position",
                "start[0].velocity",
                "start[1].angle",
                "start[1].angular_velocity",
            ],
            &[],
            &[-1.0, 0.0],
        ),
        (
            scenes::GOOD,
            &[
                "joints[3].clearance",
                "joints[3].journal_radius",
                "joints[3].impact_velocity_floor",
                "joints[3].contact.stiffness",
                "joints[3].friction.stick_slip_velocity",
            ],
            &[0.0, -1e-5],
            &[],
        ),
        (scenes::GOOD, &["bodies[1].mass", "bodies[1].inertia"], &[-1e-5], &[0.0]),
        (scenes::GOOD, &["joints[3].contact.restitution"], &[0.0, 1.1], &[1.0]),
        (scenes::GOOD, &["joints[3].contact.exponent"], &[0.9], &[1.0]),
        (scenes::GOOD, &["joints[3].friction.static_coefficient"], &[-0.1], &[0.0]),
        (scenes::GOOD, &["joints[3].friction.static_sliding_velocity"], &[1e-3], &[1.1e-3]),
    ] {
        for field in fields {
            for &value in refused {
                assert_eq!(paths(&changed(text, &pointer(field), json!(value))), [*field], "{value}");
            }
            for &value in good {
                assert!(
                    read_scene(&changed(text, &pointer(field), json!(value))).is_ok(),
                    "{field} may be {value}"
                );
            }
        }
    }
}

#[test]
fn names_references_words_and_functions_are_refused_at_their_path() {
    let mut elsewhere = Vec::new();
    let speed = |name: &str| json!({"type": "speed", "name": name, "joint": "wrist", "speed": 1});
    // Path, value, and where the problem is if not there.
    for (path, value, place) in [
        ("forces[0].b", json!("carts"), ""),
        ("forces[0].b", json!("cart.C"), ""),
        ("forces[0].b", json!("ground.O"), "forces[0]"),
        ("forces[1].b", json!("arm.C"), ""),
        ("forces[2].b", json!("arms"), ""),
        ("forces[2].b", json!("cart"), "forces[2]"),
        ("forces[3].b", json!("ground"), "forces[3]"),
        ("forces[4].point", json!("arm.D"), ""),
        ("forces[5].reaction", json!("hand"), "forces[5]"),
        ("forces[5].body", json!("hnd"), ""),
        ("forces[0].name", json!(""), ""),
        ("forces[0].name", json!("a.b"), ""),
        ("forces[0].name", json!(3), ""),
        ("forces[1].name", json!("coil"), ""),
        ("forces[0].name", json!("arm"), ""),
        ("forces[0].name", json!("pivot"), ""),
        ("drives[0].name", json!("motor"), ""),
        ("forces[0].name", json!("energy"), ""),
        ("drives[0].name", json!("energy"), ""),
        ("bodies[3].name", json!("energy"), "bodies[3].name, joints[3].journal"),
        ("joints[2].name", json!("energy"), ""),
        ("joints[2].name", json!("rail"), ""),
        ("joints[2].name", json!("arm"), ""),
        ("forces[1].type", json!("dampr"), ""),
        ("forces[4].frame", json!("world"), ""),
        ("forces[4].y.function", json!("poly"), ""),
        ("drives[0].type", json!("move"), ""),
        ("start[2].type", json!("gap"), ""),
        ("joints[3].sliding", json!("points"), ""),
        ("forces[4].y.coefficients", json!([]), ""),
        ("forces[4].y.coefficients", json!(10), ""),
        ("forces[4].y.coefficients", json!([10, "x"]), "forces[4].y.coefficients[1]"),
        ("forces[4].y.coefficients", Value::Null, ""),
        ("forces[4].y", json!("strong"), ""),
        ("forces[4].y", json!("NaN"), ""),
        ("forces[5].torque.points", json!([0, 1]), ""),
        ("forces[5].torque.points", json!([0, 2, 2]), ""),
        ("drives[0].joint", json!("rails"), ""),
        ("drives[0].joint", json!("eye"), ""),
        ("drives", json!([speed("one"), speed("two")]), "drives[1].joint"),
        ("start[0].joint", json!("eye"), ""),
        ("start[0].joint", json!("pivt"), ""),
        ("start[0].joint", json!("rail"), ""),
        ("start[1].body", json!("ground"), ""),
        ("start[1].body", json!("foot"), ""),
        ("start[2].joint", json!("pivot"), ""),
        ("start[2].eccentricity", json!(1e-4), ""),
        ("start[2].rates", json!([0.125, 18]), ""),
        ("joints[0].axis", json!([0, 0]), ""),
        ("joints[3].clearance", Value::Null, ""),
        ("joints[3].bearing", json!("arm.R"), ""),
        ("joints[3].journal", json!("hand.A"), "joints[3]"),
        ("bodies[1].inertia_about", json!("AA"), ""),
        ("bodies[1].angel", json!(0.1), ""),
        ("bodies[1].points.B", json!([1, 0, 0]), ""),
        ("bodies[3].name", json!("ground"), "bodies[3].name, joints[3].journal"),
        ("ground", json!([]), "ground, joints[0].a, forces[0].a, forces[1].a"),
        ("forces", json!(3), ""),
        ("forces[0]", json!(3), ""),
    ] {
        let found = paths(&changed(GOOD, &pointer(path), value.clone())).join(", ");
        if found != if place.is_empty() { path } else { place } {
            elsewhere.push((path, value, found));
        }
    }
    assert!(elsewhere.is_empty(), "{elsewhere:#?}");
    for text in ["", "{", "[1, 2", "[]", "{}", "null"] {
        assert!(read_scene(text).is_err());
    }
}

#[test]
fn unknown_names_are_refused_with_the_nearest_known_name_or_with_all() {
    for (path, wrong, named) in [
        ("forces[0].b", "carts", "\"cart\""),
        ("forces[5].body", "hnd", "\"hand\""),
        ("joints[1].b", "arm.a", "\"A\""),
        ("joints[3].journal", "ring.center_of_mas", "\"center_of_mass\""),
        ("joints[0].a", "grund.O", "\"ground\""),
        ("drives[0].joint", "rails", "\"rail\""),
        ("start[2].rates", "", "\"rate\""),
        ("joints[3].journal", "propeller", "cart, arm, hand, ring, ground"),
    ] {
        let error = read_scene(&changed(GOOD, &pointer(path), json!(wrong))).expect_err(wrong);
        assert!(error.problems[0].message.contains(named), "{error} names {named}");
    }
}

fn good() -> Scene {
    read_scene(GOOD).unwrap()
}

fn refused(scene: &Scene) -> Vec<String> {
    let error = Mechanism::compile(scene).map(|_| ()).expect_err("the scene is bad");
    error.problems.into_iter().map(|problem| problem.path).collect()
}

#[test]
fn starts_that_contradict_each_other_are_refused() {
    let with = |start: Start| Scene { start: [good().start, vec![start]].concat(), ..good() };
    assert_eq!(refused(&with(good().start[0].clone())), ["start[3].joint"]);
    // The hand's angle is that of the arm plus that of the wrist: all three may be given only if they agree.
    let wrist = |position, velocity| with(Start::Joint { joint: "wrist".into(), position, velocity });
    for contradiction in [wrist(Some(0.0), None), wrist(None, Some(0.0))] {
        assert!(Mechanism::compile(&contradiction).is_err());
    }
    let agreed = compile(&wrist(Some(-0.75 - 0.5), Some(1.0)));
    assert_eq!(agreed.degrees_of_freedom(), 5);
    let turned = compile(&wrist(Some(-0.75 - 0.5 + TAU), None));
    // They agree up to full turns; those given for the joint itself are kept.
    let turns: Vec<f64> = turned.start.q.iter().zip(&agreed.start.q).map(|(a, b)| (a - b) / TAU).collect();
    assert!((turns.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{turns:?}");
    assert!(turns.iter().all(|turn| (turn - turn.round()).abs() < 1e-9), "{turns:?}");
}

#[test]
fn springs_between_points_that_coincide_need_no_direction_where_they_exert_no_force() {
    let mut scene = good();
    let Force::Spring { a, b, .. } = &mut scene.forces[1] else { panic!("a damper") };
    (*a, *b) = ("arm.B".into(), "hand.A".into());
    assert_eq!(refused(&scene), ["forces"]);
    let Force::Spring { stiffness, damping, .. } = &mut scene.forces[1] else { panic!("a damper") };
    (*stiffness, *damping) = (5.0, 0.0);
    compile(&scene);
}

#[test]
fn impossible_settings_are_refused_all_at_once() {
    let mechanism = compile(&good());
    let feature = |kind, of: &str| Feature { kind, of: of.to_owned(), window: None };
    let short = || Settings::new(1.0, 2);
    for (settings, fields) in [
        // The table of the motor ends at 2 s.
        (Settings::new(2.5, 2), &["duration"][..]),
        (Settings { skip: 1.5, ..short() }, &["duration"]),
        (
            Settings {
                features: vec![feature(FeatureKind::Peak, "arm.xx"), feature(FeatureKind::Wear, "pivot")],
                ..short()
            },
            &["features[0].of", "features[1].of"],
        ),
        (
            Settings {
                outputs: Some(["arm.x", "arm.vxx", "ey.penetration"].map(str::to_owned).to_vec()),
                ..short()
            },
            &["outputs[1]", "outputs[2]"],
        ),
    ] {
        let problems =
            simulate(&mechanism, &settings, &|_| true).map(|_| ()).expect_err("bad settings").problems;
        let found: Vec<&str> =
            problems.iter().map(|problem| problem.path.trim_start_matches("settings.")).collect();
        assert_eq!(found, fields);
    }
    let text = json!({
        "duration": "NaN", "samples": 1, "skip": -1, "rtol": 0, "method": "auto", "cycles": 0, "max_steps": 0,
        "position_tolerance": -1, "velocity_tolerance": "Infinity", "companion_of": -1,
    });
    let problems = read_settings(&text.to_string()).unwrap_err().problems;
    let found: BTreeSet<&str> =
        problems.iter().map(|problem| problem.path.trim_start_matches("settings.")).collect();
    let wrong = text.as_object().unwrap().keys().map(String::as_str).filter(|field| *field != "method");
    assert_eq!(found, wrong.collect());
}
