//! Closed kinematic loops: Lagrange multipliers by a Schur complement, derivatives.
//!
//! A closure keeps two points together; its gap is the distance between them, zero in every exact state. In: the frames in a
//! state and accelerations without loops; out: those with closed loops, projected states. Uses `numerics`, `tree`.

mod massless;
mod projection;
mod variation;

pub use projection::Correction;
pub use variation::FirstOrder;

use std::ops::Range;

use super::Dynamics;
use crate::numerics::linear::{symmetric_factor, symmetric_solve};
use crate::tree::elements::CLOSURE_ROWS;
use crate::tree::kinematics::Vec2;

/// Pivot of the Schur complement, relative to the accelerance of its closure, below which the closures count as nearly
/// dependent: the state is near a change point. With an angle of about σ between the closures, whose square the pivot
/// is, a rounding error ε of the gaps moves positions by ε/σ and velocities by ε/σ²: ε^(2/3) at this bound, ε^(1/3),
/// below the tolerances of runs. Half, twice: work +6, -4 % (6 of 150 runs).
const NEARLY_DEPENDENT: f64 = 6.055e-6;
/// Damping of nearly dependent closures, relative to the accelerance: they do not act within an angle σ of its square
/// root, so that a step can pass over a change point. The motion across the closures then misses their acceleration for
/// a time in proportion to σ, and its velocity is off by about σ; rounding errors of the gaps that enter there give it
/// ε/σ². Both are least at σ = ε^(1/3). The motion along the closures is off by the square of that.
/// Half, twice: work -4, +10 % (37 of 46 runs).
const DAMPING: f64 = 3.667e-11;

/// The closed loops, linear algebra of `[M Eᵀ; E 0]` by its Schur complement; all empty in a tree.
#[derive(Clone, Debug, Default)]
pub(super) struct Loops {
    /// The rows of every closure.
    closures: Vec<Range<usize>>,
    /// E = ∂(p_b - p_a)/∂z for the free coordinates.
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
    /// Diagonal of W where the mass matrix is that with the closures; else empty.
    pub(super) row_masses: Vec<f64>,
    /// Smallest pivot relative to the accelerance of its closure, where the closures are nearly dependent, and that closure
    /// or coupling.
    weakest_pivot: f64,
    weakest: usize,
    /// Whether the closures are nearly dependent, so that `s` is damped.
    nearly_dependent: bool,
    /// What damping adds to the diagonal of S, the factor of S without it if there is one, and scratch memory.
    damping: Vec<f64>,
    undamped: Option<Vec<f64>>,
    scratch: Vec<f64>,
}

impl Loops {
    /// `counts` are the numbers of rows of the closures, `row_masses` what each adds to a mass matrix that may be singular.
    pub(super) fn new(
        counts: impl Iterator<Item = usize>,
        row_masses: Vec<f64>,
        d: usize,
        columns: usize,
    ) -> Self {
        let mut rows = 0;
        let closures = counts.map(|count| {
            rows += count;
            rows - count..rows
        });
        Self {
            closures: closures.collect(),
            e: vec![0.0; rows * d],
            y: vec![0.0; rows * d],
            s: vec![0.0; rows * rows],
            multipliers: vec![0.0; rows],
            acceleration_q: vec![0.0; rows * columns],
            acceleration_v: vec![0.0; rows * columns],
            right: vec![0.0; rows],
            row_masses,
            weakest_pivot: 1.0,
            weakest: 0,
            nearly_dependent: false,
            damping: vec![0.0; rows],
            undamped: None,
            scratch: vec![0.0; rows],
        }
    }

    /// Corrects `x` to satisfy `E x + c = 0`, with the smallest change in the metric of the mass matrix. On
    /// entry `right` holds c; on return it holds the multipliers of the correction.
    pub(super) fn correct(&mut self, x: &mut [f64]) {
        if self.row_masses.is_empty() { self.correct_by_multipliers(x) } else { self.correct_with_rows(x) }
    }

    /// The same where the factor is that of the mass matrix with the closures, which makes λ + W c of the multipliers λ.
    #[inline(never)]
    fn correct_with_rows(&mut self, x: &mut [f64]) {
        let by_rows: Vec<f64> = self.row_masses.iter().zip(&self.right).map(|(mass, c)| mass * c).collect();
        self.correct_by_multipliers(x);
        self.right.iter_mut().zip(by_rows).for_each(|(multiplier, by)| *multiplier -= by);
    }

    #[inline(always)]
    fn correct_by_multipliers(&mut self, x: &mut [f64]) {
        let rows = self.right.len();
        let d = x.len();
        for (right, row) in self.right.iter_mut().zip(self.e.chunks_exact(d.max(1))) {
            *right += row.iter().zip(&*x).map(|(e, x)| e * x).sum::<f64>();
        }
        symmetric_solve(&self.s, rows, &mut self.right);
        if self.nearly_dependent {
            // One refinement: multipliers of directions that are far from dependent keep their digits.
            for ((scratch, damping), multiplier) in
                self.scratch.iter_mut().zip(&self.damping).zip(&self.right)
            {
                *scratch = damping * multiplier;
            }
            symmetric_solve(&self.s, rows, &mut self.scratch);
            for (multiplier, scratch) in self.right.iter_mut().zip(&self.scratch) {
                *multiplier += scratch;
            }
        }
        for (multiplier, row) in self.right.iter().zip(self.y.chunks_exact(d.max(1))) {
            for (x, y) in x.iter_mut().zip(row) {
                *x -= y * multiplier;
            }
        }
    }

    /// The same without damping, where there is a factor without it.
    fn correct_undamped(&mut self, x: &mut [f64]) {
        if !self.nearly_dependent {
            return self.correct(x);
        }
        let Some(undamped) = self.undamped.take() else { return self.correct(x) };
        let damped = std::mem::replace(&mut self.s, undamped);
        let nearly_dependent = std::mem::take(&mut self.nearly_dependent);
        self.correct(x);
        self.undamped = Some(std::mem::replace(&mut self.s, damped));
        self.nearly_dependent = nearly_dependent;
    }

    /// Computes S.
    fn write_schur_complement(&mut self, d: usize) {
        let rows = self.right.len();
        for r in 0..rows {
            // The lower triangle: S is symmetric.
            for c in 0..=r {
                let (e, y) = (&self.e[r * d..(r + 1) * d], &self.y[c * d..(c + 1) * d]);
                self.s[r * rows + c] = e.iter().zip(y).map(|(e, y)| e * y).sum();
            }
        }
    }

    /// Factors S, damped if the closures are nearly dependent; false where that is impossible. `weights` are those of
    /// the coordinates in a metric of the geometry alone.
    fn factor(&mut self, d: usize, weights: impl Fn(&[f64]) -> Vec<f64>) -> bool {
        let rows = self.right.len();
        self.write_schur_complement(d);
        for r in 0..rows {
            self.scratch[r] = self.s[r * rows + r];
        }
        let regular = symmetric_factor(&mut self.s, rows);
        self.nearly_dependent = false;
        if regular && self.are_strong(&self.s, &self.scratch) {
            return true;
        }
        self.undamped = None;
        if self.are_independent(d, &weights(&self.e)) {
            // Some bodies are much heavier than others.
            return regular;
        }
        self.nearly_dependent = true;
        (self.weakest_pivot, self.weakest) = if regular { self.find_weakest_pivot() } else { (0.0, 0) };
        self.undamped = regular.then(|| self.s.clone());
        self.write_schur_complement(d);
        for closure in &self.closures {
            let damping = DAMPING * accelerance(&self.scratch, closure);
            for r in closure.clone() {
                self.damping[r] = damping;
                self.s[r * rows + r] += damping;
            }
        }
        symmetric_factor(&mut self.s, rows)
    }

    /// Whether the closures are far from dependent in a metric of the coordinates with these weights.
    fn are_independent(&self, d: usize, weights: &[f64]) -> bool {
        let rows = self.right.len();
        let mut gram = vec![0.0; rows * rows];
        for r in 0..rows {
            for c in 0..=r {
                let (one, other) = (&self.e[r * d..(r + 1) * d], &self.e[c * d..(c + 1) * d]);
                gram[r * rows + c] =
                    weights.iter().zip(one.iter().zip(other)).map(|(w, (a, b))| w * a * b).sum();
            }
        }
        let diagonal: Vec<f64> = (0..rows).map(|r| gram[r * rows + r]).collect();
        symmetric_factor(&mut gram, rows) && self.are_strong(&gram, &diagonal)
    }

    /// Whether all pivots are above [`NEARLY_DEPENDENT`].
    fn are_strong(&self, factor: &[f64], diagonal: &[f64]) -> bool {
        self.closures.iter().all(|rows| {
            let accelerance = accelerance(diagonal, rows);
            // The factor holds inverse pivots.
            let mut pivots = rows.clone().map(|r| factor[r * diagonal.len() + r]);
            pivots.all(|inverse| NEARLY_DEPENDENT * inverse * accelerance <= 1.0)
        })
    }

    /// Smallest pivot of the factor of S relative to the accelerance of its closure, whose diagonal is in the scratch
    /// memory, and the index of that.
    fn find_weakest_pivot(&self) -> (f64, usize) {
        let count = self.right.len();
        let pivots = self.closures.iter().enumerate().flat_map(|(index, rows)| {
            let accelerance = accelerance(&self.scratch, rows);
            rows.clone().map(move |r| (1.0 / (self.s[r * count + r] * accelerance), index))
        });
        pivots.fold((f64::INFINITY, 0), |least, pivot| if pivot.0 < least.0 { pivot } else { least })
    }
}

/// Sum of the diagonal entries of a closure. Unlike one of them it does not depend on the axes.
fn accelerance(diagonal: &[f64], rows: &Range<usize>) -> f64 {
    diagonal[rows.clone()].iter().sum()
}

impl Dynamics<'_> {
    /// Writes the rows of all closures, and what their accelerations are without those of the free coordinates, after
    /// [`Dynamics::move_to`].
    #[inline(always)]
    pub(super) fn write_rows(&mut self, d: usize) {
        let tree = self.tree;
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
        if !tree.couplings.is_empty() {
            self.write_coupling_rows(d);
        }
        if !tree.locks.is_empty() {
            self.write_lock_rows(d);
        }
    }

    /// Adds the effect of the forces in the loop closures to accelerations computed without them; false in a
    /// singular configuration. Called after [`Dynamics::move_to`], with the mass matrix factored.
    pub(super) fn close_accelerations(&mut self, a: &mut [f64]) -> bool {
        let tree = self.tree;
        let d = a.len();
        if !self.composites.are_light() {
            self.write_rows(d);
        }
        let loops = &mut self.loops;
        loops.y.copy_from_slice(&loops.e);
        for row in loops.y.chunks_exact_mut(d.max(1)) {
            symmetric_solve(&self.mass, d, row);
        }
        let weights = |e: &[f64]| {
            let turns = |freedom: usize| tree.frames[tree.free[freedom] + 1].kind.rotation() != 0.0;
            let entries = e.iter().enumerate().filter(|(place, _)| turns(place % d));
            // Rows of couplings have no arms.
            let entries = entries.take_while(|(place, _)| place / d < CLOSURE_ROWS * tree.closures.len());
            let arm = entries.map(|(_, entry)| entry.abs()).fold(0.0, f64::max);
            let arm = if tree.closures.is_empty() { 1.0 } else { arm };
            (0..d).map(|freedom| if turns(freedom) { 1.0 / (arm * arm) } else { 1.0 }).collect()
        };
        if !loops.factor(d, weights) {
            return false;
        }
        loops.correct(a);
        loops.multipliers.copy_from_slice(&loops.right);
        true
    }

    /// Writes the rows of the locks, whose coordinates have no acceleration of their own.
    fn write_lock_rows(&mut self, d: usize) {
        let first = self.loops.right.len() - self.tree.locks.len();
        for (row, column) in (first..).zip(&self.tree.locks) {
            self.loops.right[row] = 0.0;
            if let Ok(freedom) = self.tree.free.binary_search(column) {
                self.loops.e[row * d + freedom] = 1.0;
            }
        }
    }

    /// Declares the forces in the closures unknown.
    pub fn forget_closure_forces(&mut self) {
        self.loops.multipliers.fill(f64::NAN);
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
        self.add_coupling_derivatives();
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
        self.add_coupling_jerks(driven, jerk);
    }
}
