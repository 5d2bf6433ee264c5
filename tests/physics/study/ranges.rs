//! Certified ranges of polynomials: against closed forms, dense grids, another certificate and exact sums.

use crate::study::polynomials::loose::{evaluate, interval_bounds, polynomial_ranges};
use crate::study::polynomials::{CASES, extreme_points, random_coefficients, tensor, values};
use crate::support::Random;
use chebclear::study::chebyshev::{fit, root_nodes};
use chebclear::study::range::Ranges;

const EPS: f64 = f64::EPSILON;

fn ranges_of(coefficients: &[f64], columns: usize, degrees: &[usize]) -> Ranges {
    polynomial_ranges(coefficients, columns, degrees, Some(1)).unwrap()
}

/// Coefficients of one polynomial in several variables from its values, exact for the degree.
fn fitted(f: impl Fn(&[f64]) -> f64, degrees: &[usize]) -> Vec<f64> {
    let nodes: Vec<usize> = degrees.iter().map(|n| n + 1).collect();
    let axes: Vec<Vec<f64>> = nodes.iter().map(|&count| root_nodes(count)).collect();
    let values: Vec<f64> = tensor(&axes).chunks(degrees.len()).map(f).collect();
    fit(&values, 1, &nodes, degrees).unwrap()
}

fn extremes(values: &[f64], columns: usize, column: usize) -> (f64, f64) {
    let of_column = || values.iter().skip(column).step_by(columns);
    (of_column().fold(f64::INFINITY, |a, &b| a.min(b)), of_column().fold(f64::NEG_INFINITY, |a, &b| a.max(b)))
}

/// Grid <= attained <= certified <= Eq. (31), the attained values where they are said to be, and a gap of
/// 1e-6.
fn check_order(coefficients: &[f64], columns: usize, degrees: &[usize], points: &[f64]) -> Ranges {
    let ranges = ranges_of(coefficients, columns, degrees);
    let (low, high) = interval_bounds(coefficients, columns, degrees).unwrap();
    let on_grid = evaluate(coefficients, columns, degrees, points).unwrap();
    let at_lowest = evaluate(coefficients, columns, degrees, &ranges.lowest_at).unwrap();
    let at_highest = evaluate(coefficients, columns, degrees, &ranges.highest_at).unwrap();
    for column in 0..columns {
        let (least, most) = extremes(&on_grid, columns, column);
        let (lower, upper) = (ranges.lower[column], ranges.upper[column]);
        let (inner_lower, inner_upper) = (ranges.attained_lower[column], ranges.attained_upper[column]);
        let width = inner_upper - inner_lower;
        // What a certified end may be off: the gap of 1e-6 and rounding, of degree 8 here.
        let rounding = 1e-9 * (high[column] - low[column]) + 1e-14 * (low[column].abs() + high[column].abs());
        assert!(lower <= inner_lower && inner_upper <= upper, "column {column}");
        assert!(least >= lower - rounding * 1e-3 && most <= upper + rounding * 1e-3, "column {column}");
        assert!(inner_lower - lower <= 1.01e-6 * width + rounding, "{lower} {inner_lower} {width}");
        assert!(upper - inner_upper <= 1.01e-6 * width + rounding, "{upper} {inner_upper} {width}");
        assert!(
            least >= inner_lower - 1e-6 * width - rounding && most <= inner_upper + 1e-6 * width + rounding
        );
        let slack = 100.0 * EPS * (low[column].abs() + high[column].abs());
        assert!(low[column] - slack <= lower && upper <= high[column] + slack, "column {column}");
        assert!((at_lowest[column * columns + column] - inner_lower).abs() <= rounding, "column {column}");
        assert!((at_highest[column * columns + column] - inner_upper).abs() <= rounding, "column {column}");
    }
    ranges
}

/// The certificate of `[EhlichZeller1964]`, axis by axis: with values at the M + 1 extreme points of T_M,
/// max |p - m| <= max over the grid / Π cos(π n / 2 M) for any constant m.
fn grid_certificate(
    values: &[f64],
    columns: usize,
    column: usize,
    degrees: &[usize],
    fine: usize,
) -> (f64, f64) {
    let (least, most) = extremes(values, columns, column);
    let (middle, half) = (0.5 * (least + most), 0.5 * (most - least));
    let kappa: f64 = degrees.iter().map(|_| (std::f64::consts::PI / (2 * fine) as f64).cos()).product();
    (middle - half / kappa, middle + half / kappa)
}

#[test]
fn random_polynomials_lie_between_grid_and_certificate() {
    let mut random = Random(1);
    let fine = 8;
    for (degrees, columns) in [
        (vec![1], 40),
        (vec![7], 80),
        (vec![16], 40),
        (vec![3, 3], 150),
        (vec![8, 8], 20),
        (vec![2, 5], 60),
        (vec![3, 1, 4], 40),
    ] {
        let axes: Vec<Vec<f64>> = degrees.iter().map(|n| extreme_points(fine * n)).collect();
        let points = tensor(&axes);
        for decay in [1.0, (-1.0f64).exp(), 0.1] {
            let coefficients = random_coefficients(&mut random, &degrees, columns, decay);
            let ranges = check_order(&coefficients, columns, &degrees, &points);
            let on_grid = evaluate(&coefficients, columns, &degrees, &points).unwrap();
            for column in 0..columns {
                let (low, high) = grid_certificate(&on_grid, columns, column, &degrees, fine);
                let slack = 1e-6 * (high - low);
                assert!(low - slack <= ranges.lower[column] && ranges.upper[column] <= high + slack);
            }
        }
    }
}

#[test]
fn many_parameters() {
    let mut random = Random(2);
    for (parameters, columns) in [(4, 12), (5, 5), (6, 2)] {
        let degrees = vec![3; parameters];
        let mut points: Vec<f64> = (0..500 * parameters).map(|_| random.within(-1.0, 1.0)).collect();
        points.extend(tensor(&vec![vec![-1.0, 1.0]; parameters]));
        let coefficients = random_coefficients(&mut random, &degrees, columns, 0.2);
        check_order(&coefficients, columns, &degrees, &points);
    }
}

#[test]
fn smooth_responses_need_few_boxes() {
    // Boxes per column and both ends: 0.04, 0, 0.09, 2.3, 2.3, 4.8 and 8.8. The work is what a monotone
    // response saves.
    for (case, most) in CASES.iter().zip([0.1, 0.01, 0.2, 3.5, 3.5, 7.0, 12.0]) {
        let columns = case.samples.min(if case.parameters > 3 { 20 } else { 200 });
        let (nodes, degrees) = (vec![case.degree + 1; case.parameters], vec![case.degree; case.parameters]);
        let runs = values(case, columns, &tensor(&vec![root_nodes(case.degree + 1); case.parameters]));
        let coefficients = fit(&runs, columns, &nodes, &degrees).unwrap();
        let points = tensor(&vec![vec![-1.0, -0.5, 0.0, 0.5, 1.0]; case.parameters]);
        let ranges = check_order(&coefficients, columns, &degrees, &points);
        let boxes = ranges.boxes as f64 / columns as f64;
        assert!(boxes <= most, "{}: {boxes} boxes", case.name);
    }
}

#[test]
fn single_terms_constants_and_lines_are_exact() {
    for degree in 1..=30 {
        let mut term = vec![0.0; degree + 1];
        term[degree] = 1.0;
        let ranges = ranges_of(&term, 1, &[degree]);
        assert_eq!((ranges.lower[0], ranges.upper[0]), (-1.0, 1.0), "T_{degree}");
        assert!(ranges.attained_upper[0] >= 1.0 - 2e-6 && ranges.attained_lower[0] <= -1.0 + 2e-6);
    }
    let mut constant = vec![0.0; 16];
    constant[0] = -0.1;
    let ranges = ranges_of(&constant, 1, &[3, 3]);
    assert_eq!((ranges.lower[0], ranges.upper[0]), (-0.1, -0.1));
    assert_eq!((ranges.attained_lower[0], ranges.attained_upper[0]), (-0.1, -0.1));
    assert_eq!(ranges_of(&[0.0; 4], 1, &[1, 1]).upper, [0.0]);
    // 0.5 + 2 x - 0.25 y: at the corners 0.5 ± 2.25, no number rounded.
    let ranges = ranges_of(&[0.5, -0.25, 2.0, 0.0], 1, &[1, 1]);
    assert_eq!((ranges.lower[0], ranges.upper[0]), (-1.75, 2.75));
    assert_eq!((ranges.lowest_at, ranges.highest_at), (vec![-1.0, 1.0], vec![1.0, -1.0]));
}

#[test]
fn an_axis_of_degree_zero_or_without_effect_changes_nothing() {
    let mut random = Random(3);
    let plane = random_coefficients(&mut random, &[4, 3], 30, 0.6);
    let expected = ranges_of(&plane, 30, &[4, 3]);
    let with_axis = |degree: usize| {
        // Between the two axes, the terms of degree 1 and more are zero.
        let zeros = vec![0.0; 4 * 30 * degree];
        let coefficients: Vec<f64> = plane.chunks(4 * 30).flat_map(|rows| [rows, &zeros].concat()).collect();
        ranges_of(&coefficients, 30, &[4, degree, 3])
    };
    for degree in [0, 2] {
        let found = with_axis(degree);
        for (a, b) in found.upper.iter().zip(&expected.upper).chain(found.lower.iter().zip(&expected.lower)) {
            assert!((a - b).abs() < 1e-5, "{a} {b}");
        }
        if degree == 0 {
            assert!(
                found.highest_at.iter().skip(1).step_by(3).all(|&x| x == 0.0),
                "the middle of a degree of 0"
            );
        }
    }
}

#[test]
fn axes_of_degree_zero_have_no_corners() {
    // x + 2 y among forty others, whose corners would be 2^40 more.
    let mut degrees = vec![0; 42];
    (degrees[10], degrees[30]) = (1, 1);
    let ranges = ranges_of(&[0.0, 2.0, 1.0, 0.0], 1, &degrees);
    assert_eq!((ranges.attained_lower[0], ranges.attained_upper[0]), (-3.0, 3.0));
    for (at, end) in [(&ranges.lowest_at, -1.0), (&ranges.highest_at, 1.0)] {
        let expected: Vec<f64> = degrees.iter().map(|&degree| if degree == 0 { 0.0 } else { end }).collect();
        assert_eq!(at, &expected);
    }
}

#[test]
fn interior_extremes_in_closed_form() {
    // 1 - d², with the distance d in a skewed metric: the maximum is 1 at (a, b), the minimum in a corner.
    for (a, b, skew) in [(0.3, -0.2, 0.0), (0.0, 0.0, 1.9), (-0.77, 0.41, 1.0), (0.123, 0.9, -1.5)] {
        let f = |x: &[f64]| {
            let (u, v) = (x[0] - a, x[1] - b);
            1.0 - u * u - v * v - skew * u * v
        };
        let ranges = ranges_of(&fitted(f, &[4, 3]), 1, &[4, 3]);
        let least =
            tensor(&[vec![-1.0, 1.0], vec![-1.0, 1.0]]).chunks(2).map(f).fold(f64::INFINITY, f64::min);
        assert!((ranges.lower[0] - least).abs() < 1e-12);
        assert!((0.0..1.01e-6 * (1.0 - least)).contains(&(ranges.upper[0] - 1.0)), "{}", ranges.upper[0]);
        // A value within 1e-6 of the range is within 1e-3 of its place where the metric is not too flat.
        assert!((ranges.highest_at[0] - a).abs() < 2e-2 && (ranges.highest_at[1] - b).abs() < 2e-2);
    }
    // A sum of sines has its extremes where the sines have theirs.
    let ranges =
        ranges_of(&fitted(|x| (4.0 * x[0]).sin() + 0.5 * (3.0 * x[1]).cos(), &[22, 18]), 1, &[22, 18]);
    assert!(
        (ranges.upper[0] - 1.5).abs() < 3e-6 && (ranges.lower[0] + 1.0 - 0.5 * 3.0f64.cos()).abs() < 3e-6
    );
}

/// A number of size below 1 as a multiple of 2^-100.
fn fixed_point(x: f64) -> i128 {
    let scaled = x * f64::powi(2.0, 100);
    assert!(scaled.fract() == 0.0);
    scaled as i128
}

#[test]
fn certified_bounds_hold_against_exact_values() {
    // At a corner every T_i is ±1, so that the value is a sum of the coefficients: here it is made exactly.
    let mut random = Random(4);
    let columns = 300;
    let mut tight = 0;
    for degrees in [vec![2], vec![9], vec![3, 3], vec![2, 1, 2]] {
        for decay in [1.0, 0.3] {
            let mut coefficients = random_coefficients(&mut random, &degrees, columns, decay);
            // Few low bits, so that they are multiples of 2^-100, and signs that put extremes into corners.
            for c in &mut coefficients {
                *c = (*c * f64::powi(2.0, 60)).round() * f64::powi(2.0, -60);
            }
            let ranges = ranges_of(&coefficients, columns, &degrees);
            let corners = tensor(&vec![vec![-1.0, 1.0]; degrees.len()]);
            for corner in corners.chunks(degrees.len()) {
                let signs = degrees.iter().zip(corner).fold(vec![1], |signs, (&n, &x)| {
                    let of_term = |i: usize| if x < 0.0 && i % 2 == 1 { -1 } else { 1 };
                    signs.iter().flat_map(|s| (0..=n).map(move |i| s * of_term(i))).collect::<Vec<i128>>()
                });
                for column in 0..columns {
                    let terms = coefficients.iter().skip(column).step_by(columns).zip(&signs);
                    let exact: i128 = terms.map(|(&c, sign)| sign * fixed_point(c)).sum();
                    assert!(fixed_point(ranges.lower[column] / 64.0) * 64 <= exact);
                    assert!(exact <= fixed_point(ranges.upper[column] / 64.0) * 64);
                    tight +=
                        i32::from((ranges.upper[column] - exact as f64 * f64::powi(2.0, -100)).abs() < 1e-12);
                }
            }
        }
    }
    assert!(tight > 500, "a test of rounding needs bounds at corners, {tight}");
}

#[test]
fn columns_and_threads_do_not_meet() {
    let mut random = Random(5);
    let (degrees, columns) = ([3, 4], 203);
    let coefficients = random_coefficients(&mut random, &degrees, columns, 0.5);
    let together = ranges_of(&coefficients, columns, &degrees);
    for threads in [Some(2), Some(7), None] {
        assert_eq!(polynomial_ranges(&coefficients, columns, &degrees, threads).unwrap(), together);
    }
    for column in [0, 7, 8, 63, 64, 202] {
        let alone: Vec<f64> = coefficients.iter().skip(column).step_by(columns).copied().collect();
        let alone = ranges_of(&alone, 1, &degrees);
        assert_eq!((alone.lower[0], alone.upper[0]), (together.lower[column], together.upper[column]));
        assert_eq!(alone.highest_at, together.highest_at[2 * column..2 * column + 2]);
    }
}

#[test]
fn what_cannot_be_certified_is_refused() {
    let message = |coefficients: &[f64], columns: usize, degrees: &[usize]| {
        polynomial_ranges(coefficients, columns, degrees, None).unwrap_err().to_string()
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e281] {
        let told = message(&[0.0, 1.0, 2.0, bad], 2, &[1]);
        assert!(told.starts_with("column 1 has a coefficient") && told.contains("finite"), "{told}");
    }
    assert_eq!(
        message(&[0.0; 32], 1, &[31]),
        "axis 0 has degree 31: a certified range is found up to degree 30"
    );
    assert!(message(&[0.0; 3], 1, &[3]).contains("4 rows"));
    assert!(polynomial_ranges(&[], 0, &[1], None).is_err());
    assert!(polynomial_ranges(&[1.0], 1, &[], None).is_err());
    assert!(polynomial_ranges(&[1e280, 1e280], 1, &[1], None).is_ok());
}
