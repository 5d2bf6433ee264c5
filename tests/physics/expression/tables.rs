//! Tables: identities of their curves, pieces and ends. Their values are compared with SciPy in Python.

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
