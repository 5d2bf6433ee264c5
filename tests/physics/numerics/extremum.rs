//! Maxima within a bracket: tops of known functions, in a bounded number of evaluations.

use chebclear::numerics::extremum::highest_within;

/// Most evaluations of a search.
const EVALUATIONS: usize = 40;

#[test]
fn tops_of_known_functions_are_found() {
    for k in 0..100 {
        let top = 0.01 + 0.0098 * f64::from(k);
        let functions: [&dyn Fn(f64) -> f64; 4] = [
            &|x| 3.0 - (x - top).powi(2),
            &|x| (2.5 * (x - top)).cos(),
            &|x| -(x - top).abs().powf(1.5),
            &|x| -(x - top).abs(),
        ];
        for (index, function) in functions.iter().enumerate() {
            let middle = 0.5;
            let mut count = 0;
            let (place, value) = highest_within([0.0, 1.0], (middle, function(middle)), |x| {
                count += 1;
                function(x)
            });
            assert!((place - top).abs() < 2e-6, "{index}: {place} instead of {top}");
            assert!(function(top) - value < 2e-6_f64.powf([2.0, 2.0, 1.5, 1.0][index]), "{index} {value}");
            assert!(count <= EVALUATIONS);
        }
    }
}

#[test]
fn a_top_at_an_end_is_met_to_the_tolerance() {
    let (place, _) = highest_within([1.0, 3.0], (2.0, 2.0), |x| x);
    assert!(place > 3.0 - 1e-5, "{place}");
}
