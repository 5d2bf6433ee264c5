//! The floor of the impact velocity in contact laws, and its effect on a run.

use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::run::settings::Settings;
use chebclear::run::trajectory::{EventKind, Trajectory, simulate_from};
use chebclear::scene::parts::{Force, ForceFrame, Scene};
use chebclear::scene::time_function::TimeFunction;
use chebclear::tree::elements::State;

use crate::support::{body, compile, loose, with_floor};

const STIFFNESS: f64 = 1e9;
const CLEARANCE: f64 = 1e-3;
const RADIUS: f64 = 0.02;
const GRAVITY: f64 = 9.81;

const LAWS: [Damping; 3] = [
    Damping::LankaraniNikravesh { restitution: 0.9 },
    Damping::Flores { restitution: 0.3 },
    Damping::Flores { restitution: 0.01 },
];

/// A shaft of 1 kg over the bottom of its bearing, under its weight.
fn shaft(damping: Damping, impact_velocity_floor: Option<f64>) -> Scene {
    let contact = NormalLaw { stiffness: STIFFNESS, exponent: 1.5, damping };
    let joint = loose("bearing", ["ground", "shaft"], [RADIUS, CLEARANCE], contact, None);
    Scene {
        bodies: vec![body("shaft", 1.0, 1e-3, [0.0, 0.0], Vec::new())],
        joints: vec![with_floor(joint, impact_velocity_floor)],
        forces: vec![Force::Gravity { acceleration: [0.0, -GRAVITY] }],
        ..Scene::default()
    }
}

/// A run of 20 ms in which it starts `gap` above the bottom with a downward velocity.
fn drop_from(scene: &Scene, gap: f64, velocity: f64, rtol: f64) -> Trajectory {
    let mut settings = Settings { rtol, ..Settings::new(0.02, 2001) };
    settings.outputs = Some(["shaft.vy", "bearing.penetration"].map(str::to_owned).to_vec());
    let start = State { q: vec![0.0, gap - CLEARANCE, 0.0], v: vec![0.0, -velocity, 0.0] };
    let run = simulate_from(&compile(scene), &start, &settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "done", "{}", run.message());
    run
}

fn largest_difference(a: &Trajectory, b: &Trajectory) -> f64 {
    let velocities = |run: &Trajectory| run.values.iter().step_by(2).copied().collect::<Vec<_>>();
    velocities(a).iter().zip(velocities(b)).fold(0.0, |largest, (a, b)| (a - b).abs().max(largest))
}

#[test]
fn the_default_floor_moves_a_run_no_more_than_its_tolerance() {
    // It arrives at 1.4e-7 m/s. A contact that begins so slowly under load is the more damped the slower it
    // began, so the velocity tolerance, a tenth of √(g R) times rtol, is felt: as much as it moves a run.
    let gap = 1e-15;
    for damping in LAWS {
        let exact = drop_from(&shaft(damping.clone(), Some(1e-14)), gap, 0.0, 1e-11);
        for rtol in [1e-3, 1e-4, 1e-5] {
            let tolerance = 0.1 * rtol * (GRAVITY * RADIUS).sqrt();
            let moved = largest_difference(
                &exact,
                &drop_from(&shaft(damping.clone(), Some(1e-14)), gap, tolerance, 1e-11),
            );
            let run = drop_from(&shaft(damping.clone(), None), gap, 0.0, rtol);
            let error = largest_difference(&exact, &run);
            assert!(error <= 1.1 * moved, "{damping:?} {rtol:e}: {error:e} m/s, tolerance {moved:e} m/s");
            let told = run.warnings.iter().find(|notice| notice.code == "impacts_at_floor");
            let slow = run.impacts_at_floor == 1;
            let counted = told.map(|notice| [notice.numbers[0], notice.numbers[1]]);
            assert_eq!(counted, slow.then_some([("slow", 1.0), ("impacts", 1.0)]), "{:?}", run.warnings);
            assert!(slow || error < 1e-5);
        }
        let coarse = drop_from(&shaft(damping.clone(), None), gap, 0.0, 1e-3);
        assert_eq!(coarse.impacts_at_floor, 1);
    }
}

#[test]
fn an_impact_is_latched_as_fast_as_it_passed_the_surface() {
    // A relocation ends at a penetration of up to a part of the position tolerance: at 1e-3 it is 30 times as fast there.
    for (gap, velocity) in [(1e-13, 0.0), (1e-12, 1e-6), (1e-8, 1e-3)] {
        let expected = (2.0 * GRAVITY * gap + velocity * velocity).sqrt();
        for rtol in [1e-3, 1e-4, 1e-6] {
            let run = drop_from(&shaft(LAWS[0].clone(), Some(1e-14)), gap, velocity, rtol);
            let found = run.events[0].normal_velocity;
            assert_eq!(run.events[0].kind, EventKind::Onset);
            assert!((found / expected - 1.0).abs() < 1e-3, "{rtol:e}: {found:e} {expected:e}");
        }
    }
}

#[test]
fn a_shaft_that_starts_on_the_surface_settles_on_either_side_of_rounding() {
    let expected = (GRAVITY / STIFFNESS).powf(2.0 / 3.0);
    for damping in LAWS {
        for gap in [-2e-19, 0.0, 2e-19] {
            for rtol in [1e-4, 1e-10] {
                let run = drop_from(&shaft(damping.clone(), None), gap, 0.0, rtol);
                let depth = *run.values.last().unwrap();
                assert!((depth / expected - 1.0).abs() < 1e-3, "{gap:e} {rtol:e}: {depth:e} {expected:e}");
                assert!(run.events.is_empty() && run.impacts_at_floor == 0);
            }
        }
    }
}

#[test]
fn the_clip_of_a_strongly_damped_contact_is_found_at_a_loose_tolerance() {
    // A slow impact; a force pulls the shaft out of the bottom later.
    let mut scene = shaft(Damping::Flores { restitution: 0.01 }, Some(1e-14));
    scene.forces.push(Force::Applied {
        name: "pull".to_owned(),
        point: "shaft".to_owned(),
        x: TimeFunction::Polynomial(vec![0.0]).into(),
        y: TimeFunction::Polynomial(vec![-10.0, 2000.0]).into(),
        frame: ForceFrame::Ground,
    });
    let instants = |rtol| {
        let run = drop_from(&scene, 1e-13, 1e-5, rtol);
        let kinds: Vec<EventKind> = run.events.iter().map(|event| event.kind).collect();
        assert_eq!(kinds[..3], [EventKind::Onset, EventKind::Clip, EventKind::Separation], "{rtol:e}");
        [run.events[1].time, run.events[2].time]
    };
    let tight = instants(1e-10);
    for rtol in [1e-3, 1e-4, 1e-6] {
        for (found, expected) in instants(rtol).into_iter().zip(tight) {
            assert!((found - expected).abs() < 1e-4, "{rtol:e}: {found:e} s instead of {expected:e} s");
        }
    }
}
