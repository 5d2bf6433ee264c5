//! Bounds from the extremes of the runs in time windows, widened until held-out runs are inside.
//!
//! The distribution of an output over the box changes slowly in time, even where no polynomial follows the single
//! run. The extremes at neighboring instants are therefore estimates of the extremes at an instant. A bound is the
//! mean of the running extremes over windows of decreasing length, so that near instants weigh more. Several
//! lengths are tried, with the extremes of the runs and with those of their deviations from the mean run; the
//! narrowest bands are averaged.

use rayon::prelude::*;

use super::calibrate::{Excess, HeldOut, Requirement, Tail, inflation, persistence};
use super::extremes::{Bound, GrowingWindow, NEVER_LEFT_OUT, TopTwo, top_two};
use super::running::{Ends, Window, running_mean};

/// Longest window to either side [durations].
const LONGEST_WINDOW: f64 = 1.0 / 12.0;

/// Ratio of the lengths of neighboring windows. Ratios of 1.3 to 2 gave the same widths.
const WINDOW_RATIO: f64 = 1.5;

/// Number of windows that are averaged, besides the instant itself.
const AVERAGED_WINDOWS: usize = 7;

/// Windows use every sample where the duration has fewer than twice this many steps, else every second, fourth
/// and so on. Motions with impacts have ever higher peaks between samples, so that a bound made from all samples
/// would grow with every halving of the sampling step. All other constants were chosen at this number.
const WINDOW_INTERVALS: usize = 720;

/// The local spread is averaged over this time to either side [durations]; half or double of it gives the same
/// bands. Its mean over all time is added, for motions that occur at instants at which no run has shown them.
const SPREAD_WINDOW: f64 = 1.0 / 18.0;

/// Bands that are wider than the narrowest by up to this share of it are averaged with it, with 41 runs or fewer; with
/// more the share falls as their number to the power of two thirds. The narrowest alone would be chosen for its random
/// error, which is the larger the fewer runs there are, and the choice would jump when a sample is added. With 0.3 for all
/// numbers the bands of P3a by 321 runs are 5 % wider. Weights that fall with the width instead gave the same.
const AVERAGED_WIDTHS: f64 = 0.3;

/// The largest such share with a single parameter, whose even points leave less to the choice: bands of five problems of
/// `benchmarks/bands.py` with one of their parameters alone are 1 to 3 % narrower at 41 and 81 runs, those of P3a too.
const AVERAGED_WIDTHS_OF_ONE: f64 = 0.12;

/// Halvings of the interval in which the level is sought: to half a percent of that of exponential excesses.
const LEVEL_HALVINGS: usize = 7;

/// If a run reaches a physical limit at some instant, bounds that end near the limit are moved to it: contact that
/// is lost at some instants may be lost at others. Near is this number of local spreads over the number of runs. It
/// was chosen on the forces of P2 and P3b: bands 4 % wider, a fifth of the samples outside.
const LIMIT_MARGIN: f64 = 30.0;

/// The runs of one output.
#[derive(Clone, Copy, Debug)]
pub struct Runs<'a> {
    /// Values, rows x samples; the scored runs first.
    pub values: &'a [f64],
    /// Samples of a row, at least 2.
    pub samples: usize,
    /// Rows of a run: its revolutions, or one.
    pub block: usize,
    /// How windows continue beyond the ends of a row.
    pub ends: Ends,
    /// Runs that are held out in turn; the others always count.
    pub scored: usize,
    /// Physical limits of the output: lower and upper.
    pub limits: [f64; 2],
}

/// A calibrated band.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds.
    pub upper: Vec<f64>,
    /// Longest window to either side, in samples; mean of the bands that were averaged.
    pub window: f64,
    /// Local spreads by which the band was widened, mean of both sides and of the bands that were averaged.
    pub inflation: f64,
    /// How long runs stay outside before the band is widened, see [`persistence`].
    pub persistence: f64,
    /// What held-out runs did.
    pub held_out: HeldOut,
}

/// The lower bound of a bound of negative values; a bound at zero is 0 and not -0.
pub fn upside_down(bound: Vec<f64>) -> Vec<f64> {
    bound.into_iter().map(|value| 0.0 - value).collect()
}

/// One side of the runs: values for the upper side, negative values for the lower one.
struct Side<'a> {
    /// Values, rows x samples, and the rows of a run.
    values: &'a [f64],
    block: usize,
    /// Largest value of all runs at every instant.
    hull: Vec<f64>,
    /// Largest value of a run that can be left out, and which; no run where another has it.
    runs: Vec<u32>,
    /// Local spread.
    spread: Vec<f64>,
    /// What the level of the inflation depends on.
    tail: Tail,
    /// Physical limit of the output, and the distance from it [local spreads] below which bounds are moved to
    /// it; 0 where no run reaches it.
    limit: f64,
    near: f64,
    /// Bounds of every window, from the shortest; the extremes of the runs, then those of their deviations.
    families: [Vec<Bound>; 2],
}

/// One side of a band before it is widened.
struct Shape {
    bound: Vec<f64>,
    /// Places (sample times the rows of a run, plus the row of the run) and by how much the row is outside.
    excesses: Vec<(usize, Excess)>,
}

struct Candidate {
    shapes: [Shape; 2],
    window: f64,
    /// Local spreads by which each side is widened.
    inflation: [f64; 2],
}

/// The calibrated band of the runs.
pub fn calibrated(runs: &Runs<'_>, requirement: &Requirement) -> Calibrated {
    let samples = runs.samples;
    let windows = window_lengths(samples);
    let mean = mean_run(runs);
    let opposite: Vec<f64> = runs.values.iter().map(|value| -value).collect();
    let opposite_mean: Vec<f64> = mean.iter().map(|value| -value).collect();
    let (lower, upper) = rayon::join(
        || Side::new(&opposite, &opposite_mean, -runs.limits[0], runs, &windows),
        || Side::new(runs.values, &mean, runs.limits[1], runs, &windows),
    );
    let sides = [lower, upper];
    // Windows below half a stride are used in the means of longer ones only.
    let is_longest = |longest: &usize| *longest == 0 || windows[*longest - 1] >= 0.5;
    let kinds: Vec<(usize, usize)> = (0..2)
        .flat_map(|family| (0..=windows.len()).filter(is_longest).map(move |longest| (family, longest)))
        .collect();
    let shape = |&(family, longest): &(usize, usize)| {
        let shapes = [sides[0].shape(family, longest), sides[1].shape(family, longest)];
        (shapes, if longest == 0 { 0.0 } else { windows[longest - 1] })
    };
    let shapes: Vec<([Shape; 2], f64)> = kinds.par_iter().map(shape).collect();
    let tails = [&sides[0].tail, &sides[1].tail];
    let target = requirement.target(tails);
    let candidates = widened(shapes, target, requirement, tails);
    let band = |level| averaged(&candidates, &sides, runs, requirement, level);
    let coverages = [1.0 - target, requirement.coverage];
    settled(band, requirement.usual_level(), requirement.least_share(tails), coverages)
}

/// The shapes of all windows with how far each is widened if excesses are exponentially distributed.
fn widened(
    shapes: Vec<([Shape; 2], f64)>,
    target: f64,
    requirement: &Requirement,
    tails: [&Tail; 2],
) -> Vec<Candidate> {
    let both = shapes.iter().flat_map(|(shapes, _)| shapes);
    let mean = requirement.mean_excess(both.flat_map(|shape| shape.excesses.iter().map(|(_, e)| e)));
    let inflation_of = |shape: &Shape, tail: &Tail| {
        let excesses: Vec<Excess> = shape.excesses.iter().map(|(_, excess)| *excess).collect();
        inflation(&excesses, mean, target, requirement, tail)
    };
    let candidate = |(shapes, window): ([Shape; 2], f64)| {
        let inflation = [0, 1].map(|side| inflation_of(&shapes[side], tails[side]));
        Candidate { shapes, window, inflation }
    };
    shapes.into_par_iter().map(candidate).collect()
}

/// The band of the usual level; of a lower one, down to a share of it, if held-out runs still keep the coverage that is
/// aimed at there; of a higher one, up to that of exponential excesses, if they do not keep what is asked for.
fn settled(
    band: impl Fn(f64) -> Calibrated,
    usual: f64,
    least_share: f64,
    [aim, asked]: [f64; 2],
) -> Calibrated {
    let found = band(usual);
    let kept = found.held_out.coverage;
    if kept >= aim {
        return lowest(band, least_share * usual, (usual, found), aim);
    }
    if kept >= asked || usual >= 1.0 {
        return found;
    }
    let found = band(1.0);
    if found.held_out.coverage >= asked { lowest(band, usual, (1.0, found), asked) } else { found }
}

/// The band of the lowest level, from a least one to that of a band that was found, whose held-out runs keep a coverage as
/// those of that band do.
fn lowest(
    band: impl Fn(f64) -> Calibrated,
    mut low: f64,
    (mut high, mut found): (f64, Calibrated),
    coverage: f64,
) -> Calibrated {
    if low >= high {
        return found;
    }
    for _ in 0..LEVEL_HALVINGS {
        let level = 0.5 * (low + high);
        let tried = band(level);
        if tried.held_out.coverage >= coverage {
            (found, high) = (tried, level);
        } else {
            low = level;
        }
    }
    found
}

/// Steps from one sample that a window uses to the next: a power of two, so that windows use the same samples
/// when the sampling step is halved.
fn stride(samples: usize) -> usize {
    let steps = (samples - 1) / WINDOW_INTERVALS;
    if steps < 2 { 1 } else { 1 << steps.ilog2() }
}

/// Half-lengths of the windows in strides, in ascending order; the shortest is just above a tenth of a stride.
fn window_lengths(samples: usize) -> Vec<f64> {
    let mut windows = Vec::new();
    let mut window = LONGEST_WINDOW * (samples - 1) as f64 / stride(samples) as f64;
    while window > 0.1 {
        windows.push(window);
        window /= WINDOW_RATIO;
    }
    windows.reverse();
    windows
}

fn mean_run(runs: &Runs<'_>) -> Vec<f64> {
    let mut mean = vec![0.0; runs.samples];
    let rows = runs.scored * runs.block;
    for row in runs.values.chunks_exact(runs.samples).take(rows) {
        mean.iter_mut().zip(row).for_each(|(mean, value)| *mean += value);
    }
    mean.iter_mut().for_each(|mean| *mean /= rows as f64);
    mean
}

impl<'a> Side<'a> {
    fn new(values: &'a [f64], mean: &[f64], limit: f64, runs: &Runs<'_>, windows: &[f64]) -> Self {
        let samples = runs.samples;
        let largest = top_two(values, samples, runs.scored, runs.block);
        let hull: Vec<f64> = largest.iter().map(|top| top.first).collect();
        let labels: Vec<u32> = largest.iter().map(|top| top.run).collect();
        let reach: Vec<f64> = hull.iter().zip(mean).map(|(hull, mean)| (hull - mean).max(0.0)).collect();
        let floor = reach.iter().sum::<f64>() / samples as f64;
        let tail = Tail::of(values, &reach, runs.scored, runs.block, &labels);
        let window = Window::new(SPREAD_WINDOW * (samples - 1) as f64);
        let mut spread = runs.ends.over(&reach, window, running_mean);
        spread.iter_mut().for_each(|spread| *spread += floor);
        let deviations: Vec<TopTwo> = largest
            .iter()
            .zip(mean)
            .map(|(top, mean)| TopTwo { first: top.first - mean, second: top.second - mean, ..*top })
            .collect();
        let family = |start: Vec<TopTwo>, base: Option<&[f64]>| {
            let mut growing = GrowingWindow::new(start, runs.ends, stride(samples));
            let mut bounds = vec![Bound::over(Window::new(0.0), &mut growing, &labels)];
            bounds.extend(windows.iter().map(|&w| Bound::over(Window::new(w), &mut growing, &labels)));
            for bound in &mut bounds {
                for (at, &base) in base.into_iter().flatten().enumerate() {
                    bound.all[at] += base;
                    bound.without[at] += base;
                }
            }
            bounds
        };
        let (extremes, of_deviations) =
            rayon::join(|| family(largest, None), || family(deviations, Some(mean)));
        let families = [extremes, of_deviations];
        let reached = hull.iter().any(|&largest| largest >= limit);
        let near = if reached { LIMIT_MARGIN / runs.scored as f64 } else { 0.0 };
        Self { values, block: runs.block, hull, runs: labels, spread, tail, limit, near, families }
    }

    /// The mean of the bounds over the `longest`-th window, the next shorter ones and the instant itself.
    fn shape(&self, family: usize, longest: usize) -> Shape {
        let bounds = &self.families[family];
        let members = || (0..=longest).rev().take(AVERAGED_WINDOWS).chain((longest > 0).then_some(0));
        let count = members().count() as f64;
        let mut bound = vec![0.0; self.hull.len()];
        let mut without = vec![0.0; self.hull.len()];
        for member in members() {
            for at in 0..bound.len() {
                bound[at] += bounds[member].all[at];
                without[at] += bounds[member].without[at];
            }
        }
        for at in 0..bound.len() {
            // The mean is rounded, but no run may be outside.
            bound[at] = (bound[at] / count).max(self.hull[at]);
            without[at] /= count;
        }
        Shape { bound, excesses: self.excesses(&without) }
    }

    /// Where rows are outside of bounds made without their run. Only the run of the largest value can be.
    fn excesses(&self, without: &[f64]) -> Vec<(usize, Excess)> {
        let samples = self.hull.len();
        let mut excesses = Vec::new();
        for at in 0..samples {
            let (run, spread) = (self.runs[at], self.spread[at]);
            if run == NEVER_LEFT_OUT || self.hull[at] <= without[at] || spread <= 0.0 {
                continue;
            }
            for row in 0..self.block {
                let excess = self.values[(run as usize * self.block + row) * samples + at] - without[at];
                if excess > 0.0 {
                    excesses.push((at * self.block + row, Excess { run, score: excess / spread }));
                }
            }
        }
        excesses
    }
}

impl Candidate {
    /// The bounds of both sides, and the sum of their distances.
    fn widened(&self, sides: &[Side<'_>; 2], level: f64) -> ([Vec<f64>; 2], f64) {
        let bounds = [0, 1].map(|side| self.widened_side(side, &sides[side], level));
        let width = bounds.iter().fold(0.0, |sum, bound| sum + bound.iter().sum::<f64>());
        (bounds, width)
    }

    /// The bound of a side, widened; at the physical limit where it would end beyond or near it.
    fn widened_side(&self, side: usize, of: &Side<'_>, level: f64) -> Vec<f64> {
        let inflation = level * self.inflation[side];
        (0..of.hull.len())
            .map(|at| {
                let wide = self.shapes[side].bound[at] + inflation * of.spread[at];
                if of.limit - wide < of.near * of.spread[at] {
                    return of.limit.max(of.hull[at]);
                }
                wide.min(of.limit.max(of.hull[at]))
            })
            .collect()
    }
}

/// Width up to which bands are averaged, from the widths of all.
fn averaged_width(widths: impl Iterator<Item = f64>, requirement: &Requirement) -> f64 {
    let most =
        if (requirement.parameters, requirement.block) == (1, 1) { AVERAGED_WIDTHS_OF_ONE } else { 1.0 };
    let share = AVERAGED_WIDTHS * requirement.fewness().min(1.0).powi(2);
    widths.fold(f64::INFINITY, f64::min) * (1.0 + share.min(most))
}

/// The mean of the narrowest candidates, each widened by its inflation times `level`, and what held-out runs do in it.
fn averaged(
    candidates: &[Candidate],
    sides: &[Side<'_>; 2],
    runs: &Runs<'_>,
    requirement: &Requirement,
    level: f64,
) -> Calibrated {
    let widened: Vec<([Vec<f64>; 2], f64)> =
        candidates.par_iter().map(|candidate| candidate.widened(sides, level)).collect();
    let largest = averaged_width(widened.iter().map(|(_, width)| *width), requirement);
    let chosen: Vec<(&Candidate, &[Vec<f64>; 2])> = candidates
        .iter()
        .zip(&widened)
        .filter(|(_, (_, width))| *width <= largest)
        .map(|(candidate, (bounds, _))| (candidate, bounds))
        .collect();
    let share = 1.0 / chosen.len() as f64;
    let mut bounds = [vec![0.0; runs.samples], vec![0.0; runs.samples]];
    let inflation = [0, 1].map(|side| {
        level * chosen.iter().map(|(candidate, _)| candidate.inflation[side]).sum::<f64>() * share
    });
    let (mut excesses, mut unwidened) = (Vec::new(), Vec::new());
    for (side, of) in sides.iter().enumerate() {
        // How far the rows of the largest run are outside of the mean of the bounds that were made without it. Where
        // the run is inside a candidate before that is widened, its (negative) distance is not known, and 0 is added:
        // the sum can only be too large.
        let mut outside = vec![0.0; runs.samples * runs.block];
        for (candidate, widened) in &chosen {
            for (bound, wide) in bounds[side].iter_mut().zip(&widened[side]) {
                *bound += share * wide;
            }
            for (at, excess) in &candidate.shapes[side].excesses {
                outside[*at] += share * excess.score;
            }
        }
        let found = outside.iter().enumerate().filter(|(_, score)| **score > 0.0);
        let found = found.map(|(place, &score)| Excess { run: of.runs[place / runs.block], score });
        unwidened.extend(found.clone().map(|excess| excess.run));
        excesses.extend(found.filter_map(|Excess { run, score }| {
            let score = score - inflation[side];
            (score > 0.0).then_some(Excess { run, score })
        }));
        // Sums of shares are rounded.
        for (bound, &hull) in bounds[side].iter_mut().zip(&of.hull) {
            *bound = bound.max(hull).min(of.limit.max(hull));
        }
    }
    let [opposite, upper] = bounds;
    Calibrated {
        lower: upside_down(opposite),
        upper,
        window: chosen.iter().map(|(candidate, _)| candidate.window).sum::<f64>()
            * share
            * stride(runs.samples) as f64,
        inflation: 0.5 * (inflation[0] + inflation[1]),
        persistence: persistence(unwidened.into_iter(), requirement),
        held_out: HeldOut::of(&excesses, requirement),
    }
}
