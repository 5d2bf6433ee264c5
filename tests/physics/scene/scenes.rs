//! What is refused, all at once and with paths; what is read; how a failed run says so.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::contact::pair::SlidingVelocity;
use chebclear::error::InputError;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::settings::Settings;
use chebclear::run::trajectory::{EventKind, simulate};
use chebclear::scene::parts::{Body, CENTER_OF_MASS, Drive, Force, Joint, JointKind, Scene};
use chebclear::scene::reader::read_scene;

use crate::support::{body, compile, ideal, paper_friction, point, slider_crank};

fn refusal(scene: &Scene) -> InputError {
    Mechanism::compile(scene).map(|_| ()).expect_err("the scene is bad")
}

/// The only problem of a scene, as `path: message`.
fn only_problem(scene: &Scene) -> String {
    let error = refusal(scene);
    assert_eq!(error.problems.len(), 1, "{error}");
    error.to_string()
}

fn changed(change: impl FnOnce(&mut Scene)) -> Scene {
    let mut scene = slider_crank(false);
    change(&mut scene);
    scene
}

/// The paper's scene with another clearance joint.
fn wrist(change: impl FnOnce(&mut Joint)) -> Scene {
    changed(|scene| change(&mut scene.joints[3]))
}

macro_rules! with_wrist {
    ($field:ident = $value:expr) => {
        wrist(|joint| {
            let Joint::Clearance { $field, .. } = joint else { unreachable!() };
            *$field = $value;
        })
    };
}

fn with_contact(change: impl FnOnce(&mut NormalLaw)) -> Scene {
    wrist(|joint| {
        let Joint::Clearance { contact, .. } = joint else { unreachable!() };
        change(contact);
    })
}

fn with_friction(mu_s: f64, mu_d: f64, v_s: f64, v_d: f64) -> Scene {
    with_wrist!(
        friction = Some(FrictionLaw::ModifiedCoulomb {
            static_coefficient: mu_s,
            sliding_coefficient: mu_d,
            stick_slip_velocity: v_s,
            static_sliding_velocity: v_d,
        })
    )
}

fn with_drive(joint: &str, speed: f64, angle: f64) -> Scene {
    changed(|scene| {
        scene.drives[0] = Drive::Speed { name: "drive".to_owned(), joint: joint.to_owned(), speed, angle };
    })
}

#[test]
fn gate_06_every_impossible_number_is_refused_at_its_path() {
    let (nan, infinite) = (f64::NAN, f64::INFINITY);
    let restitution =
        |c: f64| with_contact(|law| law.damping = Damping::LankaraniNikravesh { restitution: c });
    for (scene, start) in [
        (changed(|s| s.bodies[1].mass = 0.0), "bodies[1].mass: must be > 0 [kg], got 0"),
        (changed(|s| s.bodies[1].mass = nan), "bodies[1].mass: must be a finite number [kg], got NaN"),
        (changed(|s| s.bodies[0].inertia = -1.0), "bodies[0].inertia: must be > 0 [kg m^2], got -1"),
        (
            changed(|s| s.bodies[2].angle = infinite),
            "bodies[2].angle: must be a finite number [rad], got inf",
        ),
        (changed(|s| s.bodies[2].center_of_mass[1] = nan), "bodies[2].center_of_mass[1]: must be a finite"),
        (changed(|s| s.bodies[0].points[1].position[0] = nan), "bodies[0].points.B[0]: must be a finite"),
        (changed(|s| s.ground.push(point("O", infinite, 0.0))), "ground.O[0]: must be a finite"),
        (with_wrist!(clearance = 0.0), "joints[3].clearance: must be > 0 [m], got 0"),
        (with_wrist!(clearance = -1e-5), "joints[3].clearance: must be > 0 [m]"),
        (with_wrist!(journal_radius = 0.0), "joints[3].journal_radius: must be > 0 [m]"),
        (
            with_wrist!(impact_velocity_floor = Some(0.0)),
            "joints[3].impact_velocity_floor: must be > 0 [m/s]",
        ),
        (with_contact(|law| law.stiffness = -1.0), "joints[3].contact.stiffness: must be > 0"),
        (with_contact(|law| law.exponent = 0.9), "joints[3].contact.exponent: must be >= 1"),
        (restitution(0.0), "joints[3].contact.restitution: must be > 0 and <= 1"),
        (restitution(1.1), "joints[3].contact.restitution: must be > 0 and <= 1"),
        (with_friction(-0.1, 0.1, 1e-3, 2e-3), "joints[3].friction.static_coefficient: must be >= 0"),
        (with_friction(0.1, nan, 1e-3, 2e-3), "joints[3].friction.sliding_coefficient: must be a finite"),
        (with_friction(0.1, 0.1, 0.0, 2e-3), "joints[3].friction.stick_slip_velocity: must be > 0"),
        (
            with_friction(0.1, 0.1, 1e-3, 1e-3),
            "joints[3].friction.static_sliding_velocity: must be > stick_slip_velocity = 0.001 [m/s], got 0.001",
        ),
        (
            changed(|s| s.joints[2] = ideal("guide", "ground", "slider", rail([0.0, 0.0]))),
            "joints[2].axis: must not be the zero vector",
        ),
        (
            changed(|s| s.joints[2] = ideal("guide", "ground", "slider", rail([1.0, nan]))),
            "joints[2].axis[1]: must be a finite number",
        ),
        (with_drive("crank_bearing", nan, 0.0), "drives[0].speed: must be a finite number [rad/s]"),
        (with_drive("crank_bearing", 1.0, nan), "drives[0].angle: must be a finite number [rad]"),
        (
            changed(|s| s.forces.push(Force::Gravity { acceleration: [0.0, nan] })),
            "forces[0].acceleration[1]: must be a finite number [m/s^2]",
        ),
    ] {
        let problem = only_problem(&scene);
        assert!(problem.starts_with(start), "{problem:?} should start with {start:?}");
    }
}

fn rail(axis: [f64; 2]) -> JointKind {
    JointKind::Prismatic { axis, angle: 0.0 }
}

#[test]
fn moment_of_inertia_about_a_point_must_leave_a_positive_one_about_the_center_of_mass() {
    // 0.21 kg at 0.06 m from the end: Steiner's part alone is 7.56e-4 kg m².
    let about_end = |inertia: f64| {
        changed(|scene| {
            scene.bodies[1].inertia_about = "B".to_owned();
            scene.bodies[1].inertia = inertia;
        })
    };
    let problem = only_problem(&about_end(7.0e-4));
    assert!(problem.starts_with("bodies[1].inertia: ") && problem.contains("-5.600e-5"), "{problem}");
    let central = compile(&about_end(8.0e-4)).bodies[1].inertia;
    assert!((central - 4.4e-5).abs() < 1e-18);
}

#[test]
fn unknown_names_are_refused_with_the_nearest_known_name() {
    for (scene, words) in [
        (
            with_wrist!(bearing = "rod.c".to_owned()),
            "joints[3].bearing: unknown point \"c\" of \"rod\"; did you mean \"C\"?",
        ),
        (
            with_wrist!(journal = "slidr".to_owned()),
            "joints[3].journal: unknown body \"slidr\"; did you mean \"slider\"?",
        ),
        (
            with_wrist!(journal = "slider.center_of_mas".to_owned()),
            "joints[3].journal: unknown point \"center_of_mas\" of \"slider\"; did you mean \"center_of_mass\"?",
        ),
        (
            changed(|s| s.joints[0] = ideal("crank_bearing", "grund", "crank.A", JointKind::Revolute)),
            "joints[0].a: unknown body \"grund\"; did you mean \"ground\"?",
        ),
        (
            changed(|s| s.bodies[0].inertia_about = "AA".to_owned()),
            "bodies[0].inertia_about: unknown point \"AA\" of \"crank\"; did you mean \"A\"?",
        ),
        (
            with_drive("crank_bering", 1.0, 0.0),
            "drives[0].joint: unknown joint \"crank_bering\"; did you mean \"crank_bearing\"?",
        ),
        (
            with_drive("guide", 1.0, 0.0),
            "drives[0].joint: joint \"guide\" is prismatic: a speed turns a revolute joint; for a prismatic one use a \
             drive of type \"motion\"",
        ),
        (
            with_drive("wrist", 1.0, 0.0),
            "drives[0].joint: joint \"wrist\" must be a revolute joint without clearance",
        ),
    ] {
        assert_eq!(only_problem(&scene), words);
    }
    // For a word unlike any known one all of them are named.
    let problem = only_problem(&with_wrist!(journal = "propeller".to_owned()));
    let known = "known are crank, rod, slider, ground";
    assert_eq!(problem, format!("joints[3].journal: unknown body \"propeller\"; {known}"));
}

#[test]
fn names_must_be_unique_and_usable() {
    for (scene, start) in [
        (
            changed(|s| s.bodies[2].name = "rod".to_owned()),
            "bodies[2].name: the name \"rod\" is already taken",
        ),
        (
            changed(|s| s.bodies[2].name = "ground".to_owned()),
            "bodies[2].name: \"ground\" is the name of the fixed",
        ),
        (
            changed(|s| s.bodies[2].name = "a.b".to_owned()),
            "bodies[2].name: must be a non-empty name without a dot",
        ),
        (changed(|s| s.bodies[2].name = String::new()), "bodies[2].name: must be a non-empty name"),
        (
            changed(|s| s.bodies[0].points.push(point("A", 0.0, 0.0))),
            "bodies[0].points.A: the name \"A\" is already",
        ),
    ] {
        let problems = refusal(&scene).problems;
        assert!(problems.iter().any(|problem| problem.to_string().starts_with(start)), "{problems:?}");
    }
    let twice = changed(|s| s.joints[1] = ideal("guide", "crank.B", "rod.B", JointKind::Revolute));
    assert!(only_problem(&twice).starts_with("joints[2].name: the name \"guide\" is already taken"));
    let like_a_body = changed(|s| s.joints[2] = ideal("rod", "ground", "slider", rail([1.0, 0.0])));
    assert!(only_problem(&like_a_body).starts_with("joints[2].name: a body is also called \"rod\""));
    let driven_twice = changed(|scene| {
        let Drive::Speed { joint, speed, angle, .. } = scene.drives[0].clone() else {
            panic!("a constant speed")
        };
        scene.drives.push(Drive::Speed { name: "again".to_owned(), joint, speed, angle });
    });
    assert_eq!(only_problem(&driven_twice), "drives[1].joint: joint \"crank_bearing\" is driven twice");
    let to_itself = with_wrist!(journal = "rod.B".to_owned());
    assert!(only_problem(&to_itself).starts_with("joints[3]: connects a body to itself"));
    assert!(refusal(&Scene::default()).to_string().starts_with("bodies: a scene needs at least one body"));
}

#[test]
fn all_problems_are_reported_at_once_in_the_order_of_the_scene() {
    let mut scene = with_friction(0.1, 0.1, 2e-3, 1e-3);
    scene.bodies[0].mass = -1.0;
    scene.bodies[1].inertia = f64::INFINITY;
    scene.joints[1] = ideal("crank_pin", "crank.Q", "rod.B", JointKind::Revolute);
    scene.drives[0] =
        Drive::Speed { name: "drive".to_owned(), joint: "nothing".to_owned(), speed: f64::NAN, angle: 0.0 };
    let problems = refusal(&scene).problems;
    let paths: Vec<&str> = problems.iter().map(|problem| problem.path.as_str()).collect();
    assert_eq!(
        paths,
        [
            "bodies[0].mass",
            "bodies[1].inertia",
            "joints[1].a",
            "joints[3].friction.static_sliding_velocity",
            "drives[0].speed",
            "drives[0].joint",
        ]
    );
}

#[test]
fn bodies_that_hang_together_with_nothing_are_refused() {
    let stray = || body("stray", 1.0, 1.0, [0.0, 0.0], Vec::new());
    let scene = changed(|scene| scene.bodies.push(stray()));
    assert_eq!(
        only_problem(&scene),
        "bodies[3]: body \"stray\" is not connected to \"ground\" by any joint or spring"
    );
    // Without ground the first body is what all must hang on.
    let mut scene = Scene { bodies: vec![stray()], ..Scene::default() };
    assert_eq!(compile(&scene).degrees_of_freedom(), 3);
    scene.bodies.push(Body { name: "other".to_owned(), ..stray() });
    assert_eq!(
        only_problem(&scene),
        "bodies[1]: body \"other\" is not connected to \"stray\" by any joint or spring"
    );
}

#[test]
fn loops_without_a_joint_that_could_be_cut_are_refused() {
    let doubled =
        changed(|s| s.joints.push(ideal("weld", "crank", "ground", JointKind::Fixed { angle: 0.0 })));
    let problem = only_problem(&doubled);
    assert!(
        problem.starts_with("joints[4]: joint \"weld\" closes a loop of prismatic, fixed and driven"),
        "{problem}"
    );
}

pub(crate) const GOOD: &str = r#"{
  "ground": {"A": [0, 0], "G": [0.01, -0.02]},
  "bodies": [
    {"name": "arm", "mass": 0.5, "inertia": 0.25, "inertia_about": "A", "center_of_mass": [0.1, 0.05],
     "points": {"A": [0, 0], "B": [0.3, 0.1]}, "angle": 0.1},
    {"name": "rider", "mass": 0.1, "inertia": 1e-4},
    {"name": "plate", "mass": 2, "inertia": 1}
  ],
  "joints": [
    {"type": "revolute", "name": "hinge", "a": "ground.G", "b": "arm.A"},
    {"type": "prismatic", "name": "rail", "a": "arm.B", "b": "rider", "axis": [1, 2], "angle": 0.5},
    {"type": "fixed", "name": "weld", "a": "rider", "b": "plate", "angle": -0.5},
    {"type": "clearance_revolute", "name": "eye", "bearing": "ground", "journal": "rider.center_of_mass",
     "journal_radius": 0.01, "clearance": 2e-5, "sliding": "contact_point", "impact_velocity_floor": 1e-6,
     "contact": {"law": "lankarani_nikravesh", "stiffness": 1e10, "restitution": 0.9, "exponent": 2},
     "friction": {"law": "modified_coulomb", "static_coefficient": 0.04, "sliding_coefficient": 0.03,
                  "stick_slip_velocity": 1e-3, "static_sliding_velocity": 1.5e-3}},
    {"type": "clearance_revolute", "name": "eye2", "bearing": "ground.A", "journal": "arm.B",
     "journal_radius": 0.01, "clearance": 2e-5, "sliding": "surface", "friction": null,
     "contact": {"law": "hertz", "stiffness": 1e10}}
  ],
  "forces": [{"type": "gravity", "acceleration": [0, -9.81]}],
  "drives": [{"type": "speed", "name": "motor", "joint": "hinge", "speed": 209.43951023931953}]
}"#;

#[test]
fn written_scene_is_read_as_what_it_says() {
    let mut arm = body("arm", 0.5, 0.25, [0.1, 0.05], vec![point("A", 0.0, 0.0), point("B", 0.3, 0.1)]);
    (arm.inertia_about, arm.angle) = ("A".to_owned(), 0.1);
    let eye =
        |name: &str, bearing: &str, journal: &str, contact, friction, sliding, floor| Joint::Clearance {
            name: name.to_owned(),
            bearing: bearing.to_owned(),
            journal: journal.to_owned(),
            journal_radius: 0.01,
            clearance: 2e-5,
            contact,
            friction,
            sliding,
            film: None,
            impact_velocity_floor: floor,
        };
    let law = |exponent: f64, damping: Damping| NormalLaw { stiffness: 1e10, exponent, damping };
    let damped = law(2.0, Damping::LankaraniNikravesh { restitution: 0.9 });
    let expected = Scene {
        ground: vec![point("A", 0.0, 0.0), point("G", 0.01, -0.02)],
        bodies: vec![
            arm,
            body("rider", 0.1, 1e-4, [0.0, 0.0], Vec::new()),
            body("plate", 2.0, 1.0, [0.0, 0.0], Vec::new()),
        ],
        joints: vec![
            ideal("hinge", "ground.G", "arm.A", JointKind::Revolute),
            ideal("rail", "arm.B", "rider", JointKind::Prismatic { axis: [1.0, 2.0], angle: 0.5 }),
            ideal("weld", "rider", "plate", JointKind::Fixed { angle: -0.5 }),
            eye(
                "eye",
                "ground",
                "rider.center_of_mass",
                damped,
                Some(paper_friction()),
                SlidingVelocity::ContactPoint,
                Some(1e-6),
            ),
            eye(
                "eye2",
                "ground.A",
                "arm.B",
                law(1.5, Damping::Elastic),
                None,
                SlidingVelocity::Surface,
                None,
            ),
        ],
        forces: vec![Force::Gravity { acceleration: [0.0, -9.81] }],
        drives: vec![Drive::Speed {
            name: "motor".to_owned(),
            joint: "hinge".to_owned(),
            speed: 2000.0 * std::f64::consts::PI / 30.0,
            angle: 0.0,
        }],
        start: Vec::new(),
        couplings: Vec::new(),
    };
    assert_eq!(read_scene(GOOD).unwrap(), expected);
    assert_eq!(expected.bodies[1].inertia_about, CENTER_OF_MASS);
}

/// Problems of the good text with one passage replaced.
fn misread(passage: &str, replacement: &str) -> Vec<String> {
    assert!(GOOD.contains(passage), "{passage}");
    let error = read_scene(&GOOD.replacen(passage, replacement, 1)).expect_err("the text is bad");
    error.problems.iter().map(ToString::to_string).collect()
}

#[test]
fn misspelled_missing_and_mistyped_fields_are_refused_at_their_paths() {
    for (passage, replacement, expected) in [
        (
            "\"clearance\": 2e-5, \"sliding\": \"surface\"",
            "\"sliding\": \"surface\"",
            "joints[4].clearance: is missing",
        ),
        ("\"angle\": 0.1", "\"angel\": 0.1", "bodies[0].angel: unknown field; did you mean \"angle\"?"),
        ("\"mass\": 0.1", "\"mass\": \"NaN\"", "bodies[1].mass: must be a finite number [kg], got NaN"),
        ("\"mass\": 0.1", "\"mass\": \"Infinity\"", "bodies[1].mass: must be a finite number [kg], got inf"),
        (
            "\"mass\": 0.1",
            "\"mass\": \"-Infinity\"",
            "bodies[1].mass: must be a finite number [kg], got -inf",
        ),
        ("\"mass\": 0.1", "\"mass\": \"heavy\"", "bodies[1].mass: must be a number, got \"heavy\""),
        (
            "[0, -9.81]",
            "[0, -9.81, 0]",
            "forces[0].acceleration: must be a pair of numbers [x, y], got [0,-9.81,0]",
        ),
        ("\"B\": [0.3, 0.1]", "\"B\": [0.3, \"up\"]", "bodies[0].points.B[1]: must be a number, got \"up\""),
        ("\"name\": \"motor\"", "\"name\": 7", "drives[0].name: must be a text, got 7"),
        (
            "\"contact_point\"",
            "\"points\"",
            "joints[3].sliding: must be one of \"surface\", \"contact_point\", got \"points\"",
        ),
        ("{\"A\": [0, 0], \"G\": [0.01, -0.02]}", "[]", "ground: must be an object of points"),
        ("[{\"type\": \"gravity\", \"acceleration\": [0, -9.81]}]", "3", "forces: must be a list, got 3"),
        ("{\"type\": \"gravity\", \"acceleration\": [0, -9.81]}", "3", "forces[0]: must be an object, got 3"),
    ] {
        let problems = misread(passage, replacement);
        assert!(
            problems.iter().any(|problem| problem.starts_with(expected)),
            "{expected:?} in {problems:#?}"
        );
    }
    // One fault is one problem, not a shower of consequences.
    for (passage, replacement) in
        [("\"mass\": 0.1", "\"mass\": \"NaN\""), ("\"angle\": 0.1", "\"angel\": 0.1")]
    {
        assert_eq!(misread(passage, replacement).len(), 1);
    }
    for text in ["", "{", "[1, 2"] {
        assert!(read_scene(text).unwrap_err().to_string().starts_with("scene: is not valid JSON"));
    }
    assert!(read_scene("[]").is_err() && read_scene("{}").is_err() && read_scene("null").is_err());
}

#[test]
fn gate_04_run_that_fails_says_when_and_at_which_joint_if_it_was_one() {
    let mechanism = compile(&slider_crank(false));
    let mut settings = Settings::new(0.01, 11);
    settings.limits.max_steps = 200;
    let run = simulate(&mechanism, &settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "max_steps");
    assert_eq!(run.stats.steps + run.stats.rejected, 200);
    assert!(run.time > 0.0 && run.time < 0.01);
    // The joint whose contact changed last has nothing to do with it.
    assert!(!run.events.is_empty() && run.joint.is_none());
    let message = run.message();
    assert!(message.contains(&format!("t = {:.9e} s", run.time)) && !message.contains("wrist"), "{message}");
    // Samples up to the end are there, later ones are not numbers.
    for (t, row) in run.t.iter().zip(run.values.chunks_exact(run.columns.len())) {
        assert_eq!(row.iter().all(|value| value.is_finite()), *t <= run.time);
        assert_eq!(row.iter().all(|value| value.is_nan()), *t > run.time);
    }

    settings = Settings::new(0.01, 11);
    settings.limits.max_events = 3;
    let run = simulate(&mechanism, &settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "max_events");
    assert_eq!(run.joint.as_deref(), Some("wrist"));
    assert_eq!(run.events.len(), 3);
    assert!(run.time > run.events[2].time && run.message().contains("contact changes"));
    assert!(run.events.iter().any(|event| event.kind == EventKind::Onset));

    let run = simulate(&mechanism, &Settings::new(0.01, 11), &|t| t < 1e-3).unwrap();
    assert_eq!(run.status.word(), "cancelled");
    assert!(run.time >= 1e-3 && run.time < 0.01);
}

#[test]
fn impossible_settings_and_unknown_outputs_are_refused_all_at_once() {
    let mechanism = compile(&slider_crank(false));
    let settings = Settings {
        duration: f64::NAN,
        samples: 1,
        rtol: 0.0,
        position_tolerance: Some(-1.0),
        velocity_tolerance: Some(f64::INFINITY),
        companion_of: Some(-1.0),
        ..Settings::new(1.0, 2)
    };
    let problems = simulate(&mechanism, &settings, &|_| true).map(|_| ()).unwrap_err().problems;
    let paths: Vec<&str> = problems.iter().map(|problem| problem.path.as_str()).collect();
    let fields = ["duration", "samples", "rtol", "position_tolerance", "velocity_tolerance", "companion_of"];
    assert_eq!(paths, fields.map(|field| format!("settings.{field}")));
    let settings = Settings {
        outputs: Some(["slider.vx", "slider.vxx", "rist.penetration"].map(str::to_owned).to_vec()),
        ..Settings::new(1.0, 2)
    };
    let error = simulate(&mechanism, &settings, &|_| true).map(|_| ()).unwrap_err().to_string();
    assert!(
        error.contains("settings.outputs[1]: unknown output \"slider.vxx\"; did you mean \"slider.vx\"?")
    );
    assert!(error.contains("did you mean \"wrist.penetration\"?") && !error.contains("outputs[0]"));
}
