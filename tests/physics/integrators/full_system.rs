//! The step of the core, whose position rows are eliminated, against that of the full first-order system.

use chebclear::integrators::tableaus::{RODAS4, RODAS5P, Tableau};
use nalgebra::{DMatrix, DVector};

use crate::integrators::problems::{Problem, distance, kepler, pendulum, prothero_robinson, van_der_pol};

type Vector = DVector<f64>;

/// y and the interior values at a quarter, a half and three quarters of one step of length `h`.
fn step(problem: &Problem, tableau: &Tableau, t: f64, h: f64, y: &Vector) -> (Vector, [Vector; 3]) {
    let n = y.len();
    let (_, jacobian, f_t) = problem.first_order(t, y.as_slice());
    let matrix = DMatrix::identity(n, n) / (h * tableau.gamma) - DMatrix::from_row_slice(n, n, &jacobian);
    let (lu, f_t) = (matrix.lu(), Vector::from_vec(f_t));
    let mut u: Vec<Vector> = Vec::new();
    let combined = |weights: &[f64], u: &[Vector]| {
        weights.iter().zip(u).fold(Vector::zeros(n), |sum, (weight, u)| sum + u * *weight)
    };
    for i in 0..tableau.stages {
        let argument = y + combined(tableau.a[i], &u);
        let f = Vector::from_vec(problem.first_order(t + tableau.alpha[i] * h, argument.as_slice()).0);
        let memory = combined(tableau.c[i], &u) / h;
        u.push(lu.solve(&(f + memory + &f_t * (h * tableau.d[i]))).expect("regular"));
    }
    let end = y + combined(tableau.m, &u);
    let inside = [0.25, 0.5, 0.75].map(|theta: f64| {
        let rows = tableau.h.iter().enumerate();
        let sum = rows.fold(Vector::zeros(n), |sum, (r, row)| sum + combined(row, &u) * theta.powi(r as i32));
        y * (1.0 - theta) + (&end + sum * (1.0 - theta)) * theta
    });
    (end, inside)
}

#[test]
fn the_second_order_structure_takes_the_same_step_as_the_full_system() {
    for problem in [kepler(), pendulum(), prothero_robinson(1e3), van_der_pol(0.1, -0.66)] {
        let d = problem.q.len();
        for tableau in [RODAS4, RODAS5P] {
            let mut y = Vector::from_vec([problem.q.clone(), problem.v.clone()].concat());
            let (mut q, mut v) = (vec![0.0; d], vec![0.0; d]);
            problem.equal_steps(tableau, 100, |ours| {
                let (end, inside) = step(&problem, &tableau, ours.t, ours.h, &y);
                for (theta, theirs) in [0.25, 0.5, 0.75, 1.0].into_iter().zip(inside.iter().chain([&end])) {
                    ours.at(theta, &mut q, &mut v);
                    let difference = distance(&[&q[..], &v].concat(), theirs.as_slice());
                    assert!(difference < 1e-11, "{} on {}: {difference:e}", tableau.name, problem.name);
                }
                y = end;
            });
        }
    }
}
