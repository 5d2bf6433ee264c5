//! Ranges of polynomials of total degree: bounds against dense samples, closed forms, the tensor search.

use chebclear::study::band::regression::{basis, exponents, term_count};
use chebclear::study::band::sparse_range::{COARSE, FINE, SparseRange, total_degree_ranges};
use chebclear::study::chebyshev::Polynomials;
use chebclear::study::points::SplitMix64;
use chebclear::study::range::polynomial_ranges;

/// A random polynomial whose coefficients fall with the degree.
fn polynomial(random: &mut SplitMix64, parameters: usize, degree: usize, decay: f64) -> Vec<f64> {
    exponents(parameters, degree)
        .chunks_exact(parameters)
        .map(|term| (2.0 * random.uniform() - 1.0) * decay.powi(term.iter().sum::<usize>() as i32))
        .collect()
}

fn value(coefficients: &[f64], at: &[f64], degree: usize) -> f64 {
    basis(at, at.len(), degree).iter().zip(coefficients).map(|(term, c)| term * c).sum()
}

/// A coordinate: often an end of the box.
fn place(random: &mut SplitMix64) -> f64 {
    (4.0 * (random.uniform() - 0.5)).clamp(-1.0, 1.0)
}

#[test]
fn no_value_is_beyond_the_bounds_and_the_ends_are_taken() {
    let mut random = SplitMix64::new(1);
    for (parameters, degree, decay) in
        [(1, 8, 0.7), (2, 6, 0.5), (4, 6, 0.3), (8, 2, 0.1), (8, 3, 0.3), (20, 2, 0.1)]
    {
        let search = SparseRange::new(parameters, degree, FINE);
        for _ in 0..3 {
            let c = polynomial(&mut random, parameters, degree, decay);
            let size: f64 = c.iter().skip(1).map(|c| c.abs()).sum();
            let [low, high] = search.range(&c);
            for _ in 0..500 {
                let at: Vec<f64> = (0..parameters).map(|_| place(&mut random)).collect();
                let value = value(&c, &at, degree);
                assert!(low.bound <= value && value <= high.bound, "{parameters} {degree}");
            }
            for end in [&low, &high] {
                assert!(end.at.iter().all(|s| s.abs() <= 1.0));
                assert!((value(&c, &end.at, degree) - end.attained).abs() < 1e-12 * size);
            }
            assert!(high.attained <= high.bound && low.attained >= low.bound);
            // Never wider than the sum of the terms one by one.
            assert!(high.bound <= c[0] + size * (1.0 + 1e-12) && low.bound >= c[0] - size * (1.0 + 1e-12));
        }
    }
}

#[test]
fn ranges_are_those_of_the_search_in_the_bernstein_basis() {
    let mut random = SplitMix64::new(5);
    for (parameters, degree) in [(1, 5), (2, 4), (3, 3), (4, 2)] {
        let search = SparseRange::new(parameters, degree, FINE);
        let coarse = SparseRange::new(parameters, degree, COARSE);
        let terms = exponents(parameters, degree);
        for _ in 0..10 {
            let c = polynomial(&mut random, parameters, degree, 0.5);
            let mut tensor = vec![0.0; (degree + 1).pow(parameters as u32)];
            for (term, c) in terms.chunks_exact(parameters).zip(&c) {
                tensor[term.iter().fold(0, |place, n| place * (degree + 1) + n)] = *c;
            }
            let degrees = vec![degree; parameters];
            let polynomials = Polynomials::new(&tensor, 1, &degrees).unwrap();
            let dense = polynomial_ranges(&polynomials, Some(1)).unwrap();
            let size: f64 = c.iter().skip(1).map(|c| c.abs()).sum();
            let [low, high] = search.range(&c);
            assert!((low.bound - dense.lower[0]).abs() < 3e-6 * size, "{parameters} {degree}");
            assert!((high.bound - dense.upper[0]).abs() < 3e-6 * size, "{parameters} {degree}");
            let [low, high] = coarse.range(&c);
            assert!(low.bound <= dense.attained_lower[0] && high.bound >= dense.attained_upper[0]);
        }
    }
}

#[test]
fn a_polynomial_that_is_monotone_in_all_parameters_needs_no_search() {
    // z_1 + ... + z_9 and a product: the ends are opposite corners, exactly.
    let (parameters, degree) = (9, 3);
    let c: Vec<f64> = exponents(parameters, degree)
        .chunks_exact(parameters)
        .map(|term| match term.iter().sum::<usize>() {
            1 => 1.0,
            3 if term[0] == 1 && term[4] == 1 && term[8] == 1 => 0.5,
            _ => 0.0,
        })
        .collect();
    let [low, high] = SparseRange::new(parameters, degree, FINE).range(&c);
    assert_eq!((low.attained, high.attained), (-9.5, 9.5));
    assert!((high.bound - 9.5).abs() < 1e-11 && (low.bound + 9.5).abs() < 1e-11);
    assert_eq!((low.at, high.at), (vec![-1.0; 9], vec![1.0; 9]));
}

#[test]
fn columns_are_searched_on_any_number_of_threads_until_they_are_stopped() {
    let mut random = SplitMix64::new(9);
    let (parameters, degree, columns) = (6, 3, 7);
    let all: Vec<Vec<f64>> = (0..columns).map(|_| polynomial(&mut random, parameters, degree, 0.2)).collect();
    let terms = term_count(parameters, degree);
    let c: Vec<f64> = (0..terms).flat_map(|term| all.iter().map(move |column| column[term])).collect();
    let ranges = |threads: usize| {
        total_degree_ranges(&c, columns, parameters, degree, Some(threads), &|| true).unwrap().unwrap()
    };
    assert_eq!(ranges(1), ranges(3));
    let [low, _] = SparseRange::new(parameters, degree, FINE).range(&all[2]);
    assert_eq!(ranges(1).lower[2], low.bound);
    assert_eq!(ranges(1).lowest_at[2 * parameters..3 * parameters], low.at);
    assert!(total_degree_ranges(&c, columns, parameters, degree, None, &|| false).unwrap().is_none());
    for (wrong, columns) in [(&c[1..], columns), (&c[..], 0)] {
        assert!(total_degree_ranges(wrong, columns, parameters, degree, None, &|| true).is_err());
    }
    let broken = [f64::NAN; 4];
    let error = total_degree_ranges(&broken, 1, 3, 1, None, &|| true).unwrap_err();
    assert!(error.message.contains("column 0 has a coefficient NaN"));
}
