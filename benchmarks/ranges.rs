//! Time per sample of certified ranges, beside Eq. (31) and the fit in the same process; see README.md.
//!
//! cargo bench --bench ranges [-- NAME]

#[path = "../tests/physics/study/polynomials.rs"]
#[allow(dead_code)]
mod polynomials;
#[path = "../tests/physics/support.rs"]
#[allow(dead_code)]
mod support;

use chebclear::study::chebyshev::{fit, root_nodes};
use polynomials::loose::{interval_bounds, polynomial_ranges};
use polynomials::{CASES, random_coefficients, tensor, values};
use std::hint::black_box;
use std::time::Instant;
use support::Random;

/// Shortest time of several, of three works that take turns [us per column].
fn times(terms: usize, columns: usize, works: [&dyn Fn(); 3]) -> [f64; 3] {
    let mut best = [f64::INFINITY; 3];
    // Large polynomials take long enough to be repeated less.
    let repeats = if terms > 1000 { 3 } else { 30 };
    for _ in 0..repeats {
        for (time, work) in best.iter_mut().zip(works) {
            let start = Instant::now();
            work();
            *time = time.min(1e6 * start.elapsed().as_secs_f64() / columns as f64);
        }
    }
    best
}

fn report(name: &str, degrees: &[usize], columns: usize, coefficients: &[f64], runs: Option<&[f64]>) {
    if std::env::args().skip(1).any(|asked| !asked.starts_with("--") && !name.contains(&asked)) {
        return;
    }
    let nodes: Vec<usize> = degrees.iter().map(|n| n + 1).collect();
    let runs = runs.unwrap_or(coefficients);
    let ranges = polynomial_ranges(coefficients, columns, degrees, Some(1)).unwrap();
    let (low, high) = interval_bounds(coefficients, columns, degrees).unwrap();
    let [range, interval, fitting] = times(
        coefficients.len() / columns,
        columns,
        [
            &|| drop(black_box(polynomial_ranges(coefficients, columns, degrees, Some(1)))),
            &|| drop(black_box(interval_bounds(coefficients, columns, degrees))),
            &|| drop(black_box(fit(runs, columns, &nodes, degrees))),
        ],
    );
    let width = |c: usize| ranges.attained_upper[c] - ranges.attained_lower[c];
    let widest = (0..columns).map(width).fold(0.0, f64::max);
    let each = (0..columns).filter(|&c| width(c) > 1e-9 * widest);
    let gap = each.clone().map(|c| (ranges.upper[c] - ranges.lower[c]) / width(c) - 1.0).fold(0.0, f64::max);
    let mut excess: Vec<f64> = each.map(|c| 100.0 * ((high[c] - low[c]) / width(c) - 1.0)).collect();
    excess.sort_by(f64::total_cmp);
    println!(
        "{name:20} {:3} {:4} {:8} {range:9.3} {interval:9.3} {fitting:9.3} {:9.2} {gap:9.1e} {:8.1}",
        degrees.len(),
        degrees[0],
        columns,
        ranges.boxes as f64 / columns as f64,
        excess[excess.len() / 2],
    );
}

fn main() {
    println!(
        "us per sample, both ends, one thread; boxes per sample; gap: certified over attained width; slack of Eq. (31) [%]"
    );
    println!(
        "case                   k    n  samples     range   Eq.(31)       fit     boxes       gap    slack"
    );
    for case in &CASES {
        let degrees = vec![case.degree; case.parameters];
        let runs = values(case, case.samples, &tensor(&vec![root_nodes(case.degree + 1); case.parameters]));
        let nodes: Vec<usize> = degrees.iter().map(|n| n + 1).collect();
        let coefficients = fit(&runs, case.samples, &nodes, &degrees).unwrap();
        report(case.name, &degrees, case.samples, &coefficients, Some(&runs));
    }
    let mut random = Random(1);
    for (degrees, columns) in [(vec![3; 2], 2000), (vec![8; 2], 500), (vec![5; 3], 100), (vec![3; 6], 5)] {
        for (name, decay) in [("random, no decay", 1.0), ("random, decay 1/e", (-1.0f64).exp())] {
            let coefficients = random_coefficients(&mut random, &degrees, columns, decay);
            report(name, &degrees, columns, &coefficients, None);
        }
    }
}
