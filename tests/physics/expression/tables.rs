//! Tables: identities of their curves, pieces and ends. Their values are compared with SciPy in Python.

use chebclear::expression::curve::{Beyond, Curve, Interpolation};

use chebclear::numerics::interval::Interval;

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
    curve.value(x, curve.stretch(x))
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
                        assert!(!curve.covers(curve.stretch(before)) && !curve.covers(curve.stretch(after)));
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
fn pieces_and_their_bounds_agree() {
    let mut random = Random(9);
    let (points, values) = points(&mut random, 6);
    for way in WAYS {
        for beyond in ENDS {
            let curve = Curve::new(&points, &values, way, beyond).unwrap();
            for k in 0..400 {
                let x = points[0] - 3.0 + 0.02 * f64::from(k);
                let [lower, upper] = curve.bounds(curve.stretch(x));
                assert!(lower - 1e-12 <= x && x <= upper + 1e-12, "{way:?} {beyond:?} {x}: {lower} {upper}");
            }
        }
    }
}

#[test]
fn runs_step_over_points_that_are_smooth_and_the_values_are_the_same() {
    let mut random = Random(13);
    for count in [3, 5, 9, 40] {
        let (points, values) = points(&mut random, count);
        // Straight lines through a smooth function, with one kink.
        let bent: Vec<f64> = points.iter().map(|x| 3.0 + 0.01 * x.sin() + (x - points[2]).max(0.0)).collect();
        for way in WAYS {
            for (values, beyond) in [(&values, Beyond::Repeat), (&values, Beyond::End), (&bent, Beyond::Hold)]
            {
                let curve = Curve::new(&points, values, way, beyond).unwrap();
                for rtol in [1e-6, 1e-3, 0.03, 0.3] {
                    let Some(smooth) = curve.for_tolerance(rtol) else { continue };
                    assert_ne!(way, Interpolation::Cubic);
                    for _ in 0..200 {
                        let x = random.within(points[0] - 1.0, points[count - 1] + 1.0);
                        let [one, other] = [&curve, &smooth].map(|curve| at(curve, x));
                        assert!(
                            one == other || one.is_nan() && other.is_nan(),
                            "{way:?} {beyond:?} {x}: {one} {other}"
                        );
                        let [lower, upper] = smooth.bounds(smooth.stretch(x));
                        let [first, last] = curve.bounds(curve.stretch(x));
                        assert!(lower <= first && last <= upper);
                    }
                }
            }
        }
    }
}

#[test]
fn a_kink_is_stepped_over_if_rounding_it_changes_less_than_the_tolerance() {
    // A kink of slope 0.08 between pieces of width 1 and values of about 1: rounded it changes by 0.01.
    let curve = |middle: f64| {
        let values = [1.0, 1.0, middle, 2.0 * middle - 1.0];
        Curve::new(&[0.0, 1.0, 2.0, 3.0], &values, Interpolation::Linear, Beyond::End).unwrap()
    };
    let kinked = curve(1.08);
    assert_eq!(kinked.for_tolerance(0.009).unwrap().bounds(0), [0.0, 1.0]);
    assert_eq!(kinked.for_tolerance(0.009).unwrap().bounds(1), [1.0, 3.0]);
    assert_eq!(kinked.for_tolerance(0.0101).unwrap().bounds(0), [0.0, 3.0]);
    // A straight line has no kink at any tolerance.
    assert_eq!(curve(1.0).for_tolerance(1e-13).unwrap().bounds(0), [0.0, 3.0]);
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

#[test]
fn ranges_hold_all_values_of_a_curve_and_no_more_than_it_has() {
    let mut random = Random(11);
    for count in [2, 3, 5, 9] {
        let (points, values) = points(&mut random, count);
        let span = points[count - 1] - points[0];
        for way in WAYS {
            for beyond in [Beyond::Hold, Beyond::Repeat] {
                let curve = Curve::new(&points, &values, way, beyond).unwrap();
                for _ in 0..20 {
                    let from = random.within(points[0] - 2.0 * span, points[count - 1] + span);
                    let over = Interval::between(from, from + random.within(0.0, 1.5) * span);
                    let [value, slope, ..] = curve.ranges(over);
                    let places: Vec<f64> =
                        (0..=2000).map(|k| from + (over.upper - from) * k as f64 / 2000.0).collect();
                    let known: Vec<f64> = places.iter().map(|&x| at(&curve, x)).collect();
                    let lowest = known.iter().copied().fold(f64::INFINITY, f64::min);
                    let highest = known.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    assert!(value.lower <= lowest + 1e-9 && highest <= value.upper + 1e-9, "{way:?}");
                    let width = over.upper - over.lower;
                    let steepest = slope.magnitude() * width / 2000.0 + 1e-9;
                    assert!(lowest - value.lower <= steepest && value.upper - highest <= steepest, "{way:?}");
                    for pair in known.windows(2) {
                        let mean = (pair[1] - pair[0]) * 2000.0 / width;
                        let rounding = 1e-6 * slope.magnitude().max(1.0);
                        assert!(slope.lower - rounding <= mean && mean <= slope.upper + rounding, "{way:?}");
                    }
                }
            }
        }
    }
}
