//! Chebyshev surrogates on tensor grids, and the bounds of Eq. (31).

use crate::study::polynomials::loose::{derivative, evaluate, interval_bounds};
use crate::study::polynomials::tensor;
use crate::support::Random;
use chebclear::study::chebyshev::{fit, root_nodes};
use std::f64::consts::{PI, TAU};

const EPS: f64 = f64::EPSILON;

fn root_grid(nodes: &[usize]) -> Vec<f64> {
    tensor(&nodes.iter().map(|&count| root_nodes(count)).collect::<Vec<_>>())
}

/// `count` equispaced points of [-1, 1], both ends included.
fn equispaced(count: usize) -> Vec<f64> {
    (0..count).map(|i| -1.0 + 2.0 * i as f64 / (count - 1) as f64).collect()
}

fn term_count(degrees: &[usize]) -> usize {
    degrees.iter().map(|n| n + 1).product()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn assert_close(a: &[f64], b: &[f64], tolerance: f64) {
    let difference = largest_difference(a, b);
    assert!(difference <= tolerance, "largest difference {difference:e} > {tolerance:e}");
}

#[test]
fn nodes_are_the_roots_in_decreasing_order() {
    let half = 0.5f64.sqrt();
    assert_close(&root_nodes(2), &[half, -half], EPS);
    assert_close(&root_nodes(3), &[0.75f64.sqrt(), 0.0, -0.75f64.sqrt()], EPS);
    assert!(root_nodes(0).is_empty());
    for count in 1..=200 {
        let nodes = root_nodes(count);
        assert_eq!(nodes.len(), count);
        assert!(nodes.is_sorted_by(|a, b| a > b));
        for (j, &x) in nodes.iter().enumerate() {
            let theta = (2 * j + 1) as f64 * PI / (2 * count) as f64;
            assert!((x - theta.cos()).abs() <= 2.0 * EPS, "node {j} of {count}");
        }
    }
}

#[test]
fn nodes_are_exactly_antisymmetric() {
    for count in 1..=200 {
        let nodes = root_nodes(count);
        for j in 0..count {
            assert_eq!(nodes[j], -nodes[count - 1 - j], "node {j} of {count}");
        }
        if count % 2 == 1 {
            assert_eq!(nodes[count / 2].to_bits(), 0.0f64.to_bits());
        }
    }
}

#[test]
fn coefficients_of_every_term_of_a_tensor_grid() {
    // A single T_i T_j T_k must give a single 1: the factors (2/m)^k (1/2)^s, and the order of the axes.
    let (nodes, degrees) = ([3, 5, 4], [2, 3, 3]);
    let points = root_grid(&nodes);
    for term in 0..term_count(&degrees) {
        let index = [term / 16, term / 4 % 4, term % 4];
        let values: Vec<f64> = points
            .chunks(3)
            .map(|x| (0..3).map(|q| (index[q] as f64 * x[q].acos()).cos()).product())
            .collect();
        let mut exact = vec![0.0; 48];
        exact[term] = 1.0;
        assert_close(&fit(&values, 1, &nodes, &degrees).unwrap(), &exact, 100.0 * EPS);
    }
}

#[test]
fn symmetric_responses_have_exactly_symmetric_coefficients() {
    for nodes in [4, 5, 12, 13] {
        let degree = nodes - 1;
        let points = root_nodes(nodes);
        let even: Vec<f64> = points.iter().map(|x| (3.0 * x * x).cos()).collect();
        let odd: Vec<f64> = points.iter().map(|x| x * (x * x).exp()).collect();
        let even = fit(&even, 1, &[nodes], &[degree]).unwrap();
        let odd = fit(&odd, 1, &[nodes], &[degree]).unwrap();
        for i in 0..=degree {
            assert_eq!(if i % 2 == 1 { even[i] } else { odd[i] }, 0.0, "term {i} of degree {degree}");
        }
    }
}

#[test]
fn round_trip() {
    let mut random = Random(1);
    for (nodes, degrees) in [
        (vec![1], vec![0]),
        (vec![13], vec![12]),
        (vec![4, 4], vec![3, 3]),
        (vec![7, 2, 5], vec![6, 0, 3]),
        (vec![2, 3, 2, 4], vec![1, 2, 1, 3]),
    ] {
        let columns = 3;
        let coefficients = random.vector(term_count(&degrees) * columns);
        let values = evaluate(&coefficients, columns, &degrees, &root_grid(&nodes)).unwrap();
        let again = fit(&values, columns, &nodes, &degrees).unwrap();
        assert_close(&again, &coefficients, 100.0 * EPS);
    }
}

#[test]
fn columns_are_independent_to_the_last_bit() {
    // More columns than are treated at a time, and a failed run in one of them.
    let (nodes, degrees, columns) = ([5, 4], [3, 3], 700);
    let mut random = Random(2);
    let mut values = random.vector(20 * columns);
    values[7 * columns + 300] = f64::NAN;
    let points = random.vector(2 * 150);
    let coefficients = fit(&values, columns, &nodes, &degrees).unwrap();
    let slopes = derivative(&coefficients, columns, &degrees, 0).unwrap();
    let at_points = evaluate(&coefficients, columns, &degrees, &points).unwrap();
    let (lower, upper) = interval_bounds(&coefficients, columns, &degrees).unwrap();

    let column_of = |array: &[f64], column: usize| -> Vec<f64> {
        array.iter().skip(column).step_by(columns).copied().collect()
    };
    for column in [0, 255, 256, 300, 699] {
        let alone = fit(&column_of(&values, column), 1, &nodes, &degrees).unwrap();
        let results = [
            (column_of(&coefficients, column), alone.clone()),
            (column_of(&slopes, column), derivative(&alone, 1, &degrees, 0).unwrap()),
            (column_of(&at_points, column), evaluate(&alone, 1, &degrees, &points).unwrap()),
            (vec![lower[column], upper[column]], {
                let (lower, upper) = interval_bounds(&alone, 1, &degrees).unwrap();
                [lower, upper].concat()
            }),
        ];
        for (together, alone) in results {
            if column == 300 {
                assert!(together.iter().all(|x| x.is_nan()), "a failed run must show everywhere");
            } else {
                assert_eq!(together, alone);
            }
        }
    }
    assert_eq!(coefficients.iter().filter(|c| c.is_nan()).count(), 16);
    assert!(derivative(&[f64::NAN], 1, &[0], 0).unwrap()[0].is_nan());
}

#[test]
fn more_nodes_than_terms_are_least_squares() {
    let (nodes, degree) = (9, 3);
    let points = root_nodes(nodes);
    let values: Vec<f64> = points.iter().map(|x| (2.0 * x).exp()).collect();
    let coefficients = fit(&values, 1, &[nodes], &[degree]).unwrap();
    let fitted = evaluate(&coefficients, 1, &[degree], &points).unwrap();
    let residual: Vec<f64> = values.iter().zip(&fitted).map(|(y, p)| y - p).collect();
    assert!(largest_difference(&values, &fitted) > 1e-2, "not interpolation");

    // Normal equations: the residual is orthogonal to every polynomial of the degree.
    for i in 0..=degree {
        let product: f64 = residual.iter().zip(&points).map(|(r, x)| r * x.powi(i as i32)).sum();
        assert!(product.abs() < 100.0 * EPS, "term {i}: {product:e}");
    }
}

#[test]
fn highest_coefficient_needs_degree_plus_one_nodes() {
    // At the n roots of T_n a response T_n is invisible: Eq. (28) would give zero for it.
    let degree = 6;
    let mut highest = vec![0.0; degree + 1];
    highest[degree] = 1.0;
    let at_roots = |nodes: usize| evaluate(&highest, 1, &[degree], &root_nodes(nodes)).unwrap();
    assert_close(&at_roots(degree), &[0.0; 6], 100.0 * EPS);
    assert!(fit(&at_roots(degree), 1, &[degree], &[degree]).is_err());
    for nodes in degree + 1..degree + 4 {
        let coefficients = fit(&at_roots(nodes), 1, &[nodes], &[degree]).unwrap();
        assert_close(&coefficients, &highest, 100.0 * EPS);
    }
}

#[test]
fn derivatives_of_single_terms() {
    // T_n' = n U_{n-1}: T_4' = 8 T_1 + 8 T_3, T_5' = 5 T_0 + 10 T_2 + 10 T_4; T_n'(±1) = (±1)^(n-1) n².
    let slope = |n: usize| {
        let mut term = vec![0.0; n + 1];
        term[n] = 1.0;
        derivative(&term, 1, &[n], 0).unwrap()
    };
    assert_eq!(slope(0), [0.0]);
    assert_eq!(slope(1), [1.0, 0.0]);
    assert_eq!(slope(2), [0.0, 4.0, 0.0]);
    assert_eq!(slope(4), [0.0, 8.0, 0.0, 8.0, 0.0]);
    assert_eq!(slope(5), [5.0, 0.0, 10.0, 0.0, 10.0, 0.0]);
    for n in 1..=12 {
        let sign = if n % 2 == 1 { 1.0 } else { -1.0 };
        let square = (n * n) as f64;
        assert_eq!(evaluate(&slope(n), 1, &[n], &[1.0, -1.0]).unwrap(), [square, sign * square]);
    }
}

#[test]
fn derivative_at_the_midpoint_in_closed_form() {
    // Degree 3, two parameters: d/dx_1 = c_10 - 3 c_30 - c_12 + 3 c_32, Eq. (33) with its sign corrected.
    let c = Random(5).vector(16);
    let at = |i: usize, j: usize| c[4 * i + j];
    let slope = |axis: usize| {
        let slopes = derivative(&c, 1, &[3, 3], axis).unwrap();
        evaluate(&slopes, 1, &[3, 3], &[0.0, 0.0]).unwrap()[0]
    };
    let first = at(1, 0) - 3.0 * at(3, 0) - at(1, 2) + 3.0 * at(3, 2);
    let second = at(0, 1) - 3.0 * at(0, 3) - at(2, 1) + 3.0 * at(2, 3);
    assert!((slope(0) - first).abs() < 100.0 * EPS);
    assert!((slope(1) - second).abs() < 100.0 * EPS);
}

#[test]
fn interval_bounds_enclose_the_polynomial() {
    let mut random = Random(8);
    for degrees in [vec![7], vec![3, 3], vec![2, 5], vec![3, 1, 2]] {
        let points = tensor(&vec![equispaced(if degrees.len() == 3 { 17 } else { 81 }); degrees.len()]);
        for decay in [1.0, 0.4] {
            let columns = 50;
            let mut coefficients = random.vector(term_count(&degrees) * columns);
            for (term, row) in coefficients.chunks_mut(columns).enumerate() {
                row.iter_mut().for_each(|c| *c *= f64::powi(decay, term as i32));
            }
            let (lower, upper) = interval_bounds(&coefficients, columns, &degrees).unwrap();
            let values = evaluate(&coefficients, columns, &degrees, &points).unwrap();
            for row in values.chunks(columns) {
                for column in 0..columns {
                    let slack = 100.0 * EPS * (upper[column] - lower[column]);
                    assert!(lower[column] - slack <= row[column] && row[column] <= upper[column] + slack);
                }
            }
        }
    }
}

#[test]
fn interval_bounds_of_a_single_term_are_exact() {
    let mut eighth = vec![0.0; 9];
    eighth[8] = 1.0;
    assert_eq!(interval_bounds(&eighth, 1, &[8]).unwrap(), (vec![-1.0], vec![1.0]));
    // The center is c_0 itself; signs of the others do not matter.
    let bounds = interval_bounds(&[4.0, -3.0, 0.5, 1.0, -0.25, 2.0, 0.0, -1.0], 2, &[1, 1]).unwrap();
    assert_eq!(bounds, (vec![3.25, -7.0], vec![4.75, 1.0]));
}

/// Ideal slider-crank at 2000 r/min: slider position [m], then velocity [m/s], at every half degree
/// of a revolution.
fn slider_crank(crank: f64, rod: f64) -> Vec<f64> {
    let speed = 2000.0 * TAU / 60.0;
    let angles: Vec<f64> = (720..1440).map(|i| f64::from(i) * TAU / 720.0).collect();
    let position = angles.iter().map(|a| crank * a.cos() + (rod.powi(2) - (crank * a.sin()).powi(2)).sqrt());
    let velocity = angles.iter().map(|a| {
        let (sin, cos) = a.sin_cos();
        -speed * crank * sin * (1.0 + crank * cos / (rod.powi(2) - (crank * sin).powi(2)).sqrt())
    });
    position.chain(velocity).collect()
}

/// Runs of the slider-crank at points of the box, both lengths ±10 %.
fn slider_crank_runs(points: &[f64]) -> Vec<f64> {
    points
        .chunks(2)
        .flat_map(|x| slider_crank(0.05 * (1.0 + 0.1 * x[0]), 0.12 * (1.0 + 0.1 * x[1])))
        .collect()
}

#[test]
fn ideal_slider_crank_bounds_are_the_published_ones() {
    const COLUMNS: usize = 1440;
    let values = slider_crank_runs(&root_grid(&[4, 4]));
    let coefficients = fit(&values, COLUMNS, &[4, 4], &[3, 3]).unwrap();
    let (lower, upper) = interval_bounds(&coefficients, COLUMNS, &[3, 3]).unwrap();

    let scan = slider_crank_runs(&tensor(&[equispaced(10), equispaced(10)]));
    let mut scan_lower = vec![f64::INFINITY; COLUMNS];
    let mut scan_upper = vec![f64::NEG_INFINITY; COLUMNS];
    for run in scan.chunks(COLUMNS) {
        for column in 0..COLUMNS {
            scan_lower[column] = scan_lower[column].min(run[column]);
            scan_upper[column] = scan_upper[column].max(run[column]);
        }
    }

    let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    let percent = |a: &[f64], b: &[f64]| 100.0 * (rms(a) - rms(b)).abs() / rms(b);
    let width = |low: &[f64], high: &[f64]| largest_difference(low, high);
    let (x, v) = (0..720, 720..1440);

    // Table 3 of [Xiang2020] prints 0.08 and 0.22 % for the position of the mechanism with clearance:
    // the ideal one gives the same, so that row is the slack of Eq. (31). The third decimals, the
    // velocity and the widths are from an independent Python script that solves the linear system of
    // the interpolation.
    let close = |measured: f64, expected: f64, tolerance: f64| {
        assert!((measured - expected).abs() < tolerance, "{measured} is not {expected}");
    };
    close(percent(&lower[x.clone()], &scan_lower[x.clone()]), 0.078, 5e-4);
    close(percent(&upper[x.clone()], &scan_upper[x.clone()]), 0.220, 5e-4);
    close(percent(&lower[v.clone()], &scan_lower[v.clone()]), 0.437, 5e-4);
    close(percent(&upper[v.clone()], &scan_upper[v.clone()]), 0.437, 5e-4);
    close(1e3 * width(&scan_lower[x.clone()], &scan_upper[x.clone()]), 34.42, 5e-3);
    close(width(&scan_lower[v.clone()], &scan_upper[v.clone()]), 3.191, 5e-4);
    close(width(&lower[v.clone()], &upper[v]), 3.3705, 5e-5);
}

#[test]
fn misfits_are_errors() {
    assert!(fit(&[0.0; 12], 1, &[4, 3], &[3, 3]).is_err());
    assert!(fit(&[0.0; 31], 2, &[4, 4], &[3, 3]).is_err());
    assert!(fit(&[0.0; 4], 1, &[4], &[3, 3]).is_err());
    assert!(fit(&[0.0], 1, &[], &[]).is_err());
    assert!(fit(&[], 0, &[4], &[3]).is_err());
    assert!(fit(&[], 1, &[0], &[0]).is_err());
    assert!(fit(&[0.0], 1, &[usize::MAX], &[usize::MAX]).is_err());
    assert!(fit(&[0.0], 1, &[usize::MAX, 2], &[1, 1]).is_err());

    let coefficients = [0.0; 8];
    assert!(evaluate(&coefficients, 2, &[1, 1], &[0.0, 0.0]).is_ok());
    assert!(evaluate(&coefficients, 2, &[1, 1], &[]).is_ok_and(|values| values.is_empty()));
    assert!(evaluate(&coefficients, 1, &[1, 1], &[0.0, 0.0]).is_err());
    assert!(evaluate(&coefficients, 2, &[1, 1], &[0.0; 3]).is_err());
    assert!(evaluate(&coefficients, 2, &[], &[0.0; 2]).is_err());
    for outside in [1.0 + EPS, -1.0 - EPS, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(evaluate(&coefficients, 2, &[1, 1], &[0.0, outside]).is_err(), "{outside}");
    }

    assert!(derivative(&coefficients, 2, &[1, 1], 2).is_err());
    assert!(derivative(&coefficients, 3, &[1, 1], 0).is_err());
    assert!(interval_bounds(&coefficients, 2, &[1, 2]).is_err());
    assert!(interval_bounds(&coefficients, 2, &[usize::MAX]).is_err());
}
