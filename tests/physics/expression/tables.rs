//! Tables: identities of their curves, pieces and ends. Their values are compared with SciPy in Python.

use std::f64::consts::TAU;

use chebclear::expression::curve::{Beyond, Curve, Interpolation};

use crate::support::Random;

const WAYS: [Interpolation; 3] = [Interpolation::Linear, Interpolation::Monotone, Interpolation::Cubic];
const ENDS: [Beyond; 3] = [Beyond::End, Beyond::Hold, Beyond::Repeat];

/// Random points; the last value is the first.
fn points(random: &mut Random, count: usize) -> (Vec<f64>, Vec<f64>) {
    let mut points = vec![random.within(-2.0, 2.0)];
    for k in 1..count {
        points.push(points[k - 1] + random.within(0.05, 1.0));
    }
    let mut values: Vec<f64> = points.iter().map(|_| random.within(-3.0, 3.0)).collect();
    values[count - 1] = values[0];
    (points, values)
}

fn at(curve: &Curve, x: f64) -> f64 {
    curve.value(x, curve.piece(x))
}

#[test]
fn curves_pass_through_their_points_and_hold_or_end_beyond() {
    let mut random = Random(7);
    for count in [2, 3, 4, 5, 9] {
        let (points, values) = points(&mut random, count);
        let span = points[count - 1] - points[0];
        for way in WAYS {
            for beyond in ENDS {
                let curve = Curve::new(&points, &values, way, beyond).unwrap();
                for (&x, &value) in points.iter().zip(&values) {
                    assert!((at(&curve, x) - value).abs() < 1e-12, "{way:?} {beyond:?}");
                }
                let (before, after) = (points[0] - 0.3, points[count - 1] + 0.3);
                match beyond {
                    Beyond::End => {
                        assert!(at(&curve, before).is_nan() && at(&curve, after).is_nan());
                        assert!(!curve.covers(curve.piece(before)) && !curve.covers(curve.piece(after)));
                    }
                    Beyond::Hold => {
                        assert_eq!([at(&curve, before), at(&curve, after)], [values[0], values[count - 1]]);
                    }
                    Beyond::Repeat => {
                        for turns in [-3.0, 1.0, 20.0] {
                            let inside = points[0] + 0.4 * span;
                            let error = at(&curve, inside + turns * span) - at(&curve, inside);
                            assert!(error.abs() < 1e-11, "{way:?}: {error:e}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn cubics_are_smooth_and_monotone_cubics_do_not_overshoot() {
    let mut random = Random(8);
    for _ in 0..20 {
        let (points, values) = points(&mut random, 8);
        for beyond in ENDS {
            for way in [Interpolation::Monotone, Interpolation::Cubic] {
                let curve = Curve::new(&points, &values, way, beyond).unwrap();
                let first = usize::from(beyond != Beyond::Repeat);
                for &knot in &points[first..7] {
                    let slope = |side: f64| {
                        let h = 1e-8 * side;
                        (at(&curve, knot + 2.0 * h) - at(&curve, knot + h)) / h
                    };
                    let jump = slope(1.0) - slope(-1.0);
                    assert!(jump.abs() < 1e-2, "{way:?} {beyond:?}: {jump:e}");
                }
            }
            let curve = Curve::new(&points, &values, Interpolation::Monotone, beyond).unwrap();
            for k in 0..7 {
                for part in 1..50 {
                    let x = points[k] + (points[k + 1] - points[k]) * f64::from(part) / 50.0;
                    let (low, high) = (values[k].min(values[k + 1]), values[k].max(values[k + 1]));
                    assert!((low - 1e-12..=high + 1e-12).contains(&at(&curve, x)));
                }
            }
        }
    }
}

#[test]
fn a_periodic_spline_of_a_sine_is_as_accurate_as_its_order() {
    let error = |count: usize| {
        let points: Vec<f64> = (0..=count).map(|k| TAU * k as f64 / count as f64).collect();
        let mut values: Vec<f64> = points.iter().map(|x| x.sin()).collect();
        values[count] = values[0];
        let curve = Curve::new(&points, &values, Interpolation::Cubic, Beyond::Repeat).unwrap();
        (0..1000)
            .map(|k| (at(&curve, 0.01 * f64::from(k)) - (0.01 * f64::from(k)).sin()).abs())
            .fold(0.0, f64::max)
    };
    let ratio = error(16) / error(32);
    assert!((14.0..18.0).contains(&ratio), "{ratio}");
}

#[test]
fn pieces_and_their_bounds_agree() {
    let mut random = Random(9);
    let (points, values) = points(&mut random, 6);
    for way in WAYS {
        for beyond in ENDS {
            let curve = Curve::new(&points, &values, way, beyond).unwrap();
            for k in 0..400 {
                let x = points[0] - 3.0 + 0.02 * f64::from(k);
                let [lower, upper] = curve.bounds(curve.piece(x));
                assert!(lower - 1e-12 <= x && x <= upper + 1e-12, "{way:?} {beyond:?} {x}: {lower} {upper}");
            }
        }
    }
}

#[test]
fn bad_points_are_refused() {
    let refused = |points: &[f64], values: &[f64], beyond| {
        Curve::new(points, values, Interpolation::Linear, beyond).unwrap_err()
    };
    assert!(refused(&[0.0], &[1.0], Beyond::End).contains("at least two"));
    assert!(refused(&[0.0, 1.0], &[1.0], Beyond::End).contains("2 points and 1 values"));
    assert!(refused(&[0.0, 0.0], &[1.0, 2.0], Beyond::End).contains("increase"));
    assert!(refused(&[0.0, f64::NAN], &[1.0, 2.0], Beyond::End).contains("finite"));
    assert!(refused(&[0.0, 1.0], &[1.0, 2.0], Beyond::Repeat).contains("ends with its first value"));
}
