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
}

/// Part of the share of samples that may be outside which is aimed at with very many runs: held-out runs were
/// used to choose the band, so that they promise too much. The numbers here were chosen together on seven
/// problems of 16 to 321 runs (`benchmarks/bands.py`), so that at 99.9 % asked for 99.95 % of the samples of 600 to
/// 1000 fresh runs are inside in the mean over five or six studies.
const AIM: f64 = 0.38;

/// Rows at which half of that is aimed at: few runs say less of the next one.
const FEW: f64 = 55.0;

/// Revolutions of held-out runs do not promise too much: what they are aimed at grows to all that may be outside.
/// Chosen on three problems of 9 to 41 runs with nine revolutions each.
fn aim_of(block: usize) -> f64 {
    1.0 - (1.0 - AIM) / block as f64
}

/// The tail of the scores is fitted from where this many times the share aimed at is outside: few runs decide
/// where the share itself is reached. From 10 to 40 the mean width falls and scatters less.
const TAIL: f64 = 40.0;

impl Demand {
    /// Samples of all runs together that may be outside.
    fn allowed(&self) -> f64 {
        let rows = (self.runs * self.block) as f64;
        let aim = aim_of(self.block) * rows / (rows + FEW) * (1.0 - self.coverage);
        aim * (self.runs + 1) as f64 * (self.block * self.samples) as f64
    }
}

/// Number of local spreads by which a bound must be widened so that no more samples are outside than the
/// demand allows.
///
/// The run that is outside most counts twice: the next run may be like it. Beyond the start of the tail the
/// scores are taken as exponentially distributed, which makes the result depend on all of them instead of
/// the few largest. Nothing is asked of the largest score of a run, which grows with the number of samples.
pub fn inflation(excesses: &[Excess], demand: &Demand) -> f64 {
    let allowed = demand.allowed();
    let mut scores: Vec<f64> = excesses.iter().map(|excess| excess.score).collect();
    if let Some(worst) = worst_run(excesses, demand.runs) {
        scores.extend(excesses.iter().filter(|excess| excess.run == worst).map(|excess| excess.score));
    }
    if scores.len() as f64 <= allowed {
        return 0.0;
    }
    let tail = ((TAIL * allowed) as usize).min(scores.len() - 1);
    let at = scores.len() - 1 - tail;
    let (_, &mut start, above) = scores.select_nth_unstable_by(at, f64::total_cmp);
    if tail < 3 {
        return above.iter().fold(start, |largest, &score| largest.max(score));
    }
    // In order, so that the sum does not depend on how the selection works.
    above.sort_unstable_by(f64::total_cmp);
    let mean = above.iter().map(|score| score - start).sum::<f64>() / tail as f64;
    start + mean * (tail as f64 / allowed).ln().max(0.0)
}

/// The run with the largest sum of scores.
fn worst_run(excesses: &[Excess], runs: usize) -> Option<u32> {
    let mut sums = vec![0.0; runs];
    for excess in excesses {
        sums[excess.run as usize] += excess.score;
    }
    (0..runs).max_by(|&a, &b| sums[a].total_cmp(&sums[b])).map(|run| run as u32)
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
