//! Bands of outputs over a box of parameters, from runs at points of it, with what held-out runs say of them.
//! In: values of runs, the points, the required coverage; out: bounds, the method that gave them, and the coverage
//! of held-out runs. Uses no mechanism; its only threads are those of its own pool.

pub mod extremes;
pub mod held_out;
pub mod independent;
pub mod regression;
pub mod resolve;
pub mod running;
pub mod sparse_range;
pub mod widened;

use crate::study::chebyshev::GridError;
use crate::study::pool::{private_pool, thread_count};
use crate::study::sweep::Monitor;
use held_out::{HeldOut, Runs};
use independent::independent;
use regression::Regression;
use resolve::{LARGEST_DEGREE, LARGEST_TERM_SHARE, extrapolated, resolved};
use running::Ends;
use widened::widened;

/// A polynomial that follows the response.
#[derive(Clone, Debug)]
pub struct Polynomial {
    /// Total degree.
    pub degree: usize,
    /// Largest error at held-out runs over the width of the hull, both averaged over time [-].
    pub error: f64,
    /// Coefficients in the order of [`regression::exponents`], terms x samples.
    pub coefficients: Vec<f64>,
}

/// The band of one output.
#[derive(Clone, Debug)]
pub struct OutputBand {
    /// Lower bounds, one for every sample.
    pub lower: Vec<f64>,
    /// Upper bounds.
    pub upper: Vec<f64>,
    /// Half-length of the window of the running extremes, in samples.
    pub window: f64,
    /// Local spreads by which the band was widened to either side; 0 with a polynomial.
    pub inflation: f64,
    /// Clustering of exceedances, the larger of two: the share of the samples for which a held-out run that leaves the
    /// band of the others, before that is widened, stays outside, and what [`resolve::persistence`] finds [-]; 0 with
    /// a polynomial.
    pub persistence: f64,
    /// What held-out runs did.
    pub held_out: HeldOut,
    /// The polynomial the band is made from, if one follows the response.
    pub polynomial: Option<Polynomial>,
}

/// Sizes of which powers up to the fourth are numbers.
const USUAL_SIZES: std::ops::RangeInclusive<f64> = 1e-60..=1e60;

/// Largest size of a value, whose square is a number still.
const LARGEST_VALUE: f64 = 1e150;

/// Share of its time for which a run that leaves the band of the others stays outside, from which its place in the box
/// matters more than impacts do: runs in corners without a run near them are then outside together, and the band holds
/// the range of the polynomial too. Half of it: 10 of 528 bands of `benchmarks/bands.py` by 41 and 81 runs are 1 to 2 %
/// wider. Twice: positions by crank angle (crank ±1 %, clearance ±50 %; 12 and 21 runs) keep 99.8 % instead of 100 %.
const ROUGH_PERSISTENCE: f64 = 0.3;

/// Largest error of a polynomial that tells so much, relative to the width of the hull: one that explains nothing has a
/// wide range in a box of many parameters. Half of it: no band changes; twice: one of 528 by 12 runs, 1 % wider.
const LARGEST_ROUGH_ERROR: f64 = 0.25;

/// Most terms of a polynomial, however many the runs: the factorization takes a time that grows with the square of
/// their number, with 4096 runs and 1287 terms (8 parameters, degree 5) 9 s. It costs no accuracy where impacts
/// scatter: with eight parameters and 1000 to 3000 runs degree 2 is the best for displacement and velocity of P5
/// of `benchmarks/bands.py` (5.9 % of the width for the velocity; degree 4 7.6 %, degree 5 17 % with 3000 runs). A six-bar
/// without clearance and seven parameters has 0.3 % for the acceleration with degree 4 and would have 0.1 % with degree 5.
/// Half and twice change none of 150 bands.
const LARGEST_TERM_COUNT: usize = 500;

/// Terms of the polynomials of the largest degree that is tried.
pub fn tried_terms(rows: usize, parameters: usize) -> usize {
    let counts = (1..=LARGEST_DEGREE).map(|degree| regression::term_count(parameters, degree));
    counts.take_while(|&count| count <= largest_term_count(rows)).last().unwrap_or(1)
}

fn largest_term_count(rows: usize) -> usize {
    ((LARGEST_TERM_SHARE * rows as f64) as usize).min(LARGEST_TERM_COUNT)
}

/// How bands are made from runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By held-out runs, with a polynomial where one follows the response.
    Calibrated,
    /// By held-out runs alone: a polynomial would be extrapolated into a part of the box that the runs leave out.
    OfRuns,
    /// The hull of independent runs, see [`independent`], with a polynomial where one follows the response.
    Independent,
}

/// The points of the runs and what is asked of their bands, prepared for one output after the other: so only one
/// need be in the memory as a table of its own.
#[derive(Clone, Debug)]
pub struct Design {
    regression: Regression,
    /// Number of runs.
    rows: usize,
    /// Rows of a run.
    block: usize,
    ends: Ends,
    scored: usize,
    coverage: f64,
    method: Method,
}

impl Design {
    /// Prepares runs at `points` in [-1, 1]^k, row-major rows x parameters, for bands with `coverage` of the samples of
    /// further runs inside. With `revolutions` every run has that many rows, pooled over the crank angle, the first
    /// and last sample of each at the same angle; else the samples are instants. The first `scored` runs are spread
    /// evenly or at random over the box and are held out in turn; the others are never left out. None if the monitor
    /// said no.
    ///
    /// # Errors
    ///
    /// Numbers that do not fit each other, fewer than three scored runs, a point outside the cube, a coverage that is not
    /// between 0 and 1.
    pub fn new(
        points: &[f64],
        parameters: usize,
        revolutions: Option<usize>,
        scored: usize,
        coverage: f64,
        method: Method,
        monitor: Monitor,
    ) -> Result<Option<Self>, GridError> {
        let block = revolutions.unwrap_or(1);
        check(points, parameters, block, scored, coverage)?;
        let ends = if revolutions.is_some() { Ends::Joined } else { Ends::Cut };
        let rows = points.len() / parameters;
        let terms = largest_term_count(rows);
        let regression = Regression::new(points, parameters, LARGEST_DEGREE, terms, monitor);
        Ok(regression.map(|regression| Self { regression, rows, block, ends, scored, coverage, method }))
    }

    /// The band of one output of values rows x samples with physical `limits`; None if the monitor said no, which is
    /// asked before. The work is done on `threads` threads of a private pool (default: one for every processor); its
    /// pieces are put together in order, so the bits are the same for any number.
    ///
    /// # Errors
    ///
    /// Values that do not fit the points or are not finite, fewer than two samples, threads that cannot be started.
    pub fn band(
        &self,
        values: &[f64],
        samples: usize,
        limits: [f64; 2],
        threads: Option<usize>,
        monitor: Monitor,
    ) -> Result<Option<OutputBand>, GridError> {
        self.check_values(values, samples)?;
        let pool = private_pool(thread_count(threads, usize::MAX))?;
        Ok(monitor().then(|| pool.install(|| self.scaled(values, samples, limits))))
    }

    /// The band of one output of values that were checked, in a unit in which powers of them are numbers.
    fn scaled(&self, values: &[f64], samples: usize, limits: [f64; 2]) -> OutputBand {
        let size = values.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
        if size == 0.0 || USUAL_SIZES.contains(&size) {
            return self.judged(values, samples, limits);
        }
        // Powers of two, so that no digit is lost.
        let unit = size.log2().floor().max(-1000.0).exp2();
        let values: Vec<f64> = values.iter().map(|value| value / unit).collect();
        let mut band = self.judged(&values, samples, limits.map(|limit| limit / unit));
        let coefficients = band.polynomial.iter_mut().flat_map(|polynomial| &mut polynomial.coefficients);
        band.lower.iter_mut().chain(&mut band.upper).chain(coefficients).for_each(|value| *value *= unit);
        band
    }

    /// As [`Design::scaled`], of values of a usual size.
    fn judged(&self, values: &[f64], samples: usize, limits: [f64; 2]) -> OutputBand {
        let Self { block, ends, scored, coverage, .. } = *self;
        let runs = Runs { values, samples, block, ends, scored, limits };
        match self.method {
            Method::OfRuns => lasting(widened(&runs, coverage), &runs, &self.regression),
            Method::Calibrated | Method::Independent => {
                band(&runs, &self.regression, coverage, self.method == Method::Independent)
            }
        }
    }

    fn check_values(&self, values: &[f64], samples: usize) -> Result<(), GridError> {
        let Self { rows, block, .. } = *self;
        if samples < 2 {
            return Err(GridError::new(format!("samples must be >= 2, got {samples}")));
        }
        let needed = [block, samples].iter().try_fold(rows, |count: usize, &size| count.checked_mul(size));
        if needed != Some(values.len()) {
            return Err(GridError::new(format!(
                "{} values: {rows} runs x {block} rows x {samples} samples are needed",
                values.len()
            )));
        }
        if let Some(at) = values.iter().position(|value| value.is_nan() || value.abs() > LARGEST_VALUE) {
            let run = at / (block * samples);
            return Err(GridError::new(format!(
                "run {run} has a value {:e}: all must be finite and at most {LARGEST_VALUE:e} in size",
                values[at]
            )));
        }
        Ok(())
    }
}

/// The band of one output; where no polynomial follows it, the hull of independent runs, or a widened band.
fn band(runs: &Runs<'_>, regression: &Regression, coverage: f64, are_independent: bool) -> OutputBand {
    // The error of a polynomial is small in the mean over time, and may be large at some instants.
    let holds = |band: &OutputBand| band.held_out.coverage >= coverage;
    let unresolved = || {
        if are_independent {
            return independent(runs);
        }
        lasting(with_corners(widened(runs, coverage), runs, regression), runs, regression)
    };
    resolved(runs, regression).filter(holds).unwrap_or_else(unresolved)
}

/// A calibrated band that knows how long what no polynomial explains lasts in a run. Revolutions of one run show that by
/// themselves.
fn lasting(mut band: OutputBand, runs: &Runs<'_>, regression: &Regression) -> OutputBand {
    if runs.block == 1 {
        band.persistence = band.persistence.max(resolve::persistence(runs, regression));
    }
    band
}

/// A calibrated band that contains the range of the polynomial too, where motions follow one roughly.
fn with_corners(mut band: OutputBand, runs: &Runs<'_>, regression: &Regression) -> OutputBand {
    if band.persistence >= ROUGH_PERSISTENCE
        && let Some([lowest, highest]) = extrapolated(runs, regression, LARGEST_ROUGH_ERROR)
    {
        band.lower.iter_mut().zip(&lowest).for_each(|(bound, &end)| *bound = bound.min(end));
        band.upper.iter_mut().zip(&highest).for_each(|(bound, &end)| *bound = bound.max(end));
    }
    band
}

fn check(
    points: &[f64],
    parameters: usize,
    block: usize,
    scored: usize,
    coverage: f64,
) -> Result<(), GridError> {
    let fail = |message: String| Err(GridError::new(message));
    if parameters == 0 || !points.len().is_multiple_of(parameters) {
        return fail(format!("{} coordinates do not make points of {parameters} parameters", points.len()));
    }
    let rows = points.len() / parameters;
    if block == 0 {
        return fail("revolutions must be >= 1, got 0".to_owned());
    }
    if !(3..=rows).contains(&scored) || scored >= extremes::NEVER_LEFT_OUT as usize {
        return fail(format!("scored must be >= 3 and <= {rows}, got {scored}"));
    }
    if !(coverage > 0.0 && coverage < 1.0) {
        return fail(format!("coverage must be > 0 and < 1, got {coverage}"));
    }
    if let Some(at) = points.iter().position(|z| !(-1.0..=1.0).contains(z)) {
        return fail(format!("run {} is at {}, outside [-1, 1]", at / parameters, points[at]));
    }
    Ok(())
}
