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
/// over five or six studies. The second four-bar took no part in the choice; the chain and two pins were looked
/// at for what rare motions need.
const TARGET_PER_RUN: f64 = 1.0 / 180.0;
const LARGEST_TARGET: f64 = 0.9;

/// Number of parameters for which the target holds. A point that is left out of an even set leaves a hole. The
/// fewer parameters there are, the larger the hole is against the distance of new points from their neighbors.
/// The target therefore falls as one over the square root of the number of parameters. With more parameters than
/// these that is because few runs contain rare motions, and ends where there are many more than a first number.
const REFERENCE_PARAMETERS: f64 = 2.0;
const FEW_RUNS: f64 = 41.0;

/// Prior of the mean excess [local spreads]: the geometric mean over the problems, windows and numbers of runs.
/// Single studies find 0.02 to 0.4: a few runs contain a rare motion or they do not. It is proportional to the
/// heaviness of the tail from a usual one on: at 41 runs the best level of all studies of a mechanism grows from
/// 0.2 to 0.65 local spreads between a heaviness of 0.5 and 0.9.
const PRIOR_EXCESS: f64 = 0.0625;
const USUAL_HEAVINESS: f64 = 0.65;

/// Weight of [`PRIOR_EXCESS`] against the mean excess of the study itself. Runs of several revolutions contain
/// more rare motions: this weight and the power below are then divided by the square root of their number.
const PRIOR_WEIGHT: f64 = 0.4;

/// Where the spread of the runs is uneven in time, a rare excess at an instant of small spread may be as large as
/// a common one at an instant of large spread. Bounds are therefore widened in proportion to this power of the
/// unevenness, up to a largest one.
const UNEVENNESS_POWER: f64 = 0.6;
const LARGEST_UNEVENNESS: f64 = 2.5;

/// Mean excess where the bound is set by rare motions of a few runs [local spreads]. What the study itself finds
/// then says little: penetrations of P2 and P3b, where single runs lift off, would need 0.3 to 0.7.
const RARE_EXCESS: f64 = 0.55;

/// Rarities at which a bound begins to be, and is entirely, set by rare motions.
const RARE: [f64; 2] = [0.5, 1.15];

/// Beyond this rarity a single run holds the bound: it is so far out that less is added, as one over the square.
const SINGLE: f64 = 1.5;

/// The heaviness counts up to this one for the rarity, and the rarity of so many equal runs of heaviness 1 is 1.
const COUNTED_HEAVINESS: f64 = 0.9;
const FEW_HOLDERS: f64 = 3.0;

/// A bound is widened by at most the largest excess times 1 plus this number over the number of runs; where rare
/// motions set it, up to ten times that excess.
const LARGEST_EXCESS_MARGIN: f64 = 8.0;
const RARE_MARGIN: f64 = 9.0;

/// Below this heaviness, mean of both sides, a tail is light: the level may be lowered in proportion to this power of
/// it, down to a least one. Chosen in hindsight, for all studies of a mechanism, levels are 0.8 of the usual ones at
/// a heaviness of 0.5, 0.65 at 0.44, 0.4 at 0.36 and at most 0.35 at 0.25.
const LIGHT_HEAVINESS: f64 = 0.57;
const LIGHT_POWER: f64 = 1.5;
/// The least level, relative to the usual one.
pub const LEAST_LEVEL: f64 = 0.5;

/// Numbers of runs that hold the bounds from which light tails count, and count entirely: fewer do not tell.
const HOLDERS_OF_LIGHT: [f64; 2] = [3.0, 5.0];

/// Share of what may be outside that held-out runs leave where the level is lowered: over time, and with several
/// revolutions of each run, which tell more. It is reached with so many runs, or with as many divided by the square
/// root of the number of revolutions.
const LOWERED_TARGET: f64 = 0.7;
const LOWERED_TARGET_OF_REVOLUTIONS: f64 = 0.9;
const MANY_RUNS: f64 = 81.0;

impl Requirement {
    /// Samples of held-out runs that may be outside at one side.
    fn allowed(&self) -> f64 {
        let rows = (self.runs * self.block) as f64;
        let target = ((rows * TARGET_PER_RUN).min(LARGEST_TARGET) * self.evenness()).min(1.0);
        0.5 * target * (1.0 - self.coverage) * rows * self.samples as f64
    }

    fn evenness(&self) -> f64 {
        let parameters = REFERENCE_PARAMETERS / self.parameters as f64;
        let power = if parameters < 1.0 { (FEW_RUNS / self.runs as f64).sqrt().min(1.0) } else { 1.0 };
        parameters.powf(0.5 * power)
    }

    /// How far the level may be lowered where tails are light, from [`LEAST_LEVEL`] to 1.
    ///
    /// Few runs with several revolutions tell of light tails too, but not where the spread is uneven in time.
    pub fn least_level(&self, tails: [&Tail; 2]) -> f64 {
        let [begin, end] = HOLDERS_OF_LIGHT;
        let measured = tails.map(|tail| {
            if self.block > 1 {
                (tail.heaviness * tail.unevenness.min(LARGEST_UNEVENNESS), 1.0)
            } else {
                (tail.heaviness, ((tail.holders / begin).ln() / (end / begin).ln()).clamp(0.0, 1.0))
            }
        });
        let heaviness = 0.5 * (measured[0].0 + measured[1].0);
        let weight = 0.5 * (measured[0].1 + measured[1].1);
        (heaviness / LIGHT_HEAVINESS).min(1.0).powf(LIGHT_POWER * weight).max(LEAST_LEVEL)
    }

    /// Coverage of held-out runs down to which the level is lowered [-].
    pub fn lowered_aim(&self) -> f64 {
        let runs = self.runs as f64 * (self.block as f64).sqrt();
        let target = if self.block > 1 { LOWERED_TARGET_OF_REVOLUTIONS } else { LOWERED_TARGET };
        let target = target * (runs / MANY_RUNS).min(1.0) * self.evenness();
        1.0 - target.min(1.0) * (1.0 - self.coverage)
    }
}

/// How one side of the hull of the runs is made, over all time. The reach is the distance of the hull from the
/// mean run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tail {
    /// Root mean square of the reach over its mean.
    pub unevenness: f64,
    /// Distance from the largest value to the fourth largest over the reach, both summed over time, relative to
    /// what is expected of exponentially distributed values: about 0.5 where values are normally distributed.
    pub heaviness: f64,
    /// Effective number of runs that have the largest value, weighted by the square of the reach.
    pub holders: f64,
}

/// The largest values that tell of the heaviness of a tail. Fewer depend on single runs: the heaviness of six studies of
/// one mechanism then differs by 50 % instead of 30 %.
const RANKS: usize = 4;

impl Tail {
    /// The tail of the first `scored` runs of `values`, rows x samples with `block` rows a run; `holders` are the runs
    /// of the largest values at every instant.
    pub fn of(values: &[f64], reach: &[f64], scored: usize, block: usize, holders: &[u32]) -> Self {
        let samples = reach.len();
        let sum: f64 = reach.iter().sum();
        if sum <= 0.0 {
            return Self::USUAL;
        }
        let square: f64 = reach.iter().map(|reach| reach * reach).sum();
        let mut of_runs = vec![0.0; scored + 1];
        for (reach, &run) in reach.iter().zip(holders) {
            of_runs[(run as usize).min(scored)] += reach * reach;
        }
        let ranks = RANKS.min(scored);
        let mut largest = vec![f64::NEG_INFINITY; ranks * samples];
        for rows in values.chunks_exact(samples * block).take(scored) {
            for (at, ranked) in largest.chunks_exact_mut(ranks).enumerate() {
                let value = rows.iter().skip(at).step_by(samples).copied().fold(f64::NEG_INFINITY, f64::max);
                if value > ranked[ranks - 1] {
                    let place = ranked.iter().position(|&other| value > other).unwrap_or(ranks - 1);
                    ranked[place..].rotate_right(1);
                    ranked[place] = value;
                }
            }
        }
        let distance: f64 = largest.chunks_exact(ranks).map(|ranked| ranked[0] - ranked[ranks - 1]).sum();
        // Of exponentially distributed values, in their standard deviations.
        let harmonic = |count: usize| (1..=count).map(|rank| 1.0 / rank as f64).sum::<f64>();
        let expected = harmonic(ranks - 1) / (harmonic(scored) - 1.0);
        Self {
            unevenness: (square * samples as f64).sqrt() / sum,
            heaviness: distance / sum / expected,
            holders: square * square / of_runs.iter().map(|of_run| of_run * of_run).sum::<f64>(),
        }
    }

    /// Even in time, with a usual tail to which many runs contribute.
    pub const USUAL: Self = Self { unevenness: 1.0, heaviness: USUAL_HEAVINESS, holders: f64::INFINITY };

    /// From 0 to 1: how far the bound is set by rare motions, which few of the runs contain.
    fn rareness(&self) -> f64 {
        let [begin, end] = RARE;
        ((self.rarity() / begin).ln() / (end / begin).ln()).clamp(0.0, 1.0)
    }

    fn rarity(&self) -> f64 {
        FEW_HOLDERS * self.heaviness.min(COUNTED_HEAVINESS).powi(2) / self.holders
    }
}

/// Number of local spreads by which a bound must be widened so that no more samples are outside than the requirement
/// allows.
///
/// Excesses are taken as exponentially distributed, so that their number gives the inflation in mean excesses.
/// The number is known well, since all instants count. The mean depends on the few runs that are furthest outside;
/// it is therefore shrunk toward its prior, entirely where rare motions of a few runs set the bound. The largest
/// excess of a run enters only as a limit, as it grows with the number of samples.
pub fn inflation(excesses: &[Excess], requirement: &Requirement, tail: &Tail) -> f64 {
    let (count, allowed) = (excesses.len() as f64, requirement.allowed());
    if count <= allowed {
        return 0.0;
    }
    let mean = excesses.iter().map(|excess| excess.score).sum::<f64>() / count;
    let block = (requirement.block as f64).sqrt();
    let rareness = tail.rareness();
    let weight = (PRIOR_WEIGHT + (1.0 - PRIOR_WEIGHT) * rareness) / block;
    let usual = PRIOR_EXCESS * (tail.heaviness / USUAL_HEAVINESS).max(1.0);
    let prior = usual.powf(1.0 - rareness) * RARE_EXCESS.powf(rareness);
    let single = (SINGLE / tail.rarity()).min(1.0).powi(2);
    let mean = mean.powf(1.0 - weight) * prior.powf(weight) * single;
    let factor = tail.unevenness.min(LARGEST_UNEVENNESS).powf(UNEVENNESS_POWER / block);
    // Where motions are smooth, the tail is shorter than that of an exponential distribution.
    let largest = excesses.iter().map(|excess| excess.score).fold(0.0, f64::max);
    let margin = (LARGEST_EXCESS_MARGIN / requirement.runs as f64).max(RARE_MARGIN * rareness);
    (factor * mean * (count / allowed).ln()).min((1.0 + margin) * largest)
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
