//! Bands with a proof: the hull of independent runs, widened as leave-one-out hulls require.
//!
//! Let N + 1 runs be exchangeable, and B(S, λ) the hull of a set S of runs, widened by λ times a spread that does
//! not shrink when a run is added. L_i(λ) is the share of the samples of run i outside of the band of the others.
//! Choose the least λ with
//!
//! ```text
//! (Σ_{i <= N} L_i(λ) + 1) / (N + 1) <= 1 - coverage
//! ```
//!
//! where the others are those of the N runs. With run N + 1 among them every band is at least as wide. The least λ'
//! for which the mean of L_i over all N + 1 runs is at most 1 - coverage is therefore at most λ. It does not depend on
//! the order of the runs: by exchangeability the expectation of L_{N+1}(λ'), hence that of L_{N+1}(λ), is at most
//! 1 - coverage (the argument of `[AngelopoulosEtAl2024]`, with leave-one-out bands as in `[BarberEtAl2021]`).

use super::calibrate::{Excess, HeldOut, Requirement};
use super::candidates::{Calibrated, Runs};
use super::extremes::{NEVER_LEFT_OUT, TopTwo, top_two};
use super::running::{Window, running_mean};

/// The spread is the width of the hull, averaged over this time to either side [durations], plus its mean over all
/// time times the second factor. The proof holds for any values that are fixed beforehand.
const SPREAD_WINDOW: f64 = 1.0 / 18.0;
const SPREAD_FLOOR: f64 = 0.3;

/// Least number of runs that can certify a coverage: one further run may be outside throughout.
pub fn least_runs(coverage: f64) -> usize {
    // 1 - 0.999 is a little more than a thousandth.
    ((1.0 / (1.0 - coverage)) * (1.0 - 1e-12)).ceil() as usize - 1
}

/// The certified band of the runs, each one row, which must be independent or at least exchangeable; rows that are not
/// scored always count.
pub fn certified(runs: &Runs<'_>, requirement: &Requirement) -> Calibrated {
    let samples = runs.samples;
    let opposite: Vec<f64> = runs.values.iter().map(|value| -value).collect();
    let sides = [top_two(&opposite, samples, runs.scored, 1), top_two(runs.values, samples, runs.scored, 1)];
    let width: Vec<f64> = sides[0].iter().zip(&sides[1]).map(|(low, high)| low.first + high.first).collect();
    let excesses = scores(&sides, &width, runs.scored);

    let allowed = ((1.0 - requirement.coverage) * (runs.scored + 1) as f64 - 1.0) * samples as f64;
    // 0.001 times 1000 is not exactly 1: without the addition rounding could remove a sample.
    let allowed = (allowed + 1e-9).max(0.0) as usize;
    let mut levels: Vec<f64> = excesses.iter().map(|excess| excess.score).collect();
    levels.sort_unstable_by(|a, b| b.total_cmp(a));
    let inflation = levels.get(allowed).copied().unwrap_or(0.0);

    let spread = spread(&width);
    let bound = |side: &[TopTwo], limit: f64| -> Vec<f64> {
        let wide = side
            .iter()
            .zip(&spread)
            .map(|(top, spread)| (top.first + inflation * spread).min(limit.max(top.first)));
        wide.collect()
    };
    let outside: Vec<Excess> = excesses.into_iter().filter(|excess| excess.score > inflation).collect();
    let mean = (outside.len() as f64 / samples as f64 + 1.0) / (runs.scored + 1) as f64;
    Calibrated {
        lower: bound(&sides[0], -runs.limits[0]).into_iter().map(|value| -value).collect(),
        upper: bound(&sides[1], runs.limits[1]),
        window: 0.0,
        inflation,
        held_out: HeldOut { coverage: 1.0 - mean, ..HeldOut::of(&outside, requirement) },
    }
}

fn spread(width: &[f64]) -> Vec<f64> {
    let floor = SPREAD_FLOOR * width.iter().sum::<f64>() / width.len() as f64;
    let mut spread = running_mean(width, Window::new(SPREAD_WINDOW * (width.len() - 1) as f64));
    spread.iter_mut().for_each(|spread| *spread += floor);
    spread
}

/// How far, in spreads of the others, every run is outside of the hull of the others. Only the run of the
/// largest or smallest value at an instant is.
fn scores(sides: &[Vec<TopTwo>; 2], width: &[f64], runs: usize) -> Vec<Excess> {
    let mut outside: Vec<Vec<(usize, f64)>> = vec![Vec::new(); runs];
    for side in sides {
        for (at, top) in side.iter().enumerate() {
            if top.run != NEVER_LEFT_OUT && top.first > top.second {
                outside[top.run as usize].push((at, top.first - top.second));
            }
        }
    }
    let mut scores = Vec::new();
    for (run, outside) in outside.iter().enumerate().filter(|(_, outside)| !outside.is_empty()) {
        let mut narrower = width.to_vec();
        outside.iter().for_each(|&(at, excess)| narrower[at] -= excess);
        let spread = spread(&narrower);
        scores.extend(
            outside
                .iter()
                .filter(|(at, _)| spread[*at] > 0.0)
                .map(|&(at, excess)| Excess { run: run as u32, score: excess / spread[at] }),
        );
    }
    scores
}
