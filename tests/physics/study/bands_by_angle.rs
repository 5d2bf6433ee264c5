//! Bands of revolutions: runs are left out with all their revolutions, and a revolution ends where it begins.

use std::f64::consts::PI;

use chebclear::study::band::extremes::{GrowingWindow, top_two};
use chebclear::study::band::running::{Ends, Window, running_maximum, running_mean};
use chebclear::study::band::{Method, OutputBand};
use chebclear::study::points::{SplitMix64, random_points, sobol_points};

use crate::study::tables::{NONE, Table};

fn pooled(
    points: &[f64],
    parameters: usize,
    values: &[f64],
    samples: usize,
    revolutions: usize,
) -> OutputBand {
    let scored = points.len() / parameters;
    let revolutions = Some(revolutions);
    let table = Table { points, parameters, values, samples, revolutions, scored };
    table.band(NONE, 0.999, Method::Calibrated, Some(1)).unwrap()
}

fn turn(at: usize, samples: usize) -> f64 {
    2.0 * PI * at as f64 / (samples - 1) as f64
}

#[test]
fn windows_go_on_at_the_other_end_of_a_revolution() {
    let mut random = SplitMix64::new(3);
    let period = 24;
    let mut values: Vec<f64> = (0..period).map(|_| random.uniform()).collect();
    values.push(values[0]);
    for reach in [0.0, 0.4, 1.0, 2.6, 5.0, 11.0] {
        let window = Window::new(reach);
        // The same circle, opened elsewhere, far from the samples that are compared.
        let turned = |by: usize| -> Vec<f64> { (0..=period).map(|at| values[(at + by) % period]).collect() };
        let highest = Ends::Joined.over(&values, window, running_maximum);
        let mean = Ends::Joined.over(&values, window, running_mean);
        for by in [0, 5, 12, 23] {
            let other = turned(by);
            let (largest, average) = (
                Ends::Joined.over(&other, window, running_maximum),
                Ends::Joined.over(&other, window, running_mean),
            );
            for at in 0..=period {
                assert_eq!(largest[at], highest[(at + by) % period], "{reach} {by} {at}");
                assert!((average[at] - mean[(at + by) % period]).abs() < 1e-14, "{reach} {by} {at}");
            }
        }
        assert_eq!(highest[0], highest[period]);
    }
}

#[test]
fn a_run_is_left_out_with_all_its_revolutions() {
    let (runs, block, columns, scored) = (5, 3, 31, 4);
    let mut random = SplitMix64::new(8);
    let values: Vec<f64> = (0..runs * block * columns).map(|_| (9.0 * random.uniform()).floor()).collect();
    let largest = |at: usize, half: usize, left_out: usize| {
        let period = columns - 1;
        let near = (0..=2 * half).map(|step| (at + period * 4 + step - half) % period).collect::<Vec<_>>();
        (0..runs * block)
            .filter(|row| row / block != left_out)
            .flat_map(|row| near.iter().map(move |&t| (row, t)))
            // The first and the last sample are the same place.
            .flat_map(|(row, t)| [(row, t), (row, if t == 0 { period } else { t })])
            .map(|(row, t)| values[row * columns + t])
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let mut start = top_two(&values, columns, scored, block);
    let joined = start[0].merge(start[columns - 1]);
    (start[0], start[columns - 1]) = (joined, joined);
    let mut growing = GrowingWindow::new(start, Ends::Joined);
    for half in [0, 1, 2, 5, 11] {
        for (at, top) in growing.grow(half).iter().enumerate() {
            for run in 0..scored {
                assert_eq!(top.without(run as u32), largest(at, half, run), "{half} {at} {run}");
            }
        }
    }
}

#[test]
fn a_smooth_response_by_angle_is_resolved_with_whole_runs_left_out() {
    let (runs, revolutions, samples) = (20, 16, 61);
    let points = sobol_points(2, 0, runs, Some(0));
    let mut random = SplitMix64::new(1);
    let mut deviation = 0.0_f64;
    let values: Vec<f64> = points
        .chunks_exact(2)
        .flat_map(|z| {
            let rows: Vec<f64> = (0..revolutions)
                .flat_map(|_| {
                    let shift = 0.02 * (random.uniform() - 0.5);
                    deviation = deviation.max(shift.abs());
                    (0..samples).map(move |at| z[0] * turn(at, samples).cos() + z[1] * z[1] + shift)
                })
                .collect();
            rows
        })
        .collect();
    let band = pooled(&points, 2, &values, samples, revolutions);
    let polynomial = band.polynomial.expect("resolved");
    assert_eq!(polynomial.degree, 2);
    for at in 0..samples {
        let wide = turn(at, samples).cos().abs();
        // The margin holds what revolutions of one run differ by, and the error of their means left out.
        assert!(band.upper[at] >= wide + 1.0 + deviation && band.upper[at] <= wide + 1.0 + 0.06, "{at}");
        assert!(band.lower[at] <= -wide - deviation && band.lower[at] >= -wide - 0.06, "{at}");
    }
    assert!(deviation > 0.009);
}

#[test]
fn fresh_revolutions_of_runs_that_differ_keep_the_band() {
    // What runs differ by stays the same in all revolutions of a run, and each has noise of its own: were
    // revolutions left out one by one, the run's own others would hide how far a further run is away. Runs are
    // spread evenly, as those of a study: drawn at random, 15 runs leave 0.0 to 1.3 % outside (forty sets of seeds).
    let (runs, revolutions, samples, fresh, repetitions) = (15, 6, 91, 150, 8);
    let run = |random: &mut SplitMix64, own: f64| -> Vec<f64> {
        (0..revolutions)
            .flat_map(|_| {
                let (height, phase) = (0.3 * random.uniform(), 2.0 * PI * random.uniform());
                let at_angle = move |at: usize| {
                    own * turn(at, samples).sin() + height * (3.0 * turn(at, samples) + phase).sin()
                };
                (0..samples).map(at_angle).collect::<Vec<_>>()
            })
            .collect()
    };
    let (mut inside, mut inside_of_rows, mut width) = (0, 0, 0.0);
    for repetition in 0..repetitions {
        let mut random = SplitMix64::new(40 + repetition);
        let spread = |place: usize, random: &mut SplitMix64| {
            let own = 2.0 * (place as f64 + random.uniform()) / runs as f64 - 1.0;
            run(random, own)
        };
        let values: Vec<f64> = (0..runs).flat_map(|place| spread(place, &mut random)).collect();
        // Points that tell nothing of the run.
        let points = random_points(2, 0, runs * revolutions, repetition);
        let band = pooled(&points[..2 * runs], 2, &values, samples, revolutions);
        let of_rows = pooled(&points, 2, &values, samples, 1);
        assert!(band.polynomial.is_none() && of_rows.polynomial.is_none());
        let count = (samples * repetitions as usize) as f64;
        width += band.upper.iter().zip(&band.lower).map(|(upper, lower)| upper - lower).sum::<f64>() / count;
        for _ in 0..fresh {
            let own = 2.0 * random.uniform() - 1.0;
            let fresh_run = run(&mut random, own);
            let count_in = |band: &OutputBand| {
                let bounds = |k: usize| band.lower[k % samples]..=band.upper[k % samples];
                fresh_run.iter().enumerate().filter(|(k, value)| bounds(*k).contains(value)).count()
            };
            inside += count_in(&band);
            inside_of_rows += count_in(&of_rows);
        }
    }
    let all = (repetitions as usize * fresh * samples * revolutions) as f64;
    let (coverage, of_rows) = (inside as f64 / all, inside_of_rows as f64 / all);
    let outside = [1.0 - coverage, 1.0 - of_rows];
    // In forty sets of seeds 0.004 % in the mean and 0.024 % at most, and six to over a hundred times as much with
    // revolutions as runs.
    assert!(outside[0] < 5e-4 && outside[1] > 3.0 * outside[0], "{coverage}, revolutions as runs {of_rows}");
    // The range is that of sin, and 0.3 to either side.
    let range = 2.0 * (2.0 / PI + 0.3);
    assert!((0.95..1.3).contains(&(width / range)), "{}", width / range);
}

#[test]
fn wrong_revolutions_are_refused() {
    let points = random_points(1, 0, 4, 0);
    let values = [1.0; 4 * 2 * 3];
    let table = Table {
        points: &points,
        parameters: 1,
        values: &values,
        samples: 3,
        revolutions: Some(2),
        scored: 4,
    };
    let refused =
        |table: Table<'_>, method: Method| table.band(NONE, 0.5, method, Some(1)).unwrap_err().message;
    assert!(refused(Table { revolutions: Some(0), ..table }, Method::Calibrated).contains(">= 1"));
    assert!(refused(Table { revolutions: Some(3), ..table }, Method::Calibrated).contains("x 3 rows"));
}
