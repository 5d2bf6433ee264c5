//! Bands from few runs: running hulls of the deviations from the mean run, widened by a generalized Pareto tail that is
//! fitted to what held-out runs exceed them by. `docs/theory.md` has the rule, which `tests/python/one_page.py`
//! writes in NumPy. The two largest values of different runs hold all hulls without one run.

use super::OutputBand;
use super::extremes::{Bound, GrowingWindow, NEVER_LEFT_OUT, TopTwo, top_two};
use super::held_out::{Excess, HeldOut, Runs, persistence};
use super::running::{Window, running_mean};
use crate::numerics::accuracy::ROUNDING_OF_SOLUTION;

/// Longest window to either side [durations]. Half and twice as much give the same bands within 1 to 2 %.
const LONGEST_WINDOW: f64 = 1.0 / 12.0;

/// Standard errors that are added to what n rows estimate, one over the root of n each: the shape of the tail, and the
/// narrowest of the bands. With 2 and the whole share bands are 4 to 5 % narrower, and one study in ten misses.
const STANDARD_ERRORS: f64 = 1.0;

/// Share of the samples that may be outside which the fitted tail uses; the rest is for what no run has shown. See
/// [`STANDARD_ERRORS`].
const SHARE_OF_TAIL: f64 = 0.5;

/// Ratio of neighboring windows, and their largest number: a grid that ends below a sample.
const WINDOW_RATIO: f64 = 1.5;
/// Half changes 4 of 91 bands, twice none.
const WINDOWS: i32 = 12;

/// One side of the runs, as deviations from the mean run; the lower one with opposite signs.
struct Side {
    /// The two largest values at every instant.
    largest: Vec<TopTwo>,
    /// The rows of the run with the largest value, samples x rows of a run: no other run can be outside.
    rows: Vec<f64>,
    /// Local spread.
    spread: Vec<f64>,
    /// Bounds of every window, from the shortest.
    bounds: Vec<Bound>,
}

/// The widened band of the runs.
pub fn widened(runs: &Runs<'_>, coverage: f64) -> OutputBand {
    let Runs { samples, block, .. } = *runs;
    let longest = LONGEST_WINDOW * (samples - 1) as f64;
    let mut windows: Vec<usize> = (0..WINDOWS).map(|j| (longest / WINDOW_RATIO.powi(j)) as usize).collect();
    windows.push(0);
    windows.sort_unstable();
    windows.dedup();

    let mean = mean_row(runs);
    let opposite: Vec<f64> = runs.values.iter().map(|value| -value).collect();
    let opposite_mean: Vec<f64> = mean.iter().map(|value| -value).collect();
    let (low, high) = rayon::join(
        || Side::new(&opposite, &opposite_mean, runs, &windows),
        || Side::new(runs.values, &mean, runs, &windows),
    );
    let sides = [low, high];

    let rows = (runs.scored * block) as f64;
    let error = STANDARD_ERRORS / rows.sqrt();
    let may_be_outside = SHARE_OF_TAIL * (1.0 - coverage) / 2.0;
    let levels = levels(&sides, windows.len(), rows * samples as f64, error, may_be_outside);
    let width = |window: usize| -> f64 {
        let of = |side: usize| sides[side].widened(window, levels[window][side]).sum::<f64>();
        of(0) + of(1)
    };
    let widths: Vec<f64> = (0..windows.len()).map(width).collect();
    let most = widths.iter().copied().fold(f64::INFINITY, f64::min) * (1.0 + error);
    let chosen: Vec<usize> = (0..windows.len()).filter(|&window| widths[window] <= most).collect();
    let share = 1.0 / chosen.len() as f64;

    let mut outside = Outside::default();
    let level = [0, 1].map(|side| chosen.iter().map(|&window| share * levels[window][side]).sum::<f64>());
    let [lower, upper] = [(0, -1.0), (1, 1.0)].map(|(side, sign): (usize, f64)| {
        let chosen: Vec<(usize, f64)> = chosen.iter().map(|&window| (window, levels[window][side])).collect();
        let bound = sides[side].mean_bound(&chosen, level[side], &mut outside);
        sides[side].within_limit(bound, &mean, sign, runs.limits[side], level[side])
    });
    OutputBand {
        lower,
        upper,
        window: chosen.iter().map(|&window| share * windows[window] as f64).sum(),
        inflation: 0.5 * (level[0] + level[1]),
        persistence: persistence(outside.unwidened.into_iter(), runs),
        held_out: HeldOut::of(&outside.widened, runs),
        polynomial: None,
    }
}

/// Where held-out runs are outside of bounds that were made without them.
#[derive(Default)]
struct Outside {
    /// Runs outside of the bound before it is widened.
    unwidened: Vec<u32>,
    /// Those outside of the widened one.
    widened: Vec<Excess>,
}

/// Local spreads by which the bounds of every window and side are widened, so that a generalized Pareto tail leaves a
/// share of the `places` of one side outside.
fn levels(sides: &[Side; 2], windows: usize, places: f64, error: f64, may_be_outside: f64) -> Vec<[f64; 2]> {
    let (mut count, mut sum, mut square) = (0.0_f64, 0.0, 0.0);
    let mut shares = vec![[0.0; 2]; windows];
    for (side, of) in sides.iter().enumerate() {
        for (window, shares) in shares.iter_mut().enumerate() {
            for excess in of.excesses(window) {
                shares[side] += 1.0 / places;
                count += 1.0;
                sum += excess;
                square += excess * excess;
            }
        }
    }
    let mean = sum / count.max(1.0);
    let variance = (square / count.max(1.0) - mean * mean).max(f64::MIN_POSITIVE);
    let shape = 0.5 * (1.0 - mean * mean / variance);
    let scale = mean * (1.0 - shape);
    let shape = if shape + error == 0.0 { 1e-9 } else { shape + error };
    let level = |share: f64| scale * (shape * (share / may_be_outside).max(1.0).ln()).exp_m1() / shape;
    shares.into_iter().map(|shares| shares.map(level)).collect()
}

fn mean_row(runs: &Runs<'_>) -> Vec<f64> {
    let mut mean = vec![0.0; runs.samples];
    let rows = runs.scored * runs.block;
    for row in runs.values.chunks_exact(runs.samples).take(rows) {
        mean.iter_mut().zip(row).for_each(|(mean, value)| *mean += value);
    }
    mean.iter_mut().for_each(|mean| *mean /= rows as f64);
    mean
}

impl Side {
    fn new(values: &[f64], mean: &[f64], runs: &Runs<'_>, windows: &[usize]) -> Self {
        let Runs { samples, block, .. } = *runs;
        let mut largest = top_two(values, samples, runs.scored, block);
        for (top, mean) in largest.iter_mut().zip(mean) {
            top.first -= mean;
            top.second -= mean;
        }
        let row = |at: usize, row: usize| match largest[at].run {
            NEVER_LEFT_OUT => f64::NEG_INFINITY,
            run => values[(run as usize * block + row) * samples + at] - mean[at],
        };
        let rows = (0..samples * block).map(|place| row(place / block, place % block)).collect();
        let reach: Vec<f64> = largest.iter().map(|top| top.first).collect();
        let overall = reach.iter().sum::<f64>() / samples as f64;
        let longest = windows[windows.len() - 1];
        let local = runs.ends.over(&reach, Window::new(longest as f64), running_mean);
        let spread = local.iter().map(|local| (local + overall).max(f64::MIN_POSITIVE)).collect();
        let labels: Vec<u32> = largest.iter().map(|top| top.run).collect();
        let mut growing = GrowingWindow::new(largest.clone(), runs.ends);
        let bounds = windows.iter().map(|&half| Bound::over(half, &mut growing, &labels)).collect();
        Self { largest, rows, spread, bounds }
    }

    /// The bound of a window, widened.
    fn widened(&self, window: usize, level: f64) -> impl Iterator<Item = f64> {
        self.bounds[window].all.iter().zip(&self.spread).map(move |(bound, spread)| bound + level * spread)
    }

    /// The mean of the bounds of some windows, each widened by its level, and which held-out runs are outside of it with the
    /// mean `level`.
    fn mean_bound(&self, chosen: &[(usize, f64)], level: f64, outside: &mut Outside) -> Vec<f64> {
        let samples = self.spread.len();
        let (block, share) = (self.rows.len() / samples, 1.0 / chosen.len() as f64);
        let mut bound = vec![0.0; samples];
        for &(window, level) in chosen {
            bound
                .iter_mut()
                .zip(self.widened(window, level))
                .for_each(|(bound, wide)| *bound += share * wide);
        }
        for at in 0..samples {
            let without: f64 =
                chosen.iter().map(|&(window, _)| share * self.bounds[window].without[at]).sum();
            let run = self.largest[at].run;
            for &row in &self.rows[at * block..][..block] {
                if row > without {
                    outside.unwidened.push(run);
                }
                let score = row - without - level * self.spread[at];
                // A mean of equal numbers is rounded.
                if score > ROUNDING_OF_SOLUTION * self.spread[at] {
                    outside.widened.push(Excess { run, score });
                }
            }
        }
        bound
    }

    /// A bound of deviations as one of values: never inside of a run, and at a physical limit that some run reaches and
    /// one widening more would cross. Contact that is lost at some instants may be lost at others.
    fn within_limit(&self, bound: Vec<f64>, mean: &[f64], sign: f64, limit: f64, level: f64) -> Vec<f64> {
        let limit = sign * limit;
        let hull = || self.largest.iter().zip(mean).map(|(top, mean)| top.first + sign * mean);
        let reached = hull().any(|largest| largest >= limit);
        let bounded = |(at, largest): (usize, f64)| {
            let wide = bound[at] + sign * mean[at];
            let beyond = reached && wide + level * self.spread[at] > limit;
            // A bound at zero is 0 and not -0.
            sign * (if beyond { limit } else { wide.min(limit) }).max(largest) + 0.0
        };
        hull().enumerate().map(bounded).collect()
    }

    /// How far rows are outside of the bound of a window that was made without their run [local spreads].
    fn excesses(&self, window: usize) -> impl Iterator<Item = f64> {
        let block = self.rows.len() / self.spread.len();
        let without = self.bounds[window].without.iter().zip(&self.spread);
        let places = self.rows.chunks_exact(block).zip(without);
        places.flat_map(|(rows, (without, spread))| {
            rows.iter().map(move |row| (row - without) / spread).filter(|excess| *excess > 0.0)
        })
    }
}
