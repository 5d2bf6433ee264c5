//! Identities of the equations of motion, on random tree mechanisms.

use chebclear::contact::normal::Damping;
use chebclear::contact::pair::SlidingVelocity;
use chebclear::dynamics::Dynamics;
use chebclear::scene::loads::Load;
use chebclear::scene::parts::{Force, ForceFrame, JointKind, Scene, Start};

use crate::dynamics::cartesian::*;
use crate::dynamics::constraints::cartesian_constraints;
use crate::dynamics::guides::assert_linearization;
use crate::dynamics::random_trees::{Case, REGIMES, cases};
use crate::support::{body, compile, derivative, ideal, point};

#[test]
fn the_random_mechanisms_cover_what_the_identities_are_for() {
    let (drawn, refused) = cases(COUNT);
    assert!(10 * refused < COUNT, "{refused} scenes that can be assembled were refused");
    let cases = moving_cases();
    let count = |found: &dyn Fn(&Case) -> bool| cases.iter().filter(|case| found(case)).count();
    assert!(count(&|case| case.scene.bodies.len() == 8) > 10);
    assert!(count(&|case| !case.mechanism.driven.is_empty()) > 50);
    assert!(count(&|case| case.mechanism.driven.iter().any(|driven| driven.sign < 0.0)) > 20);
    assert!(count(&|case| case.mechanism.driven.len() > 1) > 20);
    assert!(
        count(&|case| case.mechanism.accelerated.iter().any(|&one| case.mechanism.driven[one].is_angle)) > 10
    );
    assert!(
        count(&|case| case.mechanism.accelerated.iter().any(|&one| !case.mechanism.driven[one].is_angle))
            > 10
    );
    let forces = |kind: &dyn Fn(&Force) -> bool| count(&|case| case.scene.forces.iter().any(kind));
    assert!(forces(&|force| matches!(force, Force::Spring { damping: 0.0, .. })) > 10);
    assert!(forces(&|force| matches!(force, Force::Spring { damping, .. } if *damping > 0.0)) > 50);
    assert!(forces(&|force| matches!(force, Force::TorsionSpring { .. })) > 50);
    assert!(forces(&|force| matches!(force, Force::Applied { frame: ForceFrame::Body, .. })) > 30);
    assert!(forces(&|force| matches!(force, Force::Applied { frame: ForceFrame::Ground, .. })) > 30);
    assert!(forces(&|force| matches!(force, Force::Torque { .. })) > 50);
    assert!(count(&|case| case.mechanism.slots.len() > 1) > 50);
    assert!(drawn.iter().any(|case| case.mechanism.degrees_of_freedom() > 12));
    let mut seen = std::collections::BTreeMap::new();
    for case in &cases {
        let states = states_at(case, case.t, &case.q, &case.v);
        for (index, contact) in contacts(case, &states).iter().enumerate() {
            let law = &case.mechanism.slots[index].law;
            if contact.force == Vec2::zeros() {
                continue;
            }
            assert!(contact.penetration > 0.0);
            let ground = contact.journal.is_none() || contact.bearing.is_none();
            let regime = match law.friction {
                None => "none",
                // A joint that does not slide (two points of a rigid group) is below V_s in any case.
                Some(_) if contact.sliding.abs() < 1e-3 => REGIMES[0],
                Some(_) => REGIMES[case.regimes[index]],
            };
            let elastic = law.normal.damping == Damping::Elastic;
            *seen.entry((regime, law.sliding == SlidingVelocity::Surface, elastic)).or_insert(0) += 1;
            *seen.entry(("exponent", law.normal.exponent == 1.5, ground)).or_insert(0) += 1;
        }
    }
    // Four kinds of friction, two conventions, two laws; two kinds of exponent, with and without ground.
    assert_eq!(seen.len(), 4 * 2 * 2 + 2 * 2, "{seen:?}");
    assert!(seen.values().all(|&count| count >= 3), "{seen:?}");
}

#[test]
fn joint_coordinates_satisfy_the_constraints_and_their_rates() {
    for (index, case) in moving_cases().iter().enumerate() {
        let states = states_at(case, case.t, &case.q, &case.v);
        let d = case.q.len();
        let still = states_at(case, case.t, &case.q, &vec![0.0; d]);
        for constraint in &cartesian_constraints(&case.scene).unwrap() {
            for equation in equations(constraint, case.t, &states) {
                let (a, b) = (state_of(&states, constraint.body_a), state_of(&states, constraint.body_b));
                let rate = rate_of(&equation, &a, &b) + equation.phi_t;
                assert!(
                    equation.phi.abs() < 1e-12,
                    "case {index}, {}: φ = {:e}",
                    constraint.name,
                    equation.phi
                );
                assert!(rate.abs() < 1e-12, "case {index}, {}: φ_q q̇ + φ_t = {rate:e}", constraint.name);
            }
        }
        for freedom in 0..d {
            // q̇ = B ż + b is linear in ż: a column of B is a difference of velocities, without error.
            let mut unit = vec![0.0; d];
            unit[freedom] = 1.0;
            let mut column = states_at(case, case.t, &case.q, &unit);
            for (state, still) in column.iter_mut().zip(&still) {
                state.velocity -= still.velocity;
                state.angular_velocity -= still.angular_velocity;
            }
            for constraint in &cartesian_constraints(&case.scene).unwrap() {
                for equation in equations(constraint, case.t, &states) {
                    let (a, b) = (state_of(&column, constraint.body_a), state_of(&column, constraint.body_b));
                    let product = rate_of(&equation, &a, &b);
                    assert!(product.abs() < 1e-12, "case {index}, {}: φ_q B = {product:e}", constraint.name);
                }
            }
            let by_position = derivative(|h| {
                let moved = states_at(case, case.t, &added(&case.q, h, &unit), &case.v);
                moved.iter().flat_map(|state| [state.position.x, state.position.y, state.angle]).collect()
            });
            for (expected, found) in by_position.iter().zip(column.iter().flat_map(rates)) {
                assert!((expected - found).abs() < 1e-9, "case {index}: B {found}, ∂q/∂z {expected}");
            }
        }
        let by_time = derivative(|s| {
            let moved = states_at(case, case.t + s, &added(&case.q, s, &case.v), &case.v);
            moved.iter().flat_map(|state| [state.position.x, state.position.y, state.angle]).collect()
        });
        for (expected, found) in by_time.iter().zip(states.iter().flat_map(rates)) {
            assert!((expected - found).abs() < 1e-8, "case {index}: q̇ {found}, difference {expected}");
        }
    }
}

#[test]
fn accelerations_and_drive_torques_are_those_of_the_cartesian_system() {
    for (index, case) in moving_cases().iter().enumerate() {
        let states = states_at(case, case.t, &case.q, &case.v);
        let mut dynamics = dynamics_of(case);
        let (_, forces) = assert_motion(case, index, &mut dynamics, &rows(case, &states), &[], 1e-9);
        let rest = dynamics.unbalanced();
        assert!(rest.force.norm().max(rest.moment.abs()) <= 1e-8 * forces, "case {index}: {rest:?}");
    }
}

#[test]
fn linearization_agrees_with_differences_of_the_accelerations() {
    let mut grazing = 0;
    for (index, case) in moving_cases().iter().enumerate() {
        // Differences across the onset of a force say nothing about either side.
        let states = states_at(case, case.t, &case.q, &case.v);
        if contacts(case, &states).iter().any(|contact| contact.penetration.abs() < 2e-3) {
            grazing += 1;
            continue;
        }
        assert_linearization(&mut dynamics_of(case), case, index, 1.0);
    }
    assert!(grazing < COUNT / 20, "{grazing} cases were left out");
}

#[test]
fn a_distance_of_a_rounding_error_gives_a_spring_no_direction() {
    let block = |length: f64, damping: f64| Scene {
        bodies: vec![body("block", 1.0, 0.1, [0.0, 0.0], vec![point("P", 0.0, 0.0)])],
        ground: vec![point("O", 0.0, 0.0), point("far", 1.0, 0.0)],
        joints: vec![ideal(
            "guide",
            "ground.O",
            "block.P",
            JointKind::Prismatic { axis: [1.0, 0.0], angle: 0.0 },
        )],
        forces: vec![Force::Spring {
            name: "strut".into(),
            a: "ground.O".into(),
            b: "block.P".into(),
            stiffness: 50.0,
            length,
            damping,
            tension: Load::NONE,
        }],
        start: vec![Start::Joint { joint: "guide".into(), position: Some(0.2), velocity: Some(0.0) }],
        ..Scene::default()
    };
    let force = |length: f64, damping: f64, position: f64| {
        let mechanism = compile(&block(length, damping));
        let mut dynamics = Dynamics::new(&mechanism);
        dynamics.move_to(0.0, &[position], &[1.0]);
        dynamics.exerted(&mechanism.forces[0]).force[0]
    };
    for noise in [2e-18, -1e-16] {
        assert!(force(0.1, 0.0, noise).is_nan() && force(0.1, 3.0, noise).is_nan());
        assert_eq!(force(0.0, 3.0, noise), -50.0 * noise);
        assert_eq!(force(0.0, 0.0, noise), -50.0 * noise);
    }
    assert_eq!(force(0.0, 3.0, 0.5), -25.0 - 3.0);
    assert!((force(0.1, 3.0, -0.5) - (20.0 - 3.0)).abs() < 1e-12);
}
