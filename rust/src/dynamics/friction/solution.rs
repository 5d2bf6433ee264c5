//! The friction of all joints in one state.
//!
//! Accelerations and reactions are affine in the friction T of all joints, λ = λ₀ + Λ T. Every joint transmits a fraction φ
//! of the largest friction h that its law allows under its reaction,
//!
//! ```text
//! T_j + φ_j h_j(λ_j) = 0
//! ```
//!
//! with φ = ±1 where it slides, and that with which it does not accelerate where it sticks. h_j(Λ_jk) bounds what a change
//! of T_k makes of h_j.
//! Where the matrix of |φ_j| h_j(Λ_jk) has a spectral radius below one there is one solution, which Newton's method finds.
//! For a single joint that slides the bound is exact: from one on there are two solutions or none.
//!
//! How joints at rest share what holds them, equilibrium alone does not say where one of them cannot move without another.
//! They share it as springs would that are loaded together, φ_j = Σ_p C_jp y_p, with the correlation C of their motions. It is
//! ±1 between joints that can only move together: these transmit equal fractions, and slide from the same instant on.

use super::{Equations, Friction, Response, along};
use crate::contact::friction::JointPhase;
use crate::dynamics::Dynamics;
use crate::numerics::accuracy::{HALF_DIGITS, NEWTON_STEPS, ROUNDING_OF_CHAIN, ROUNDING_OF_SOLUTION};
use crate::numerics::linear::{lu_factor, lu_solve, symmetric_solve};

impl Equations {
    fn factor(&mut self, count: usize) -> bool {
        let (weights, pivots) = (&mut self.weights[..count], &mut self.pivots[..count]);
        lu_factor(&mut self.matrix[..count * count], count, weights, pivots)
    }

    fn solve(&self, count: usize, right: &mut [f64]) {
        lu_solve(&self.matrix[..count * count], count, &self.pivots[..count], &mut right[..count]);
    }

    /// Eliminates a column of a square matrix from the rows below its diagonal, if the pivot there is above the least one;
    /// returns the pivot.
    fn eliminate(&mut self, place: usize, count: usize, least: f64) -> f64 {
        let (above, below) = self.matrix[..count * count].split_at_mut((place + 1) * count);
        let row = &above[place * count..];
        if row[place] > least {
            for other in below.chunks_exact_mut(count) {
                let factor = other[place] / row[place];
                other.iter_mut().zip(row).for_each(|(entry, above)| *entry -= factor * above);
            }
        }
        row[place]
    }
}

impl Friction<'_> {
    /// Finds the friction of all joints in the state of the mechanism, unless it is known; false where there is not one
    /// solution. What nothing can hold goes as the others let it, with an infinite fraction.
    pub(super) fn find(&mut self, dynamics: &Dynamics) -> bool {
        if !self.is_at(dynamics) {
            self.follows = self.follow(dynamics);
            self.found = None;
        }
        if let Some(found) = self.found {
            return found;
        }
        let found = self.follows && self.hold();
        self.found = Some(found);
        found
    }

    /// Whether the state that was last followed is that of the mechanism.
    fn is_at(&self, dynamics: &Dynamics) -> bool {
        let Self { reacting, other, .. } = self;
        let mut columns = other.columns.iter().zip(&dynamics.turns);
        let mut freedoms = other.freedoms.iter().zip(&dynamics.tree.free);
        reacting.t == dynamics.t
            && reacting.phases == dynamics.phases
            && reacting.switches == dynamics.switches
            && columns.all(|(&column, turns)| reacting.turns[column] == *turns)
            && freedoms.all(|(&freedom, &column)| {
                let coordinate = &dynamics.coordinates[column];
                (self.q[freedom], self.v[freedom]) == (coordinate.position, coordinate.velocity)
            })
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
        self.kept.multipliers.copy_from_slice(&reacting.loops.multipliers);
        let count = self.joints.len();
        for (source, (response, joint)) in self.responses.iter_mut().zip(self.joints).enumerate() {
            response.accelerations.fill(0.0);
            joint.reacting.iter().for_each(|&(freedom, factor)| response.accelerations[freedom] = factor);
            symmetric_solve(&reacting.mass, self.q.len(), &mut response.accelerations);
            response.without_loops = along(&joint.reacting, |freedom| response.accelerations[freedom]);
            reacting.loops.right.fill(0.0);
            reacting.loops.correct(&mut response.accelerations);
            response.multipliers.copy_from_slice(&reacting.loops.right);
            for (place, other) in self.joints.iter().enumerate() {
                let place = place * count + source;
                self.accelerances[place] = along(&other.reacting, |freedom| response.accelerations[freedom]);
                self.influences[place] = other.rows.map(|row| response.multipliers[row]);
            }
        }
        for (driven, joint) in self.driven.iter_mut().zip(self.joints) {
            *driven = along(&joint.driven, |column| dynamics.coordinates[column].acceleration);
        }
        true
    }

    /// What friction of size one in a joint adds to the acceleration of another.
    pub(super) fn accelerance(&self, joint: usize, source: usize) -> f64 {
        self.accelerances[joint * self.joints.len() + source]
    }

    /// Whether friction can move a joint: not where drives prescribe its motion.
    pub(super) fn moves(&self, joint: usize) -> bool {
        self.accelerance(joint, joint) > ROUNDING_OF_SOLUTION * self.responses[joint].without_loops
    }

    /// Correlation of the motions of two joints: exactly 1 or -1 where neither moves without the other.
    pub(super) fn correlation(&self, joint: usize, other: usize) -> f64 {
        let own = self.accelerance(joint, joint) * self.accelerance(other, other);
        let correlation = self.accelerance(joint, other) / own.sqrt();
        if 1.0 - correlation * correlation <= HALF_DIGITS { correlation.signum() } else { correlation }
    }

    /// Acceleration of a joint, and the size of its terms.
    fn accelerations(&self, joint: usize) -> (f64, f64) {
        let kept = along(&self.joints[joint].reacting, |freedom| self.kept.accelerations[freedom]);
        let alone = kept + self.driven[joint];
        let terms = self.efforts.iter().enumerate().map(|(k, effort)| self.accelerance(joint, k) * effort);
        terms.fold((alone, alone.abs()), |(sum, size), term| (sum + term, size + term.abs()))
    }

    /// Direction in which a joint accelerates from rest; zero within rounding errors.
    pub(super) fn accelerates(&self, joint: usize) -> f64 {
        let (acceleration, size) = self.accelerations(joint);
        if acceleration.abs() <= ROUNDING_OF_SOLUTION * size { 0.0 } else { acceleration.signum() }
    }

    /// Selects joints, and those of them whose motions are independent, on which the motions of the others depend.
    pub(super) fn select(&mut self, is_held: impl Fn(usize, &JointPhase) -> bool) {
        self.held.clear();
        for joint in 0..self.joints.len() {
            if is_held(joint, &self.phases[joint]) && self.moves(joint) {
                self.held.push(joint);
            }
        }
        let count = self.held.len();
        for (row, &joint) in self.held.iter().enumerate() {
            for (column, &other) in self.held.iter().enumerate() {
                self.equations.matrix[row * count + column] = self.correlation(joint, other);
            }
        }
        self.pulling.clear();
        for place in 0..count {
            if self.equations.eliminate(place, count, HALF_DIGITS) > HALF_DIGITS {
                self.pulling.push(self.held[place]);
            }
        }
        self.pulls.clear();
        self.pulls.resize(self.pulling.len(), 0.0);
    }

    /// The fraction that a joint transmits: none where nothing can hold it.
    fn transmitted(&self, joint: usize) -> f64 {
        Some(self.fractions[joint]).filter(|fraction| fraction.is_finite()).unwrap_or_default()
    }

    /// What friction of size one in a joint adds to the reaction of another.
    fn influence(&self, joint: usize, source: usize) -> [f64; 2] {
        self.influences[joint * self.joints.len() + source]
    }

    /// The largest friction of a joint under its present reaction, and its derivatives.
    pub(super) fn limit(&self, joint: usize) -> (f64, [f64; 2]) {
        let [mut first, mut second] = self.joints[joint].rows.map(|row| self.kept.multipliers[row]);
        for (source, effort) in self.efforts.iter().enumerate() {
            let [by_first, by_second] = self.influence(joint, source);
            (first, second) = (first + effort * by_first, second + effort * by_second);
        }
        self.joints[joint].law.limit([first, second])
    }

    /// Whether friction of the joints that slide has one solution; otherwise a joint and its bound. The spectral radius is
    /// below one where all pivots of one less the bounds are positive.
    fn check(&mut self) -> Option<(usize, f64)> {
        let count = self.joints.len();
        for j in 0..count {
            for k in 0..count {
                let bound = self.fractions[j].abs() * self.joints[j].law.limit(self.influence(j, k)).0;
                self.equations.matrix[j * count + k] = f64::from(j == k) - bound;
            }
        }
        (0..count).find_map(|place| {
            let pivot = self.equations.eliminate(place, count, 0.0);
            (pivot.is_nan() || pivot <= 0.0).then_some((place, 1.0 - pivot))
        })
    }

    /// Writes the equations of all joints, and of those on whose pulls the fractions of the held ones depend: these must not
    /// accelerate. Derivatives are with respect to friction and pulls. Returns their number.
    fn write_equations(&mut self) -> usize {
        let joints = self.joints.len();
        let count = joints + self.pulling.len();
        for j in 0..joints {
            let (law, fraction) = (self.joints[j].law, self.transmitted(j));
            let (limit, [x, y]) = self.limit(j);
            let mut size = law.limit(self.joints[j].rows.map(|row| self.kept.multipliers[row])).0;
            for k in 0..joints {
                let [by_x, by_y] = self.influence(j, k);
                self.equations.matrix[j * count + k] = f64::from(j == k) + fraction * (x * by_x + y * by_y);
                size += self.efforts[k].abs() * law.limit([by_x, by_y]).0;
            }
            // One that is held may need many times its largest friction, before it slides.
            let mut most = 1.0;
            for (place, &p) in self.pulling.iter().enumerate() {
                let part = if self.held.contains(&j) { self.correlation(j, p) } else { 0.0 };
                self.equations.matrix[j * count + joints + place] = limit * part;
                most = f64::max(most, (part * self.pulls[place]).abs());
            }
            self.equations.left[j] = self.efforts[j] + fraction * limit;
            self.equations.sizes[j] = size * most;
        }
        for (place, &p) in self.pulling.iter().enumerate() {
            let (own, (left, size)) = (self.accelerance(p, p), self.accelerations(p));
            let row = joints + place;
            for k in 0..joints {
                self.equations.matrix[row * count + k] = self.accelerance(p, k) / own;
            }
            self.equations.matrix[row * count + joints..(row + 1) * count].fill(0.0);
            (self.equations.left[row], self.equations.sizes[row]) = (left / own, size / own);
        }
        count
    }

    /// Finds the friction of all joints, and the fractions with which those that stick hold each other without acceleration;
    /// false where there is not one solution.
    fn solve(&mut self) -> bool {
        self.efforts.fill(0.0);
        for (fraction, phase) in self.fractions.iter_mut().zip(&self.phases) {
            *fraction = phase.direction();
        }
        self.fault = self.check();
        let mut solved = false;
        for _ in 0..NEWTON_STEPS {
            if solved || self.fault.is_some() {
                break;
            }
            let count = self.write_equations();
            let Equations { left, sizes, .. } = &self.equations;
            let mut both = left[..count].iter().zip(sizes);
            solved = both.all(|(left, size)| left.abs() <= ROUNDING_OF_CHAIN * size);
            if !self.equations.factor(count) {
                return solved;
            }
            let mut change = std::mem::take(&mut self.equations.left);
            self.equations.solve(count, &mut change);
            let unknowns = self.efforts.iter_mut().chain(&mut self.pulls);
            unknowns.zip(&change).for_each(|(value, change)| *value -= change);
            self.equations.left = change;
            for &j in &self.held {
                let terms = self.pulling.iter().zip(&self.pulls);
                self.fractions[j] = terms.map(|(&p, pull)| self.correlation(j, p) * pull).sum();
            }
        }
        solved && self.efforts.iter().all(|effort| effort.is_finite())
    }

    fn hold(&mut self) -> bool {
        self.select(|_, phase| phase.sticks());
        let solved = self.solve();
        if solved || self.held.is_empty() || self.fault.is_some() {
            return solved;
        }
        let held = std::mem::take(&mut self.held);
        self.pulling.clear();
        self.pulls.clear();
        let found = self.solve();
        for &joint in &held {
            self.fractions[joint] = self.accelerations(joint).0.signum() * f64::INFINITY;
        }
        self.held = held;
        found
    }

    /// Takes back from positions, velocities or accelerations what they are `off` in the selected joints.
    pub(super) fn take_back(&mut self, off: impl Fn(usize, &[f64]) -> f64, state: &mut [f64]) {
        let count = self.pulling.len();
        if count == 0 {
            return;
        }
        for (row, &joint) in self.pulling.iter().enumerate() {
            self.equations.left[row] = off(joint, state);
            for (column, &source) in self.pulling.iter().enumerate() {
                self.equations.matrix[row * count + column] = self.accelerance(joint, source);
            }
        }
        if !self.equations.factor(count) {
            return;
        }
        let mut change = std::mem::take(&mut self.equations.left);
        self.equations.solve(count, &mut change);
        for (&source, change) in self.pulling.iter().zip(&change) {
            let by = &self.responses[source].accelerations;
            for (value, &freedom) in state.iter_mut().zip(&self.other.freedoms) {
                *value -= change * by[freedom];
            }
        }
        self.equations.left = change;
    }

    /// Finds the gradients of friction, where what sticks has no acceleration. Joints that hold more than they must share it
    /// as they do in this state.
    pub(super) fn differentiate(&mut self, dynamics: &Dynamics) {
        let tree = dynamics.tree;
        let count = self.write_equations();
        if !self.equations.factor(count) {
            // A joint without any load sticks.
            self.gradients.iter_mut().for_each(|gradient| gradient.fill(0.0));
            return;
        }
        let d = tree.free.len();
        let Response { accelerations, multipliers, .. } = &mut self.whole;
        accelerations.copy_from_slice(&self.kept.accelerations);
        multipliers.copy_from_slice(&self.kept.multipliers);
        for (effort, response) in self.efforts.iter().zip(&self.responses) {
            accelerations.iter_mut().zip(&response.accelerations).for_each(|(sum, by)| *sum += effort * by);
            multipliers.iter_mut().zip(&response.multipliers).for_each(|(sum, by)| *sum += effort * by);
        }
        let reacting = &mut *self.reacting;
        reacting.accelerate(accelerations);
        reacting.loops.multipliers.copy_from_slice(multipliers);
        reacting.find_residual_derivatives();
        let mut gradients = std::mem::take(&mut self.gradients);
        for (place, gradient) in gradients.iter_mut().enumerate() {
            // The change of the multipliers with all friction kept is left in the memory of the loops.
            let column = |freedom: usize| self.other.columns[tree.free[freedom]];
            let accelerations = &mut self.whole.accelerations;
            self.reacting.accelerations_by(accelerations, |this, row| match place {
                _ if place < d => this.residual_by_position(row, column(place)),
                _ if place < 2 * d => this.residual_by_velocity(row, column(place - d)),
                _ => this.residual_by_time(row),
            });
            for (j, joint) in self.joints.iter().enumerate() {
                let [by_x, by_y] = joint.rows.map(|row| self.reacting.loops.right[row]);
                let (_, [x, y]) = self.limit(j);
                gradient[j] = -self.transmitted(j) * (x * by_x + y * by_y);
            }
            for (row, &p) in (self.joints.len()..).zip(&self.pulling) {
                let joint = &self.joints[p];
                let mut change = along(&joint.reacting, |freedom| self.whole.accelerations[freedom]);
                if place == 2 * d {
                    let jerk = |column| {
                        let index = tree.driven.iter().position(|driven| driven.column == column);
                        index.map_or(0.0, |index| dynamics.jerks[index])
                    };
                    change += along(&joint.driven, jerk);
                }
                gradient[row] = -change / self.accelerance(p, p);
            }
            self.equations.solve(count, gradient);
        }
        self.gradients = gradients;
    }
}
