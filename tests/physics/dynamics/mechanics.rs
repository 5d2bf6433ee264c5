//! Identities of the equations of motion, on random tree mechanisms.

use chebclear::contact::normal::Damping;
use chebclear::contact::pair::SlidingVelocity;
use chebclear::dynamics::{Dynamics, Linearization};
use chebclear::scene::loads::Load;
use chebclear::scene::parts::{Force, ForceFrame, JointKind, Scene, Start};
use nalgebra::{DMatrix, DVector};

use crate::dynamics::cartesian::*;
use crate::dynamics::constraints::{CartesianConstraint, CartesianState, Equation, cartesian_constraints};
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
fn constraint_derivatives_agree_with_differences_of_the_constraints() {
    for (index, case) in moving_cases().iter().enumerate() {
        // Off the constraint surface too: every body elsewhere, with any velocity.
        for displaced in [0.0, 0.3] {
            let mut states = states_at(case, case.t, &case.q, &case.v);
            for (k, state) in states.iter_mut().enumerate() {
                let k = k as f64;
                state.position += displaced * Vec2::new(k.sin(), (2.0 * k).cos());
                state.angle += displaced * (3.0 * k).sin();
                state.velocity += displaced * Vec2::new((5.0 * k).cos(), (7.0 * k).sin());
                state.angular_velocity += displaced * (9.0 * k).cos();
            }
            for constraint in &cartesian_constraints(&case.scene).unwrap() {
                check_constraint(constraint, case.t, &states, index);
            }
        }
    }
}

fn check_constraint(constraint: &CartesianConstraint, t: f64, states: &[CartesianState], case: usize) {
    let (a, b) = (state_of(states, constraint.body_a), state_of(states, constraint.body_b));
    let exact = constraint.equations(t, &a, &b);
    let phis = |t: f64, a: &CartesianState, b: &CartesianState| -> Vec<f64> {
        constraint.equations(t, a, b).iter().map(|equation| equation.phi).collect()
    };
    for k in 0..3 {
        let by_a = derivative(|h| phis(t, &shifted(&a, k, h), &b));
        let by_b = derivative(|h| phis(t, &a, &shifted(&b, k, h)));
        for (row, equation) in exact.iter().enumerate() {
            assert!((equation.phi_q_a[k] - by_a[row]).abs() < 1e-9, "case {case}, {constraint:?}, {k}");
            assert!((equation.phi_q_b[k] - by_b[row]).abs() < 1e-9, "case {case}, {constraint:?}, {k}");
        }
    }
    let by_time = derivative(|s| phis(t + s, &a, &b));
    // Without acceleration d/dt (φ_q q̇ + φ_t) = (φ_q q̇)_q q̇ + 2 φ_qt q̇ + φ_tt = -γ, Eq. (13).
    let gamma = derivative(|s| {
        let (a, b) = (drifted(&a, s), drifted(&b, s));
        let equations = constraint.equations(t + s, &a, &b);
        equations.iter().map(|equation| rate_of(equation, &a, &b) + equation.phi_t).collect()
    });
    for (row, equation) in exact.iter().enumerate() {
        assert!((equation.phi_t - by_time[row]).abs() < 1e-9, "case {case}, {constraint:?}");
        assert!((equation.gamma + gamma[row]).abs() < 1e-8, "case {case}, {constraint:?}");
    }
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
        let n = 3 * states.len();
        let constraints = cartesian_constraints(&case.scene).unwrap();
        let rows: Vec<(&CartesianConstraint, Equation)> = constraints
            .iter()
            .flat_map(|constraint| {
                equations(constraint, case.t, &states).into_iter().map(move |equation| (constraint, equation))
            })
            .collect();
        // [M φ_qᵀ; φ_q 0] [q̈; λ] = [Q; γ], Eq. (16).
        let mut matrix = DMatrix::zeros(n + rows.len(), n + rows.len());
        let mut right = DVector::zeros(n + rows.len());
        for (body, inertia) in case.inertias.iter().enumerate() {
            let mass = case.scene.bodies[body].mass;
            for (k, value) in [mass, mass, *inertia].into_iter().enumerate() {
                matrix[(3 * body + k, 3 * body + k)] = value;
            }
            right[3 * body] = mass * gravity(case).x;
            right[3 * body + 1] = mass * gravity(case).y;
        }
        for load in loads(case, case.t, &states) {
            if let Some(body) = load.body {
                right[3 * body] += load.force.x;
                right[3 * body + 1] += load.force.y;
                right[3 * body + 2] += load.moment;
            }
        }
        for (row, (constraint, equation)) in rows.iter().enumerate() {
            for (body, part) in [(constraint.body_a, equation.phi_q_a), (constraint.body_b, equation.phi_q_b)]
            {
                for (k, value) in part.into_iter().enumerate() {
                    if let Some(body) = body {
                        matrix[(n + row, 3 * body + k)] += value;
                        matrix[(3 * body + k, n + row)] += value;
                    }
                }
            }
            right[n + row] = equation.gamma;
        }
        let solution = matrix.lu().solve(&right).unwrap();
        let scale = largest(solution.rows(0, n).iter()).max(1.0);

        let a = acceleration(case, case.t, &case.q, &case.v);
        let mut dynamics = dynamics_of(case);
        dynamics.move_to(case.t, &case.q, &case.v);
        dynamics.accelerate(&a);
        dynamics.find_contacts();
        dynamics.find_reactions();
        for (body, placement) in case.mechanism.bodies.iter().enumerate() {
            let frame = dynamics.frame(placement.frame);
            let linear = frame.point(placement.center).acceleration + gravity(case);
            for (k, found) in [linear.x, linear.y, frame.angular_acceleration].into_iter().enumerate() {
                let error = (found - solution[3 * body + k]).abs();
                assert!(error <= 1e-9 * scale, "case {index}, body {body}, {k}: {error:e} of {scale:e}");
            }
        }
        // The multiplier of θ_b - θ_a - (angle + speed t) = 0 is the torque of the drive on a.
        let forces = largest(solution.rows(n, rows.len()).iter()).max(1.0);
        for (number, driven) in case.mechanism.driven.iter().enumerate() {
            let row = rows.iter().position(|(constraint, _)| constraint.name == driven.name).unwrap();
            let error = (dynamics.drive_effort(number) + solution[n + row]).abs();
            assert!(error <= 1e-9 * forces, "case {index}, {}: effort off by {error:e}", driven.name);
        }
        // -φ_qᵀ λ of a joint and its drive is what they exert on body b, or the reverse of that on a.
        for (number, joint) in case.mechanism.ideal_joints.iter().enumerate() {
            let drive = case.scene.drives.iter().find(|drive| drive.joint() == joint.name);
            let ours = |name: &str| name == joint.name || drive.is_some_and(|drive| drive.name() == name);
            let (mut force, mut moment, mut point) = (Vec2::zeros(), 0.0, Vec2::zeros());
            for (row, (constraint, equation)) in rows.iter().enumerate() {
                if ours(&constraint.name) {
                    let (body, part, sign) = match constraint.body_b {
                        Some(body) => (body, equation.phi_q_b, -1.0),
                        None => (constraint.body_a.unwrap(), equation.phi_q_a, 1.0),
                    };
                    let lambda = sign * solution[n + row];
                    force += lambda * Vec2::new(part[0], part[1]);
                    // About the origin, from the center of mass.
                    let center = states[body].position;
                    moment += lambda * (part[2] + cross(center, Vec2::new(part[0], part[1])));
                    point = state_of(&states, constraint.body_b).position
                        + turned(state_of(&states, constraint.body_b).angle, constraint.point_b);
                }
            }
            let reaction = dynamics.reaction(number);
            let error =
                (reaction.force - force).norm().max((reaction.moment - moment + cross(point, force)).abs());
            assert!(error <= 1e-8 * forces, "case {index}, {}: reaction off by {error:e}", joint.name);
        }
        let rest = dynamics.unbalanced();
        assert!(rest.force.norm().max(rest.moment.abs()) <= 1e-8 * forces, "case {index}: {rest:?}");
    }
}

#[test]
fn kinetic_energy_grows_by_the_power_of_gravity_contacts_and_drives() {
    for (index, case) in moving_cases().iter().enumerate() {
        let a = acceleration(case, case.t, &case.q, &case.v);
        let kinetic = |s: f64| {
            let q: Vec<f64> = (0..a.len()).map(|k| case.q[k] + s * case.v[k] + 0.5 * s * s * a[k]).collect();
            let states = states_at(case, case.t + s, &q, &added(&case.v, s, &a));
            let of_body = |(body, state): (usize, &CartesianState)| {
                0.5 * case.scene.bodies[body].mass * state.velocity.norm_squared()
                    + 0.5 * case.inertias[body] * state.angular_velocity.powi(2)
            };
            vec![states.iter().enumerate().map(of_body).sum()]
        };
        let rate = derivative(kinetic)[0];

        let states = states_at(case, case.t, &case.q, &case.v);
        let mut powers: Vec<f64> = (states.iter().zip(&case.scene.bodies))
            .map(|(state, body)| body.mass * gravity(case).dot(&state.velocity))
            .collect();
        for load in loads(case, case.t, &states) {
            let state = state_of(&states, load.body);
            powers.push(load.force.dot(&state.velocity) + load.moment * state.angular_velocity);
        }
        let mut dynamics = dynamics_of(case);
        dynamics.move_to(case.t, &case.q, &case.v);
        dynamics.accelerate(&a);
        dynamics.find_contacts();
        dynamics.find_reactions();
        for (number, driven) in case.mechanism.driven.iter().enumerate() {
            powers.push(dynamics.drive_effort(number) * driven.motion.at(case.t)[1]);
        }
        let scale = largest(&powers).max(1.0);
        let error = (rate - powers.iter().sum::<f64>()).abs();
        assert!(error < 1e-9 * scale, "case {index}: {error:e} W of {scale:e} W");
    }
}

#[test]
fn linearization_agrees_with_differences_of_the_accelerations() {
    let mut grazing = 0;
    for (index, case) in moving_cases().iter().enumerate() {
        let (t, q, v) = (case.t, &case.q, &case.v);
        // Differences across the onset of a force say nothing about either side.
        let states = states_at(case, t, q, v);
        if contacts(case, &states).iter().any(|contact| contact.penetration.abs() < 2e-3) {
            grazing += 1;
            continue;
        }
        let d = q.len();
        let mut exact = Linearization::new(d);
        assert!(dynamics_of(case).linearize(t, q, v, &mut exact));
        assert_eq!(exact.a, acceleration(case, t, q, v));
        let mut by_q = vec![0.0; d * d];
        let mut by_v = vec![0.0; d * d];
        for k in 0..d {
            let mut unit = vec![0.0; d];
            unit[k] = 1.0;
            let column_q = derivative(|h| acceleration(case, t, &added(q, h, &unit), v));
            let column_v = derivative(|h| acceleration(case, t, q, &added(v, h, &unit)));
            for i in 0..d {
                by_q[i * d + k] = column_q[i];
                by_v[i * d + k] = column_v[i];
            }
        }
        let by_t = derivative(|s| acceleration(case, t + s, q, v));
        let size = largest(&exact.a).max(1.0);
        for (name, exact, difference) in
            [("a_q", &exact.a_q, &by_q), ("a_v", &exact.a_v, &by_v), ("a_t", &exact.a_t, &by_t)]
        {
            let scale = largest(exact).max(size);
            let errors = exact.iter().zip(difference).map(|(a, b)| (a - b).abs());
            let error = errors.fold(0.0, f64::max);
            assert!(error <= 1e-6 * scale, "case {index}, {name}: {error:e} of {scale:e}");
        }
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
        dynamics.link_force(&mechanism.links[0]).x
    };
    for noise in [2e-18, -1e-16] {
        assert!(force(0.1, 0.0, noise).is_nan() && force(0.1, 3.0, noise).is_nan());
        assert_eq!(force(0.0, 3.0, noise), -50.0 * noise);
        assert_eq!(force(0.0, 0.0, noise), -50.0 * noise);
    }
    assert_eq!(force(0.0, 3.0, 0.5), -25.0 - 3.0);
    assert!((force(0.1, 3.0, -0.5) - (20.0 - 3.0)).abs() < 1e-12);
}
