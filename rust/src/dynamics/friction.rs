//! Friction in ideal joints, from the reactions that it changes, with exact derivatives.
//!
//! Accelerations and reactions are affine in the friction T of all joints, λ = λ₀ + Λ T. A joint that sticks has a spring,
//! whose force depends on no reaction; those that slide in the direction s satisfy
//!
//! ```text
//! T_j + s_j h_j(λ_j) = 0
//! ```
//!
//! with the norms h of their laws. h_j(Λ_jk) bounds what a change of T_k makes of T_j. Where the matrix of these bounds has a
//! spectral radius below one there is one solution, which Newton's method finds. For a single joint the bound is exact: from
//! one on there are two solutions or none.

use super::Dynamics;
use super::reactions::Wrench;
use super::response::ROUNDING;
use crate::contact::sticking::Traction;
use crate::numerics::linear::{lu_factor, lu_solve, symmetric_solve};
use crate::numerics::turns::with_turns;
use crate::tree::elements::Tree;
use crate::tree::friction::{DryJoint, Reacting};
use crate::tree::kinematics::Coordinate;

/// Most steps of Newton's method; a few suffice.
const STEPS: usize = 20;
/// Residual that counts as rounding, relative to the friction of all terms of a reaction.
const SOLVED: f64 = 64.0 * f64::EPSILON;

/// What friction of size one in a joint adds to the accelerations and multipliers.
#[derive(Clone, Debug, Default)]
struct Response {
    accelerations: Vec<f64>,
    multipliers: Vec<f64>,
}

/// Friction in the ideal joints of a mechanism in one state.
#[derive(Clone, Debug)]
pub(super) struct Friction<'m> {
    /// Whether each joint sticks or slides. Without stiffness its motion is prescribed by drives: it has a direction only.
    tractions: Vec<Traction>,
    joints: &'m [DryJoint],
    other: &'m Reacting,
    /// The same mechanism with reactions.
    reacting: Box<Dynamics<'m>>,
    q: Vec<f64>,
    v: Vec<f64>,
    /// Accelerations and multipliers without friction, and what that of each joint adds.
    kept: Response,
    responses: Vec<Response>,
    /// Torque or force on the second body of each joint along its coordinate [N m or N], and the largest that its reaction
    /// allows.
    efforts: Vec<f64>,
    limits: Vec<f64>,
    /// Derivatives of all efforts with respect to every degree of freedom, then to their velocities, then to time.
    gradients: Vec<Vec<f64>>,
    /// The joint at which two solutions or none were found in the last state, with the bound.
    fault: Option<(usize, f64)>,
}

impl<'m> Friction<'m> {
    /// That of a tree, if it has any: nothing acts until the joints stick or slide.
    pub(super) fn of(tree: &'m Tree) -> Option<Box<Self>> {
        let other = tree.reacting.as_ref()?;
        let (d, count) = (other.tree.degrees_of_freedom(), tree.dry_joints.len());
        Some(Box::new(Self {
            tractions: vec![Traction::from_numbers([0.0; Traction::NAMES.len()]); count],
            joints: &tree.dry_joints,
            other,
            reacting: Box::new(Dynamics::new(&other.tree)),
            q: vec![0.0; d],
            v: vec![0.0; d],
            kept: Response { accelerations: vec![0.0; d], multipliers: Vec::new() },
            responses: vec![Response::default(); count],
            efforts: vec![0.0; count],
            limits: vec![f64::NAN; count],
            gradients: vec![vec![0.0; count]; 2 * tree.degrees_of_freedom() + 1],
            fault: None,
        }))
    }

    /// The joints that slide, except one that is held.
    fn sliding(&self, held: Option<usize>) -> Vec<usize> {
        let slides = |&index: &usize| !self.tractions[index].sticks() && held != Some(index);
        (0..self.joints.len()).filter(slides).collect()
    }

    /// Takes over the state of the mechanism, and finds accelerations and multipliers without friction and the responses
    /// to it. False where there are none.
    fn follow(&mut self, dynamics: &Dynamics) -> bool {
        let reacting = &mut *self.reacting;
        reacting.phases.copy_from_slice(&dynamics.phases);
        reacting.switches.copy_from_slice(&dynamics.switches);
        for (&column, &turns) in self.other.columns.iter().zip(&dynamics.turns) {
            reacting.turns[column] = turns;
        }
        for (&freedom, &column) in self.other.freedoms.iter().zip(&dynamics.tree.free) {
            let coordinate = &dynamics.coordinates[column];
            (self.q[freedom], self.v[freedom]) = (coordinate.position, coordinate.velocity);
        }
        if !reacting.acceleration_and_contacts(dynamics.t, &self.q, &self.v, &mut self.kept.accelerations) {
            return false;
        }
        self.kept.multipliers.clone_from(&reacting.loops.multipliers);
        for (response, joint) in self.responses.iter_mut().zip(self.joints) {
            response.accelerations = vec![0.0; self.q.len()];
            joint.reacting.iter().for_each(|&(freedom, factor)| response.accelerations[freedom] = factor);
            symmetric_solve(&reacting.mass, self.q.len(), &mut response.accelerations);
            reacting.loops.right.fill(0.0);
            reacting.loops.correct(&mut response.accelerations);
            response.multipliers.clone_from(&reacting.loops.right);
        }
        true
    }

    /// What friction of size one in a joint adds to the reaction of another.
    fn influence(&self, joint: usize, source: usize) -> [f64; 2] {
        self.joints[joint].rows.map(|row| self.responses[source].multipliers[row])
    }

    /// The reaction of a joint from the multipliers without friction, or its change, and the friction of all joints.
    fn reaction(&self, joint: usize, kept: &[f64], efforts: &[f64]) -> [f64; 2] {
        let added = |row: usize, kept: f64| {
            let terms = efforts.iter().zip(&self.responses);
            terms.fold(kept, |sum, (effort, response)| sum + effort * response.multipliers[row])
        };
        self.joints[joint].rows.map(|row| added(row, kept[row]))
    }

    /// The largest friction of a joint under its present reaction, and its derivatives.
    fn limit(&self, joint: usize) -> (f64, [f64; 2]) {
        self.joints[joint].law.limit(self.reaction(joint, &self.kept.multipliers, &self.efforts))
    }

    /// Whether the friction of the joints that slide has one solution; otherwise a joint and its bound. The spectral radius
    /// is below one where all pivots of one less the bounds are positive.
    fn check(&self, sliding: &[usize]) -> Option<(usize, f64)> {
        let row = |&j: &usize| -> Vec<f64> {
            let bound = |k: usize| self.joints[j].law.limit(self.influence(j, k)).0;
            sliding.iter().map(|&k| f64::from(j == k) - bound(k)).collect()
        };
        let mut rows: Vec<Vec<f64>> = sliding.iter().map(row).collect();
        for place in 0..rows.len() {
            let (done, rest) = rows.split_at_mut(place + 1);
            let pivot = &done[place];
            if pivot[place].is_nan() || pivot[place] <= 0.0 {
                return Some((sliding[place], 1.0 - pivot[place]));
            }
            for row in rest {
                let factor = row[place] / pivot[place];
                row.iter_mut().zip(pivot).for_each(|(entry, above)| *entry -= factor * above);
            }
        }
        None
    }

    /// The equations of some joints that slide, the last of which may be held without acceleration instead: what is left of
    /// each, the size of its terms, and the derivatives with respect to their friction.
    fn equations(&self, joints: &[usize], held: Option<usize>) -> Vec<(f64, f64, Vec<f64>)> {
        let terms = |of: &dyn Fn(usize) -> f64, [kept, size]: [f64; 2]| {
            let sum = self.efforts.iter().enumerate();
            sum.fold((kept, size.abs()), |(sum, size), (k, effort)| {
                (sum + of(k) * effort, size + (of(k) * effort).abs())
            })
        };
        let equation = |&j: &usize| {
            let accelerates = |response: &Response| {
                along(&self.joints[j].reacting, |freedom| response.accelerations[freedom])
            };
            let own = accelerates(&self.responses[j]);
            let by = |k: usize| accelerates(&self.responses[k]) / own;
            if held == Some(j) {
                let kept = accelerates(&self.kept) / own;
                let (left, size) = terms(&by, [kept; 2]);
                return (left, size, joints.iter().map(|&k| by(k)).collect());
            }
            let (law, direction) = (self.joints[j].law, self.tractions[j].direction);
            let (limit, [x, y]) = self.limit(j);
            let slope = |k: usize| {
                let [by_x, by_y] = self.influence(j, k);
                f64::from(j == k) + direction * (x * by_x + y * by_y)
            };
            let kept = law.limit(self.joints[j].rows.map(|row| self.kept.multipliers[row])).0;
            let (_, size) = terms(&|k| law.limit(self.influence(j, k)).0, [0.0, kept]);
            (self.efforts[j] + direction * limit, size, joints.iter().map(|&k| slope(k)).collect())
        };
        joints.iter().map(equation).collect()
    }

    /// Finds the friction of the joints that slide beside that of those that stick, and that by which a joint is held
    /// without acceleration; false where there is not one solution.
    fn solve(&mut self, held: Option<usize>) -> bool {
        let mut joints = self.sliding(held);
        self.fault = self.check(&joints);
        joints.extend(held);
        let mut solved = self.fault.is_none() && joints.is_empty();
        for _ in 0..STEPS {
            if solved || self.fault.is_some() {
                break;
            }
            let equations = self.equations(&joints, held);
            solved = equations.iter().all(|(left, size, _)| left.abs() <= SOLVED * size);
            let mut change: Vec<f64> = equations.iter().map(|(left, ..)| *left).collect();
            let Some(factor) = factor(equations) else { return false };
            lu_solve(&factor.0, joints.len(), &factor.1, &mut change);
            joints.iter().zip(change).for_each(|(&j, change)| self.efforts[j] -= change);
        }
        self.limits = (0..self.joints.len()).map(|j| self.limit(j).0).collect();
        solved && self.efforts.iter().all(|effort| effort.is_finite())
    }

    /// Finds the gradients of the joints that slide; those of the others are known, theirs zero.
    fn differentiate(&mut self, free: &[usize]) {
        let sliding = self.sliding(None);
        let Some((matrix, pivots)) = factor(self.equations(&sliding, None)).filter(|_| !sliding.is_empty())
        else {
            return;
        };
        let slopes: Vec<[f64; 2]> = sliding.iter().map(|&j| self.limit(j).1).collect();
        let reacting = &mut *self.reacting;
        let Response { mut accelerations, mut multipliers } = self.kept.clone();
        for (effort, response) in self.efforts.iter().zip(&self.responses) {
            accelerations.iter_mut().zip(&response.accelerations).for_each(|(sum, by)| *sum += effort * by);
            multipliers.iter_mut().zip(&response.multipliers).for_each(|(sum, by)| *sum += effort * by);
        }
        reacting.accelerate(&accelerations);
        reacting.loops.multipliers = multipliers;
        reacting.find_residual_derivatives();
        for place in 0..self.gradients.len() {
            // The change of the multipliers with all friction kept is left in the memory of the loops.
            let column = |freedom: usize| self.other.columns[free[freedom]];
            let d = free.len();
            self.reacting.accelerations_by(&mut accelerations, |this, row| match place {
                _ if place < d => this.residual_by_position(row, column(place)),
                _ if place < 2 * d => this.residual_by_velocity(row, column(place - d)),
                _ => this.residual_by_time(row),
            });
            let change = |(&j, [x, y]): (&usize, &[f64; 2])| {
                let [by_x, by_y] = self.reaction(j, &self.reacting.loops.right, &self.gradients[place]);
                -self.tractions[j].direction * (x * by_x + y * by_y)
            };
            let mut changes: Vec<f64> = sliding.iter().zip(&slopes).map(change).collect();
            lu_solve(&matrix, sliding.len(), &pivots, &mut changes);
            sliding.iter().zip(changes).for_each(|(&j, change)| self.gradients[place][j] = change);
        }
    }
}

/// The factored derivatives of some equations.
fn factor(equations: Vec<(f64, f64, Vec<f64>)>) -> Option<(Vec<f64>, Vec<usize>)> {
    let n = equations.len();
    let mut matrix: Vec<f64> = equations.into_iter().flat_map(|(.., row)| row).collect();
    let (mut weights, mut pivots) = (vec![1.0; n], vec![0; n]);
    lu_factor(&mut matrix, n, &mut weights, &mut pivots).then_some((matrix, pivots))
}

/// Sum of the entries times their factors.
fn along(columns: &[(usize, f64)], of: impl Fn(usize) -> f64) -> f64 {
    columns.iter().map(|&(index, factor)| factor * of(index)).sum()
}

impl Dynamics<'_> {
    /// Whether each ideal joint with friction sticks or slides.
    pub fn tractions(&self) -> &[Traction] {
        self.friction.as_ref().map_or(&[], |friction| &friction.tractions)
    }

    /// Sets what the joint with friction of this index does.
    pub fn set_traction(&mut self, index: usize, traction: Traction) {
        if let Some(friction) = &mut self.friction {
            friction.tractions[index] = traction;
        }
    }

    /// Sets what all joints with friction do.
    pub fn set_tractions(&mut self, tractions: &[Traction]) {
        if let Some(friction) = &mut self.friction {
            friction.tractions.copy_from_slice(tractions);
        }
    }

    /// Takes over the phases of all contacts and joints and the states of the switches.
    pub fn copy_phases(&mut self, other: &Self) {
        self.phases.copy_from_slice(&other.phases);
        self.switches.copy_from_slice(&other.switches);
        if let (Some(own), Some(other)) = (&mut self.friction, &other.friction) {
            own.tractions.copy_from_slice(&other.tractions);
        }
    }

    /// Velocity [rad/s or m/s] in a joint with friction, after [`Dynamics::move_to`].
    pub fn dry_velocity(&self, index: usize) -> f64 {
        along(&self.tree.dry_joints[index].columns, |column| self.coordinates[column].velocity)
    }

    /// Acceleration [rad/s² or m/s²] in a joint with friction, after [`Dynamics::accelerate`].
    pub fn dry_acceleration(&self, index: usize) -> f64 {
        along(&self.tree.dry_joints[index].columns, |column| self.coordinates[column].acceleration)
    }

    /// Stretch of the spring of a joint that sticks [rad or m].
    fn dry_stretch(&self, index: usize, traction: &Traction) -> f64 {
        let columns = &self.tree.dry_joints[index].columns;
        let near = along(columns, |column| self.coordinates[column].position) - traction.anchor;
        with_turns(near, along(columns, |column| self.turns[column]) - traction.turns[0])
    }

    /// The traction of a joint that begins to stick with a friction [N m or N], in the state last moved to.
    pub fn anchored_joint(&self, index: usize, effort: f64, traction: Traction) -> Traction {
        let columns = &self.tree.dry_joints[index].columns;
        let turns = [along(columns, |column| self.turns[column]), 0.0];
        let held = (effort + traction.damping * self.dry_velocity(index)) / traction.stiffness;
        let anchor = along(columns, |column| self.coordinates[column].position) + held;
        Traction { direction: 0.0, anchor, turns, ..traction }
    }

    /// Mass [kg] or moment of inertia [kg m²] that friction in a joint moves, after [`Dynamics::acceleration`]; infinite where
    /// drives prescribe its motion.
    pub fn dry_inertia(&mut self, index: usize) -> f64 {
        let free = &self.tree.dry_joints[index].free;
        let mut response = vec![0.0; self.tree.free.len()];
        free.iter().for_each(|&(freedom, factor)| response[freedom] = factor);
        symmetric_solve(&self.mass, response.len(), &mut response);
        let without_loops = along(free, |freedom| response[freedom]);
        if !self.loops.right.is_empty() {
            self.loops.right.fill(0.0);
            self.loops.correct(&mut response);
        }
        let accelerance = along(free, |freedom| response[freedom]);
        if accelerance > ROUNDING * without_loops { 1.0 / accelerance } else { f64::INFINITY }
    }

    /// Finds the friction in the state last moved to, where no joint slides without the reactions unless they are asked for;
    /// false where it has two solutions or none.
    #[inline(never)]
    pub fn find_friction(&mut self, with_limits: bool) -> bool {
        self.find_friction_beside(None, with_limits)
    }

    /// The friction that holds a joint without acceleration in the state last moved to, and the largest that its reaction
    /// then allows [N m or N], after [`Dynamics::acceleration`] there; `None` where there is none.
    pub fn holding_effort(&mut self, index: usize) -> Option<(f64, f64)> {
        // Rounding errors would decide the sign.
        let found = self.dry_inertia(index).is_finite() && self.find_friction_beside(Some(index), true);
        found.then(|| (self.dry_effort(index), self.dry_limit(index)))
    }

    fn find_friction_beside(&mut self, held: Option<usize>, with_limits: bool) -> bool {
        let Some(mut friction) = self.friction.take() else { return true };
        // What slides is found anew, whatever was evaluated before.
        friction.efforts.fill(0.0);
        for (index, traction) in friction.tractions.iter().enumerate().filter(|(_, one)| one.sticks()) {
            if held == Some(index) {
                continue;
            }
            let spring = traction.stiffness * self.dry_stretch(index, traction);
            friction.efforts[index] = -spring - traction.damping * self.dry_velocity(index);
        }
        let is_needed = with_limits || friction.tractions.iter().any(|traction| !traction.sticks());
        let found = !is_needed || (friction.follow(self) && friction.solve(held));
        self.friction = Some(friction);
        found
    }

    /// The joint at which friction has two solutions or none in the state last evaluated, and how much friction there
    /// changes itself: by one or more of its own size.
    pub fn friction_fault(&self) -> Option<(usize, f64)> {
        self.friction.as_ref()?.fault
    }

    /// Adds the generalized forces of friction.
    pub(super) fn add_friction(&self, forces: &mut [f64]) {
        let Some(friction) = &self.friction else { return };
        for (joint, effort) in friction.joints.iter().zip(&friction.efforts) {
            joint.free.iter().for_each(|&(freedom, factor)| forces[freedom] += factor * effort);
        }
    }

    /// Finds the derivatives of friction, after [`Dynamics::acceleration`] and [`Dynamics::accelerate`] in the same state.
    pub fn differentiate_friction(&mut self) {
        let tree = self.tree;
        let Some(mut friction) = self.friction.take() else { return };
        let d = tree.free.len();
        for (index, (joint, traction)) in tree.dry_joints.iter().zip(&friction.tractions).enumerate() {
            friction.gradients.iter_mut().for_each(|gradient| gradient[index] = 0.0);
            if !traction.sticks() {
                continue;
            }
            for &(freedom, factor) in &joint.free {
                friction.gradients[freedom][index] = -traction.stiffness * factor;
                friction.gradients[d + freedom][index] = -traction.damping * factor;
            }
            for &(column, factor) in joint.columns.iter().filter(|(column, _)| !tree.free.contains(column)) {
                let Coordinate { velocity, acceleration, .. } = self.coordinates[column];
                friction.gradients[2 * d][index] -=
                    factor * (traction.stiffness * velocity + traction.damping * acceleration);
            }
        }
        friction.differentiate(&tree.free);
        self.friction = Some(friction);
    }

    /// Adds the derivatives of friction to those of the force residual.
    pub(super) fn add_friction_derivatives(&mut self) {
        let (tree, columns) = (self.tree, self.coordinates.len());
        self.differentiate_friction();
        let Some(friction) = &self.friction else { return };
        for (index, joint) in tree.dry_joints.iter().enumerate() {
            let (by_position, others) = friction.gradients.split_at(tree.free.len());
            for &(row, factor) in &joint.free {
                for ((&column, by_position), by_velocity) in tree.free.iter().zip(by_position).zip(others) {
                    self.residual_q[row * columns + column] -= factor * by_position[index];
                    self.residual_v[row * columns + column] -= factor * by_velocity[index];
                }
                self.residual_t[row] -= factor * friction.gradients[2 * tree.free.len()][index];
            }
        }
    }

    /// Velocity of the slider of a joint that slides [rad/s or m/s], after [`Dynamics::differentiate_friction`]: its own less
    /// the rate at which the spring would stretch.
    pub fn dry_slider(&self, index: usize) -> f64 {
        let Some(friction) = &self.friction else { return f64::NAN };
        let (by_position, others) = friction.gradients.split_at(self.tree.free.len());
        let terms = self.tree.free.iter().zip(by_position).zip(others).map(
            |((&column, by_position), by_velocity)| {
                let Coordinate { velocity, acceleration, .. } = self.coordinates[column];
                by_position[index] * velocity + by_velocity[index] * acceleration
            },
        );
        let rate = terms.sum::<f64>() + friction.gradients[2 * self.tree.free.len()][index];
        self.dry_velocity(index) + rate / friction.tractions[index].stiffness
    }

    /// Friction in a joint on its second body, along its coordinate [N m or N], after [`Dynamics::acceleration`].
    pub fn dry_effort(&self, index: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.efforts[index])
    }

    /// The largest friction that the reaction allows [N m or N], after [`Dynamics::find_friction`] with limits.
    pub fn dry_limit(&self, index: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.limits[index])
    }

    /// Friction, power or whether it sticks, by its place in [`crate::contact::friction::JointFriction::outputs`].
    pub fn dry_value(&self, index: usize, quantity: usize) -> f64 {
        match quantity {
            0 => self.dry_effort(index),
            1 => self.dry_loss(index),
            _ => f64::from(self.tractions()[index].sticks()),
        }
    }

    /// Power dissipated in a joint [W], after [`Dynamics::acceleration`].
    pub fn dry_loss(&self, index: usize) -> f64 {
        let velocity = self.dry_velocity(index);
        let traction = &self.tractions()[index];
        if traction.sticks() {
            traction.damping * velocity * velocity
        } else {
            -self.dry_effort(index) * velocity
        }
    }

    /// Energy of the spring of a joint that sticks [J], after [`Dynamics::move_to`].
    pub fn dry_energy(&self, index: usize) -> f64 {
        let traction = &self.tractions()[index];
        if traction.sticks() {
            0.5 * traction.stiffness * self.dry_stretch(index, traction).powi(2)
        } else {
            0.0
        }
    }

    /// Calls `supply` with what friction exerts on bodies.
    pub(super) fn each_friction_load(&self, supply: &mut impl FnMut(Option<usize>, Wrench)) {
        for (index, dry) in self.tree.dry_joints.iter().enumerate() {
            let joint = &self.tree.ideal_joints[dry.joint];
            self.supply_effort(Some(joint), joint.bodies, self.dry_effort(index), supply);
        }
    }
}
