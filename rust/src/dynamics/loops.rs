//! Closed kinematic loops: Lagrange multipliers by a Schur complement, projection, derivatives.
//!
//! A closure keeps two points together; its gap is the distance between them, zero in every exact state.

use super::Dynamics;
use crate::numerics::linear::{symmetric_factor, symmetric_solve};
use crate::tree::elements::Scales;
use crate::tree::kinematics::{PointState, Vec2};

/// Most Newton steps of a projection. Two usually suffice; a step of a motion that drives prescribe takes up
/// to ten.
const PROJECTIONS: usize = 20;
/// Largest gap relative to the positions, and gap rate relative to the velocities, that count as rounding.
/// For comparison, steps at a tight tolerance left gaps of at most 2.5 ε times the size of a six-bar or quick
/// return and gap rates of 1.9 ε times its speed; the medians were 0.45 ε and 0.3 ε.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Pivot of the Schur complement relative to its diagonal below which the closures count as
/// dependent: the state is a dead center or change point to within a few hundred rounding errors.
const SINGULAR_PIVOT: f64 = 1e-13;

/// The closed loops, linear algebra of `[M Eᵀ; E 0]` by its Schur complement; all empty in a tree.
#[derive(Clone, Debug, Default)]
pub(super) struct Loops {
    /// E = ∂(p_b - p_a)/∂z for the free coordinates: two rows a closure.
    pub(super) e: Vec<f64>,
    /// M⁻¹ Eᵀ, transposed: row r is M⁻¹ (row r of E).
    pub(super) y: Vec<f64>,
    /// Factor of S = E M⁻¹ Eᵀ.
    pub(super) s: Vec<f64>,
    /// Lagrange multipliers λ [N]: the force on point b is -λ.
    pub(super) multipliers: Vec<f64>,
    /// Derivatives of the closure accelerations with respect to (q, v) of every column.
    pub(super) acceleration_q: Vec<f64>,
    pub(super) acceleration_v: Vec<f64>,
    /// Right-hand sides of the Schur complement.
    pub(super) right: Vec<f64>,
}

impl Loops {
    pub(super) fn new(rows: usize, d: usize, columns: usize) -> Self {
        Self {
            e: vec![0.0; rows * d],
            y: vec![0.0; rows * d],
            s: vec![0.0; rows * rows],
            multipliers: vec![0.0; rows],
            acceleration_q: vec![0.0; rows * columns],
            acceleration_v: vec![0.0; rows * columns],
            right: vec![0.0; rows],
        }
    }

    /// Corrects `x` to satisfy `E x + c = 0`, with the smallest change in the metric of the mass matrix. On
    /// entry `right` holds c; on return it holds the multipliers of the correction.
    pub(super) fn correct(&mut self, x: &mut [f64]) {
        let rows = self.right.len();
        let d = x.len();
        for (right, row) in self.right.iter_mut().zip(self.e.chunks_exact(d.max(1))) {
            *right += row.iter().zip(&*x).map(|(e, x)| e * x).sum::<f64>();
        }
        symmetric_solve(&self.s, rows, &mut self.right);
        for (multiplier, row) in self.right.iter().zip(self.y.chunks_exact(d.max(1))) {
            for (x, y) in x.iter_mut().zip(row) {
                *x -= y * multiplier;
            }
        }
    }
}

/// Size of a projection onto the loop closures. Coordinates are multiplied by their levers: the largest
/// distance that a point moves per unit of the coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Correction {
    /// Largest change of a coordinate times its lever [m].
    pub position: f64,
    /// Largest change of a velocity times its lever [m/s].
    pub velocity: f64,
    /// Whether the gaps were rounding errors alone. Near a dead center these may still move a coordinate far.
    pub rounded_position: bool,
    /// Whether the gap rates were rounding errors alone.
    pub rounded_velocity: bool,
}

impl Dynamics<'_> {
    /// Adds the effect of the forces in the loop closures to accelerations computed without them; false in a
    /// singular configuration. Called after [`Dynamics::move_to`], with the mass matrix factored.
    pub(super) fn close_accelerations(&mut self, a: &mut [f64]) -> bool {
        let tree = self.tree;
        let d = a.len();
        let rows = 2 * tree.closures.len();
        self.loops.e.fill(0.0);
        for (index, closure) in tree.closures.iter().enumerate() {
            let mut bias = Vec2::zeros();
            for (point, sign) in [(closure.b, 1.0), (closure.a, -1.0)] {
                let state = self.point(point);
                bias += sign * state.acceleration;
                for &(column, i) in &tree.paths[point.frame].free {
                    let (b, _) = self.column(column, state.position);
                    self.loops.e[2 * index * d + i] += sign * b.x;
                    self.loops.e[(2 * index + 1) * d + i] += sign * b.y;
                }
            }
            self.loops.right[2 * index] = bias.x;
            self.loops.right[2 * index + 1] = bias.y;
        }
        let loops = &mut self.loops;
        loops.y.copy_from_slice(&loops.e);
        for row in loops.y.chunks_exact_mut(d.max(1)) {
            symmetric_solve(&self.mass, d, row);
        }
        for r in 0..rows {
            // The lower triangle: S is symmetric.
            for c in 0..=r {
                let (e, y) = (&loops.e[r * d..(r + 1) * d], &loops.y[c * d..(c + 1) * d]);
                loops.s[r * rows + c] = e.iter().zip(y).map(|(e, y)| e * y).sum();
            }
        }
        for r in 0..rows {
            loops.multipliers[r] = loops.s[r * rows + r];
        }
        if !symmetric_factor(&mut loops.s, rows) {
            return false;
        }
        // The factor holds inverse pivots. The diagonal of S was saved in `multipliers`, which are not yet
        // needed.
        let singular = |r: usize| 1.0 / loops.s[r * rows + r] < SINGULAR_PIVOT * loops.multipliers[r];
        if (0..rows).any(singular) {
            return false;
        }
        loops.correct(a);
        loops.multipliers.copy_from_slice(&loops.right);
        true
    }

    /// Projects a state that nearly closes the loops onto the closures, in the metric of the mass matrix:
    /// positions by Newton's method, then velocities. Returns the size of the correction, or `None` in
    /// a singular configuration or where Newton's method does not converge.
    pub fn project(&mut self, t: f64, q: &mut [f64], v: &mut [f64], scales: &Scales) -> Option<Correction> {
        let mut correction =
            Correction { rounded_position: true, rounded_velocity: true, ..Correction::default() };
        let mut closed = self.tree.closures.is_empty();
        let mut a = std::mem::take(&mut self.scratch);
        for _ in 0..PROJECTIONS {
            if closed || !self.acceleration(t, q, v, &mut a) {
                break;
            }
            let [closes, stays] = self.is_closed(q, v, scales);
            closed = closes;
            correction.rounded_position &= closed;
            correction.position =
                correction.position.max(self.close(q, &scales.levers, &mut a, |point| point.position));
            if closed {
                // The positions changed by rounding alone since the velocities were tested.
                correction.rounded_velocity = stays;
                correction.velocity = self.close(v, &scales.levers, &mut a, |point| point.velocity);
            }
        }
        self.scratch = a;
        closed.then_some(correction)
    }

    /// Whether all gaps, and whether all gap rates, are rounding errors alone, after
    /// [`Dynamics::move_to`].
    fn is_closed(&self, q: &[f64], v: &[f64], scales: &Scales) -> [bool; 2] {
        let largest = |of: &[f64]| {
            of.iter().zip(&scales.levers).map(|(x, lever)| (x * lever).abs()).fold(0.0, f64::max)
        };
        // The rounding error of a large angle counts at the size of the mechanism. The velocity of a point
        // may be a sum of much larger terms, whose rounding errors count.
        let (size, speed) = (scales.length + largest(q), scales.speed + largest(v));
        let meet = |a: Vec2, b: Vec2, scale: f64| (b - a).amax() <= ROUNDING * (a.amax() + b.amax() + scale);
        self.tree.closures.iter().fold([true; 2], |[closed, stays], closure| {
            let (a, b) = (self.point(closure.a), self.point(closure.b));
            [closed && meet(a.position, b.position, size), stays && meet(a.velocity, b.velocity, speed)]
        })
    }

    /// One correction of `x`, positions or velocities, toward closed loops; returns the largest change times
    /// its lever.
    fn close(
        &mut self,
        x: &mut [f64],
        levers: &[f64],
        change: &mut [f64],
        of: impl Fn(PointState) -> Vec2,
    ) -> f64 {
        for (index, closure) in self.tree.closures.iter().enumerate() {
            let gap = of(self.point(closure.b)) - of(self.point(closure.a));
            self.loops.right[2 * index] = gap.x;
            self.loops.right[2 * index + 1] = gap.y;
        }
        change.fill(0.0);
        self.loops.correct(change);
        let mut largest = 0.0_f64;
        for ((x, change), lever) in x.iter_mut().zip(change).zip(levers) {
            *x += *change;
            largest = largest.max((*change * lever).abs());
        }
        largest
    }

    /// Adds the derivatives of Eᵀ λ with fixed λ to the residual, and computes those of the relative
    /// accelerations of the closures.
    pub(super) fn add_closure_derivatives(&mut self) {
        let tree = self.tree;
        let columns = self.coordinates.len();
        self.loops.acceleration_q.fill(0.0);
        self.loops.acceleration_v.fill(0.0);
        for (index, closure) in tree.closures.iter().enumerate() {
            let force = Vec2::new(self.loops.multipliers[2 * index], self.loops.multipliers[2 * index + 1]);
            for (point, sign) in [(closure.b, 1.0), (closure.a, -1.0)] {
                let state = self.point(point);
                let path = &tree.paths[point.frame];
                for &k in &path.columns {
                    let frame = &self.states[k + 1];
                    let by_position = sign * frame.acceleration_column(state.acceleration);
                    let by_velocity = 2.0 * sign * frame.velocity_column(state.velocity);
                    for axis in 0..2 {
                        let place = (2 * index + axis) * columns + k;
                        self.loops.acceleration_q[place] += by_position[axis];
                        self.loops.acceleration_v[place] += by_velocity[axis];
                    }
                    for &(column, i) in &path.free {
                        self.residual_q[i * columns + k] +=
                            sign * self.second_column(column, k, state.position).dot(&force);
                    }
                }
            }
        }
    }

    /// Adds the contribution of the third time derivative of a driven coordinate to the time derivative of
    /// the relative accelerations of the closures.
    pub(super) fn add_closure_jerks(&mut self, driven: usize, jerk: f64) {
        let tree = self.tree;
        let d = tree.free.len();
        for (index, closure) in tree.closures.iter().enumerate() {
            for (point, sign) in [(closure.b, 1.0), (closure.a, -1.0)] {
                if tree.paths[point.frame].columns.binary_search(&driven).is_ok() {
                    let (by, _) = self.column(driven, self.point(point).position);
                    self.residual_t[d + 2 * index] += sign * by.x * jerk;
                    self.residual_t[d + 2 * index + 1] += sign * by.y * jerk;
                }
            }
        }
    }
}
