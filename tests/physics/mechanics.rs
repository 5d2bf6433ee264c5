//! Identities of the equations of motion, on random tree mechanisms.
//!
//! The Cartesian side of each identity (bodies with three coordinates, constraints, forces at the
//! contact points) is written here from the printed equations, not from the joint-coordinate core.

use chebclear::contact::clearance::{Phase, SlidingVelocity};
use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::Damping;
use chebclear::dynamics::{Dynamics, Linearisation};
use chebclear::scene::parts::{Force, ForceFrame, Joint};
use nalgebra::{DMatrix, DVector, Rotation2, Vector2};

use crate::constraints::{CartesianConstraint, CartesianState, Equation, cartesian_constraints};
use crate::random_trees::{Case, REGIMES, cases};
use crate::support::derivative;

type Vec2 = Vector2<f64>;

const COUNT: usize = 300;

fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

fn turned(angle: f64, vector: Vec2) -> Vec2 {
    Rotation2::new(angle) * vector
}

/// Cartesian states of all bodies after `move_to`.
fn cartesian(dynamics: &Dynamics) -> Vec<CartesianState> {
    dynamics
        .tree
        .bodies
        .iter()
        .enumerate()
        .map(|(index, body)| {
            let frame = dynamics.frame(body.frame);
            let center = frame.point(body.center);
            CartesianState {
                position: center.position,
                angle: dynamics.body_angle(index),
                velocity: center.velocity,
                angular_velocity: frame.angular_velocity,
            }
        })
        .collect()
}

fn states_at(case: &Case, t: f64, q: &[f64], v: &[f64]) -> Vec<CartesianState> {
    let mut dynamics = Dynamics::new(&case.mechanism);
    dynamics.move_to(t, q, v);
    cartesian(&dynamics)
}

fn state_of(states: &[CartesianState], body: Option<usize>) -> CartesianState {
    body.map_or(CartesianState::GROUND, |body| states[body])
}

fn equations(constraint: &CartesianConstraint, t: f64, states: &[CartesianState]) -> Vec<Equation> {
    constraint.equations(t, &state_of(states, constraint.body_a), &state_of(states, constraint.body_b))
}

/// q̇ of a body.
fn rates(state: &CartesianState) -> [f64; 3] {
    [state.velocity.x, state.velocity.y, state.angular_velocity]
}

fn shifted(state: &CartesianState, index: usize, by: f64) -> CartesianState {
    let mut moved = *state;
    match index {
        0 => moved.position.x += by,
        1 => moved.position.y += by,
        _ => moved.angle += by,
    }
    moved
}

/// The state after the time `s` without acceleration.
fn drifted(state: &CartesianState, s: f64) -> CartesianState {
    CartesianState {
        position: state.position + s * state.velocity,
        angle: state.angle + s * state.angular_velocity,
        ..*state
    }
}

/// φ_q q̇ of one equation.
fn rate_of(equation: &Equation, a: &CartesianState, b: &CartesianState) -> f64 {
    (0..3).map(|k| equation.phi_q_a[k] * rates(a)[k] + equation.phi_q_b[k] * rates(b)[k]).sum()
}

/// A clearance joint in Cartesian coordinates, after section 2 of `[Xiang2020]` with the forces at
/// the contact points and the sliding velocity of the material surfaces (or as printed).
struct Contact {
    journal: Option<usize>,
    bearing: Option<usize>,
    penetration: f64,
    sliding: f64,
    /// Contact points seen from the mass centres (ground: from the origin).
    arm_journal: Vec2,
    arm_bearing: Vec2,
    force: Vec2,
}

fn contacts(case: &Case, states: &[CartesianState]) -> Vec<Contact> {
    let clearances = case.scene.joints.iter().filter_map(|joint| match joint {
        Joint::Clearance { bearing, journal, journal_radius, clearance, contact, sliding, .. } => {
            Some((bearing, journal, *journal_radius, *clearance, contact, *sliding))
        }
        Joint::Ideal { .. } => None,
    });
    let mut list = Vec::new();
    for (index, (bearing, journal, radius, clearance, contact, convention)) in clearances.enumerate() {
        let end = |reference: &str| {
            let end = case.scene.attachment(reference).unwrap();
            let center = end.body.map_or([0.0; 2], |body| case.scene.bodies[body].center_of_mass);
            let state = state_of(states, end.body);
            let arm = turned(state.angle, Vec2::from(end.position) - Vec2::from(center));
            let turn = Vec2::new(-arm.y, arm.x);
            let position = state.position + arm;
            (end.body, arm, position, state.velocity + state.angular_velocity * turn, state.angular_velocity)
        };
        let (body_b, arm_b, p_b, v_b, w_b) = end(bearing);
        let (body_j, arm_j, p_j, v_j, w_j) = end(journal);
        let (e, e_dot) = (p_j - p_b, v_j - v_b);
        // Two points of one rigid group stay concentric: no normal, no contact.
        let n = if e.norm() > 0.0 { e / e.norm() } else { Vec2::zeros() };
        let t = Vec2::new(-n.y, n.x);
        let delta = e.norm() - clearance;
        let sliding = match convention {
            SlidingVelocity::Surface => e_dot.dot(&t) + w_j * radius - w_b * (radius + clearance),
            SlidingVelocity::ContactPoint => e_dot.dot(&t) * delta / e.norm().max(clearance),
        };
        let mut force = Vec2::zeros();
        if let Phase::Contact { hysteresis_factor, clipped: false } = case.phases[index]
            && delta > 0.0
        {
            let bracket = 1.0 + hysteresis_factor * e_dot.dot(&n);
            let normal = contact.stiffness * delta.powf(contact.exponent) * bracket;
            let mu = case.mechanism.clearance_joints[index].law.friction.map_or(0.0, |law| mu(law, sliding));
            force = -normal * n - mu * sliding.signum() * normal * t;
        }
        list.push(Contact {
            journal: body_j,
            bearing: body_b,
            penetration: delta,
            sliding,
            arm_journal: arm_j + radius * n,
            arm_bearing: arm_b + (radius + clearance) * n,
            force,
        });
    }
    list
}

/// A force at the mass centre of a body, and a moment.
struct Load {
    body: Option<usize>,
    force: Vec2,
    moment: f64,
}

/// Contacts, springs, dampers, given forces and torques, from their textbook definitions.
fn loads(case: &Case, t: f64, states: &[CartesianState]) -> Vec<Load> {
    let mut loads = Vec::new();
    let mut push = |body: Option<usize>, arm: Vec2, force: Vec2| {
        loads.push(Load { body, force, moment: cross(arm, force) });
    };
    for contact in contacts(case, states) {
        push(contact.journal, contact.arm_journal, contact.force);
        push(contact.bearing, contact.arm_bearing, -contact.force);
    }
    let end = |reference: &str| {
        let end = case.scene.attachment(reference).unwrap();
        let center = end.body.map_or([0.0; 2], |body| case.scene.bodies[body].center_of_mass);
        let state = state_of(states, end.body);
        let arm = turned(state.angle, Vec2::from(end.position) - Vec2::from(center));
        let velocity = state.velocity + state.angular_velocity * Vec2::new(-arm.y, arm.x);
        (end.body, arm, state.position + arm, velocity)
    };
    let mut couples = Vec::new();
    for force in &case.scene.forces {
        match force {
            Force::Gravity { .. } => {}
            Force::Spring { a, b, stiffness, length, damping, .. } => {
                let ((body_a, arm_a, p_a, v_a), (body_b, arm_b, p_b, v_b)) = (end(a), end(b));
                let direction = (p_b - p_a).normalize();
                let tension =
                    stiffness * ((p_b - p_a).norm() - length) + damping * (v_b - v_a).dot(&direction);
                push(body_a, arm_a, tension * direction);
                push(body_b, arm_b, -tension * direction);
            }
            Force::TorsionSpring { a, b, stiffness, angle, damping, .. } => {
                let [a, b] = [a, b].map(|name| case.scene.body_index(name).unwrap());
                let (on_a, on_b) = (state_of(states, a), state_of(states, b));
                let torque = stiffness * (on_b.angle - on_a.angle - angle)
                    + damping * (on_b.angular_velocity - on_a.angular_velocity);
                couples.push((a, torque));
                couples.push((b, -torque));
            }
            Force::Applied { point, x, y, frame, .. } => {
                let (body, arm, ..) = end(point);
                let components = Vec2::new(x.at(t)[0], y.at(t)[0]);
                let angle = state_of(states, body).angle;
                let turning = *frame == ForceFrame::Body;
                push(body, arm, if turning { turned(angle, components) } else { components });
            }
            Force::Torque { body, reaction, torque, .. } => {
                couples.push((case.scene.body_index(body).unwrap(), torque.at(t)[0]));
                couples.push((case.scene.body_index(reaction).unwrap(), -torque.at(t)[0]));
            }
        }
    }
    let couple = |(body, moment)| Load { body, force: Vec2::zeros(), moment };
    loads.extend(couples.into_iter().map(couple));
    loads
}

/// Friction coefficient of Eq. (11).
fn mu(law: FrictionLaw, v: f64) -> f64 {
    let FrictionLaw::ModifiedCoulomb {
        static_coefficient: mu_s,
        sliding_coefficient: mu_d,
        stick_slip_velocity: v_s,
        static_sliding_velocity: v_d,
    } = law
    else {
        unreachable!("the random trees have this law only")
    };
    let (v, pi) = (v.abs(), std::f64::consts::PI);
    if v < v_s {
        mu_s * (pi * v / (2.0 * v_s)).sin()
    } else if v <= v_d {
        (mu_s + mu_d) / 2.0 + (mu_s - mu_d) / 2.0 * (pi * (v - v_s) / (v_d - v_s)).cos()
    } else {
        mu_d
    }
}

/// The random cases with friction set to their regimes.
pub(crate) fn moving_cases() -> Vec<Case> {
    let (mut cases, _) = cases(COUNT);
    for case in &mut cases {
        let states = states_at(case, case.t, &case.q, &case.v);
        let sliding: Vec<f64> = contacts(case, &states).iter().map(|contact| contact.sliding).collect();
        for (joint, sliding) in sliding.into_iter().enumerate() {
            case.set_friction(joint, sliding);
        }
    }
    cases
}

pub(crate) fn dynamics_of(case: &Case) -> Dynamics<'_> {
    let mut dynamics = Dynamics::new(&case.mechanism);
    dynamics.phases.clone_from(&case.phases);
    dynamics
}

pub(crate) fn acceleration(case: &Case, t: f64, q: &[f64], v: &[f64]) -> Vec<f64> {
    let mut a = vec![0.0; q.len()];
    assert!(dynamics_of(case).acceleration(t, q, v, &mut a));
    a
}

fn gravity(case: &Case) -> Vec2 {
    let of = |force: &Force| match force {
        Force::Gravity { acceleration } => Vec2::from(*acceleration),
        _ => Vec2::zeros(),
    };
    case.scene.forces.iter().map(of).sum()
}

pub(crate) fn added(base: &[f64], s: f64, direction: &[f64]) -> Vec<f64> {
    base.iter().zip(direction).map(|(x, d)| x + s * d).collect()
}

fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

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
        count(&|case| case.mechanism.accelerated.iter().any(|&one| case.mechanism.driven[one].turns)) > 10
    );
    assert!(
        count(&|case| case.mechanism.accelerated.iter().any(|&one| !case.mechanism.driven[one].turns)) > 10
    );
    let forces = |kind: &dyn Fn(&Force) -> bool| count(&|case| case.scene.forces.iter().any(kind));
    assert!(forces(&|force| matches!(force, Force::Spring { damping: 0.0, .. })) > 10);
    assert!(forces(&|force| matches!(force, Force::Spring { damping, .. } if *damping > 0.0)) > 50);
    assert!(forces(&|force| matches!(force, Force::TorsionSpring { .. })) > 50);
    assert!(forces(&|force| matches!(force, Force::Applied { frame: ForceFrame::Body, .. })) > 30);
    assert!(forces(&|force| matches!(force, Force::Applied { frame: ForceFrame::Ground, .. })) > 30);
    assert!(forces(&|force| matches!(force, Force::Torque { .. })) > 50);
    assert!(count(&|case| case.mechanism.clearance_joints.len() > 1) > 50);
    assert!(drawn.iter().any(|case| case.mechanism.degrees_of_freedom() > 12));
    let mut seen = std::collections::BTreeMap::new();
    for case in &cases {
        let states = states_at(case, case.t, &case.q, &case.v);
        for (index, contact) in contacts(case, &states).iter().enumerate() {
            let law = &case.mechanism.clearance_joints[index].law;
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
                    // About the origin, from the mass centre.
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
fn linearisation_agrees_with_differences_of_the_accelerations() {
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
        let mut exact = Linearisation::new(d);
        assert!(dynamics_of(case).linearise(t, q, v, &mut exact));
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
