//! How far a bound must be widened so that runs it does not know stay inside.

/// Where one run leaves a bound that was made without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess {
    /// Which run.
    pub run: u32,
    /// By how much, in local spreads; above 0.
    pub score: f64,
}

/// What held-out runs must do inside a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
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

/// Part of the share of samples that may be outside which is aimed at: that of each run, and the most. Held-out
/// runs were used to choose the band, and few of them tell little of rare motions, so that they promise too much.
///
/// This and the other constants of calibrated bands were chosen together on nine problems of
/// `benchmarks/bands.py` (P1 to P5, quick return, six-bar, pendulum) at 41, 81 and 321 runs, so that at 99.9 %
/// asked for 99.95 % of the samples of 600 to 2000 fresh runs are inside in the mean over five or six studies.
/// The chain was not looked at before.
const AIM_OF_RUN: f64 = 1.0 / 180.0;
const MOST_AIM: f64 = 0.9;

/// Parameters at which that is so. A point that is left out of an even set leaves a hole, which is the larger
/// against the distances of fresh points, the fewer parameters there are; so the aim falls as one over the root of
/// their number.
const USUAL_PARAMETERS: f64 = 2.0;

/// How far, in local spreads, held-out runs are beyond a bound where they are beyond it: the mean of the
/// logarithm over the problems, windows and numbers of runs. Single studies find 0.02 to 0.4, as it comes to whether
/// one of their few runs did something rare.
const USUAL_EXCESS: f64 = 0.065;

/// Weight of [`USUAL_EXCESS`] against the mean excess that a study finds itself. Runs of several revolutions show
/// more of what is rare: both this and the power below are then divided by the root of their number.
const USUAL_WEIGHT: f64 = 0.4;

/// Where the reach of the runs is uneven in time, what is rare at a quiet instant may be as large as what is
/// common at a loud one: bounds are widened by this power of the unevenness more.
const UNEVENNESS_POWER: f64 = 0.6;
const MOST_UNEVENNESS: f64 = 2.5;

/// A bound is widened by no more than the largest excess and this part of it, over the number of runs.
const BEYOND_LARGEST: f64 = 8.0;

impl Demand {
    /// Samples of held-out runs that may be outside at one side.
    fn allowed(&self) -> f64 {
        let rows = (self.runs * self.block) as f64;
        let evenness = (USUAL_PARAMETERS / self.parameters as f64).sqrt();
        let aim = ((rows * AIM_OF_RUN).min(MOST_AIM) * evenness).min(1.0);
        0.5 * aim * (1.0 - self.coverage) * rows * self.samples as f64
    }
}

/// Number of local spreads by which a bound must be widened so that no more samples are outside than the demand
/// allows.
///
/// Excesses are taken as exponentially distributed: their number says how many mean excesses are needed. The number is
/// well known, as all instants count, but the mean hangs on the few runs that are furthest outside, so that
/// it is drawn toward the usual one. `unevenness` is the root mean square of the reach of the runs over its mean,
/// both over time. Nothing is asked of the largest excess of each run, which grows with the number of samples.
pub fn inflation(excesses: &[Excess], demand: &Demand, unevenness: f64) -> f64 {
    let (count, allowed) = (excesses.len() as f64, demand.allowed());
    if count <= allowed {
        return 0.0;
    }
    let mean = excesses.iter().map(|excess| excess.score).sum::<f64>() / count;
    let block = (demand.block as f64).sqrt();
    let usual = USUAL_WEIGHT / block;
    let mean = mean.powf(1.0 - usual) * USUAL_EXCESS.powf(usual);
    let factor = unevenness.min(MOST_UNEVENNESS).powf(UNEVENNESS_POWER / block);
    // None was further outside: where motions are smooth the tail is shorter than that of an exponential.
    let largest = excesses.iter().map(|excess| excess.score).fold(0.0, f64::max);
    let most = (1.0 + BEYOND_LARGEST / demand.runs as f64) * largest;
    (factor * mean * (count / allowed).ln()).min(most)
}

/// What held-out runs did, given where they are outside (scores above 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Share of the samples that are inside [-].
    pub coverage: f64,
    /// Probability that may be promised of a further run to be inside throughout [-].
    pub whole_run: f64,
}

impl HeldOut {
    /// From the excesses of a band.
    pub fn of(excesses: &[Excess], demand: &Demand) -> Self {
        let mut left = vec![false; demand.runs];
        excesses.iter().for_each(|excess| left[excess.run as usize] = true);
        let inside = left.iter().filter(|left| !**left).count();
        // The i-th smallest of the largest scores of N exchangeable runs bounds that of a further one with
        // probability i / (N + 1) `[VovkGammermanShafer2005]`; one run is given up because the same runs
        // chose the window.
        Self {
            coverage: 1.0 - excesses.len() as f64 / (demand.runs * demand.block * demand.samples) as f64,
            whole_run: inside.saturating_sub(1) as f64 / (demand.runs + 1) as f64,
        }
    }
}
