//! Hulls of independent runs: of n + 1 runs that are drawn alike, the newest has the largest value at an instant with the
//! probability 1 / (n + 1), and the smallest one likewise. On average 2 / (n + 1) of the samples of a further run are
//! therefore outside of the hull of n, whatever the model; fewer where runs agree, or where a run has several revolutions.

use super::OutputBand;
use super::extremes::{NEVER_LEFT_OUT, top_two};
use super::held_out::{Excess, HeldOut, Runs};
use super::resolve::hull;

/// The hull of the runs, of which the scored ones must be independent.
pub fn independent(runs: &Runs<'_>) -> OutputBand {
    let [lower, upper] = hull(runs);
    let opposite: Vec<f64> = runs.values.iter().map(|value| -value).collect();
    let outermost: Vec<Excess> = [runs.values, opposite.as_slice()]
        .into_iter()
        .flat_map(|values| top_two(values, runs.samples, runs.scored, runs.block))
        .filter(|top| top.run != NEVER_LEFT_OUT && top.first > top.second)
        .map(|top| Excess { run: top.run, score: top.first - top.second })
        .collect();
    let coverage = 1.0 - 2.0 / (runs.scored + 1) as f64;
    OutputBand {
        lower,
        upper,
        window: 0.0,
        inflation: 0.0,
        persistence: 0.0,
        held_out: HeldOut { coverage, ..HeldOut::of(&outermost, runs) },
        polynomial: None,
    }
}
