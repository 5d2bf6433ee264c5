//! Bands with a proof: the hull of independent runs, widened as leave-one-out hulls require.
//!
//! Let N + 1 runs be exchangeable, and B(S, λ) the hull of a set S of runs over a fixed short window in time,
//! widened by λ times a spread. Neither shrinks when a run is added. L_i(λ) is the share of the samples of run i
//! outside of the band of the others. Choose the least λ with
//!
//! ```text
//! (Σ_{i <= N} L_i(λ) + 1) / (N + 1) <= 1 - coverage
//! ```
//!
//! where the others are those of the N runs. With run N + 1 among them every band is at least as wide. The least λ'
//! for which the mean of L_i over all N + 1 runs is at most 1 - coverage is therefore at most λ. It does not depend on
//! the order of the runs: by exchangeability the expectation of L_{N+1}(λ'), hence that of L_{N+1}(λ), is at most
//! 1 - coverage (the argument of `[AngelopoulosEtAl2024]`, with leave-one-out bands as in `[BarberEtAl2021]`).

use super::OutputBand;
use super::extremes::{Bound, GrowingWindow, NEVER_LEFT_OUT, TopTwo, top_two};
use super::held_out::{Excess, HeldOut, Runs};
use super::running::{Ends, Window, running_mean};

/// The spread is the width of the hull, averaged over this time to either side [durations], plus its mean over all
/// time times the second factor. The proof holds for any values that are fixed beforehand; factors of 0.1 to 1 differ
/// by a thousandth of the width.
const SPREAD_WINDOW: f64 = 1.0 / 18.0;
const SPREAD_FLOOR: f64 = 1.0;

/// The hull is taken over this time to either side [durations]. Where runs scatter, neighboring instants tell what
/// one run more would do, so that the level falls; where the hull is steep, bands get wider. Chosen on P1 of
/// `benchmarks/bands.py`: accelerations, penetrations and forces are 0.7 % narrower than without it, velocities 0.2 %
/// wider; twice as much makes velocities 2 % wider.
const HULL_WINDOW: f64 = 1.0 / 2880.0;

/// Least number of runs that can certify a coverage: one further run may be outside throughout.
pub fn least_runs(coverage: f64) -> usize {
    // 1 - 0.999 is a little more than a thousandth.
    ((1.0 / (1.0 - coverage)) * (1.0 - 1e-12)).ceil() as usize - 1
}

/// The certified band of the runs, each one row, which must be independent or at least exchangeable; rows that are not
/// scored always count.
pub fn certified(runs: &Runs<'_>, coverage: f64) -> OutputBand {
    let samples = runs.samples;
    let opposite: Vec<f64> = runs.values.iter().map(|value| -value).collect();
    let sides = [top_two(&opposite, samples, runs.scored, 1), top_two(runs.values, samples, runs.scored, 1)];
    let width: Vec<f64> = sides[0].iter().zip(&sides[1]).map(|(low, high)| low.first + high.first).collect();
    let bounds = [hull(&sides[0], runs.ends), hull(&sides[1], runs.ends)];
    let excesses = scores(&sides, &bounds, &width, runs.scored);

    let allowed = ((1.0 - coverage) * (runs.scored + 1) as f64 - 1.0) * samples as f64;
    // 0.001 times 1000 is not exactly 1: without the addition rounding could remove a sample.
    let allowed = (allowed + 1e-9).max(0.0) as usize;
    let mut levels: Vec<f64> = excesses.iter().map(|excess| excess.score).collect();
    levels.sort_unstable_by(|a, b| b.total_cmp(a));
    // Where more excesses are infinite than may be outside, no level is enough: the coverage then says so.
    let inflation = levels.into_iter().skip(allowed).find(|level| level.is_finite()).unwrap_or(0.0);

    let spread = spread(&width);
    let bound = |side: usize, limit: f64| -> Vec<f64> {
        let ends = bounds[side].all.iter().zip(&sides[side]).zip(&spread);
        ends.map(|((bound, top), spread)| (bound + inflation * spread).min(limit.max(top.first))).collect()
    };
    let outside: Vec<Excess> = excesses.into_iter().filter(|excess| excess.score > inflation).collect();
    let mean = (outside.len() as f64 / samples as f64 + 1.0) / (runs.scored + 1) as f64;
    OutputBand {
        // A bound at zero is 0 and not -0.
        lower: bound(0, -runs.limits[0]).into_iter().map(|bound| 0.0 - bound).collect(),
        upper: bound(1, runs.limits[1]),
        window: 0.0,
        inflation,
        persistence: 0.0,
        held_out: HeldOut { coverage: 1.0 - mean, ..HeldOut::of(&outside, runs) },
        polynomial: None,
    }
}

/// The largest values over the window, with all runs and without that of the largest value at the instant.
fn hull(side: &[TopTwo], ends: Ends) -> Bound {
    let window = Window::new(HULL_WINDOW * (side.len() - 1) as f64);
    let labels: Vec<u32> = side.iter().map(|top| top.run).collect();
    let mut bound = Bound::over(window, &mut GrowingWindow::new(side.to_vec(), ends), &labels);
    // Interpolation is rounded, but no run may be outside.
    bound.all.iter_mut().zip(side).for_each(|(bound, top)| *bound = bound.max(top.first));
    bound
}

fn spread(width: &[f64]) -> Vec<f64> {
    let floor = SPREAD_FLOOR * width.iter().sum::<f64>() / width.len() as f64;
    let mut spread = running_mean(width, Window::new(SPREAD_WINDOW * (width.len() - 1) as f64));
    spread.iter_mut().for_each(|spread| *spread += floor);
    spread
}

/// How far, in spreads of the others, every run is outside of the bounds of the others; infinitely far where the
/// others do not spread at all. Only the run of the largest or smallest value at an instant can be outside.
fn scores(sides: &[Vec<TopTwo>; 2], bounds: &[Bound; 2], width: &[f64], runs: usize) -> Vec<Excess> {
    // Instant, by how much the hull is narrower without the run, by how much the run is outside.
    let mut largest: Vec<Vec<(usize, f64, f64)>> = vec![Vec::new(); runs];
    for (side, bound) in sides.iter().zip(bounds) {
        for (at, top) in side.iter().enumerate() {
            if top.run != NEVER_LEFT_OUT && top.first > top.second {
                largest[top.run as usize].push((at, top.first - top.second, top.first - bound.without[at]));
            }
        }
    }
    let mut scores = Vec::new();
    for (run, largest) in largest.iter().enumerate().filter(|(_, largest)| !largest.is_empty()) {
        let mut narrower = width.to_vec();
        largest.iter().for_each(|&(at, gap, _)| narrower[at] -= gap);
        let spread = spread(&narrower);
        scores.extend(
            largest
                .iter()
                .filter(|(_, _, outside)| *outside > 0.0)
                .map(|&(at, _, outside)| Excess { run: run as u32, score: outside / spread[at] }),
        );
    }
    scores
}
