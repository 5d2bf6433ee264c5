//! Bands from runs: windows and leave-one-out against brute force, coverage of processes of known
//! distribution.

use std::sync::atomic::{AtomicUsize, Ordering};

use chebclear::study::band::held_out::{Excess, HeldOut, Runs};
use chebclear::study::band::regression::{Regression, basis, exponents, term_count};
use chebclear::study::band::running::Ends;
use chebclear::study::band::{Method, OutputBand};
use chebclear::study::points::{SplitMix64, random_points, sobol_points};

use crate::study::tables::{NONE, Table};

/// A normal variable by the sum of twelve uniform ones: bounded, but close enough in the range of the tests.
fn normal(random: &mut SplitMix64) -> f64 {
    (0..12).map(|_| random.uniform()).sum::<f64>() - 6.0
}

#[test]
fn sobol_points_fill_every_dyadic_interval() {
    for seed in [None, Some(0), Some(1), Some(u64::MAX)] {
        let (parameters, count) = (32, 256);
        let points = sobol_points(parameters, 0, count, seed);
        for axis in 0..parameters {
            let mut cells = vec![0; count];
            for point in points.chunks_exact(parameters) {
                cells[(0.5 * (point[axis] + 1.0) * count as f64) as usize] += 1;
            }
            assert!(cells.iter().all(|&cell| cell == 1), "axis {axis}, seed {seed:?}");
        }
        // The first two axes are a (0, 2)-sequence: boxes of any shape with the volume of a point.
        for digits in 0..=8 {
            let mut cells = vec![0; count];
            let (wide, high) = (1 << digits, count >> digits);
            for point in points.chunks_exact(parameters) {
                let place = |axis: usize, cells: usize| (0.5 * (point[axis] + 1.0) * cells as f64) as usize;
                cells[place(0, wide) * high + place(1, high)] += 1;
            }
            assert!(cells.iter().all(|&cell| cell == 1), "{wide} x {high}, seed {seed:?}");
        }
    }
}

#[test]
fn a_sequence_of_points_goes_on() {
    let whole = sobol_points(5, 0, 100, Some(7));
    let mut parts = sobol_points(5, 0, 41, Some(7));
    parts.extend(sobol_points(5, 41, 59, Some(7)));
    assert_eq!(whole, parts);
    assert_ne!(whole, sobol_points(5, 0, 100, Some(8)));
    let whole = random_points(3, 0, 50, 4);
    let mut parts = random_points(3, 0, 20, 4);
    parts.extend(random_points(3, 20, 30, 4));
    assert_eq!(whole, parts);
    assert!(whole.iter().all(|z| (-1.0..1.0).contains(z)));
    let mean = random_points(1, 0, 10_000, 1).iter().sum::<f64>() / 10_000.0;
    assert!(mean.abs() < 0.03); // five standard deviations
}

#[test]
fn points_out_of_reach_are_none() {
    assert!(sobol_points(0, 0, 3, None).is_empty() && sobol_points(33, 0, 3, None).is_empty());
    assert!(sobol_points(2, u64::MAX, 3, None).is_empty());
}

/// The first numbers of SplitMix64 with seed 1234567, as published with its reference implementation.
#[test]
fn the_generator_is_splitmix64() {
    let mut random = SplitMix64::new(1_234_567);
    let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
    assert_eq!(expected, [random.bits(), random.bits(), random.bits()]);
}

#[test]
fn terms_are_counted_and_valued() {
    assert_eq!(exponents(2, 2), [0, 0, 1, 0, 0, 1, 2, 0, 1, 1, 0, 2]);
    for (parameters, degree) in [(1, 8), (2, 5), (3, 4), (8, 3)] {
        assert_eq!(exponents(parameters, degree).len(), parameters * term_count(parameters, degree));
    }
    assert_eq!(term_count(8, 3), 165);
    let z = [0.3, -0.7];
    let t = |n: usize, z: f64| (n as f64 * z.acos()).cos();
    for (value, e) in basis(&z, 2, 5).iter().zip(exponents(2, 5).chunks(2)) {
        assert!((value - t(e[0], z[0]) * t(e[1], z[1])).abs() < 1e-14);
    }
}

/// A smooth and a rough function of two parameters at random points, runs x 2.
fn two_outputs(points: &[f64]) -> Vec<f64> {
    points
        .chunks_exact(2)
        .flat_map(|z| [(z[0] + 0.5 * z[1]).exp(), (30.0 * z[0] * z[1]).sin() + z[1].abs()])
        .collect()
}

fn prepared(points: &[f64], parameters: usize, degree: usize, terms: usize) -> Regression {
    Regression::new(points, parameters, degree, terms, &|| true).unwrap()
}

#[test]
fn preparing_points_stops_between_two_columns() {
    let points = sobol_points(2, 0, 30, Some(1));
    let asked = AtomicUsize::new(0);
    let third = || asked.fetch_add(1, Ordering::Relaxed) < 2;
    assert!(Regression::new(&points, 2, 8, 21, &third).is_none());
    assert_eq!(asked.into_inner(), 3);
}

#[test]
fn a_basis_is_orthonormal_also_where_its_columns_are_nearly_dependent() {
    // Points so close together that the last terms differ by 1e-5 of their size from the span of the others.
    let points: Vec<f64> = sobol_points(1, 0, 200, Some(3)).iter().map(|z| 0.5 + 0.1 * z).collect();
    let regression = prepared(&points, 1, 4, 5);
    assert_eq!(regression.largest_degree(), Some(4));
    let rows: Vec<&[f64]> = (0..200).map(|run| regression.row(run, 4)).collect();
    for (a, b) in (0..5).flat_map(|a| (0..5).map(move |b| (a, b))) {
        let product: f64 = rows.iter().map(|row| row[a] * row[b]).sum();
        assert!((product - f64::from(a == b)).abs() < 1e-13, "{a} {b} {product:e}");
    }
}

#[test]
fn errors_at_points_left_out_are_those_of_fits_without_them() {
    let points = sobol_points(2, 0, 30, Some(1));
    let values = two_outputs(&points);
    let regression = prepared(&points, 2, 8, 21);
    assert_eq!(regression.largest_degree(), Some(5));
    for degree in 0..=4 {
        let projected = regression.project(&values, 2, degree);
        let mut residuals = values.clone();
        (0..=degree).for_each(|d| regression.reduce(&mut residuals, &projected, 2, d));
        let errors = regression.leave_one_out(&residuals, 2, degree);
        for run in [0, 7, 29] {
            let without = |list: &[f64]| [&list[..2 * run], &list[2 * run + 2..]].concat();
            let (points, others) = (without(&points), without(&values));
            let fit = prepared(&points, 2, degree, 21);
            let coefficients = fit.coefficients(&fit.project(&others, 2, degree), 2, degree);
            let terms = basis(&sobol_points(2, run as u64, 1, Some(1)), 2, degree);
            for output in 0..2 {
                let predicted: f64 =
                    terms.iter().zip(coefficients.chunks(2)).map(|(term, c)| term * c[output]).sum();
                let expected = values[2 * run + output] - predicted;
                assert!((errors[2 * run + output] - expected).abs() < 1e-9, "{degree} {run} {output}");
            }
        }
    }
}

#[test]
fn points_on_a_grid_bear_only_the_degrees_they_tell_apart() {
    let levels = [-1.0, 0.0, 1.0];
    let points: Vec<f64> = levels.iter().flat_map(|&x| levels.iter().flat_map(move |&y| [x, y])).collect();
    // T_3 takes the values of T_1 there.
    assert_eq!(prepared(&points, 2, 8, 9).largest_degree(), Some(2));
    assert_eq!(prepared(&points[..2], 2, 8, 9).largest_degree(), None);
}

fn excesses(scores: &[(u32, f64)]) -> Vec<Excess> {
    scores.iter().map(|&(run, score)| Excess { run, score }).collect()
}

fn scored_runs(scored: usize, samples: usize) -> Runs<'static> {
    Runs { values: &[], samples, block: 1, ends: Ends::Cut, scored, limits: NONE }
}

#[test]
fn a_band_that_all_runs_keep_is_not_widened() {
    let held_out = HeldOut::of(&[], &scored_runs(41, 721));
    assert_eq!(held_out.coverage, 1.0);
    assert!((held_out.whole_run - 40.0 / 42.0).abs() < 1e-15);
}

#[test]
fn held_out_runs_are_counted_whole_and_by_samples() {
    let left = HeldOut::of(&excesses(&[(47, 2.0), (48, 1.0), (48, 3.0)]), &scored_runs(49, 1000));
    // 47 runs are inside throughout, one of which is given up.
    assert!((left.whole_run - 46.0 / 50.0).abs() < 1e-15);
    assert!((left.coverage - (1.0 - 3.0 / 49e3)).abs() < 1e-15);
}

fn one_band(points: &[f64], parameters: usize, values: &[f64], limits: [f64; 2]) -> OutputBand {
    let samples = values.len() / (points.len() / parameters);
    let table = Table::new(points, parameters, values, samples);
    table.band(limits, 0.999, Method::Calibrated, Some(1)).unwrap()
}

#[test]
fn the_error_at_a_kink_is_told_and_noise_is_not_resolved() {
    for count in [25, 41, 81, 161, 321] {
        let points = sobol_points(1, 0, count, Some(3));
        let kink: Vec<f64> = points.iter().flat_map(|z| [(z - 0.3).abs(), (z - 0.3).abs()]).collect();
        let band = one_band(&points, 1, &kink, NONE);
        // The error of the best polynomial of degree 8 is 0.28 / 8 of the slope at the kink (Bernstein): what
        // is left is in the error and in the band, whatever it is called.
        if let Some(polynomial) = &band.polynomial {
            assert!(polynomial.error > 0.02, "{count}: {}", polynomial.error);
        }
        assert!(band.lower.iter().all(|&lower| lower <= 0.05) && band.upper.iter().all(|&u| u >= 1.25));
        let mut random = SplitMix64::new(1);
        let noise: Vec<f64> = (0..2 * count).map(|_| random.uniform()).collect();
        assert!(one_band(&points, 1, &noise, NONE).polynomial.is_none());
    }
}

#[test]
fn bands_are_the_same_bits_on_any_number_of_threads() {
    let mut random = SplitMix64::new(4);
    let (runs, samples, outputs) = (25, 60, 7);
    let points = sobol_points(2, 0, runs, Some(0));
    let values: Vec<f64> = (0..runs * samples * outputs).map(|_| normal(&mut random)).collect();
    let all: [Vec<OutputBand>; 3] = [1, 2, 5].map(|threads| {
        let tables =
            values.chunks_exact(runs * samples).map(|values| Table::new(&points, 2, values, samples));
        tables.map(|table| table.band(NONE, 0.99, Method::Calibrated, Some(threads)).unwrap()).collect()
    });
    for other in &all[1..] {
        for (a, b) in all[0].iter().zip(other) {
            assert_eq!((&a.lower, &a.upper, a.held_out), (&b.lower, &b.upper, b.held_out));
        }
    }
}

#[test]
fn rows_that_are_not_held_out_always_count() {
    let mut random = SplitMix64::new(6);
    let (runs, samples) = (20, 50);
    let points = sobol_points(2, 0, runs + 1, Some(0));
    let mut values: Vec<f64> = (0..runs * samples).map(|_| random.uniform()).collect();
    values.extend(vec![5.0; samples]);
    let table = Table { scored: runs, ..Table::new(&points, 2, &values, samples) };
    let band = table.band(NONE, 0.99, Method::Calibrated, Some(1)).unwrap();
    // No run that is held out can leave the band upwards, so it need not be widened there for them.
    assert!(band.upper.iter().all(|&upper| upper >= 5.0));
    assert!(band.held_out.coverage > 0.98);
}

#[test]
fn wrong_tables_are_refused() {
    let points = sobol_points(2, 0, 4, Some(0));
    let values = [1.0; 8];
    let good = Table::new(&points, 2, &values, 2);
    let message = |table: Table<'_>, coverage: f64| {
        table.band(NONE, coverage, Method::Calibrated, None).unwrap_err().message
    };
    assert!(message(Table { samples: 3, ..good }, 0.9).contains("8 values"));
    assert!(message(Table { scored: 2, ..good }, 0.9).contains("scored must be >= 3 and <= 4, got 2"));
    assert!(message(Table { parameters: 0, ..good }, 0.9).contains("parameters"));
    assert!(message(good, 1.0).contains("coverage must be > 0 and < 1"));
    let broken = [1.0, 1.0, f64::NAN, 1.0, 1.0, 1.0, 1.0, 1.0];
    assert!(message(Table { values: &broken, ..good }, 0.9).contains("run 1 has a value NaN"));
    let outside = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0];
    assert!(message(Table { points: &outside, ..good }, 0.9).contains("run 3 is at 2"));
    let short = Table { samples: 1, values: &values[..4], ..good };
    assert!(message(short, 0.9).contains("samples must be >= 2"));
}

#[test]
fn a_further_run_leaves_the_hull_of_independent_runs_as_often_as_it_is_the_newest_extreme() {
    // With rare excursions that most studies of 60 runs hardly see, and with three revolutions of each run.
    let (samples, fresh, repetitions) = (40, 100, 400);
    let excursion = |random: &mut SplitMix64, rows: usize| -> Vec<f64> {
        let height = if random.uniform() < 0.05 { 20.0 * random.uniform() } else { random.uniform() };
        let phase = random.uniform();
        let value = |at: usize| height * (0.3 * at as f64 + phase).sin();
        (0..rows * samples).map(|place| value(place % samples) + 0.1 * normal(random)).collect()
    };
    for (runs, rows) in [(60, 1), (30, 3)] {
        let mut outside = 0;
        for repetition in 0..repetitions {
            let mut random = SplitMix64::new(5000 + repetition);
            let values: Vec<f64> = (0..runs).flat_map(|_| excursion(&mut random, rows)).collect();
            let points = random_points(1, 0, runs, repetition);
            let table = Table {
                revolutions: (rows > 1).then_some(rows),
                scored: runs,
                ..Table::new(&points, 1, &values, samples)
            };
            let band = table.band(NONE, 0.9, Method::Independent, Some(1)).unwrap();
            assert!(band.polynomial.is_none());
            assert!((1.0 - band.held_out.coverage - 2.0 / (runs + 1) as f64).abs() < 1e-15);
            for _ in 0..fresh {
                let run = excursion(&mut random, rows);
                let inside = |place: usize| {
                    (band.lower[place % samples]..=band.upper[place % samples]).contains(&run[place])
                };
                outside += (0..rows * samples).filter(|&place| !inside(place)).count();
            }
        }
        let share = outside as f64 / (repetitions as usize * fresh * samples * rows) as f64;
        let expected = 2.0 / (runs + 1) as f64;
        // Exactly so with one row of each run; of several rows not all leave the hull together.
        assert!(share < 1.1 * expected && share > 0.4 * expected, "{share} of {expected}");
        assert!(rows > 1 || share > 0.9 * expected, "{share} of {expected}");
    }
}

#[test]
fn a_polynomial_that_follows_independent_runs_gives_their_band() {
    let points = random_points(1, 0, 30, 4);
    let values: Vec<f64> = points.iter().flat_map(|x| [1.0 + 2.0 * x, 3.0 - x]).collect();
    let band = Table::new(&points, 1, &values, 2).band(NONE, 0.9, Method::Independent, Some(1)).unwrap();
    assert_eq!(band.polynomial.unwrap().degree, 1);
    for (ends, expected) in [(band.lower, [-1.0, 2.0]), (band.upper, [3.0, 4.0])] {
        assert!(ends.iter().zip(expected).all(|(end, expected)| (end - expected).abs() < 1e-9), "{ends:?}");
    }
}
