//! Bands of revolutions: runs are left out with all their revolutions, and a revolution ends where it begins.

use std::f64::consts::PI;

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
