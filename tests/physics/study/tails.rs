//! Bands whose bounds are set by rare motions: the tail of runs of known distribution, and the share of new runs
//! that are inside.

use chebclear::study::band::calibrate::{Excess, Requirement, Tail, inflation};
use chebclear::study::band::extremes::NEVER_LEFT_OUT;
use chebclear::study::band::{Method, OutputBand};
use chebclear::study::points::{SplitMix64, random_points, sobol_points};

use crate::study::tables::{NONE, Table};

/// Samples of the random runs.
const SAMPLES: usize = 241;

/// The tail of runs whose values at all instants are independent.
fn tail_of(runs: usize, samples: usize, mean: f64, mut value: impl FnMut(usize) -> f64) -> Tail {
    let values: Vec<f64> = (0..runs).flat_map(|run| vec![run; samples]).map(&mut value).collect();
    let (mut reach, mut holders) = (Vec::new(), Vec::new());
    for at in 0..samples {
        let run =
            (0..runs).max_by(|a, b| values[a * samples + at].total_cmp(&values[b * samples + at])).unwrap();
        holders.push(run as u32);
        reach.push(values[run * samples + at] - mean);
    }
    Tail::of(&values, &reach, runs, 1, &holders)
}

#[test]
fn exponential_values_have_the_heaviness_one_and_uniform_ones_less() {
    for runs in [5, 41, 321] {
        let mut random = SplitMix64::new(7);
        let exponential = tail_of(runs, 4000, 1.0, |_| -random.uniform().ln());
        assert!((exponential.heaviness - 1.0).abs() < 0.05, "{runs}: {exponential:?}");
        // All runs alike, up to chance and what the squares of the reach count more.
        let share = exponential.holders / runs as f64;
        assert!((0.7..=1.0).contains(&share), "{runs}: {exponential:?}");
    }
    let mut random = SplitMix64::new(7);
    let uniform = tail_of(41, 4000, 0.5, |_| random.uniform());
    // Largest less fourth largest of 41 uniform ones: 3 / 42; the largest less the mean: 41 / 42 - 1 / 2.
    let harmonic: f64 = (2..=41).map(|rank| 1.0 / f64::from(rank)).sum();
    let expected = 3.0 / 42.0 / (41.0 / 42.0 - 0.5) * harmonic / (1.0 + 0.5 + 1.0 / 3.0);
    assert!((uniform.heaviness - expected).abs() < 0.02, "{uniform:?} {expected}");
}

#[test]
fn the_effective_number_of_holders_counts_runs_by_the_square_of_their_reach() {
    // Two of ten runs are the largest by turns, one by 3, the other by 1.
    let tail = tail_of(10, 100, 0.0, |run| f64::from(u8::from(run == 4)));
    assert_eq!(tail.holders, 1.0);
    assert_eq!(tail.unevenness, 1.0);
    let mut instant = 0;
    let tail = tail_of(10, 100, 0.0, |run| {
        instant = (instant + 1) % 100;
        if run == 2 + instant % 2 { [3.0, 1.0][instant % 2] } else { 0.0 }
    });
    assert!((tail.holders - 100.0 / 82.0).abs() < 1e-12, "{tail:?}");
    assert!((tail.unevenness - 5.0_f64.sqrt() / 2.0).abs() < 1e-12, "{tail:?}");
}

#[test]
fn the_tail_is_that_of_the_scored_runs_with_all_their_rows() {
    let (runs, samples) = (6, 200);
    let mut random = SplitMix64::new(2);
    let rows: Vec<f64> = (0..2 * runs * samples).map(|_| random.uniform()).collect();
    let largest: Vec<f64> = (0..runs * samples)
        .map(|place| {
            let at = place / samples * 2 * samples + place % samples;
            rows[at].max(rows[at + samples])
        })
        .collect();
    let (reach, holders) = (vec![0.5; samples], vec![0; samples]);
    let of_largest = Tail::of(&largest, &reach, runs, 1, &holders);
    assert_eq!(Tail::of(&rows, &reach, runs, 2, &holders), of_largest);
    let mut with_another = largest;
    with_another.extend(vec![9.0; samples]);
    assert_eq!(Tail::of(&with_another, &reach, runs, 1, &holders), of_largest);
    // Where rows that are not scored are the largest, they count as one run more.
    let tail = Tail::of(&[1.0; 8], &[3.0, 1.0], 4, 1, &[2, NEVER_LEFT_OUT]);
    assert!((tail.holders - 100.0 / 82.0).abs() < 1e-12, "{tail:?}");
}

/// 300 excesses of seven runs, exponentially distributed.
fn exponential_excesses() -> Vec<Excess> {
    let score = |at: u32| -0.02 * ((f64::from(at) + 0.5) / 300.0).ln();
    (0..300).map(|at| Excess { run: at % 7, score: score(at) }).collect()
}

/// The level of a bound of so many runs and rows of a run, where 1 % may be outside and the mean excess is that of
/// the bound itself.
fn level(runs: usize, block: usize, excesses: &[Excess], tail: &Tail) -> f64 {
    let requirement = Requirement { coverage: 0.99, runs, block, samples: 721 / block, parameters: 2 };
    let mean = excesses.iter().map(|excess| excess.score).sum::<f64>() / excesses.len() as f64;
    inflation(excesses, mean, 0.006, &requirement, tail)
}

#[test]
fn a_bound_that_few_runs_with_a_heavy_tail_hold_is_widened_by_more() {
    let excesses = exponential_excesses();
    let tail = |heaviness, holders| Tail { heaviness, holders, ..Tail::USUAL };
    let level_of = level;
    let level = |heaviness, holders| level_of(41, 1, &excesses, &tail(heaviness, holders));
    assert_eq!(level(0.5, 12.0), level(1.3, 40.0));
    // A smooth motion is held by few runs too.
    assert_eq!(level(0.3, 2.0), level(0.5, 12.0));
    assert!(level(0.9, 2.5) > 3.0 * level(0.9, 12.0));
    // One that is alone far out says that it is: by the square of its rarity over 1.5.
    let rarity = 3.0 * 0.9 * 0.9;
    let alone = level(1.3, 1.0) / level(1.3, rarity / 1.5);
    assert!((alone - (1.5 / rarity).powi(2)).abs() < 1e-12, "{alone}");
    assert!(level(0.9, 1.0) > level(0.9, 12.0));
    // The rarity is the square of the heaviness, up to that of 0.9, over the number of runs. Where the largest run is far
    // ahead, its spread is large, and less is added by the square.
    assert!((level(1.4, 2.0) / level(1.2, 2.0) - (1.2_f64 / 1.4).powi(2)).abs() < 1e-12);
    let rareness = (3.0 * 0.36 / 1.6 / 0.6_f64).ln() / (1.15_f64 / 0.6).ln();
    let equally_rare = level(0.6, 1.6) / level(0.5, 1.6 * 25.0 / 36.0);
    assert!((equally_rare - (25.0_f64 / 36.0).powf(rareness)).abs() < 1e-12, "{equally_rare}");
    // Fewer runs know no more of rare motions.
    let far: Vec<Excess> = excesses.iter().map(|one| Excess { score: 10.0 * one.score, ..*one }).collect();
    for (fewer, more) in [(3, 5), (5, 9), (9, 17), (17, 41)] {
        let [fewer_runs, more_runs] = [fewer, more].map(|runs| level_of(runs, 1, &far, &tail(1.3, 2.0)));
        assert!(fewer_runs > more_runs, "{fewer}: {fewer_runs} {more_runs}");
    }
}

#[test]
fn a_bound_is_widened_by_more_where_its_spread_is_uneven() {
    let excesses = exponential_excesses();
    for (block, root) in [(1, 1.0), (9, 3.0)] {
        let level = |unevenness| level(41, block, &excesses, &Tail { unevenness, ..Tail::USUAL });
        let uneven = level(2.0) / level(1.0);
        assert!((uneven - 2.0_f64.powf(1.0 / root)).abs() < 1e-12, "{block}: {uneven}");
        assert_eq!(level(2.5), level(40.0));
    }
}

#[test]
fn a_bound_is_hardly_widened_beyond_the_largest_excess() {
    // All excesses are equal: no tail is beyond them.
    let excesses: Vec<Excess> = (0..400).map(|at| Excess { run: at % 7, score: 1e-3 }).collect();
    assert!((level(41, 1, &excesses, &Tail::USUAL) / (1e-3 * (1.0 + 8.0 / 41.0)) - 1.0).abs() < 1e-12);
    // Rare motions of other runs may be ten times as far out.
    let rare = Tail { heaviness: 0.9, holders: 2.0, ..Tail::USUAL };
    assert!((level(41, 1, &excesses, &rare) / 1e-2 - 1.0).abs() < 1e-12);
}

#[test]
fn the_usual_level_falls_as_the_ninth_root_of_the_number_of_runs() {
    let usual = |runs, block| {
        let requirement = Requirement { coverage: 0.999, runs, block, samples: 721, parameters: 2 };
        requirement.usual_level()
    };
    for (found, expected) in [
        (usual(9, 1), 1.0),
        (usual(41, 1), 1.0),
        (usual(41 * 512, 1), 0.5),
        // Nine revolutions count as three runs, and the power by a third.
        (usual(13, 9), 1.0),
        (usual(41 * 1024, 9), 3072.0_f64.powf(-1.0 / 27.0)),
    ] {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}

#[test]
fn held_out_runs_may_lower_the_level_where_tails_are_light_and_enough_of_them_hold_the_bounds() {
    let least = |runs, block, parameters, heaviness, holders| {
        let requirement = Requirement { coverage: 0.999, runs, block, samples: 721, parameters };
        let tail = Tail { heaviness, holders, unevenness: 1.0 };
        requirement.least_share([&tail, &tail])
    };
    // By the third power of the heaviness over 0.6.
    for (found, expected) in [
        (least(41, 1, 2, 0.3, 20.0), 0.125),
        (least(321, 1, 3, 0.3, 5.0), 0.125),
        (least(41, 1, 2, 0.5, 20.0), (5.0_f64 / 6.0).powi(3)),
        (least(321, 1, 2, 0.6, 20.0), 1.0),
        (least(321, 1, 2, 0.9, 20.0), 1.0),
        // Three runs tell nothing; with several revolutions they do.
        (least(41, 1, 2, 0.3, 3.0), 1.0),
        (least(41, 9, 2, 0.3, 3.0), 0.125),
        // Between three and five by the logarithm of their number.
        (least(41, 1, 2, 0.3, 15.0_f64.sqrt()), 1.0 - 0.5 * 0.875),
        // Where motions are rare, nothing is lowered: half of them by the logarithm.
        (least(324, 1, 2, 0.3, 0.2), 1.0),
        (least(324, 9, 2, 0.3, 3.0 * 0.09 / (0.6_f64 * 1.15).sqrt()), 1.0 - 0.5 * 0.875),
        // Few runs tell little, and with many parameters more are few.
        (least(9, 1, 2, 0.3, 9.0), 1.0 - 0.875 * 9.0 / 41.0),
        (least(9, 4, 2, 0.3, 9.0), 1.0 - 0.875 * 18.0 / 41.0),
        (least(41, 1, 12, 0.3, 9.0), 1.0 - 0.875 * 0.25),
    ] {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}

#[test]
fn held_out_runs_are_aimed_at_less_than_what_is_asked() {
    let target = |runs, block, parameters, heaviness, unevenness| {
        let requirement = Requirement { coverage: 0.99, runs, block, samples: 721, parameters };
        let [light, heavy] =
            [0.8, 1.2].map(|share| Tail { heaviness: share * heaviness, unevenness, ..Tail::USUAL });
        requirement.target([&light, &heavy]) / 0.01
    };
    for (found, expected) in [
        (target(81, 1, 2, 0.9, 1.0), 0.42),
        (target(321, 1, 2, 0.6, 3.0), 0.42),
        (target(9, 1, 2, 0.9, 1.0), 0.42 / 3.0),
        (target(9, 4, 2, 0.9, 1.0), 0.8 * (18.0_f64 / 81.0).sqrt()),
        // With one parameter by its fourth power, times the root of the unevenness.
        (target(81, 1, 1, 0.9, 1.0), 0.42),
        (target(81, 1, 1, 0.5, 1.0), 0.42 * 1.2_f64.powi(4)),
        (target(81, 1, 1, 0.5, 1.44), 0.42),
        (target(81, 1, 1, 0.45, 1.44), 0.42 * 0.9_f64.powi(-4)),
        (target(41, 1, 1, 0.1, 1.0), 0.42 * 2.8 * (41.0_f64 / 81.0).sqrt()),
        // But not with several revolutions.
        (target(9, 9, 1, 0.6 / 4.0, 2.0), 0.8 * (2.0_f64 / 3.0).sqrt()),
        (target(41, 1, 8, 0.9, 1.0), 0.21 * (41.0_f64 / 81.0).sqrt()),
        // By the root of the heaviness, mean of both sides, with several revolutions times the unevenness.
        (target(81, 1, 2, 0.6 / 2.0, 2.0), 0.42 * 2.0_f64.sqrt()),
        (target(9, 9, 2, 0.6 / 4.0, 2.0), 0.8 * (2.0_f64 / 3.0).sqrt()),
        (target(9, 9, 2, 0.6 / 4.0, 9.0), 0.8 * (4.0_f64 / 2.1 / 3.0).sqrt()),
        (target(81, 1, 1, 0.0, 1.0), 1.0),
    ] {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}

/// The calibrated band of random runs, and the number of samples of fresh ones inside.
fn studied(
    run: fn(&mut SplitMix64, usize) -> Vec<f64>,
    (runs, fresh): (usize, usize),
    (seed, repetition): (u64, u64),
) -> (OutputBand, usize) {
    let mut random = SplitMix64::new(seed + repetition);
    let values: Vec<f64> = (0..runs).flat_map(|_| run(&mut random, SAMPLES)).collect();
    let points = random_points(2, 0, runs, repetition);
    let table = Table::new(&points, 2, &values, SAMPLES);
    let band = table.band(NONE, 0.999, Method::Calibrated, Some(1)).unwrap();
    let mut inside = 0;
    for _ in 0..fresh {
        let values = run(&mut random, SAMPLES);
        let kept = |(at, value): &(usize, &f64)| (band.lower[*at]..=band.upper[*at]).contains(*value);
        inside += values.iter().enumerate().filter(kept).count();
    }
    (band, inside)
}

/// The sum of two oscillations of random phase: within -1 and 1, and near them at any instant in some runs.
fn bounded_run(random: &mut SplitMix64, samples: usize) -> Vec<f64> {
    let phases = [6.3 * random.uniform(), 6.3 * random.uniform()];
    let t = |at: usize| at as f64 / (samples - 1) as f64;
    (0..samples)
        .map(|at| 0.5 * (6.3 * t(at) + phases[0]).sin() + 0.5 * (19.0 * t(at) + phases[1]).sin())
        .collect()
}

#[test]
fn bands_of_bounded_motions_end_little_beyond_their_bounds() {
    let (runs, fresh, repetitions) = (81, 100, 20);
    let (mut inside, mut width, mut held_out) = (0, 0.0, 1.0_f64);
    for repetition in 0..repetitions {
        let (band, kept) = studied(bounded_run, (runs, fresh), (80, repetition));
        let range: f64 = band.upper.iter().zip(&band.lower).map(|(upper, lower)| upper - lower).sum();
        width += 0.5 * range / (SAMPLES * repetitions as usize) as f64;
        held_out = held_out.min(band.held_out.coverage);
        inside += kept;
    }
    let share = inside as f64 / (repetitions as usize * fresh * SAMPLES) as f64;
    // With other seeds 99.91 % in the mean of a hundred studies, which differ by 0.14 %, since two phases are all that a
    // run contains. With the level of a usual tail 99.98 %, at 1.13 times the range.
    assert!(share >= 0.9975 && held_out >= 0.999, "{share}, held out {held_out}");
    assert!((1.0..1.11).contains(&width), "{width}");
}

/// Small oscillations, from which a tenth of the runs departs once to one side.
fn run_with_rare_motion(random: &mut SplitMix64, samples: usize) -> Vec<f64> {
    let phase = 6.3 * random.uniform();
    let rare = random.uniform() < 0.1;
    let (size, center) = (0.2 + 0.8 * random.uniform(), random.uniform());
    let width = 0.02 * size.sqrt();
    (0..samples)
        .map(|at| {
            let t = at as f64 / (samples - 1) as f64;
            let departure = if rare { (1.0 - ((t - center) / width).powi(2)).max(0.0) } else { 0.0 };
            0.02 * (40.0 * t + phase).sin() - size * departure
        })
        .collect()
}

#[test]
fn rare_motions_leave_bands_less_often_than_a_usual_tail_would_let_them() {
    let (runs, fresh, repetitions) = (41, 300, 12);
    let inside: usize = (0..repetitions)
        .map(|repetition| studied(run_with_rare_motion, (runs, fresh), (60, repetition)).1)
        .sum();
    let share = 1.0 - inside as f64 / (repetitions as usize * fresh * SAMPLES) as f64;
    // Where no run departs, nothing tells of it. With the level of a usual tail 0.2 % are outside.
    assert!(share < 1.6e-3, "{share}");
}

#[test]
fn contact_that_is_lost_once_may_be_lost_at_any_instant() {
    let mut random = SplitMix64::new(11);
    let (runs, samples) = (41, 61);
    let points = sobol_points(2, 0, runs, Some(0));
    let mut values: Vec<f64> = (0..runs * samples).map(|_| 0.3 + random.uniform()).collect();
    let lower = |values: &[f64]| {
        let table = Table::new(&points, 2, values, samples);
        table.band([0.0, f64::INFINITY], 0.999, Method::Calibrated, Some(1)).unwrap().lower
    };
    let loaded = lower(&values);
    assert!(loaded.iter().all(|&lower| lower > 0.05), "{loaded:?}");
    values[17 * samples + 20] = 0.0;
    let lost = lower(&values);
    assert!(lost.iter().all(|&lower| lower == 0.0), "{lost:?}");
}
