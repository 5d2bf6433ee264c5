//! Weighted sums of the stages of a step. They are private to the crate, so that their file is compiled here once more.

use sums::{Stages, Weights};

#[path = "../../../rust/src/integrators/stages.rs"]
#[allow(dead_code)]
mod sums;

/// Stages of `n` components that hold small integers, whose sums are exact.
fn stages(n: usize) -> Stages {
    let mut stages = <Stages>::new(6, n);
    for stage in 0..6 {
        for (k, value) in stages.row_mut(stage).iter_mut().enumerate() {
            *value = (7 * stage + 3 * k) as f64;
        }
    }
    stages
}

#[test]
fn sums_are_those_of_plain_loops_for_every_width() {
    let weights = [2.0, 0.0, 0.0, -3.0, 5.0];
    for n in 1..=22 {
        let stages = stages(n);
        let start: Vec<f64> = (0..n).map(|k| k as f64).collect();
        let sum = |k: usize| (0..5).map(|stage| weights[stage] * stages.at(stage, k)).sum::<f64>();
        for weights in [Weights::sparse(&weights), Weights::dense(&weights)] {
            let mut out = vec![f64::NAN; n];
            stages.advance_by(&start, 0.5, weights, &mut out);
            assert!((0..n).all(|k| out[k] == start[k] + 0.5 * sum(k)));
            stages.combine_all([weights, weights], &mut out, |[a, b]| a + 2.0 * b);
            assert!((0..n).all(|k| out[k] == 3.0 * sum(k)));
        }
        let mut out = vec![f64::NAN; n];
        stages.add(&start, &weights, &mut out);
        assert!((0..n).all(|k| out[k] == start[k] + sum(k)));
    }
}

#[test]
fn no_weights_read_no_stage() {
    for n in [4, 8, 12, 16, 20] {
        let mut stages = <Stages>::new(2, n);
        stages.row_mut(0).fill(f64::NAN);
        let mut out = vec![f64::NAN; n];
        stages.add(&vec![1.0; n], &[], &mut out);
        assert_eq!(out, vec![1.0; n]);
    }
}
