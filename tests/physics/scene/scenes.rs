//! What is refused, all at once and with paths; what is read; how a failed run says so.

use chebclear::error::InputError;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::settings::Settings;
use chebclear::run::trajectory::{EventKind, simulate};
use chebclear::scene::parts::{Body, JointKind, Scene};

use crate::support::{body, compile, ideal, slider_crank};

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
    assert!(run.time > run.events[2].time);
    assert!(run.events.iter().any(|event| event.kind == EventKind::Onset));

    let run = simulate(&mechanism, &Settings::new(0.01, 11), &|t| t < 1e-3).unwrap();
    assert_eq!(run.status.word(), "cancelled");
    assert!(run.time >= 1e-3 && run.time < 0.01);
}
