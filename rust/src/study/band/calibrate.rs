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

/// Share of the samples of held-out runs that may be left outside, relative to the share that may be outside: with so
/// many runs or more, the reference number of parameters and a tail that is not light. It is below 1 because held-out
/// runs are optimistic: they were used to choose the band, and few of them contain rare motions. With fewer runs it
/// falls as the square root of their number. Runs of several revolutions count as more, and contain more rare motions.
///
/// This and the other constants of calibrated bands were chosen together on twelve problems of `benchmarks/bands.py` at
/// 41, 81 and 321 runs, 9 to 36 studies each. With a required coverage of 99.9 %, 99.95 % of the samples of new runs are
/// then inside at least, in the mean over the studies of a problem, to 0.01 %; of penetrations with rare lift-offs 99.9 %,
/// to 0.03 %.
const TARGET: f64 = 0.42;
const TARGET_OF_REVOLUTIONS: f64 = 0.8;
const MANY_RUNS: f64 = 81.0;

/// Number of parameters for which the target holds. With more, few runs contain rare motions: the target falls as one
/// over the square root of the number, and no longer where there are many more runs than [`FEW_RUNS`].
const REFERENCE_PARAMETERS: f64 = 2.0;
/// Number of runs that are few: constants that depend on the number of runs are those of so many.
const FEW_RUNS: f64 = 41.0;

/// Below this heaviness, mean of both sides, a tail is light: held-out runs are pessimistic, and the target rises as one
/// over the square root of the heaviness, to a largest ratio.
const LIGHT_HEAVINESS: f64 = 0.6;
const LARGEST_LIGHT_RATIO: f64 = 2.0;

/// The same with a single parameter. A point that is left out of an even set leaves a hole, which is the larger against
/// the distance of new points from their neighbors the fewer parameters there are. It matters where the tail is light,
/// since motions are smooth then; where the spread is uneven in time, less. Runs of several revolutions fill it. Chosen
/// on P3a and on seven problems of `benchmarks/bands.py` with one of their parameters alone.
const LIGHT_POWER_OF_ONE: i32 = -4;
const LARGEST_LIGHT_RATIO_OF_ONE: f64 = 2.8;

/// Mean excess of usual studies of [`FEW_RUNS`] runs [local spreads]. It falls as the cubic root of the number of runs.
const USUAL_EXCESS: f64 = 0.0625;

/// The usual excess counts as much as that of the study itself has been found by this number of runs. The logarithm of
/// the mean excess differs by 0.18 between studies of 41 runs of one mechanism, and by 0.4 between mechanisms.
const USUAL_RUNS: f64 = 8.0;

/// With more runs than [`FEW_RUNS`] the level falls as the ninth root of their number: tails are shorter than exponential
/// ones, the more so the further out a bound lies. At one level for all numbers accelerations of P1 by 321 runs are 1.08
/// times as wide as the hull of 4000 runs, now 1.03.
const LEVEL_POWER: f64 = 1.0 / 9.0;

/// Where the spread of the runs is uneven in time, a rare excess at an instant of small spread may be as large as
/// a common one at an instant of large spread. Bounds are therefore widened in proportion to the unevenness, up to this
/// one. Runs of several revolutions contain more rare motions: that factor and [`RARE_LEVEL`] then count with the power
/// of one over the square root of their number.
const LARGEST_UNEVENNESS: f64 = 2.1;

/// Level where the bound is set by rare motions of a few runs [local spreads], times the square of the tail's heaviness.
/// What the study itself finds then says little: penetrations of P2 and P3b, where single runs lift off. The spread is that
/// of the largest run: where that is far ahead of the others, a deep lift-off has been found, and less is to be expected
/// beyond it. With fewer than [`FEW_RUNS`] runs the level rises as the usual excess.
const RARE_LEVEL: f64 = 1.3;

/// Rarities at which a bound begins to be, and is entirely, set by rare motions.
const RARE: [f64; 2] = [0.6, 1.15];

/// Beyond this rarity a single run holds the bound: it is so far out that less is added, as one over the square.
const SINGLE: f64 = 1.5;

/// The heaviness counts up to this one for the rarity, and the rarity of so many equal runs of heaviness 1 is 1.
const COUNTED_HEAVINESS: f64 = 0.9;
const FEW_HOLDERS: f64 = 3.0;

/// A bound is widened by at most the largest excess times 1 plus this number over the number of runs; where rare
/// motions set it, up to ten times that excess.
const LARGEST_EXCESS_MARGIN: f64 = 8.0;
const RARE_MARGIN: f64 = 9.0;

/// Held-out runs may lower the level where the tail is light, down to this power of the heaviness over
/// [`LIGHT_HEAVINESS`]; elsewhere they do not tell, however many they are, since one run more or less outside decides. If
/// they might lower it everywhere, random processes would keep 99.82 instead of 99.91 % with 41 runs, and P4 99.955 instead
/// of 99.980 % with 321. Fewer runs than [`FEW_RUNS`] tell less in proportion, as do those of more than a number of
/// parameters.
const LIGHT_POWER: i32 = 3;
const FEW_PARAMETERS: f64 = 3.0;

/// Numbers of runs that hold the bounds from which held-out runs may lower the level, and may do so entirely.
const HOLDERS: [f64; 2] = [3.0, 5.0];

impl Requirement {
    /// Number of runs of one row that tell as much.
    fn effective_runs(&self) -> f64 {
        self.runs as f64 * (self.block as f64).sqrt()
    }

    /// Share of the samples of held-out runs that is to be outside of the band [-].
    pub fn target(&self, tails: [&Tail; 2]) -> f64 {
        let parameters = (REFERENCE_PARAMETERS / self.parameters as f64).min(1.0);
        let evenness = parameters.powf(0.5 * (FEW_RUNS / self.runs as f64).sqrt().min(1.0));
        let heaviness = self.relative_heaviness(tails);
        let light = match (self.parameters, self.block) {
            (1, 1) => {
                let [lower, upper] = tails.map(|tail| tail.unevenness.min(LARGEST_UNEVENNESS).sqrt());
                let light = (0.5 * (lower + upper) * heaviness).powi(LIGHT_POWER_OF_ONE);
                light.clamp(1.0, LARGEST_LIGHT_RATIO_OF_ONE)
            }
            _ => heaviness.powf(-0.5).clamp(1.0, LARGEST_LIGHT_RATIO),
        };
        let runs = (self.effective_runs() / MANY_RUNS).min(1.0).sqrt();
        let share = if self.block > 1 { TARGET_OF_REVOLUTIONS } else { TARGET };
        (share * runs * evenness * light).min(1.0) * (1.0 - self.coverage)
    }

    /// Heaviness of the tails over that below which they are light. With several revolutions it counts as more where the
    /// spread is uneven in time.
    fn relative_heaviness(&self, tails: [&Tail; 2]) -> f64 {
        let heaviness = tails.map(|tail| match self.block {
            1 => tail.heaviness,
            _ => tail.heaviness * tail.unevenness.min(LARGEST_UNEVENNESS),
        });
        0.5 * (heaviness[0] + heaviness[1]) / LIGHT_HEAVINESS
    }

    /// What the usual excess is multiplied by: 1 with 41 effective runs, more with fewer, less with more.
    pub(super) fn fewness(&self) -> f64 {
        (FEW_RUNS / self.effective_runs()).cbrt()
    }

    /// The mean excess that is expected of new runs [local spreads], from that of all windows and both sides of a study.
    ///
    /// The windows share most of their excesses, but their mean differs less between studies of one mechanism than that
    /// of a window, and a usual one adds to it where runs are few.
    pub fn mean_excess<'a>(&self, excesses: impl Iterator<Item = &'a Excess>) -> f64 {
        let (count, sum) = excesses.fold((0, 0.0), |(count, sum), excess| (count + 1, sum + excess.score));
        if count == 0 {
            return 0.0;
        }
        let weight = USUAL_RUNS / (USUAL_RUNS + self.effective_runs());
        (sum / f64::from(count)).powf(1.0 - weight) * (USUAL_EXCESS * self.fewness()).powf(weight)
    }

    /// The level at which held-out runs are asked first, relative to that of exponential excesses.
    pub fn usual_level(&self) -> f64 {
        let power = LEVEL_POWER / (self.block as f64).sqrt();
        (FEW_RUNS / self.effective_runs()).min(1.0).powf(power)
    }

    /// How far held-out runs may lower the usual level, from a least share of it to 1; not where few runs hold the bounds.
    pub fn least_share(&self, tails: [&Tail; 2]) -> f64 {
        let [begin, end] = HOLDERS;
        let known = tails.map(|tail| match self.block {
            1 => ((tail.holders / begin).ln() / (end / begin).ln()).clamp(0.0, 1.0),
            _ => 1.0,
        });
        let rareness = tails[0].rareness().max(tails[1].rareness());
        let light = 1.0 - self.relative_heaviness(tails).min(1.0).powi(LIGHT_POWER);
        let parameters = (FEW_PARAMETERS / self.parameters as f64).min(1.0);
        let telling = (parameters * self.effective_runs() / FEW_RUNS).min(1.0);
        1.0 - light * 0.5 * (known[0] + known[1]) * (1.0 - rareness) * telling
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

    /// Even in time, with a tail that is neither heavy nor light and to which many runs contribute.
    pub const USUAL: Self = Self { unevenness: 1.0, heaviness: 0.65, holders: f64::INFINITY };

    /// From 0 to 1: how far the bound is set by rare motions, which few of the runs contain.
    fn rareness(&self) -> f64 {
        let [begin, end] = RARE;
        ((self.rarity() / begin).ln() / (end / begin).ln()).clamp(0.0, 1.0)
    }

    fn rarity(&self) -> f64 {
        FEW_HOLDERS * self.heaviness.min(COUNTED_HEAVINESS).powi(2) / self.holders
    }
}

/// Number of local spreads by which a bound must be widened so that no more than a share of the samples of further runs
/// is outside at both sides together. The mean is that of [`Requirement::mean_excess`].
///
/// Excesses are taken as exponentially distributed, so that their number gives the inflation in mean excesses.
/// The number is known well, since all instants count. The mean depends on the few runs that are furthest outside,
/// and says little where rare motions of a few runs set the bound. The largest excess of a run enters only as a limit,
/// as it grows with the number of samples.
pub fn inflation(excesses: &[Excess], mean: f64, target: f64, requirement: &Requirement, tail: &Tail) -> f64 {
    let Requirement { runs, block, samples, .. } = *requirement;
    let (count, allowed) = (excesses.len() as f64, 0.5 * target * (runs * block * samples) as f64);
    if count <= allowed {
        return 0.0;
    }
    let root = (block as f64).sqrt();
    let factor = tail.unevenness.min(LARGEST_UNEVENNESS).powf(1.0 / root);
    let rareness = tail.rareness();
    let usual = (factor * mean).powf(1.0 - rareness / root);
    let rare = (RARE_LEVEL * requirement.fewness().max(1.0) / tail.heaviness.powi(2)).powf(rareness / root);
    let single = (SINGLE / tail.rarity()).min(1.0).powi(2);
    let level = usual * rare * single;
    // Where motions are smooth, the tail is shorter than that of an exponential distribution.
    let largest = excesses.iter().map(|excess| excess.score).fold(0.0, f64::max);
    let margin = (LARGEST_EXCESS_MARGIN / runs as f64).max(RARE_MARGIN * rareness);
    (level * (count / allowed).ln()).min((1.0 + margin) * largest)
}

/// What held-out runs did, given where they are outside (scores above 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Share of the samples that are inside [-].
    pub coverage: f64,
    /// Probability that a further run is inside throughout [-].
    pub whole_run: f64,
}

/// Share of the samples for which a held-out run that leaves the band of the others, before that is widened, stays
/// outside [-]: the mean over these runs, each weighted by its share. 0 where none leaves it.
pub fn persistence(outside: impl Iterator<Item = u32>, requirement: &Requirement) -> f64 {
    let mut of_runs = vec![0.0_f64; requirement.runs];
    outside.for_each(|run| of_runs[run as usize] += 1.0);
    let sum: f64 = of_runs.iter().sum();
    let square: f64 = of_runs.iter().map(|count| count * count).sum();
    if sum > 0.0 { square / (sum * (requirement.block * requirement.samples) as f64) } else { 0.0 }
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
