//! Friction in ideal joints, from the reactions that it changes, with exact derivatives.
//!
//! Accelerations and reactions are affine in the friction T of all joints, λ = λ₀ + Λ T. Every joint transmits a fraction φ
//! of the largest friction h that its law allows under its reaction,
//!
//! ```text
//! T_j + φ_j h_j(λ_j) = 0
//! ```
//!
//! with φ = ±1 where it slides and that of its spring where it sticks. h_j(Λ_jk) bounds what a change of T_k makes of h_j.
//! Where the matrix of |φ_j| h_j(Λ_jk) has a spectral radius below one there is one solution, which Newton's method finds.
//! For a single joint that slides the bound is exact: from one on there are two solutions or none.
//!
//! How joints at rest share what holds them, equilibrium alone does not say where one of them cannot move without another.
//! They share it as springs would that are loaded together, φ_j = Σ_p C_jp y_p, with the correlation C of their motions. It is
//! ±1 between joints that can only move together: these transmit equal fractions, and slide from the same instant on.

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
/// Square of the sine of the angle between two motions that count as one: a correlation loses half of its digits.
const DEPENDENT: f64 = 1.490_116_119_384_765_6e-8;
/// Acceleration that counts as none where a joint begins to slide, relative to its terms.
const SETTLED: f64 = 1e-9;

/// What friction of size one in a joint adds to the accelerations and multipliers.
#[derive(Clone, Debug, Default)]
struct Response {
    accelerations: Vec<f64>,
    multipliers: Vec<f64>,
    /// The acceleration of the joint without closures.
    without_loops: f64,
}

/// An equation of friction: what is left of it, the size of its terms, its derivatives.
type Equation = (f64, f64, Vec<f64>);

/// Friction in the ideal joints of a mechanism in one state.
#[derive(Clone, Debug)]
pub(super) struct Friction<'m> {
    /// Whether each joint sticks or slides. Springs give fractions: stiffness is in 1/rad or 1/m, damping in s/rad or s/m.
    /// Without stiffness the motion is prescribed by drives: it has a direction only.
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
    /// Accelerations of the joints by drives.
    driven: Vec<f64>,
    /// Part of its largest friction that each joint transmits against its direction or stretch.
    fractions: Vec<f64>,
    /// Torque or force on the second body of each joint along its coordinate [N m or N].
    efforts: Vec<f64>,
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
            kept: Response { accelerations: vec![0.0; d], ..Response::default() },
            responses: vec![Response::default(); count],
            driven: vec![0.0; count],
            fractions: vec![0.0; count],
            efforts: vec![0.0; count],
            gradients: vec![vec![0.0; count]; 2 * tree.degrees_of_freedom() + 1],
            fault: None,
        }))
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
            response.without_loops = along(&joint.reacting, |freedom| response.accelerations[freedom]);
            reacting.loops.right.fill(0.0);
            reacting.loops.correct(&mut response.accelerations);
            response.multipliers.clone_from(&reacting.loops.right);
        }
        for (driven, joint) in self.driven.iter_mut().zip(self.joints) {
            *driven = along(&joint.driven, |column| dynamics.coordinates[column].acceleration);
        }
        true
    }

    /// The acceleration of a joint in a response.
    fn acceleration(&self, joint: usize, response: &Response) -> f64 {
        along(&self.joints[joint].reacting, |freedom| response.accelerations[freedom])
    }

    /// What friction of size one in a joint adds to the acceleration of another.
    fn accelerance(&self, joint: usize, source: usize) -> f64 {
        self.acceleration(joint, &self.responses[source])
    }

    /// Correlation of the motions of two joints: 1 or -1 where neither moves without the other.
    fn correlation(&self, joint: usize, other: usize) -> f64 {
        let own = self.accelerance(joint, joint) * self.accelerance(other, other);
        self.accelerance(joint, other) / own.sqrt()
    }

    /// Acceleration of a joint, and the size of its terms.
    fn accelerations(&self, joint: usize) -> (f64, f64) {
        let alone = self.acceleration(joint, &self.kept) + self.driven[joint];
        let terms = self.efforts.iter().enumerate().map(|(k, effort)| self.accelerance(joint, k) * effort);
        terms.fold((alone, alone.abs()), |(sum, size), term| (sum + term, size + term.abs()))
    }

    /// Direction in which a joint accelerates from rest; zero within rounding errors.
    fn accelerates(&self, joint: usize) -> f64 {
        let (acceleration, size) = self.accelerations(joint);
        if acceleration.abs() <= SETTLED * size { 0.0 } else { acceleration.signum() }
    }

    /// Those of some joints whose motions are independent, on which the motions of the others depend.
    fn independent(&self, joints: &[usize]) -> Vec<usize> {
        let row = |&j: &usize| joints.iter().map(|&k| self.correlation(j, k)).collect();
        let mut rows: Vec<Vec<f64>> = joints.iter().map(row).collect();
        let mut found = Vec::new();
        for (place, &joint) in joints.iter().enumerate() {
            let (done, rest) = rows.split_at_mut(place + 1);
            if done[place][place] > DEPENDENT {
                found.push(joint);
                subtract(&done[place], rest, place);
            }
        }
        found
    }

    /// What friction of size one in a joint adds to the reaction of another.
    fn influence(&self, joint: usize, source: usize) -> [f64; 2] {
        self.joints[joint].rows.map(|row| self.responses[source].multipliers[row])
    }

    /// The largest friction of a joint under its present reaction, and its derivatives.
    fn limit(&self, joint: usize) -> (f64, [f64; 2]) {
        let added = |row: usize| {
            let terms = self.efforts.iter().zip(&self.responses);
            terms.fold(self.kept.multipliers[row], |sum, (effort, response)| {
                sum + effort * response.multipliers[row]
            })
        };
        let DryJoint { law, rows, .. } = &self.joints[joint];
        law.limit(rows.map(added))
    }

    /// Whether friction has one solution; otherwise a joint and its bound. The spectral radius is below one where all pivots
    /// of one less the bounds are positive.
    fn check(&self) -> Option<(usize, f64)> {
        let joints = 0..self.joints.len();
        let row = |j: usize| -> Vec<f64> {
            let bound = |k: usize| self.fractions[j].abs() * self.joints[j].law.limit(self.influence(j, k)).0;
            joints.clone().map(|k| f64::from(j == k) - bound(k)).collect()
        };
        let mut rows: Vec<Vec<f64>> = joints.clone().map(row).collect();
        for place in joints {
            let (done, rest) = rows.split_at_mut(place + 1);
            let pivot = done[place][place];
            if pivot.is_nan() || pivot <= 0.0 {
                return Some((place, 1.0 - pivot));
            }
            subtract(&done[place], rest, place);
        }
        None
    }

    /// The equations of all joints, and of those on whose pulls the fractions of the held ones depend: these must not
    /// accelerate. Derivatives are with respect to friction and pulls.
    fn equations(&self, held: &[usize], pulling: &[usize]) -> Vec<Equation> {
        let count = self.joints.len();
        let friction = |j: usize| {
            let (law, fraction) = (self.joints[j].law, self.fractions[j]);
            let (limit, [x, y]) = self.limit(j);
            let slope = |k: usize| {
                let [by_x, by_y] = self.influence(j, k);
                f64::from(j == k) + fraction * (x * by_x + y * by_y)
            };
            let pull = |&p: &usize| if held.contains(&j) { limit * self.correlation(j, p) } else { 0.0 };
            let kept = law.limit(self.joints[j].rows.map(|row| self.kept.multipliers[row])).0;
            let terms = self.efforts.iter().enumerate();
            let size =
                terms.fold(kept, |sum, (k, effort)| sum + effort.abs() * law.limit(self.influence(j, k)).0);
            let left = self.efforts[j] + fraction * limit;
            (left, size, (0..count).map(slope).chain(pulling.iter().map(pull)).collect())
        };
        let rest = |&p: &usize| {
            let (own, (left, size)) = (self.accelerance(p, p), self.accelerations(p));
            let by = (0..count).map(|k| self.accelerance(p, k) / own);
            (left / own, size / own, by.chain(pulling.iter().map(|_| 0.0)).collect())
        };
        (0..count).map(friction).chain(pulling.iter().map(rest)).collect()
    }

    /// Finds the friction of all joints, and the fractions with which some of them hold each other without acceleration; false
    /// where there is not one solution.
    fn solve(&mut self, held: &[usize]) -> bool {
        self.fault = self.check();
        let pulling = self.independent(held);
        let mut pulls = vec![0.0; pulling.len()];
        let mut solved = false;
        for _ in 0..STEPS {
            if solved || self.fault.is_some() {
                break;
            }
            let equations = self.equations(held, &pulling);
            solved = equations.iter().all(|(left, size, _)| left.abs() <= SOLVED * size);
            let mut change: Vec<f64> = equations.iter().map(|(left, ..)| *left).collect();
            let Some((matrix, pivots)) = factor(equations) else { return solved };
            lu_solve(&matrix, change.len(), &pivots, &mut change);
            self.efforts
                .iter_mut()
                .chain(&mut pulls)
                .zip(change)
                .for_each(|(value, change)| *value -= change);
            for &j in held {
                let terms = pulling.iter().zip(&pulls);
                self.fractions[j] = terms.map(|(&p, pull)| self.correlation(j, p) * pull).sum();
            }
        }
        solved && self.efforts.iter().all(|effort| effort.is_finite())
    }

    /// The same; what nothing can hold goes as the others let it, with an infinite fraction.
    fn hold(&mut self, held: &[usize]) -> bool {
        let solved = self.solve(held);
        if solved || held.is_empty() || self.fault.is_some() {
            return solved;
        }
        self.efforts.fill(0.0);
        held.iter().for_each(|&j| self.fractions[j] = 0.0);
        let found = self.solve(&[]);
        held.iter().for_each(|&j| self.fractions[j] = self.accelerations(j).0.signum() * f64::INFINITY);
        found
    }

    /// Finds the gradients of friction from those of the fractions.
    fn differentiate(&mut self, free: &[usize]) {
        let Some((matrix, pivots)) = factor(self.equations(&[], &[])) else { return };
        let count = self.joints.len();
        let limits: Vec<(f64, [f64; 2])> = (0..count).map(|j| self.limit(j)).collect();
        let reacting = &mut *self.reacting;
        let Response { mut accelerations, mut multipliers, .. } = self.kept.clone();
        for (effort, response) in self.efforts.iter().zip(&self.responses) {
            accelerations.iter_mut().zip(&response.accelerations).for_each(|(sum, by)| *sum += effort * by);
            multipliers.iter_mut().zip(&response.multipliers).for_each(|(sum, by)| *sum += effort * by);
        }
        reacting.accelerate(&accelerations);
        reacting.loops.multipliers = multipliers;
        reacting.find_residual_derivatives();
        for (place, gradient) in self.gradients.iter_mut().enumerate() {
            // The change of the multipliers with all friction kept is left in the memory of the loops.
            let column = |freedom: usize| self.other.columns[free[freedom]];
            let d = free.len();
            reacting.accelerations_by(&mut accelerations, |this, row| match place {
                _ if place < d => this.residual_by_position(row, column(place)),
                _ if place < 2 * d => this.residual_by_velocity(row, column(place - d)),
                _ => this.residual_by_time(row),
            });
            for (j, (limit, [x, y])) in limits.iter().enumerate() {
                let [by_x, by_y] = self.joints[j].rows.map(|row| reacting.loops.right[row]);
                gradient[j] = -gradient[j] * limit - self.fractions[j] * (x * by_x + y * by_y);
            }
            lu_solve(&matrix, count, &pivots, gradient);
        }
    }
}

/// Eliminates a column from the rows below a pivot.
fn subtract(pivot: &[f64], rows: &mut [Vec<f64>], column: usize) {
    for row in rows {
        let factor = row[column] / pivot[column];
        row.iter_mut().zip(pivot).for_each(|(entry, above)| *entry -= factor * above);
    }
}

/// The factored derivatives of some equations.
fn factor(equations: Vec<Equation>) -> Option<(Vec<f64>, Vec<usize>)> {
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

    /// The fraction of its largest friction that a joint transmits in a traction, after [`Dynamics::move_to`].
    pub fn dry_fraction(&self, index: usize, traction: &Traction) -> f64 {
        if !traction.sticks() {
            return traction.direction;
        }
        let columns = &self.tree.dry_joints[index].columns;
        let near = along(columns, |column| self.coordinates[column].position) - traction.anchor;
        let stretch = with_turns(near, along(columns, |column| self.turns[column]) - traction.turns[0]);
        traction.stiffness * stretch + traction.damping * self.dry_velocity(index)
    }

    /// The traction of a joint that begins to stick with a fraction of its largest friction, in the state last moved to.
    pub fn anchored_joint(&self, index: usize, fraction: f64, traction: Traction) -> Traction {
        let columns = &self.tree.dry_joints[index].columns;
        let turns = [along(columns, |column| self.turns[column]), 0.0];
        let stretch = (fraction - traction.damping * self.dry_velocity(index)) / traction.stiffness;
        let anchor = along(columns, |column| self.coordinates[column].position) - stretch;
        Traction { direction: 0.0, anchor, turns, ..traction }
    }

    /// Mass [kg] or moment of inertia [kg m²] that friction in a joint moves, after [`Dynamics::find_friction`]; infinite
    /// where drives prescribe its motion.
    pub fn dry_inertia(&self, index: usize) -> f64 {
        let Some(friction) = &self.friction else { return f64::NAN };
        let accelerance = friction.accelerance(index, index);
        let moves = accelerance > ROUNDING * friction.responses[index].without_loops;
        if moves { 1.0 / accelerance } else { f64::INFINITY }
    }

    /// Correlation of the motions of two joints that friction can move: exactly 1 or -1 where neither moves without the
    /// other.
    pub fn dry_correlation(&self, index: usize, other: usize) -> f64 {
        let correlation =
            self.friction.as_ref().map_or(f64::NAN, |friction| friction.correlation(index, other));
        if 1.0 - correlation * correlation <= DEPENDENT { correlation.signum() } else { correlation }
    }

    /// Finds the friction in the state last moved to; false where it has two solutions or none.
    #[inline(never)]
    pub fn find_friction(&mut self) -> bool {
        self.hold_joints(&[])
    }

    /// The same, where some joints hold each other without acceleration; after [`Dynamics::acceleration`] there.
    pub fn hold_joints(&mut self, held: &[usize]) -> bool {
        let Some(mut friction) = self.friction.take() else { return true };
        // It is found anew, whatever was evaluated before.
        friction.efforts.fill(0.0);
        for (index, traction) in friction.tractions.iter().enumerate() {
            let is_held = held.contains(&index);
            friction.fractions[index] = if is_held { 0.0 } else { self.dry_fraction(index, traction) };
        }
        let found = friction.follow(self) && friction.hold(held);
        self.friction = Some(friction);
        found
    }

    /// The fraction of its largest friction that a joint transmits, as its friction was last found.
    pub fn held_fraction(&self, index: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.fractions[index])
    }

    /// Whether a joint accelerates with its friction as last found.
    pub fn dry_accelerates(&self, index: usize) -> bool {
        self.friction.as_ref().is_some_and(|friction| friction.accelerates(index) != 0.0)
    }

    /// Where a joint must go from a state of rest, as its friction was last found, if it cannot stay there: one that is held
    /// slides where it would need more than its largest friction, one that slides is held (0) where it would turn back.
    pub fn dry_departure(&self, index: usize) -> Option<f64> {
        let friction = self.friction.as_ref()?;
        let (direction, fraction) = (friction.tractions[index].direction, friction.fractions[index]);
        if direction == 0.0 {
            (fraction.abs() > 1.0).then(|| fraction.signum())
        } else {
            (direction * friction.accelerates(index) < 0.0).then_some(0.0)
        }
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
                friction.gradients[freedom][index] = traction.stiffness * factor;
                friction.gradients[d + freedom][index] = traction.damping * factor;
            }
            friction.gradients[2 * d][index] = along(&joint.driven, |column| {
                let Coordinate { velocity, acceleration, .. } = self.coordinates[column];
                traction.stiffness * velocity + traction.damping * acceleration
            });
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

    /// Friction in a joint on its second body, along its coordinate [N m or N], after [`Dynamics::acceleration`].
    pub fn dry_effort(&self, index: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.efforts[index])
    }

    /// The largest friction that its reaction allows [N m or N], after [`Dynamics::find_friction`].
    pub fn dry_limit(&self, index: usize) -> f64 {
        self.friction.as_ref().map_or(f64::NAN, |friction| friction.limit(index).0)
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
        -self.dry_effort(index) * self.dry_velocity(index)
    }

    /// Calls `supply` with what friction exerts on bodies.
    pub(super) fn each_friction_load(&self, supply: &mut impl FnMut(Option<usize>, Wrench)) {
        for (index, dry) in self.tree.dry_joints.iter().enumerate() {
            let joint = &self.tree.ideal_joints[dry.joint];
            self.supply_effort(Some(joint), joint.bodies, self.dry_effort(index), supply);
        }
    }
}
