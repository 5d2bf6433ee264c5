//! What runs do in bands that were made without them.

use super::running::Ends;

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

/// Where one run leaves a bound that was made without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess {
    /// Which run.
    pub run: u32,
    /// By how much; above 0.
    pub score: f64,
}

/// What held-out runs did, given where they are outside (scores above 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Share of the samples that are inside [-].
    pub coverage: f64,
    /// Estimated probability that a whole new run is inside [-].
    pub whole_run: f64,
}

/// Share of the samples for which a held-out run that leaves the band of the others, before that is widened, stays
/// outside [-]: the mean over these runs, each weighted by its share. 0 where none leaves it.
pub fn persistence(outside: impl Iterator<Item = u32>, runs: &Runs<'_>) -> f64 {
    let mut of_runs = vec![0.0_f64; runs.scored];
    outside.for_each(|run| of_runs[run as usize] += 1.0);
    let sum: f64 = of_runs.iter().sum();
    let square: f64 = of_runs.iter().map(|count| count * count).sum();
    if sum > 0.0 { square / (sum * (runs.block * runs.samples) as f64) } else { 0.0 }
}

impl HeldOut {
    /// From the excesses of a band.
    pub fn of(excesses: &[Excess], runs: &Runs<'_>) -> Self {
        let mut left = vec![false; runs.scored];
        excesses.iter().for_each(|excess| left[excess.run as usize] = true);
        let inside = left.iter().filter(|left| !**left).count();
        // The i-th smallest of the largest scores of N exchangeable runs bounds that of a further one with
        // probability i / (N + 1) `[VovkGammermanShafer2005]`. One run is subtracted because the same runs chose
        // the band.
        Self {
            coverage: 1.0 - excesses.len() as f64 / (runs.scored * runs.block * runs.samples) as f64,
            whole_run: inside.saturating_sub(1) as f64 / (runs.scored + 1) as f64,
        }
    }
}
