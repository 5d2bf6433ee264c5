//! The first step of a multistep method: Dormand and Prince's Runge-Kutta method of order 5(4)
//! `[DormandPrince1980]`, whose dense output supplies the first differences.

use crate::integrators::HybridSystem;
use crate::integrators::dense::{DenseStep, Form};
use crate::integrators::stages::{Stages, Weights};
use crate::numerics::instant::Instant;

const STAGES: usize = 7;
/// Order of the embedded solution.
const EMBEDDED_ORDER: usize = 4;

const C: [f64; STAGES] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
/// The last row holds the weights of the solution.
const A: [[f64; STAGES - 1]; STAGES] = [
    [0.0; 6],
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Weights of the solution less those of the embedded one.
const E: [f64; STAGES] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
/// Weights of the last coefficient of the dense output, of order 4 `[HairerNorsettWanner1993]`.
const D: [f64; STAGES] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// The method with its scratch memory.
#[derive(Clone, Debug)]
pub(super) struct Start {
    /// Slopes (v, a).
    slopes: Stages,
    argument: Vec<f64>,
}

impl Start {
    /// Evaluations of a step.
    pub(super) const EVALUATIONS: usize = STAGES - 1;

    /// The method for `n` components of (q, v).
    pub(super) fn new(n: usize) -> Self {
        Self { slopes: Stages::new(STAGES, n), argument: vec![0.0; n] }
    }

    /// Takes the step whose start and length `step` holds, from accelerations `a`; false where something is
    /// not finite.
    pub(super) fn take(&mut self, system: &mut dyn HybridSystem, a: &[f64], step: &mut DenseStep) -> bool {
        let d = a.len();
        let (slope_q, slope_v) = self.slopes.row_mut(0).split_at_mut(d);
        slope_q.copy_from_slice(&step.start[d..]);
        slope_v.copy_from_slice(a);
        for stage in 1..STAGES {
            self.slopes.advance(&step.start, step.h, &A[stage][..stage], &mut self.argument);
            let (q, v) = self.argument.split_at(d);
            let (slope_q, slope_v) = self.slopes.row_mut(stage).split_at_mut(d);
            slope_q.copy_from_slice(v);
            if !system.acceleration(Instant::after(step.t, C[stage] * step.h), q, v, slope_v) {
                return false;
            }
        }
        step.end.copy_from_slice(&self.argument);
        let h = step.h;
        self.slopes.combine_all([Weights::dense(&E)], &mut step.error, |[sum]| h * sum);
        step.embedded_order = EMBEDDED_ORDER;
        step.end.iter().all(|y| y.is_finite())
    }

    /// Writes the dense output of the last step.
    pub(super) fn finish_dense(&mut self, step: &mut DenseStep) {
        let (n, h) = (step.end.len(), step.h);
        self.slopes.combine_all([Weights::dense(&D)], &mut self.argument, |[sum]| h * sum);
        step.form = Form::Powers;
        step.rows.resize(3 * n, 0.0);
        for k in 0..n {
            let change = step.end[k] - step.start[k];
            let first = h * self.slopes.at(0, k) - change;
            let second = change - h * self.slopes.at(STAGES - 1, k) - first;
            let third = self.argument[k];
            for (row, value) in [first, second + third, -third].into_iter().enumerate() {
                step.rows[row * n + k] = value;
            }
        }
    }
}
