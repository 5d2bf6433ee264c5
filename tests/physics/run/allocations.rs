//! Steps take no memory from the heap: a run of twice the steps allocates as often.

use allocation_counter::measure;
use chebclear::contact::friction::JointFriction;
use chebclear::integrators::Limits;
use chebclear::run::settings::Method;
use chebclear::run::trajectory::{Settings, simulate};
use chebclear::scene::parts::{Joint, Scene, Start};

use crate::dynamics::loops::four_bar;
use crate::support::compile;

/// A four-bar with friction in all joints.
fn dry_four_bar(speed: f64, coefficient: f64) -> Scene {
    let mut scene = four_bar(None);
    for joint in &mut scene.joints {
        if let Joint::Ideal { friction, .. } = joint {
            *friction = Some(JointFriction::Journal { coefficient, journal_radius: 0.03 });
        }
    }
    scene.start = vec![Start::Joint { joint: "A".into(), position: Some(0.4), velocity: Some(speed) }];
    scene
}

/// Allocations and steps of a run.
fn allocations(scene: &Scene, method: Method, duration: f64) -> (u64, usize) {
    let mechanism = compile(scene);
    let mut steps = 0;
    let counted = measure(|| {
        // What is at rest would take a single step.
        let limits = Limits { max_step: 1e-3, ..Limits::default() };
        let settings = Settings { method, limits, ..Settings::new(duration, 2) };
        let run = simulate(&mechanism, &settings, &|_| true).unwrap();
        assert_eq!(run.status.word(), "done", "{}", run.message());
        // The list of events alone grows.
        assert!(run.events.is_empty());
        steps = run.stats.steps;
    });
    (counted.count_total, steps)
}

#[test]
fn steps_of_dry_joints_allocate_nothing() {
    for method in [Method::Rodas5P, Method::Dop853, Method::Adams] {
        for (speed, coefficient) in [(40.0, 0.05), (0.0, 2.0)] {
            let scene = dry_four_bar(speed, coefficient);
            let [short, long] = [0.02, 0.04].map(|duration| allocations(&scene, method, duration));
            assert!(long.1 > short.1 + 10, "{method:?}, {speed}: {short:?} and {long:?}");
            assert_eq!(short.0, long.0, "{method:?}, {speed}: {short:?} and {long:?}");
        }
    }
}
