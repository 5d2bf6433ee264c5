//! The mass that a contact feels, and the scales of contacts and of what is connected.

use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::dynamics::Dynamics;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::run::tolerances::default_impact_velocity_floors;
use chebclear::scene::loads::{Expression, Load};
use chebclear::scene::parts::{Body, Drive, Force, ForceFrame, Joint, JointKind, Scene, Start};
use chebclear::scene::time_function::TimeFunction;
use chebclear::tree::elements::{ContactScales, State};
use chebclear::tree::kinematics::Vec2;

use crate::dynamics::random_trees::cases;
use crate::support::{body, compile, ideal, loose, point, slider_crank};

/// The scene with its last clearance joint made ideal: it closes a loop, or joins what floated.
fn last_joint_ideal(mut scene: Scene) -> Scene {
    let clearance = |joint: &&mut Joint| matches!(joint, Joint::Clearance { .. });
    if let Some(joint) = scene.joints.iter_mut().rfind(clearance)
        && let Joint::Clearance { name, bearing, journal, .. } = &*joint
    {
        *joint = ideal(name, bearing, journal, JointKind::Revolute);
    }
    scene
}

/// The scene with a unit force in a direction on the journal of a joint, and its reaction on the bearing.
fn pressed(mut scene: Scene, joint: &str, direction: Vec2) -> Scene {
    let ends = scene.joints.iter().find_map(|other| match other {
        Joint::Clearance { name, bearing, journal, .. } if name == joint => {
            Some([(bearing.clone(), -direction), (journal.clone(), direction)])
        }
        _ => None,
    });
    for (point, force) in ends.into_iter().flatten().filter(|(point, _)| !point.starts_with("ground")) {
        let [x, y] = [force.x, force.y].map(|component| TimeFunction::Polynomial(vec![component]));
        scene.forces.push(Force::Applied {
            name: format!("on {}", point.replace('.', " ")),
            point,
            x: x.into(),
            y: y.into(),
            frame: ForceFrame::Ground,
        });
    }
    scene
}

/// Acceleration of the journals seen from their bearings at the start.
fn opening(mechanism: &Mechanism) -> Vec<Vec2> {
    let State { q, v } = &mechanism.start;
    let mut dynamics = Dynamics::new(mechanism);
    let mut a = vec![0.0; q.len()];
    assert!(dynamics.acceleration(0.0, q, v, &mut a));
    dynamics.accelerate(&a);
    mechanism.slots.iter().map(|joint| dynamics.slot_motion(joint).acceleration).collect()
}

#[test]
fn a_force_accelerates_what_the_effective_mass_says() {
    let (mut loops, mut held) = (0, 0);
    for case in cases(300).0 {
        for scene in [case.scene.clone(), last_joint_ideal(case.scene)] {
            let Ok(mechanism) = Mechanism::compile(&scene) else { continue };
            let before = opening(&mechanism);
            let mut dynamics = Dynamics::new(&mechanism);
            let State { q, v } = &mechanism.start;
            assert!(dynamics.acceleration(0.0, q, v, &mut vec![0.0; q.len()]));
            for (index, joint) in mechanism.slots.iter().enumerate() {
                let accelerance = dynamics.accelerance([joint.points[0], joint.points[1]]);
                let mut softness = 0.0;
                for direction in [Vec2::new(0.6, 0.8), Vec2::new(-0.8, 0.6)] {
                    let after = opening(&compile(&pressed(scene.clone(), &joint.name, direction)))[index];
                    let gained = (after - before[index]).dot(&direction);
                    let expected = 1.0 / accelerance.mass_along(direction);
                    // Masses are about 1 kg.
                    let scale = 1.0 + expected + before[index].norm();
                    assert!((gained - expected).abs() <= 1e-9 * scale, "{gained:e} {expected:e}: {scene:?}");
                    softness += gained;
                    held += usize::from(expected == 0.0);
                    loops += usize::from(!mechanism.closures.is_empty());
                }
                let mean = 2.0 / accelerance.mean_mass();
                assert!((mean - softness).abs() <= 1e-9 * (1.0 + mean + before[index].norm()));
            }
        }
    }
    assert!(loops > 30 && held > 5, "{loops} {held}");
}

/// A driven four-bar with a swinging link and a rocker on its coupler, joined to it with clearance. Its
/// own links have `prescribed` times their ordinary mass.
fn six_bar(crank_angle: f64, prescribed: f64) -> Scene {
    let link = |name: &str, length: f64, angle: f64, factor: f64| {
        let mass = factor * 2.0 * length;
        let points = vec![point("P", 0.0, 0.0), point("Q", length, 0.0), point("R", 0.5 * length, 0.06)];
        Body { angle, ..body(name, mass, mass * length * length / 12.0, [0.5 * length, 0.0], points) }
    };
    let damping = Damping::LankaraniNikravesh { restitution: 0.9 };
    let contact = NormalLaw { stiffness: 3.3e11, exponent: 1.5, damping };
    Scene {
        ground: vec![point("A", 0.0, 0.0), point("D", 0.12, 0.0), point("G", 0.18, 0.08)],
        bodies: vec![
            link("crank", 0.05, crank_angle, prescribed),
            link("coupler", 0.1, 0.7, prescribed),
            link("rocker", 0.08, 1.8, prescribed),
            link("link", 0.14, 0.3, 1.0),
            link("output", 0.1, 1.8, 1.0),
        ],
        joints: vec![
            ideal("A", "ground.A", "crank.P", JointKind::Revolute),
            ideal("B", "crank.Q", "coupler.P", JointKind::Revolute),
            ideal("C", "coupler.Q", "rocker.Q", JointKind::Revolute),
            ideal("D", "ground.D", "rocker.P", JointKind::Revolute),
            ideal("F", "link.Q", "output.Q", JointKind::Revolute),
            ideal("G", "ground.G", "output.P", JointKind::Revolute),
            loose("E", ["coupler.R", "link.P"], [9.8e-3, 2e-5], contact, None),
        ],
        drives: vec![Drive::Speed {
            name: "drive".to_owned(),
            joint: "A".to_owned(),
            speed: 200.0,
            angle: crank_angle,
        }],
        ..Scene::default()
    }
}

fn scales(scene: &Scene) -> [f64; 3] {
    let mechanism = compile(scene);
    let ContactScales { resting_penetration, resting_speed, resting_velocity, .. } =
        mechanism.scales.contacts[0];
    [resting_penetration, resting_speed, resting_velocity]
}

#[test]
fn masses_that_a_drive_prescribes_do_not_change_the_scales() {
    let light = scales(&six_bar(0.0, 1.0));
    for prescribed in [1e-3, 1e3] {
        for (found, expected) in scales(&six_bar(0.0, prescribed)).into_iter().zip(light) {
            assert!((found / expected - 1.0).abs() < 1e-8, "{prescribed}: {found:e} {expected:e}");
        }
    }
}

#[test]
fn the_pose_of_the_start_hardly_changes_the_scales() {
    let mut range = [[f64::INFINITY, 0.0]; 3];
    for step in 0..24 {
        let scene = six_bar(std::f64::consts::TAU * f64::from(step) / 24.0, 1.0);
        for ([least, most], value) in range.iter_mut().zip(scales(&scene)) {
            (*least, *most) = (least.min(value), most.max(value));
        }
    }
    assert!(range.iter().all(|[least, most]| most / least < 1.05), "{range:?}");
}

#[test]
fn what_is_not_connected_changes_no_scale() {
    let alone = compile(&slider_crank(false));
    for speed in [15.0, 1500.0, -1e5] {
        let mut scene = slider_crank(false);
        // Ground connects nothing, and no part of the rotor is near.
        scene.bodies.push(body("rotor", 30.0, 5.0, [0.0; 2], vec![point("rim", 7.0, 0.0)]));
        scene.joints.push(ideal("axle", "ground", "rotor", JointKind::Revolute));
        scene.drives.push(Drive::Speed { name: "motor".into(), joint: "axle".into(), speed, angle: 0.0 });
        let beside = compile(&scene);
        assert_eq!(beside.scales.contacts, alone.scales.contacts);
        assert_eq!(beside.scales.components[0], alone.scales.components[0]);
        assert_eq!(beside.scales.levers, alone.scales.levers);
        assert_eq!(default_impact_velocity_floors(&beside), default_impact_velocity_floors(&alone));
    }
}

#[test]
fn a_size_is_that_of_the_scene_and_never_a_meter_without_a_notice() {
    let sizes =
        |scene: &Scene| compile(scene).scales.components.iter().map(|of| of.length).collect::<Vec<_>>();
    let slide = |force: Force, start: [f64; 2]| Scene {
        bodies: vec![body("block", 2.0, 1.0, [0.0; 2], Vec::new())],
        joints: vec![ideal(
            "slide",
            "ground",
            "block",
            JointKind::Prismatic { axis: [1.0, 0.0], angle: 0.0 },
        )],
        forces: vec![Force::Gravity { acceleration: [5.0, 0.0] }, force],
        start: vec![Start::Joint {
            joint: "slide".into(),
            position: Some(start[0]),
            velocity: Some(start[1]),
        }],
        ..Scene::default()
    };
    let spring = |stiffness: f64, length: f64, damping: f64| Force::Spring {
        name: "spring".into(),
        a: "ground".into(),
        b: "block".into(),
        stiffness,
        length,
        damping,
        tension: Load::NONE,
    };
    // Weight over stiffness, amplitude of a speed, natural length, place of the start.
    assert_eq!(sizes(&slide(spring(400.0, 0.0, 0.0), [0.0, 0.0])), [10.0 / 400.0]);
    assert_eq!(sizes(&slide(spring(200.0, 0.0, 0.0), [0.0, 3.0])), [3.0 / 10.0]);
    assert_eq!(sizes(&slide(spring(200.0, 0.07, 0.0), [0.02, 3.0])), [0.07]);
    assert_eq!(sizes(&slide(spring(200.0, 0.0, 0.0), [0.2, 3.0])), [0.2]);
    // The center of mass is no point with a name, and the pin is at the origin of its body.
    let pendulum = Scene {
        bodies: vec![body("bob", 0.5, 2e-3, [0.3, 0.4], Vec::new())],
        joints: vec![ideal("pin", "ground", "bob", JointKind::Revolute)],
        ..Scene::default()
    };
    assert_eq!(sizes(&pendulum), [0.5]);
    // Nothing says how far this goes.
    let formula = Expression::read("-3*block.x**3".into(), Vec::new()).expect("the formula is good");
    let force = Force::Applied {
        name: "force".into(),
        point: "block".into(),
        x: Load::Motion(Box::new(formula)),
        y: Load::NONE,
        frame: ForceFrame::Ground,
    };
    let mut scene = slide(force, [0.0, 0.0]);
    scene.forces.remove(0);
    let mechanism = compile(&scene);
    let [notice] = &mechanism.warnings[..] else { panic!("{:?}", mechanism.warnings) };
    assert_eq!((notice.code, &notice.about[..]), ("no_size", &["bodies[0].points".to_owned()][..]));
}
