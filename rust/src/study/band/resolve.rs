//! Whether a polynomial in the parameters follows an output, and the band that it then gives.

use super::extremes::{GrowingWindow, NEVER_LEFT_OUT, TopTwo, top_two};
use super::held_out::{self, Excess, HeldOut, Runs};
use super::regression::{Regression, exponents};
use super::running::{Window, running_maximum};
use super::sparse_range::{COARSE, SparseRange};
use super::{OutputBand, Polynomial};
use crate::numerics::accuracy::ROUNDING_OF_SOLUTION;
use crate::study::BLOCK;
use crate::study::chebyshev::Polynomials;
use crate::study::range::polynomial_ranges;
use rayon::prelude::*;
use std::borrow::Cow;

/// Largest degree that is tried: higher ones were not better even for smooth outputs.
/// Half, twice: 5, 2 of 150 bands get another degree.
pub const LARGEST_DEGREE: usize = 8;

/// Largest number of terms of a polynomial over the number of runs. Half, twice: 21, 4 of 150 bands get another degree.
pub const LARGEST_TERM_SHARE: f64 = 0.7;

/// Largest error of a trusted polynomial at runs it was not fitted to, relative to the width of the hull of the
/// other runs, both averaged over time. (Relative to the range of the polynomial itself, a polynomial that oscillates
/// would seem good; relative to a hull that the run makes, one run far from all others would hide itself.)
/// Half, twice: 6 of 150 bands lose their polynomial, 6 get one.
pub const LARGEST_TRUSTED_ERROR: f64 = 0.05;

/// No higher degree is tried below this error. Half, twice: 5, 1 of 150 bands get another degree.
const NEGLIGIBLE_ERROR: f64 = 1e-3;

/// Number of instants on which the degree is chosen. Half and twice change none of 150 bands.
const PROBES: usize = 128;

/// The margin at an instant is the largest error within this time to either side [durations].
/// Half and twice change 61 of 70 bands.
const MARGIN_WINDOW: f64 = 1.0 / 90.0;

/// Terms of the tensor up to which the range of the polynomial is found in the Bernstein basis: 6 parameters of
/// degree 2, or 4 of degree 5. Half and twice change none of 87 bands.
const LARGEST_TENSOR: usize = 1296;

/// The band of the polynomial that follows the runs, if there is one.
///
/// All rows of values take part in the fit and in the verdict, the nominal run too; its margin is that of the scored
/// ones.
pub fn resolved(runs: &Runs<'_>, regression: &Regression) -> Option<OutputBand> {
    let degree = chosen_degree(runs, regression, LARGEST_TRUSTED_ERROR)?;
    let samples = runs.samples;
    let Fitted { coefficients, largest, farthest } = fitted(runs, regression, degree);
    let errors: Vec<f64> = largest.iter().map(|top| top.first).collect();
    let error = relative_error(runs, &farthest);
    if error > LARGEST_TRUSTED_ERROR {
        return None;
    }

    let [lowest, highest] = range(&coefficients, samples, regression.parameters, degree);
    let window = Window::new(MARGIN_WINDOW * (samples - 1) as f64);
    let margin = runs.ends.over(&errors, window, running_maximum);
    let [hull_lower, hull_upper] = hull(runs);
    let [least, most] = runs.limits;
    let lower: Vec<f64> =
        (0..samples).map(|at| (lowest[at] - margin[at]).max(least).min(hull_lower[at])).collect();
    let upper: Vec<f64> =
        (0..samples).map(|at| (highest[at] + margin[at]).min(most).max(hull_upper[at])).collect();
    let excesses = held_out_excesses(runs, largest, window, &lowest, &highest);
    Some(OutputBand {
        lower,
        upper,
        window: MARGIN_WINDOW * (samples - 1) as f64,
        inflation: 0.0,
        persistence: 0.0,
        held_out: HeldOut::of(&excesses, runs),
        polynomial: Some(Polynomial { degree, error, coefficients }),
    })
}

/// The range over the box of the polynomial with the least error, if that is below `largest_error`; with physical
/// limits.
pub fn extrapolated(runs: &Runs<'_>, regression: &Regression, largest_error: f64) -> Option<[Vec<f64>; 2]> {
    let degree = chosen_degree(runs, regression, largest_error)?;
    let Fitted { coefficients, .. } = fitted(runs, regression, degree);
    let [mut lowest, mut highest] = range(&coefficients, runs.samples, regression.parameters, degree);
    let [least, most] = runs.limits;
    lowest.iter_mut().for_each(|value| *value = value.max(least));
    highest.iter_mut().for_each(|value| *value = value.min(most));
    Some([lowest, highest])
}

/// Polynomials of a degree, and their errors at runs that are left out, at every instant.
struct Fitted {
    /// Terms x samples.
    coefficients: Vec<f64>,
    /// The largest errors of scored runs.
    largest: Vec<TopTwo>,
    /// The largest error of all runs, and its run.
    farthest: Vec<(f64, usize)>,
}

/// Fits a degree in blocks of time, so that residuals of all runs are never there at once.
fn fitted(runs: &Runs<'_>, regression: &Regression, degree: usize) -> Fitted {
    let starts: Vec<usize> = (0..runs.samples).step_by(BLOCK).collect();
    let of_block = |&start: &usize| {
        let end = (start + BLOCK).min(runs.samples);
        let rows = runs.values.chunks_exact(runs.samples);
        let values: Vec<f64> = rows.flat_map(|row| row[start..end].iter().copied()).collect();
        fitted_block(&Runs { values: &values, samples: end - start, ..*runs }, regression, degree)
    };
    let blocks: Vec<Fitted> = starts.par_iter().map(of_block).collect();
    let terms = regression.terms[degree];
    let mut coefficients = Vec::with_capacity(terms * runs.samples);
    for term in 0..terms {
        for block in &blocks {
            coefficients
                .extend_from_slice(&block.coefficients[term * block.largest.len()..][..block.largest.len()]);
        }
    }
    let mut whole = Fitted { coefficients, largest: Vec::new(), farthest: Vec::new() };
    for block in blocks {
        whole.largest.extend(block.largest);
        whole.farthest.extend(block.farthest);
    }
    whole
}

/// As [`fitted`], at once.
fn fitted_block(runs: &Runs<'_>, regression: &Regression, degree: usize) -> Fitted {
    let samples = runs.samples;
    let means = means(runs);
    let projected = regression.project(&means, samples, degree);
    let mut residuals = means.to_vec();
    (0..=degree).for_each(|degree| regression.reduce(&mut residuals, &projected, samples, degree));
    let mut errors = errors_of_rows(runs, &means, regression.leave_one_out(&residuals, samples, degree));
    errors.iter_mut().for_each(|error| *error = error.abs());
    let farthest = farthest(&errors, samples, runs.block);
    errors.truncate(runs.scored * runs.block * samples);
    let largest = top_two(&errors, samples, runs.scored, runs.block);
    Fitted { coefficients: regression.coefficients(&projected, samples, degree), largest, farthest }
}

/// How long what no polynomial explains lasts in a run: 1 where the same two runs are furthest from the polynomial with
/// the least error at all instants, about two over the number of runs where every instant has others [-].
///
/// Runs that differ by an offset or a factor, beside what their parameters do, are single observations, however many
/// samples they have. For runs of one row.
pub fn persistence(runs: &Runs<'_>, regression: &Regression) -> f64 {
    let Some(Tried { mut errors, probes, .. }) = tried(runs, regression) else { return 0.0 };
    errors.truncate(runs.scored * probes);
    let mut furthest = Vec::with_capacity(2 * probes);
    for at in 0..probes {
        let of_runs = || errors.iter().skip(at).step_by(probes).zip(0_u32..);
        let order = |a: &(&f64, u32), b: &(&f64, u32)| a.0.total_cmp(b.0);
        if let (Some((low, lowest)), Some((high, highest))) =
            (of_runs().min_by(order), of_runs().max_by(order))
            && low < high
        {
            furthest.extend([lowest, highest]);
        }
    }
    held_out::persistence(furthest.into_iter(), &Runs { samples: probes, ..*runs })
}

/// The degree with the least error at left-out runs, at some instants; None where no polynomial is nearly good
/// enough.
fn chosen_degree(runs: &Runs<'_>, regression: &Regression, largest_error: f64) -> Option<usize> {
    // The error over all instants may be smaller.
    tried(runs, regression).filter(|tried| tried.error <= 1.2 * largest_error).map(|tried| tried.degree)
}

/// The polynomial with the least error at left-out runs.
struct Tried {
    degree: usize,
    /// Largest error over the width of the hull, both averaged over the probes [-].
    error: f64,
    /// Errors of the rows of all runs, rows x probes.
    errors: Vec<f64>,
    /// Number of instants at which it was tried.
    probes: usize,
}

fn tried(runs: &Runs<'_>, regression: &Regression) -> Option<Tried> {
    let last = runs.samples - 1;
    let count = PROBES.min(runs.samples);
    let probes: Vec<usize> = (0..count).map(|probe| probe * last / (count - 1).max(1)).collect();
    let rows = runs.values.chunks_exact(runs.samples);
    let values: Vec<f64> = rows.flat_map(|row| probes.iter().map(|&at| row[at])).collect();
    let at_probes = Runs { values: &values, samples: count, ..*runs };
    let most = regression.largest_degree()?;
    let means = means(&at_probes);
    let projected = regression.project(&means, count, most);
    let mut residuals = means.to_vec();
    let mut best: Option<Tried> = None;
    for degree in 0..=most {
        regression.reduce(&mut residuals, &projected, count, degree);
        let errors = errors_of_rows(&at_probes, &means, regression.leave_one_out(&residuals, count, degree));
        let error = relative_error(&at_probes, &farthest(&errors, count, runs.block));
        if best.as_ref().is_none_or(|best| error < best.error) {
            best = Some(Tried { degree, error, errors, probes: count });
        }
        if error < NEGLIGIBLE_ERROR {
            break;
        }
    }
    best
}

/// Means of the rows of every run, runs x samples: least squares of the rows and of their means are the same.
fn means<'a>(runs: &Runs<'a>) -> Cow<'a, [f64]> {
    if runs.block == 1 {
        return Cow::Borrowed(runs.values);
    }
    let samples = runs.samples;
    let mut means = Vec::with_capacity(runs.values.len() / runs.block);
    for rows in runs.values.chunks_exact(samples * runs.block) {
        let sum = |at: usize| rows.iter().skip(at).step_by(samples).sum::<f64>();
        means.extend((0..samples).map(|at| sum(at) / runs.block as f64));
    }
    Cow::Owned(means)
}

/// Errors of the rows of all runs when the run is left out, from those of the means of the runs.
fn errors_of_rows(runs: &Runs<'_>, means: &[f64], errors: Vec<f64>) -> Vec<f64> {
    if runs.block == 1 {
        return errors;
    }
    let rows = runs.values.chunks_exact(runs.samples).enumerate();
    rows.flat_map(|(row, values)| {
        let from = row / runs.block * runs.samples;
        let errors_of_run_means = means[from..].iter().zip(&errors[from..]);
        values.iter().zip(errors_of_run_means).map(|(value, (mean, error))| value - mean + error)
    })
    .collect()
}

/// Largest error of all rows at every instant, and its run.
fn farthest(errors: &[f64], samples: usize, block: usize) -> Vec<(f64, usize)> {
    let mut farthest = vec![(0.0_f64, 0); samples];
    for (row, errors) in errors.chunks_exact(samples).enumerate() {
        for (farthest, error) in farthest.iter_mut().zip(errors) {
            if error.abs() > farthest.0 {
                *farthest = (error.abs(), row / block);
            }
        }
    }
    farthest
}

/// Largest error of the runs over the width of the hull of the others, both averaged over time; 0 where the error is
/// rounding.
fn relative_error(runs: &Runs<'_>, farthest: &[(f64, usize)]) -> f64 {
    let mut hull = vec![(f64::INFINITY, f64::NEG_INFINITY); runs.samples];
    let mut sizes = vec![0.0_f64; runs.samples];
    for (row, values) in runs.values.chunks_exact(runs.samples).enumerate() {
        for ((&value, &(_, left_out)), (hull, size)) in
            values.iter().zip(farthest).zip(hull.iter_mut().zip(&mut sizes))
        {
            *size = size.max(value.abs());
            if row / runs.block != left_out {
                *hull = (hull.0.min(value), hull.1.max(value));
            }
        }
    }
    let width: f64 = hull.iter().map(|(lower, upper)| upper - lower).sum();
    let error: f64 = farthest.iter().map(|(error, _)| error).sum();
    // Rounding of the fit must not count against an output that does not vary.
    if error <= ROUNDING_OF_SOLUTION * sizes.iter().sum::<f64>() { 0.0 } else { error / width }
}

/// Smallest and largest value of all rows at every instant.
pub(super) fn hull(runs: &Runs<'_>) -> [Vec<f64>; 2] {
    let mut lower = vec![f64::INFINITY; runs.samples];
    let mut upper = vec![f64::NEG_INFINITY; runs.samples];
    for row in runs.values.chunks_exact(runs.samples) {
        for (at, &value) in row.iter().enumerate() {
            lower[at] = lower[at].min(value);
            upper[at] = upper[at].max(value);
        }
    }
    [lower, upper]
}

/// Certified bounds of the polynomials over the box, found in blocks of time: tight where the tensor of
/// coefficients is small.
fn range(coefficients: &[f64], samples: usize, parameters: usize, degree: usize) -> [Vec<f64>; 2] {
    let starts: Vec<usize> = (0..samples).step_by(BLOCK).collect();
    let of_block = |&start: &usize| {
        let end = (start + BLOCK).min(samples);
        let rows = coefficients.chunks_exact(samples);
        let block: Vec<f64> = rows.flat_map(|row| row[start..end].iter().copied()).collect();
        range_of_block(&block, end - start, parameters, degree)
    };
    let blocks: Vec<[Vec<f64>; 2]> = starts.par_iter().map(of_block).collect();
    [0, 1].map(|side| blocks.iter().flat_map(|block| block[side].iter().copied()).collect())
}

/// As [`range`], one after the other.
fn range_of_block(coefficients: &[f64], samples: usize, parameters: usize, degree: usize) -> [Vec<f64>; 2] {
    let degrees = vec![degree; parameters];
    let certified = tensor(coefficients, samples, parameters, degree).and_then(|tensor| {
        Polynomials::new(&tensor, samples, &degrees)
            .and_then(|polynomials| polynomial_ranges(&polynomials, Some(1)))
            .ok()
    });
    if let Some(ranges) = certified {
        return [ranges.lower, ranges.upper];
    }
    let search = SparseRange::new(parameters, degree, COARSE);
    let mut column = vec![0.0; coefficients.len() / samples];
    let mut result = [vec![0.0; samples], vec![0.0; samples]];
    for at in 0..samples {
        column.iter_mut().zip(coefficients.chunks_exact(samples)).for_each(|(c, row)| *c = row[at]);
        let [low, high] = search.range(&column);
        (result[0][at], result[1][at]) = (low.bound, high.bound);
    }
    result
}

/// The coefficients as an array of `degree` + 1 terms for every parameter, if it is not too large.
fn tensor(coefficients: &[f64], samples: usize, parameters: usize, degree: usize) -> Option<Vec<f64>> {
    let terms = (degree + 1).checked_pow(parameters as u32).filter(|&terms| terms <= LARGEST_TENSOR)?;
    let mut tensor = vec![0.0; terms * samples];
    let exponents = exponents(parameters, degree);
    for (term, row) in exponents.chunks_exact(parameters).zip(coefficients.chunks_exact(samples)) {
        let place = term.iter().fold(0, |place, exponent| place * (degree + 1) + exponent);
        tensor[place * samples..][..samples].copy_from_slice(row);
    }
    Some(tensor)
}

/// Where runs are outside of the band whose margin was made without them. Only the run with the largest error of a
/// window can be.
fn held_out_excesses(
    runs: &Runs<'_>,
    largest: Vec<TopTwo>,
    window: Window,
    lowest: &[f64],
    highest: &[f64],
) -> Vec<Excess> {
    let mut growing = GrowingWindow::new(largest, runs.ends);
    let margins = growing.grow(window.whole);
    let mut excesses = Vec::new();
    for (at, margin) in margins.iter().enumerate() {
        if margin.run != NEVER_LEFT_OUT {
            for row in 0..runs.block {
                let value = runs.values[(margin.run as usize * runs.block + row) * runs.samples + at];
                let score = (value - highest[at]).max(lowest[at] - value) - margin.second;
                // For an output that does not vary, the fit and its range differ by rounding.
                if score > ROUNDING_OF_SOLUTION * value.abs() {
                    excesses.push(Excess { run: margin.run, score });
                }
            }
        }
    }
    excesses
}
