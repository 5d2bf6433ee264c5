//! The balance of energies: an identity on random mechanisms, and over whole runs.

use chebclear::contact::pair::{Phase, SlidingVelocity};
use chebclear::expression::curve::Curve;
use chebclear::run::settings::Method;
use chebclear::run::trajectory::{Settings, simulate};
use chebclear::scene::parts::{Drive, Force, JointKind, Scene};
use chebclear::scene::time_function::TimeFunction;

use crate::dynamics::cartesian::{acceleration, added, dynamics_of, moving_cases};
use crate::support::{body, compile, derivative, ideal, point};

#[test]
fn energy_changes_by_the_powers_that_are_named() {
    // d/dt (kinetic + potential + contact) = input - impact, friction and damping losses: along the motion
    // with its accelerations, for every force, law and drive of the random mechanisms.
    let (mut sliding, mut damped) = (0, 0);
    for (index, case) in moving_cases().iter().enumerate() {
        let a = acceleration(case, case.t, &case.q, &case.v);
        let energy = |s: f64| {
            let mut dynamics = dynamics_of(case);
            let q: Vec<f64> = added(&added(&case.q, s, &case.v), 0.5 * s * s, &a);
            dynamics.move_to(case.t + s, &q, &added(&case.v, s, &a));
            dynamics.find_contacts();
            let contacts: f64 = (0..case.phases.len()).map(|joint| dynamics.contact_energy(joint)).sum();
            vec![dynamics.kinetic_energy() + dynamics.potential_energy() + contacts]
        };
        let rate = derivative(energy)[0];
        let mut dynamics = dynamics_of(case);
        let mut again = a.clone();
        assert!(dynamics.acceleration_and_contacts(case.t, &case.q, &case.v, &mut again));
        assert_eq!(again, a, "case {index}");
        dynamics.accelerate(&a);
        dynamics.find_reactions();
        let mut powers = vec![dynamics.input_power(), -dynamics.damping_loss()];
        assert!(dynamics.damping_loss() >= 0.0);
        damped += usize::from(dynamics.damping_loss() > 0.0);
        for (joint, phase) in case.phases.iter().enumerate() {
            let loss = dynamics.contact_loss(joint);
            powers.extend([-loss.impact, -loss.friction]);
            let law = &case.mechanism.slots[joint].law;
            if law.sliding == SlidingVelocity::Surface
                && matches!(phase, Phase::Contact { clipped: false, .. })
            {
                // Friction only takes; so does damping while the force does not pull.
                let state = dynamics.contact_state(joint);
                if state.normal_force >= 0.0 {
                    assert!(loss.friction >= 0.0, "case {index}: friction gives {:e} W", -loss.friction);
                    assert!(loss.wear >= 0.0 && loss.impact >= 0.0, "case {index}: {loss:?}");
                    sliding += usize::from(loss.friction > 0.0);
                }
            }
        }
        let sum: f64 = powers.iter().sum();
        let largest = powers.iter().fold(1.0_f64, |largest, power| largest.max(power.abs()));
        let balanced = dynamics.balanced_power();
        assert!((balanced - powers[0]).abs() < 1e-9 * largest, "case {index}: {balanced} W, {powers:?}");
        // The difference has the rounding of the energy: 9 kJ in a contact that is 3 m deep.
        let rounding = 1e-2 * energy(0.0)[0].abs();
        let scale = powers.iter().fold(rounding.max(1.0), |largest, power| largest.max(power.abs()));
        assert!((rate - sum).abs() < 1e-7 * scale, "case {index}: {rate} is not {sum}, {powers:?}");
    }
    assert!(sliding > 30 && damped > 30, "{sliding} sliding contacts, {damped} mechanisms with dampers");
}

/// Largest `energy.balance` over the largest energy.
fn imbalance(scene: &Scene, duration: f64, rtol: f64, method: Method) -> f64 {
    let settings = Settings {
        rtol,
        method,
        outputs: Some(
            [
                "balance", "kinetic", "potential", "contact", "input", "impact_loss", "friction_loss",
                "damping_loss",
            ]
            .map(|name| format!("energy.{name}"))
            .to_vec(),
        ),
        ..Settings::new(duration, 101)
    };
    let run = simulate(&compile(scene), &settings, &|_| true).unwrap();
    assert_eq!(run.status.word(), "done", "{}", run.message());
    let largest = |columns: std::ops::Range<usize>| {
        let rows = run.values.chunks_exact(8).flat_map(|row| row[columns.clone()].to_vec());
        rows.fold(0.0_f64, |largest, value| largest.max(value.abs()))
    };
    largest(0..1) / largest(1..8)
}

#[test]
fn the_balance_closes_where_a_crank_turns_many_times_in_one_step() {
    // A cart that rolls on by itself has steps as long as the run; a lopsided crank beside it is driven.
    let origin = || vec![point("A", 0.0, 0.0)];
    let table = Curve::spline(&[0.0, 0.3, 0.7, 0.8, 1.0], &[0.0, 70.0, -40.0, 30.0, 0.0]).unwrap();
    for motion in [
        TimeFunction::Harmonic { mean: 0.0, amplitude: 1.0, angular_frequency: 50.0, phase: 0.0 },
        TimeFunction::Polynomial(vec![0.0, 200.0]),
        TimeFunction::Polynomial(vec![0.0, 0.0, 100.0, -50.0]),
        TimeFunction::Table(table),
    ] {
        let scene = Scene {
            bodies: vec![
                body("crank", 1.0, 0.02, [0.1, 0.0], origin()),
                body("cart", 1.0, 0.1, [0.0; 2], origin()),
            ],
            joints: vec![
                ideal("axle", "ground", "crank.A", JointKind::Revolute),
                ideal("rail", "ground", "cart.A", JointKind::Prismatic { axis: [1.0, 0.0], angle: 0.0 }),
            ],
            forces: vec![Force::Gravity { acceleration: [1.0, -9.81] }],
            drives: vec![Drive::Motion { name: "motor".into(), joint: "axle".into(), motion }],
            ..Scene::default()
        };
        let steps = simulate(&compile(&scene), &Settings::new(1.0, 2), &|_| true).unwrap().stats.steps;
        assert!(steps < 20, "{steps} steps");
        for method in [Method::Rodas5P, Method::Dop853, Method::Adams] {
            let error = imbalance(&scene, 1.0, 1e-6, method);
            assert!(error < 1e-8, "{:?}, {method:?}: {error:e}", scene.drives);
        }
    }
}
