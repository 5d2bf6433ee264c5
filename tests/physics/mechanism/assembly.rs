//! Assembly: which starts exist, and that they are the closed forms of the ideal mechanism.

use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::settings::Settings;
use chebclear::run::trajectory::simulate;
use chebclear::scene::parts::{Body, Drive, JointKind, Scene};

use crate::support::{body, compile, ideal, point, slider_crank};

fn refusal(scene: &Scene) -> String {
    Mechanism::compile(scene).map(|_| ()).expect_err("the scene cannot be started").to_string()
}

fn rail(axis: [f64; 2]) -> JointKind {
    JointKind::Prismatic { axis, angle: 0.0 }
}

#[test]
fn start_that_no_velocity_satisfies_is_refused_as_singular() {
    let mut scene = slider_crank(false);
    // The guide passes where the rod stands upright on the crank's pin: the pin moves up, the
    // slider only sideways.
    scene.ground.push(point("guide", 0.0, 0.12));
    scene.joints[2] = ideal("guide", "ground.guide", "slider", rail([1.0, 0.0]));
    scene.bodies[1].angle = std::f64::consts::FRAC_PI_2;
    let problem = refusal(&scene);
    assert!(problem.contains("singular") && problem.contains("m/s"), "{problem}");
    // With the guide within reach the same start is fine.
    scene.ground[0].position[1] = 0.11;
    compile(&scene);
}

#[test]
fn initial_angle_of_a_welded_body_counts_for_what_it_is_welded_to() {
    let bar = |name: &str, angle: f64| Body { angle, ..body(name, 1.0, 1.0, [0.1, 0.0], Vec::new()) };
    for order in [["plate", "arm"], ["arm", "plate"]] {
        let scene = Scene {
            bodies: order.map(|name| bar(name, if name == "arm" { 0.5 } else { 1.2 })).to_vec(),
            joints: vec![
                ideal("weld", "arm", "plate", JointKind::Fixed { angle: 0.7 }),
                ideal("hinge", "arm", "ground", JointKind::Revolute),
            ],
            ..Scene::default()
        };
        let run = simulate(&compile(&scene), &Settings::new(1.0, 2), &|_| true).unwrap();
        for (name, angle) in [("arm", 0.5), ("plate", 1.2)] {
            let column = run.columns.iter().position(|column| *column == format!("{name}.angle")).unwrap();
            assert!((run.values[column] - angle).abs() < 1e-15);
        }
    }
}

/// Bars of length 1 m pinned between points of ground and of each other.
fn truss(ground: &[(&str, f64, f64)], bars: &[(&str, f64)], pins: &[(&str, &str, &str)]) -> Scene {
    let bar = |&(name, angle): &(&str, f64)| {
        let ends = vec![point("P", 0.0, 0.0), point("Q", 1.0, 0.0)];
        Body { angle, ..body(name, 1.0, 0.1, [0.5, 0.0], ends) }
    };
    Scene {
        ground: ground.iter().map(|&(name, x, y)| point(name, x, y)).collect(),
        bodies: bars.iter().map(bar).collect(),
        joints: pins.iter().map(|&(name, a, b)| ideal(name, a, b, JointKind::Revolute)).collect(),
        ..Scene::default()
    }
}

#[test]
fn too_many_joints_or_drives_are_counted() {
    let ground = [("A", 0.0, 0.0), ("B", 1.0, 0.0), ("C", 2.0, 0.0)];
    let bars = [("a", 1.0), ("b", 2.1), ("c", 2.5)];
    // Three bars of 1 m cannot hold one point from three pins in line.
    let pins = [
        ("p", "ground.A", "a.P"),
        ("q", "ground.B", "b.P"),
        ("t", "ground.C", "c.P"),
        ("r", "a.Q", "b.Q"),
        ("u", "c.Q", "a.Q"),
    ];
    let problem = refusal(&truss(&ground, &bars, &pins));
    assert!(problem.contains("cannot be assembled"), "{problem}");
    assert!(problem.contains("\"r\" and \"u\" give 4 equations for 3 free coordinates"), "{problem}");
    // Both cranks of a parallelogram driven: in step, one drive is redundant; out of step, they fight.
    let mut scene = truss(
        &ground,
        &[("a", 1.0), ("b", 1.0), ("k", 0.0)],
        &[("p", "ground.A", "a.P"), ("q", "ground.B", "b.P"), ("r", "a.Q", "k.P"), ("s", "b.Q", "k.Q")],
    );
    let drive = |name: &str, joint: &str, speed| Drive::Speed {
        name: name.into(),
        joint: joint.into(),
        speed,
        angle: 1.0,
    };
    for (speed, word) in [(10.0, "redundant"), (5.0, "singular")] {
        scene.drives = vec![drive("one", "p", 10.0), drive("two", "q", speed)];
        let problem = refusal(&scene);
        assert!(
            problem.contains(word) && problem.contains("there is one joint or drive too many"),
            "{problem}"
        );
    }
    scene.drives.pop();
    assert_eq!(compile(&scene).mobility(), 0);
}
