//! The Cartesian side of the identities of the equations of motion, on random tree mechanisms: bodies with
//! three coordinates, constraints and forces at the contact points, written from the printed equations and
//! not from the joint-coordinate core.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::pair::{Phase, SlidingVelocity};
use chebclear::dynamics::Dynamics;
use chebclear::scene::loads::Load as SceneLoad;
use chebclear::scene::parts::{Force, ForceFrame, Joint};
use nalgebra::{DMatrix, DVector, Rotation2, Vector2};

use crate::dynamics::constraints::{CartesianConstraint, CartesianState, Equation, cartesian_constraints};
use crate::dynamics::random_trees::{Case, cases};

pub(crate) type Vec2 = Vector2<f64>;

pub(crate) const COUNT: usize = 300;

/// Value of a force or torque that is a function of time.
fn value_of(load: &SceneLoad, t: f64) -> f64 {
    match load {
        SceneLoad::Time(function) => function.at(t)[0],
        SceneLoad::Motion(_) => unreachable!("random trees have functions of time only"),
    }
}

pub(crate) fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

pub(crate) fn turned(angle: f64, vector: Vec2) -> Vec2 {
    Rotation2::new(angle) * vector
}

/// Cartesian states of all bodies after `move_to`.
pub(crate) fn cartesian(dynamics: &Dynamics) -> Vec<CartesianState> {
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

pub(crate) fn states_at(case: &Case, t: f64, q: &[f64], v: &[f64]) -> Vec<CartesianState> {
    let mut dynamics = Dynamics::new(&case.mechanism);
    dynamics.move_to(t, q, v);
    cartesian(&dynamics)
}

pub(crate) fn state_of(states: &[CartesianState], body: Option<usize>) -> CartesianState {
    body.map_or(CartesianState::GROUND, |body| states[body])
}

pub(crate) fn equations(
    constraint: &CartesianConstraint,
    t: f64,
    states: &[CartesianState],
) -> Vec<Equation> {
    constraint.equations(t, &state_of(states, constraint.body_a), &state_of(states, constraint.body_b))
}

/// q̇ of a body.
pub(crate) fn rates(state: &CartesianState) -> [f64; 3] {
    [state.velocity.x, state.velocity.y, state.angular_velocity]
}

/// φ_q q̇ of one equation.
pub(crate) fn rate_of(equation: &Equation, a: &CartesianState, b: &CartesianState) -> f64 {
    (0..3).map(|k| equation.phi_q_a[k] * rates(a)[k] + equation.phi_q_b[k] * rates(b)[k]).sum()
}

/// A clearance joint in Cartesian coordinates, after section 2 of `[Xiang2020]` with the forces at
/// the contact points and the sliding velocity of the material surfaces (or as printed).
pub(crate) struct Contact {
    pub(crate) journal: Option<usize>,
    pub(crate) bearing: Option<usize>,
    pub(crate) penetration: f64,
    pub(crate) sliding: f64,
    /// Contact points seen from the centers of mass (ground: from the origin).
    pub(crate) arm_journal: Vec2,
    pub(crate) arm_bearing: Vec2,
    pub(crate) force: Vec2,
}

pub(crate) fn contacts(case: &Case, states: &[CartesianState]) -> Vec<Contact> {
    let clearances = case.scene.joints.iter().filter_map(|joint| match joint {
        Joint::Clearance { bearing, journal, journal_radius, clearance, contact, sliding, .. } => {
            Some((bearing, journal, *journal_radius, *clearance, contact, *sliding))
        }
        Joint::Ideal { .. } | Joint::Guide { .. } => None,
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
        if let Phase::Contact { latch, clipped: false, .. } = case.phases[index]
            && delta > 0.0
        {
            let hysteresis_factor = latch.hysteresis_factor;
            let bracket = 1.0 + hysteresis_factor * e_dot.dot(&n);
            let normal = contact.stiffness * delta.powf(contact.exponent) * bracket;
            let mu = case.mechanism.slots[index].law.friction.as_ref().map_or(0.0, |law| mu(law, sliding));
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

/// A force at the center of mass of a body, and a moment.
pub(crate) struct Load {
    pub(crate) body: Option<usize>,
    pub(crate) force: Vec2,
    pub(crate) moment: f64,
}

/// Contacts, springs, dampers, given forces and torques, from their textbook definitions.
pub(crate) fn loads(case: &Case, t: f64, states: &[CartesianState]) -> Vec<Load> {
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
            Force::Bushing { .. } => unreachable!("random trees have none"),
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
                let components = Vec2::new(value_of(x, t), value_of(y, t));
                let angle = state_of(states, body).angle;
                let turning = *frame == ForceFrame::Body;
                push(body, arm, if turning { turned(angle, components) } else { components });
            }
            Force::Torque { body, reaction, torque, .. } => {
                couples.push((case.scene.body_index(body).unwrap(), value_of(torque, t)));
                couples.push((case.scene.body_index(reaction).unwrap(), -value_of(torque, t)));
            }
        }
    }
    let couple = |(body, moment)| Load { body, force: Vec2::zeros(), moment };
    loads.extend(couples.into_iter().map(couple));
    loads
}

/// A scalar constraint on the coordinates of all bodies.
pub(crate) struct Row {
    /// Name of the joint, drive or coupling.
    pub(crate) name: String,
    pub(crate) jacobian: Vec<f64>,
    /// Forces and moments on the bodies per unit of minus the multiplier.
    pub(crate) column: Vec<f64>,
    pub(crate) gamma: f64,
}

impl Row {
    /// φ_q of an equation of a constraint, in the coordinates of all `bodies`.
    pub(crate) fn jacobian(constraint: &CartesianConstraint, equation: &Equation, bodies: usize) -> Vec<f64> {
        let mut row = vec![0.0; 3 * bodies];
        let ends = [(constraint.body_a, equation.phi_q_a), (constraint.body_b, equation.phi_q_b)];
        for (body, part) in ends.into_iter().filter_map(|(body, part)| Some((body?, part))) {
            (0..3).for_each(|k| row[3 * body + k] += part[k]);
        }
        row
    }
}

/// The constraints of the joints and drives of a case.
pub(crate) fn rows(case: &Case, states: &[CartesianState]) -> Vec<Row> {
    let mut rows = Vec::new();
    for constraint in &cartesian_constraints(&case.scene).unwrap() {
        rows.extend(equations(constraint, case.t, states).into_iter().map(|equation| {
            let jacobian = Row::jacobian(constraint, &equation, states.len());
            let column = jacobian.clone();
            Row { name: constraint.name.clone(), jacobian, column, gamma: equation.gamma }
        }));
    }
    rows
}

/// Solves [M φ_qᵀ; φ_q 0] [q̈; λ] = [Q; γ], Eq. (16), and holds accelerations, efforts of drives and reactions of
/// the core against it; the multipliers, and the largest of them. `more` are further forces and moments on the bodies.
pub(crate) fn assert_motion(
    case: &Case,
    index: usize,
    dynamics: &mut Dynamics,
    rows: &[Row],
    more: &[f64],
    tolerance: f64,
) -> (Vec<f64>, f64) {
    let states = states_at(case, case.t, &case.q, &case.v);
    let n = 3 * states.len();
    let mut matrix = DMatrix::zeros(n + rows.len(), n + rows.len());
    let mut right = DVector::zeros(n + rows.len());
    for (body, inertia) in case.inertias.iter().enumerate() {
        let mass = case.scene.bodies[body].mass;
        for (k, value) in [mass, mass, *inertia].into_iter().enumerate() {
            matrix[(3 * body + k, 3 * body + k)] = value;
        }
        (right[3 * body], right[3 * body + 1]) = (mass * gravity(case).x, mass * gravity(case).y);
    }
    for load in loads(case, case.t, &states) {
        let Some(body) = load.body else { continue };
        for (k, value) in [load.force.x, load.force.y, load.moment].into_iter().enumerate() {
            right[3 * body + k] += value;
        }
    }
    for (place, row) in rows.iter().enumerate() {
        for (k, (&by, &force)) in row.jacobian.iter().zip(&row.column).enumerate() {
            (matrix[(n + place, k)], matrix[(k, n + place)]) = (by, force);
        }
        right[n + place] = row.gamma;
    }
    right.iter_mut().zip(more).for_each(|(sum, force)| *sum += force);
    let solution = matrix.lu().solve(&right).unwrap();
    let scale = largest(solution.rows(0, n).iter()).max(1.0);
    let multipliers = solution.as_slice()[n..].to_vec();
    let forces = largest(&multipliers).max(1.0);

    let mut a = vec![0.0; case.q.len()];
    assert!(dynamics.acceleration_and_contacts(case.t, &case.q, &case.v, &mut a));
    dynamics.accelerate(&a);
    dynamics.find_reactions();
    for (body, placement) in case.mechanism.bodies.iter().enumerate() {
        let frame = dynamics.frame(placement.frame);
        let linear = frame.point(placement.center).acceleration + gravity(case);
        for (k, found) in [linear.x, linear.y, frame.angular_acceleration].into_iter().enumerate() {
            let error = (found - solution[3 * body + k]).abs();
            assert!(error <= tolerance * scale, "case {index}, body {body}, {k}: {error:e} of {scale:e}");
        }
    }
    // The multiplier of θ_b - θ_a - (angle + speed t) = 0 is the torque of the drive on a.
    for (number, driven) in case.mechanism.driven.iter().enumerate() {
        let place = rows.iter().position(|row| row.name == driven.name).unwrap();
        let error = (dynamics.drive_effort(number) + multipliers[place]).abs();
        assert!(error <= tolerance * forces, "case {index}, {}: effort off by {error:e}", driven.name);
    }
    // -φ_qᵀ λ of a joint and its drive is what they exert on body b, or the reverse of that on a.
    for (number, joint) in case.mechanism.ideal_joints.iter().enumerate() {
        let drive = case.scene.drives.iter().find(|drive| drive.joint() == joint.name);
        let (body, sign) = match joint.bodies {
            [_, Some(body)] => (body, -1.0),
            [first, None] => (first.unwrap(), 1.0),
        };
        let (mut force, mut moment) = (Vec2::zeros(), 0.0);
        for (row, multiplier) in rows.iter().zip(&multipliers) {
            if row.name == joint.name || drive.is_some_and(|drive| drive.name() == row.name) {
                let part = Vec2::new(row.jacobian[3 * body], row.jacobian[3 * body + 1]);
                force += sign * multiplier * part;
                // About the origin, from the center of mass.
                let about_origin = row.jacobian[3 * body + 2] + cross(states[body].position, part);
                moment += sign * multiplier * about_origin;
            }
        }
        let in_scene = case.scene.joints.iter().find(|other| other.name() == joint.name).unwrap();
        let Joint::Ideal { b, .. } = in_scene else { unreachable!("an ideal joint") };
        let end = case.scene.attachment(b).unwrap();
        let state = state_of(&states, end.body);
        let center = end.body.map_or([0.0; 2], |body| case.scene.bodies[body].center_of_mass);
        let point = state.position + turned(state.angle, Vec2::from(end.position) - Vec2::from(center));
        let reaction = dynamics.reaction(number);
        let error =
            (reaction.force - force).norm().max((reaction.moment - moment + cross(point, force)).abs());
        assert!(
            error <= 10.0 * tolerance * forces,
            "case {index}, {}: reaction off by {error:e}",
            joint.name
        );
    }
    (multipliers, forces)
}

/// Friction coefficient of Eq. (11).
pub(crate) fn mu(law: &FrictionLaw, v: f64) -> f64 {
    let &FrictionLaw::ModifiedCoulomb {
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

pub(crate) fn gravity(case: &Case) -> Vec2 {
    let of = |force: &Force| match force {
        Force::Gravity { acceleration } => Vec2::from(*acceleration),
        _ => Vec2::zeros(),
    };
    case.scene.forces.iter().map(of).sum()
}

pub(crate) fn added(base: &[f64], s: f64, direction: &[f64]) -> Vec<f64> {
    base.iter().zip(direction).map(|(x, d)| x + s * d).collect()
}

pub(crate) fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |largest, value| largest.max(value.abs()))
}
