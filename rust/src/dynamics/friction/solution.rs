//! The friction of all joints in one state.
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

use super::{Friction, Response, along};
use crate::dynamics::Dynamics;
use crate::numerics::accuracy::{EQUAL, HALF_DIGITS, NEWTON_STEPS, ROUNDING_OF_CHAIN};
use crate::numerics::linear::{lu_factor, lu_solve, symmetric_solve};
use crate::tree::friction::DryJoint;

/// An equation of friction: what is left of it, the size of its terms, its derivatives.
type Equation = (f64, f64, Vec<f64>);

impl Friction<'_> {
    /// Takes over the state of the mechanism, and finds accelerations and multipliers without friction and the responses
    /// to it. False where there are none.
    pub(super) fn follow(&mut self, dynamics: &Dynamics) -> bool {
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
            response.accelerations.clear();
            response.accelerations.resize(self.q.len(), 0.0);
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
    pub(super) fn accelerance(&self, joint: usize, source: usize) -> f64 {
        self.acceleration(joint, &self.responses[source])
    }

    /// Correlation of the motions of two joints: 1 or -1 where neither moves without the other.
    pub(super) fn correlation(&self, joint: usize, other: usize) -> f64 {
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
    pub(super) fn accelerates(&self, joint: usize) -> f64 {
        let (acceleration, size) = self.accelerations(joint);
        if acceleration.abs() <= EQUAL * size { 0.0 } else { acceleration.signum() }
    }

    /// Those of some joints whose motions are independent, on which the motions of the others depend.
    fn independent(&self, joints: &[usize]) -> Vec<usize> {
        let row = |&j: &usize| joints.iter().map(|&k| self.correlation(j, k)).collect();
        let mut rows: Vec<Vec<f64>> = joints.iter().map(row).collect();
        let mut found = Vec::new();
        for (place, &joint) in joints.iter().enumerate() {
            let (done, rest) = rows.split_at_mut(place + 1);
            if done[place][place] > HALF_DIGITS {
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
    pub(super) fn limit(&self, joint: usize) -> (f64, [f64; 2]) {
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
        for _ in 0..NEWTON_STEPS {
            if solved || self.fault.is_some() {
                break;
            }
            let equations = self.equations(held, &pulling);
            solved = equations.iter().all(|(left, size, _)| left.abs() <= ROUNDING_OF_CHAIN * size);
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
    pub(super) fn hold(&mut self, held: &[usize]) -> bool {
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
    pub(super) fn differentiate(&mut self, free: &[usize]) {
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
