//! The coefficients on differential-algebraic equations of index 1, `M y' = f(t, y)`: the product
//! integrates none today, but its methods are chosen to be able to.

use chebclear::integrators::tableaus::{RODAS4, RODAS5P, Tableau};
use nalgebra::{DMatrix, DVector};

use crate::integrators::problems::{distance, kepler, pendulum, prothero_robinson, van_der_pol};
use crate::integrators::rodas6p::RODAS6P;

type Vector = DVector<f64>;
/// A function of t and y.
type Law<T> = Box<dyn Fn(f64, &Vector) -> T>;

/// `M y' = f(t, y)` with M = diag(1, ..., 1, 0) or, with no algebraic equation, M = I.
struct Constrained {
    name: &'static str,
    algebraic: bool,
    f: Law<Vector>,
    jacobian: Law<DMatrix<f64>>,
    time_derivative: Law<Vector>,
    start: Vector,
    t0: f64,
    duration: f64,
}

/// y and the interior values at a quarter, a half and three quarters of one step of length `h`.
fn step(problem: &Constrained, tableau: &Tableau, t: f64, h: f64, y: &Vector) -> (Vector, [Vector; 3]) {
    let (n, s) = (y.len(), tableau.stages);
    let mut mass = DMatrix::identity(n, n);
    if problem.algebraic {
        mass[(n - 1, n - 1)] = 0.0;
    }
    let f_t = (problem.time_derivative)(t, y);
    let matrix = &mass / (h * tableau.gamma) - (problem.jacobian)(t, y);
    let lu = matrix.lu();
    let mut u: Vec<Vector> = Vec::with_capacity(s);
    let combined = |weights: &[f64], u: &[Vector]| {
        weights.iter().zip(u).fold(Vector::zeros(n), |sum, (weight, u)| sum + u * *weight)
    };
    for i in 0..s {
        let argument = y + combined(&tableau.a[i], &u);
        let memory = combined(&tableau.c[i], &u) / h;
        let rhs =
            (problem.f)(t + tableau.alpha[i] * h, &argument) + &mass * memory + &f_t * (h * tableau.d[i]);
        u.push(lu.solve(&rhs).expect("regular"));
    }
    let end = y + combined(tableau.m, &u);
    let inside = [0.25, 0.5, 0.75].map(|theta: f64| {
        let rows = tableau.h.iter().enumerate();
        let sum = rows.fold(Vector::zeros(n), |sum, (r, row)| sum + combined(row, &u) * theta.powi(r as i32));
        y * (1.0 - theta) + (&end + sum * (1.0 - theta)) * theta
    });
    (end, inside)
}

/// Values at the fraction `index / (4 count)` of the duration, for every index.
fn equal_steps(problem: &Constrained, tableau: &Tableau, count: usize) -> Vec<Vector> {
    let mut values = vec![problem.start.clone()];
    let h = problem.duration / count as f64;
    for index in 0..count {
        let t = problem.t0 + problem.duration * index as f64 / count as f64;
        let (end, inside) = step(problem, tableau, t, h, values.last().expect("the start"));
        values.extend(inside);
        values.push(end);
    }
    values
}

/// Orders over two halvings: (at the ends of the steps, inside them) for each.
fn orders(
    problem: &Constrained,
    tableau: &Tableau,
    steps: usize,
    exact: &dyn Fn(f64) -> Vector,
) -> [(f64, f64); 2] {
    let errors = [steps, 2 * steps, 4 * steps].map(|count| {
        let (mut ends, mut inside) = (0.0_f64, 0.0_f64);
        for (index, y) in equal_steps(problem, tableau, count).iter().enumerate() {
            let reference = exact(index as f64 / (4 * count) as f64);
            let difference = distance(y.as_slice(), reference.as_slice());
            let largest = if index % 4 == 0 { &mut ends } else { &mut inside };
            *largest = largest.max(difference);
        }
        (ends, inside)
    });
    let rates =
        [0, 1].map(|k| ((errors[k].0 / errors[k + 1].0).log2(), (errors[k].1 / errors[k + 1].1).log2()));
    println!(
        "{} on {}, {steps} steps: errors {:.1e} {:.1e}",
        tableau.name, problem.name, errors[2].0, errors[2].1
    );
    println!("    orders {rates:.2?}");
    rates
}

/// y₁' = y₂³ y₃ / 2, y₂' = y₂ y₃ / 6, 0 = y₃ + 6 y₁ / y₂³, with y₁ = e^(-3t) and y₂³ = y₁ + 1.
fn cubic() -> Constrained {
    Constrained {
        name: "index-1 DAE",
        algebraic: true,
        f: Box::new(|_, y| {
            let cube = y[1].powi(3);
            Vector::from_vec(vec![0.5 * cube * y[2], y[1] * y[2] / 6.0, y[2] + 6.0 * y[0] / cube])
        }),
        jacobian: Box::new(|_, y| {
            let (square, cube) = (y[1].powi(2), y[1].powi(3));
            let rows = [
                [0.0, 1.5 * square * y[2], 0.5 * cube],
                [0.0, y[2] / 6.0, y[1] / 6.0],
                [6.0 / cube, -18.0 * y[0] / (cube * y[1]), 1.0],
            ];
            DMatrix::from_row_slice(3, 3, rows.as_flattened())
        }),
        time_derivative: Box::new(|_, _| Vector::zeros(3)),
        start: cubic_solution(0.0),
        t0: 0.0,
        duration: 1.0,
    }
}

fn cubic_solution(t: f64) -> Vector {
    let y1 = (-3.0 * t).exp();
    Vector::from_vec(vec![y1, (y1 + 1.0).cbrt(), -6.0 * y1 / (y1 + 1.0)])
}

/// Angle θ counts from the downward vertical; the tangential force on the unit mass is
/// 2 cos 3t - 0.2 θ', gravity 9.81.
fn tangential(t: f64, rate: f64) -> f64 {
    2.0 * (3.0 * t).cos() - 0.2 * rate
}

/// The pendulum of unit mass and length in Cartesian coordinates (x, y, vx, vy, λ), its
/// constraint at the level of accelerations: v' = force - λ q, 0 = q·force - λ q² + v².
fn cartesian_pendulum() -> Constrained {
    // The tangent is (-y, x), so θ' = x vy - y vx.
    fn force(t: f64, z: &Vector) -> [f64; 2] {
        let push = tangential(t, z[0] * z[3] - z[1] * z[2]);
        [-push * z[1], push * z[0] - 9.81]
    }
    Constrained {
        name: "index-1 pendulum",
        algebraic: true,
        f: Box::new(|t, z| {
            let [fx, fy] = force(t, z);
            let square = z[0] * z[0] + z[1] * z[1];
            Vector::from_vec(vec![
                z[2],
                z[3],
                fx - z[4] * z[0],
                fy - z[4] * z[1],
                z[0] * fx + z[1] * fy - z[4] * square + z[2] * z[2] + z[3] * z[3],
            ])
        }),
        jacobian: Box::new(|t, z| {
            let (x, y, vx, vy, lambda) = (z[0], z[1], z[2], z[3], z[4]);
            let push = tangential(t, x * vy - y * vx);
            // Derivatives of the push by x, y, vx, vy.
            let by = [-0.2 * vy, 0.2 * vx, 0.2 * y, -0.2 * x];
            let mut j = DMatrix::zeros(5, 5);
            j[(0, 2)] = 1.0;
            j[(1, 3)] = 1.0;
            for k in 0..4 {
                j[(2, k)] = -by[k] * y;
                j[(3, k)] = by[k] * x;
            }
            j[(2, 1)] -= push;
            j[(3, 0)] += push;
            j[(2, 0)] -= lambda;
            j[(3, 1)] -= lambda;
            j[(2, 4)] = -x;
            j[(3, 4)] = -y;
            // q·force = -9.81 y: the push is tangential.
            let last = [-2.0 * lambda * x, -9.81 - 2.0 * lambda * y, 2.0 * vx, 2.0 * vy, -x * x - y * y];
            for (k, entry) in last.into_iter().enumerate() {
                j[(4, k)] = entry;
            }
            j
        }),
        time_derivative: Box::new(|t, z| {
            let push = -6.0 * (3.0 * t).sin();
            Vector::from_vec(vec![0.0, 0.0, -push * z[1], push * z[0], 0.0])
        }),
        start: cartesian(1.0, 0.5),
        t0: 0.0,
        duration: 2.0,
    }
}

/// (q, v, λ) from the angle and its rate; λ = θ'² + 9.81 cos θ is the tension.
fn cartesian(angle: f64, rate: f64) -> Vector {
    let (s, c) = angle.sin_cos();
    Vector::from_vec(vec![s, -c, c * rate, s * rate, rate * rate + 9.81 * c])
}

/// Robertson's kinetics with the sum of the species as the algebraic equation.
fn robertson(start: Vector, t0: f64, duration: f64) -> Constrained {
    Constrained {
        name: "Robertson",
        algebraic: true,
        f: Box::new(|_, y| {
            let forward = -0.04 * y[0] + 1e4 * y[1] * y[2];
            Vector::from_vec(vec![forward, -forward - 3e7 * y[1] * y[1], y[0] + y[1] + y[2] - 1.0])
        }),
        jacobian: Box::new(|_, y| {
            let rows = [
                [-0.04, 1e4 * y[2], 1e4 * y[1]],
                [0.04, -1e4 * y[2] - 6e7 * y[1], -1e4 * y[1]],
                [1.0, 1.0, 1.0],
            ];
            DMatrix::from_row_slice(3, 3, rows.as_flattened())
        }),
        time_derivative: Box::new(|_, _| Vector::zeros(3)),
        start,
        t0,
        duration,
    }
}

fn check(rates: [(f64, f64); 2], order: f64, dense: f64) {
    for (ends, inside) in rates {
        assert!((ends - order).abs() < 0.2, "order {ends}, not {order}");
        // From above: in the differential variables the dense output is one order better.
        assert!(inside > dense - 0.2 && inside < dense + 0.5, "order {inside} inside the steps, not {dense}");
    }
}

#[test]
fn gate_01_an_index_1_equation_is_solved_with_the_order_of_the_method() {
    for (tableau, steps, order) in [(RODAS4, 32, 4.0), (RODAS5P, 32, 5.0), (RODAS6P, 32, 6.0)] {
        check(orders(&cubic(), &tableau, steps, &cubic_solution), order, order - 1.0);
    }
}

#[test]
fn gate_01_a_pendulum_with_its_constraint_is_solved_with_the_order_of_the_method() {
    let minimal = pendulum().reference(8192);
    let exact = |fraction: f64| {
        let state = &minimal[(8192.0 * fraction) as usize];
        cartesian(state[0], state[1])
    };
    for (tableau, order) in [(RODAS4, 4.0), (RODAS5P, 5.0)] {
        check(orders(&cartesian_pendulum(), &tableau, 256, &exact), order, order - 1.0);
    }
}

#[test]
fn gate_01_robertson_s_kinetics_are_solved_with_the_order_of_the_method() {
    let transient = robertson(Vector::from_vec(vec![1.0, 0.0, 0.0]), 0.0, 1.0);
    let start = equal_steps(&transient, &RODAS6P, 1 << 15).pop().expect("the end");
    let problem = robertson(start, 1.0, 20.0);
    let fine = equal_steps(&problem, &RODAS6P, 2048);
    let exact = |fraction: f64| fine[(8192.0 * fraction) as usize].clone();
    for (at_ends, _) in orders(&problem, &RODAS5P, 16, &exact) {
        assert!((at_ends - 5.0).abs() < 0.2, "order {at_ends}");
    }
    // Rodas4 lacks the conditions for stiff components: the fast one holds its order between 3
    // and 4 down to rounding errors.
    for (at_ends, _) in orders(&problem, &RODAS4, 64, &exact) {
        assert!(at_ends > 3.3 && at_ends < 4.2, "order {at_ends}");
    }
}

#[test]
fn the_second_order_structure_takes_the_same_step_as_the_full_system() {
    for original in [kepler(), pendulum(), prothero_robinson(1e3), van_der_pol(0.1, -0.66)] {
        let d = original.q.len();
        let problems = [(); 3].map(|()| original.clone());
        let [f, jacobian, f_t] =
            problems.map(|problem| move |t: f64, y: &Vector| problem.first_order(t, y.as_slice()));
        let full = Constrained {
            name: original.name,
            algebraic: false,
            f: Box::new(move |t, y| Vector::from_vec(f(t, y).0)),
            jacobian: Box::new(move |t, y| DMatrix::from_row_slice(2 * d, 2 * d, &jacobian(t, y).1)),
            time_derivative: Box::new(move |t, y| Vector::from_vec(f_t(t, y).2)),
            start: Vector::from_vec([original.q.clone(), original.v.clone()].concat()),
            t0: 0.0,
            duration: original.duration,
        };
        for tableau in [RODAS4, RODAS5P] {
            let count = 100;
            let mut inside = Vec::new();
            let (mut q, mut v) = (vec![0.0; d], vec![0.0; d]);
            original.equal_steps(tableau, count, |step| {
                for theta in [0.25, 0.5, 0.75, 1.0] {
                    step.at(theta, &mut q, &mut v);
                    inside.push([&q[..], &v].concat());
                }
            });
            for (ours, theirs) in inside.iter().zip(&equal_steps(&full, &tableau, count)[1..]) {
                let difference = distance(ours, theirs.as_slice());
                assert!(difference < 1e-11, "{} on {}: {difference:e}", tableau.name, original.name);
            }
        }
    }
}
