//! A step with its error estimate and the polynomial through it.

use crate::integrators::HybridSystem;
use crate::integrators::adams::coefficients::{Alphas, integrals_to};
use crate::numerics::instant::Instant;
use crate::numerics::linear::lu_solve;

/// Form of the polynomial through a step.
#[derive(Clone, Debug, Default)]
pub(super) enum Form {
    /// Of one-step methods: `y(t + θh) = (1-θ) y₀ + θ (y₁ + (1-θ) (K₁ + θ K₂ + θ² K₃ + ...))`; a row K_r holds
    /// (q, v).
    #[default]
    Powers,
    /// Of the Adams method: accelerations `Σ c_i(θ) D_i`, whose integrals are velocities and positions; a row D_i
    /// holds accelerations. A step has few samples, and to find the powers of θ costs as much as four.
    Differences(Alphas),
}

/// The factors of `W = I/(hγ) - a_v - hγ a_q` of a Rosenbrock step.
#[derive(Clone, Debug, Default)]
pub(super) struct Factors {
    pub(super) w: Vec<f64>,
    pub(super) pivots: Vec<usize>,
    /// hγ [s].
    pub(super) diagonal: f64,
}

/// A step from `t` to `t + h`, its error estimate and its dense output.
#[derive(Clone, Debug, Default)]
pub struct DenseStep {
    /// Start of the step [s].
    pub t: f64,
    /// Length of the step [s].
    pub h: f64,
    /// The instant [s] at which the step had to end, if it did. It is `t + h` but for the rounding of the length.
    pub stop: Option<f64>,
    /// (q, v) at the start.
    pub start: Vec<f64>,
    /// (q, v) at the end.
    pub end: Vec<f64>,
    /// Local error estimate of (q, v) at the end.
    pub error: Vec<f64>,
    /// Length times the fastest rate at which the Jacobian at the start damps the velocities [-]. Far above
    /// 1, the step is determined by the Jacobian more than by the accelerations. Zero without a Jacobian.
    pub damping: f64,
    /// Order of the embedded solution.
    pub embedded_order: usize,
    /// Whether the method that took it is explicit.
    pub is_explicit: bool,
    /// Whether states inside are corrected, because forces follow the velocities too steeply for those of the polynomial.
    pub is_corrected: bool,
    /// Whether it is short against every oscillation of the motion, and nothing is held that does not move, so that its ends
    /// tell what happens inside.
    pub is_short: bool,
    /// Rows of the dense output, and what they are.
    pub(super) rows: Vec<f64>,
    pub(super) form: Form,
    pub(super) factors: Factors,
}

impl DenseStep {
    /// Memory for steps of `n` components by a method whose dense output has `rows` rows.
    pub(super) fn new(n: usize, rows: usize, embedded_order: usize, is_explicit: bool) -> Self {
        Self {
            t: 0.0,
            h: 0.0,
            stop: None,
            start: vec![0.0; n],
            end: vec![0.0; n],
            error: vec![0.0; n],
            damping: 0.0,
            embedded_order,
            is_explicit,
            is_corrected: false,
            is_short: false,
            rows: vec![0.0; rows * n],
            form: Form::Powers,
            factors: Factors::default(),
        }
    }

    /// State at `t + theta h`, theta in [0, 1], written to `q` and `v`.
    pub fn at(&self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        // The compiler keeps the sums in registers where it knows their number.
        match (&self.form, q.len()) {
            (Form::Differences(alpha), 2) => self.integrate_to::<2>(2, alpha, theta, q, v),
            (Form::Differences(alpha), d) => self.integrate_to::<1>(d, alpha, theta, q, v),
            (Form::Powers, 1) => self.at_of::<2>(theta, q, v),
            (Form::Powers, 2) => self.at_of::<4>(theta, q, v),
            (Form::Powers, d) => {
                // Positions and velocities in one pass over the rows.
                for (k, (q, v)) in q.iter_mut().zip(v).enumerate() {
                    let sums = self
                        .rows
                        .rchunks_exact(2 * d)
                        .fold([0.0; 2], |sums, row| [sums[0] * theta + row[k], sums[1] * theta + row[d + k]]);
                    (*q, *v) = (self.between(theta, k, sums[0]), self.between(theta, d + k, sums[1]));
                }
            }
        }
    }

    /// The state from the integrals of the accelerations, as many components at a time as LANES says.
    #[inline(always)]
    fn integrate_to<const LANES: usize>(
        &self,
        d: usize,
        alpha: &Alphas,
        theta: f64,
        q: &mut [f64],
        v: &mut [f64],
    ) {
        let (h, part) = (self.h, theta * self.h);
        let (q, v) = (&mut q[..d], &mut v[..d]);
        let (q_start, v_start) = self.start[..2 * d].split_at(d);
        let [once, twice] = integrals_to(alpha, (self.rows.len() / d.max(1)).saturating_sub(1), theta);
        for first in (0..d).step_by(LANES) {
            let (mut velocities, mut positions) = ([0.0; LANES], [0.0; LANES]);
            for (row, (once, twice)) in self.rows.chunks_exact(d).zip(once.iter().zip(&twice)) {
                for lane in 0..LANES {
                    velocities[lane] += once * row[first + lane];
                    positions[lane] += twice * row[first + lane];
                }
            }
            for lane in 0..LANES {
                let k = first + lane;
                q[k] = q_start[k] + (part * v_start[k] + h * h * positions[lane]);
                v[k] = v_start[k] + h * velocities[lane];
            }
        }
    }

    /// The same for a known number of components.
    #[inline(always)]
    fn at_of<const N: usize>(&self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        let (rows, _) = self.rows.as_chunks::<N>();
        let sums =
            rows.iter().rev().fold([0.0; N], |sums, row| std::array::from_fn(|k| sums[k] * theta + row[k]));
        for ((k, y), sum) in q.iter_mut().chain(v).enumerate().zip(sums) {
            *y = self.between(theta, k, sum);
        }
    }

    /// A component at `t + theta h`, with the sum of its powers in the rows.
    #[inline(always)]
    fn between(&self, theta: f64, k: usize, sum: f64) -> f64 {
        let rest = 1.0 - theta;
        rest * self.start[k] + theta * (self.end[k] + rest * sum)
    }

    /// Accelerations at `t + theta h` of a step in powers: the derivatives of its velocities.
    pub(crate) fn rates(&self, theta: f64, a: &mut [f64]) {
        let n = self.start.len();
        let d = n / 2;
        let count = self.rows.len().checked_div(n).unwrap_or(0);
        for (k, a) in a.iter_mut().enumerate() {
            let (mut sum, mut slope) = (0.0, 0.0);
            for r in (0..count).rev() {
                slope = slope * theta + sum;
                sum = sum * theta + self.rows[r * n + d + k];
            }
            let change = self.end[d + k] - self.start[d + k];
            *a = (change + (1.0 - 2.0 * theta) * sum + theta * (1.0 - theta) * slope) / self.h;
        }
    }

    /// The state at `t + theta h`, corrected if it must be.
    pub(super) fn corrected_at(
        &self,
        system: &mut dyn HybridSystem,
        theta: f64,
        q: &mut [f64],
        v: &mut [f64],
    ) {
        self.at(theta, q, v);
        if self.is_corrected {
            system.correct(self, theta, q, v);
        }
    }

    /// hγ of a Rosenbrock step [s].
    pub(crate) fn diagonal(&self) -> f64 {
        self.factors.diagonal
    }

    /// Solves W x = b in place, in a Rosenbrock step.
    pub(crate) fn solve(&self, b: &mut [f64]) {
        lu_solve(&self.factors.w, b.len(), &self.factors.pivots, b);
    }

    /// The instant `t + theta h`.
    pub fn instant(&self, theta: f64) -> Instant {
        Instant::after(self.t, theta * self.h)
    }

    /// The fraction of the step that has passed at an instant [s] inside it.
    pub fn part_until(&self, t: f64) -> f64 {
        // The length of a step that had to end at a certain instant is rounded.
        ((t - self.t) / self.h).min(1.0)
    }

    /// End of the step [s].
    pub fn end_time(&self) -> f64 {
        self.stop.unwrap_or(self.t + self.h)
    }
}
