//! A step with its error estimate and the polynomial through it, in the form that all methods share.
//!
//! ```text
//! y(t + θh) = (1-θ) y₀ + θ (y₁ + (1-θ) (K₁ + θ K₂ + θ² K₃ + ...))
//! ```

use crate::numerics::instant::Instant;

/// A step from `t` to `t + h`, its error estimate and its dense output.
#[derive(Clone, Debug, Default)]
pub struct DenseStep {
    /// Start of the step [s].
    pub t: f64,
    /// Length of the step [s].
    pub h: f64,
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
    /// Whether it is short against every oscillation of the motion, so that its ends tell what happens inside.
    pub is_short: bool,
    /// Rows K_r of the dense output, (q, v) each.
    pub(super) rows: Vec<f64>,
}

impl DenseStep {
    /// Memory for steps of `n` components by a method whose dense output has `rows` rows.
    pub(super) fn new(n: usize, rows: usize, embedded_order: usize, is_explicit: bool) -> Self {
        Self {
            t: 0.0,
            h: 0.0,
            start: vec![0.0; n],
            end: vec![0.0; n],
            error: vec![0.0; n],
            damping: 0.0,
            embedded_order,
            is_explicit,
            is_short: false,
            rows: vec![0.0; rows * n],
        }
    }

    /// State at `t + theta h`, theta in [0, 1], written to `q` and `v`.
    pub fn at(&self, theta: f64, q: &mut [f64], v: &mut [f64]) {
        let (d, rest) = (q.len(), 1.0 - theta);
        let (start_q, start_v) = self.start.split_at(d);
        let (end_q, end_v) = self.end.split_at(d);
        for (k, (q, v)) in q.iter_mut().zip(v).enumerate() {
            let mut sums = [0.0; 2];
            for row in self.rows.rchunks_exact(2 * d) {
                sums = [sums[0] * theta + row[k], sums[1] * theta + row[d + k]];
            }
            *q = rest * start_q[k] + theta * (end_q[k] + rest * sums[0]);
            *v = rest * start_v[k] + theta * (end_v[k] + rest * sums[1]);
        }
    }

    /// Accelerations at `t + theta h`: the derivatives of its velocities.
    pub(super) fn rates(&self, theta: f64, a: &mut [f64]) {
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

    /// The instant `t + theta h`.
    pub fn instant(&self, theta: f64) -> Instant {
        Instant::after(self.t, theta * self.h)
    }

    /// End of the step [s].
    pub fn end_time(&self) -> f64 {
        self.t + self.h
    }
}
