//! How far a bound must be widened so that runs it was not made from stay inside.

/// Where one run leaves a bound that was made without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess {
    /// Which run.
    pub run: u32,
    /// By how much, in local spreads; above 0.
    pub score: f64,
}

/// Share of the samples of held-out runs that must be inside a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Requirement {
    /// Share of the samples that must be inside [-].
    pub coverage: f64,
    /// Number of runs that were held out.
    pub runs: usize,
    /// Rows of a run: its revolutions, or one.
    pub block: usize,
    /// Number of samples of a row.
    pub samples: usize,
    /// Number of parameters.
    pub parameters: usize,
}

/// The share of samples of held-out runs that is left outside, relative to the share that may be outside: what
/// each run adds to it, and its largest value. It is below 1 because held-out runs are optimistic: they were used to
/// choose the band, and few of them contain rare motions.
///
/// This and the other constants of calibrated bands were chosen together on nine problems of
/// `benchmarks/bands.py` (P1, P2, P3a, P3b, P4, P5, quick return, six-bar, pendulum) at 41, 81 and 321 runs. With
/// a required coverage of 99.9 %, 99.95 % of the samples of 600 to 2000 new runs are then inside, in the mean
/// over five or six studies. The chain took no part in the choice.
const TARGET_PER_RUN: f64 = 1.0 / 180.0;
const LARGEST_TARGET: f64 = 0.9;

/// Number of parameters for which the target holds. A point that is left out of an even set leaves a hole. The
/// fewer parameters there are, the larger the hole is against the distance of new points from their neighbors.
/// The target therefore falls as one over the square root of the number of parameters.
const REFERENCE_PARAMETERS: f64 = 2.0;

/// Prior of the mean excess [local spreads]: the geometric mean over the problems, windows and numbers of runs.
/// Single studies find 0.02 to 0.4: a few runs contain a rare motion or they do not.
const PRIOR_EXCESS: f64 = 0.065;

/// Weight of [`PRIOR_EXCESS`] against the mean excess of the study itself. Runs of several revolutions contain
/// more rare motions: this weight and the power below are then divided by the square root of their number.
const PRIOR_WEIGHT: f64 = 0.4;

/// Where the spread of the runs is uneven in time, a rare excess at an instant of small spread may be as large as
/// a common one at an instant of large spread. Bounds are therefore widened in proportion to this power of the
/// unevenness, up to a largest one.
const UNEVENNESS_POWER: f64 = 0.6;
const LARGEST_UNEVENNESS: f64 = 2.5;

/// A bound is widened by at most the largest excess times 1 plus this number over the number of runs.
const LARGEST_EXCESS_MARGIN: f64 = 8.0;

impl Requirement {
    /// Samples of held-out runs that may be outside at one side.
    fn allowed(&self) -> f64 {
        let rows = (self.runs * self.block) as f64;
        let evenness = (REFERENCE_PARAMETERS / self.parameters as f64).sqrt();
        let target = ((rows * TARGET_PER_RUN).min(LARGEST_TARGET) * evenness).min(1.0);
        0.5 * target * (1.0 - self.coverage) * rows * self.samples as f64
    }
}

/// Number of local spreads by which a bound must be widened so that no more samples are outside than the requirement
/// allows.
///
/// Excesses are taken as exponentially distributed, so that their number gives the inflation in mean excesses.
/// The number is known well, since all instants count. The mean depends on the few runs that are furthest outside;
/// it is therefore shrunk toward its prior. `unevenness` is the root mean square over the mean, both over time, of
/// the distance of the hull from the mean run. The largest excess of a run enters only as a limit, as it grows with
/// the number of samples.
pub fn inflation(excesses: &[Excess], requirement: &Requirement, unevenness: f64) -> f64 {
    let (count, allowed) = (excesses.len() as f64, requirement.allowed());
    if count <= allowed {
        return 0.0;
    }
    let mean = excesses.iter().map(|excess| excess.score).sum::<f64>() / count;
    let block = (requirement.block as f64).sqrt();
    let weight = PRIOR_WEIGHT / block;
    let mean = mean.powf(1.0 - weight) * PRIOR_EXCESS.powf(weight);
    let factor = unevenness.min(LARGEST_UNEVENNESS).powf(UNEVENNESS_POWER / block);
    // Where motions are smooth, the tail is shorter than that of an exponential distribution.
    let largest = excesses.iter().map(|excess| excess.score).fold(0.0, f64::max);
    let most = (1.0 + LARGEST_EXCESS_MARGIN / requirement.runs as f64) * largest;
    (factor * mean * (count / allowed).ln()).min(most)
}

/// What held-out runs did, given where they are outside (scores above 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Share of the samples that are inside [-].
    pub coverage: f64,
    /// Probability that a further run is inside throughout [-].
    pub whole_run: f64,
}

impl HeldOut {
    /// From the excesses of a band.
    pub fn of(excesses: &[Excess], requirement: &Requirement) -> Self {
        let mut left = vec![false; requirement.runs];
        excesses.iter().for_each(|excess| left[excess.run as usize] = true);
        let inside = left.iter().filter(|left| !**left).count();
        // The i-th smallest of the largest scores of N exchangeable runs bounds that of a further one with
        // probability i / (N + 1) `[VovkGammermanShafer2005]`. One run is subtracted because the same runs chose
        // the window.
        Self {
            coverage: 1.0
                - excesses.len() as f64 / (requirement.runs * requirement.block * requirement.samples) as f64,
            whole_run: inside.saturating_sub(1) as f64 / (requirement.runs + 1) as f64,
        }
    }
}
