//! The steppers on smooth problems: orders observed with equal steps.

use chebclear::integrators::dop853::Dop853;
use chebclear::integrators::tableaus::{RODAS4, RODAS5P, Tableau};
use chebclear::integrators::{StateAt, Stats, Stepper};

use crate::integrators::problems::{
    Problem, SmoothSystem, distance, kepler, pendulum, prothero_robinson, van_der_pol,
};
use crate::integrators::rodas6p::RODAS6P;

/// Steps of the references, and of the coarsest run. Every grid point of the runs, and the
/// quarters between them, is a grid point of the reference.
const REFERENCE: usize = 8192;

/// Largest error at the ends of the steps and at the quarters inside them, with `count` equal steps.
fn errors(problem: &Problem, tableau: Tableau, count: usize, reference: &[Vec<f64>]) -> (f64, f64) {
    let d = problem.q.len();
    let stride = REFERENCE / count;
    let (mut q, mut v) = (vec![0.0; d], vec![0.0; d]);
    let (mut index, mut ends, mut inside) = (0, 0.0_f64, 0.0_f64);
    problem.equal_steps(tableau, count, |step| {
        for quarter in 1..4 {
            step.at(0.25 * quarter as f64, &mut q, &mut v);
            let exact = &reference[index * stride + quarter * stride / 4];
            inside = inside.max(distance(&[&q[..], &v].concat(), exact));
        }
        index += 1;
        ends = ends.max(distance(&step.end, &reference[index * stride]));
    });
    (ends, inside)
}

/// Checks the orders seen over two halvings of `duration / steps`, at the end and inside the steps.
fn check_orders(problem: &Problem, tableau: Tableau, steps: usize, order: f64, dense: f64) {
    let reference = problem.reference(REFERENCE);
    let runs = [steps, 2 * steps, 4 * steps].map(|count| errors(problem, tableau, count, &reference));
    let name = format!("{} on {}", tableau.name, problem.name);
    let rate = |a: f64, b: f64| (a / b).log2();
    for pair in runs.windows(2) {
        let (at_end, inside) = (rate(pair[0].0, pair[1].0), rate(pair[0].1, pair[1].1));
        println!("{name}: {:.2e} {:.2e}: order {at_end:.3}, dense {inside:.3}", pair[1].0, pair[1].1);
    }
    for pair in runs.windows(2) {
        let (at_end, inside) = (rate(pair[0].0, pair[1].0), rate(pair[0].1, pair[1].1));
        assert!((at_end - order).abs() < 0.2, "{name}: order {at_end}");
        assert!((inside - dense).abs() < 0.2, "{name}: order {inside} inside the steps");
    }
}

#[test]
fn gate_01_the_solution_and_the_dense_output_have_the_order_of_the_method() {
    for (problem, rodas4, rodas5p) in
        [(prothero_robinson(1.0), 64, 32), (van_der_pol(1.0, -0.66), 128, 64), (pendulum(), 128, 64)]
    {
        check_orders(&problem, RODAS4, rodas4, 4.0, 4.0);
        check_orders(&problem, RODAS5P, rodas5p, 5.0, 5.0);
    }
    // The reference method of the tests is what it should be, too.
    check_orders(&van_der_pol(1.0, -0.66), RODAS6P, 32, 6.0, 6.0);
    check_orders(&pendulum(), RODAS6P, 32, 6.0, 6.0);
}

#[test]
fn gate_01_coupled_coordinates_are_integrated_with_the_order_of_the_method() {
    check_orders(&kepler(), RODAS4, 128, 4.0, 4.0);
    check_orders(&kepler(), RODAS5P, 64, 5.0, 5.0);
}

#[test]
fn gate_01_dop853_is_of_order_8_with_a_dense_output_of_order_7() {
    let problem = kepler();
    let d = problem.q.len();
    let errors = [8, 16, 32].map(|count| {
        let mut system = SmoothSystem::new(&problem, 1.0);
        let mut method = Dop853::new(d);
        let mut stats = Stats::default();
        let (mut q, mut v) = (problem.q.clone(), problem.v.clone());
        let h = problem.duration / count as f64;
        let (mut ends, mut inside) = (0.0_f64, 0.0_f64);
        let mut t = problem.t0;
        for _ in 0..count {
            assert!(method.begin(&mut system, StateAt { t, q: &q, v: &v }, &mut stats));
            assert!(method.attempt(&mut system, h, &mut stats));
            assert!(method.finish_dense(&mut system, &mut stats));
            for theta in [0.2, 0.5, 0.9] {
                method.step().at(theta, &mut q, &mut v);
                let exact = problem.solution(t + theta * h).unwrap();
                inside = inside.max(distance(&[&q[..], &v].concat(), &exact));
            }
            q.copy_from_slice(&method.step().end[..d]);
            v.copy_from_slice(&method.step().end[d..]);
            t = method.step().end_time();
            ends = ends.max(distance(&method.step().end, &problem.solution(t).unwrap()));
        }
        // 12 stages and 3 more evaluations for the dense output; the slope at the start is known from the
        // step before, but for the first.
        assert_eq!(stats.evaluations, 15 * count + 1);
        (ends, inside)
    });
    for pair in errors.windows(2) {
        let order = (pair[0].0 / pair[1].0).log2();
        let dense = (pair[0].1 / pair[1].1).log2();
        println!("{:.2e} {:.2e}: order {order:.3}, dense {dense:.3}", pair[1].0, pair[1].1);
        assert!((order - 8.0).abs() < 0.2, "order {order}");
        assert!(dense > 6.8, "order {dense} inside the steps");
    }
}

#[test]
fn gate_01_stiff_forcing_is_followed_accurately() {
    // hL between 15 and 125: where methods without Steinebach's conditions fall to order 1.
    let problem = prothero_robinson(1e3);
    let reference = problem.reference(64);
    for count in [8, 16, 32, 64] {
        let error = |tableau| {
            let end = problem.equal_steps(tableau, count, |_| ());
            distance(&end, &reference[64])
        };
        let (rodas4, rodas5p) = (error(RODAS4), error(RODAS5P));
        println!("{count} steps: Rodas4 {rodas4:.1e}, Rodas5P {rodas5p:.1e}");
        if count == 64 {
            assert!(rodas5p <= 1e-8, "Rodas5P: {rodas5p:e} with 64 steps");
        }
    }
}
