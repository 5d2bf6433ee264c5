//! Smooth initial value problems `q̈ = a(q, q̇, t)` for the integrator, with exact derivatives.

use chebclear::dynamics::Linearization;
use chebclear::integrators::dense::DenseStep;
use chebclear::integrators::rosenbrock::Rosenbrock;
use chebclear::integrators::tableaus::Tableau;
use chebclear::integrators::{HybridSystem, Limits, Outcome, StateAt, Stats, Stepper, integrate};
use chebclear::numerics::instant::Instant;
use std::f64::consts::FRAC_PI_4;

use crate::integrators::rodas6p::RODAS6P;

/// Integrates with a Rosenbrock method.
pub fn rosenbrock(
    system: &mut dyn HybridSystem,
    tableau: Tableau,
    limits: Limits,
    t: f64,
    end: f64,
    q: &mut [f64],
    v: &mut [f64],
) -> Outcome {
    integrate(system, &mut Rosenbrock::new(tableau, q.len()), limits, t, end, q, v)
}

/// Accelerations: parameter, time since the start, q, v, out.
type Law = fn(f64, f64, &[f64], &[f64], &mut [f64]);
/// Their derivatives: parameter, time since the start, q, v, out.
type Derivatives = fn(f64, f64, &[f64], &[f64], &mut Linearization);
/// A solution: parameter, time since the start, q, v, both written to.
type Solution = fn(f64, f64, &mut [f64], &mut [f64]);

/// An initial value problem.
#[derive(Clone)]
pub struct Problem {
    pub name: &'static str,
    law: Law,
    derivatives: Derivatives,
    parameter: f64,
    /// Start; the law counts the time from here.
    pub t0: f64,
    pub duration: f64,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    /// The solution, where there is a closed form.
    exact: Option<Solution>,
}

/// v' = -L (v - φ) - L/2 (v² - φ²) + φ' with the solution v = φ = sin(t + π/4): Prothero and
/// Robinson, nonlinear. The position, which no force depends on, is the integral of φ.
pub fn prothero_robinson(stiffness: f64) -> Problem {
    Problem {
        name: "Prothero-Robinson",
        law: |l, t, _, v, a| {
            let (phi, rate) = (t + FRAC_PI_4).sin_cos();
            a[0] = -l * (v[0] - phi) - 0.5 * l * (v[0] * v[0] - phi * phi) + rate;
        },
        derivatives: |l, t, _, v, out| {
            let (phi, rate) = (t + FRAC_PI_4).sin_cos();
            out.a_q[0] = 0.0;
            out.a_v[0] = -l * (1.0 + v[0]);
            out.a_t[0] = l * rate * (1.0 + phi) - phi;
        },
        parameter: stiffness,
        t0: 0.0,
        duration: 1.0,
        q: vec![0.0],
        v: vec![FRAC_PI_4.sin()],
        exact: Some(|_, t, q, v| {
            q[0] = FRAC_PI_4.cos() - (t + FRAC_PI_4).cos();
            v[0] = (t + FRAC_PI_4).sin();
        }),
    }
}

/// Van der Pol: ε q̈ = (1 - q²) q̇ - q.
pub fn van_der_pol(epsilon: f64, v: f64) -> Problem {
    Problem {
        name: "van der Pol",
        law: |epsilon, _, q, v, a| a[0] = ((1.0 - q[0] * q[0]) * v[0] - q[0]) / epsilon,
        derivatives: |epsilon, _, q, v, out| {
            out.a_q[0] = (-2.0 * q[0] * v[0] - 1.0) / epsilon;
            out.a_v[0] = (1.0 - q[0] * q[0]) / epsilon;
            out.a_t[0] = 0.0;
        },
        parameter: epsilon,
        t0: 0.0,
        duration: 2.0,
        q: vec![2.0],
        v: vec![v],
        exact: None,
    }
}

/// A pendulum in its angle, with a torque that changes with time.
pub fn pendulum() -> Problem {
    Problem {
        name: "pendulum",
        law: |_, t, q, v, a| a[0] = -9.81 * q[0].sin() - 0.2 * v[0] + 2.0 * (3.0 * t).cos(),
        derivatives: |_, t, q, _, out| {
            out.a_q[0] = -9.81 * q[0].cos();
            out.a_v[0] = -0.2;
            out.a_t[0] = -6.0 * (3.0 * t).sin();
        },
        parameter: 0.0,
        t0: 0.0,
        duration: 2.0,
        q: vec![1.0],
        v: vec![0.5],
        exact: None,
    }
}

/// Eccentricity of the orbit of [`kepler`].
const ECCENTRICITY: f64 = 0.3;

/// Kepler's problem seen from a frame that turns once in an orbit: two coordinates that the forces
/// couple in position and velocity.
pub fn kepler() -> Problem {
    let periapsis = 1.0 - ECCENTRICITY;
    Problem {
        name: "Kepler in a rotating frame",
        law: |_, _, q, v, a| {
            let cube = (q[0] * q[0] + q[1] * q[1]).powf(1.5);
            a[0] = -q[0] / cube + 2.0 * v[1] + q[0];
            a[1] = -q[1] / cube - 2.0 * v[0] + q[1];
        },
        derivatives: |_, _, q, _, out| {
            let square = q[0] * q[0] + q[1] * q[1];
            let (cube, fifth) = (square.powf(1.5), square.powf(2.5));
            for i in 0..2 {
                for j in 0..2 {
                    out.a_q[2 * i + j] = 3.0 * q[i] * q[j] / fifth;
                }
                out.a_q[3 * i] += 1.0 - 1.0 / cube;
            }
            out.a_v.copy_from_slice(&[0.0, 2.0, -2.0, 0.0]);
            out.a_t.fill(0.0);
        },
        parameter: 0.0,
        t0: 0.0,
        duration: 2.0,
        q: vec![periapsis, 0.0],
        v: vec![0.0, ((1.0 + ECCENTRICITY) / periapsis).sqrt() - periapsis],
        exact: Some(|_, t, q, v| {
            // Kepler's equation E - e sin E = t by Newton's method.
            let mut anomaly = t;
            for _ in 0..50 {
                anomaly -=
                    (anomaly - ECCENTRICITY * anomaly.sin() - t) / (1.0 - ECCENTRICITY * anomaly.cos());
            }
            let (sine, cosine) = anomaly.sin_cos();
            let minor = (1.0 - ECCENTRICITY * ECCENTRICITY).sqrt();
            let rate = 1.0 / (1.0 - ECCENTRICITY * cosine);
            let (x, y) = (cosine - ECCENTRICITY, minor * sine);
            let (vx, vy) = (-sine * rate, minor * cosine * rate);
            // Into the frame turned by t, which turns at the speed 1.
            let (s, c) = t.sin_cos();
            q.copy_from_slice(&[c * x + s * y, c * y - s * x]);
            v.copy_from_slice(&[c * vx + s * vy + q[1], c * vy - s * vx - q[0]]);
        }),
    }
}

impl Problem {
    /// Takes `count` equal steps; every one is shown to `each`. Returns (q, v) at the end.
    pub fn equal_steps(&self, tableau: Tableau, count: usize, mut each: impl FnMut(&DenseStep)) -> Vec<f64> {
        let d = self.q.len();
        let mut system = SmoothSystem::new(self, 1.0);
        let mut method = Rosenbrock::new(tableau, d);
        let mut stats = Stats::default();
        let mut state = [self.q.clone(), self.v.clone()].concat();
        let h = self.duration / count as f64;
        for index in 0..count {
            let t = self.t0 + self.duration * index as f64 / count as f64;
            let (q, v) = state.split_at(d);
            assert!(method.begin(&mut system, StateAt { t, q, v }, &mut stats));
            assert!(method.attempt(&mut system, h, &mut stats));
            assert!(method.finish_dense(&mut system, &mut stats));
            each(&method.step);
            state.copy_from_slice(&method.step.end);
        }
        state
    }

    /// (q, v) at the fraction `index / count` of the duration for every index: the closed form, or
    /// Rodas6P with `count` equal steps.
    pub fn reference(&self, count: usize) -> Vec<Vec<f64>> {
        let instant = |index| self.t0 + self.duration * index as f64 / count as f64;
        if self.exact.is_some() {
            return (0..=count).filter_map(|index| self.solution(instant(index))).collect();
        }
        let mut states = vec![[self.q.clone(), self.v.clone()].concat()];
        self.equal_steps(RODAS6P, count, |step| states.push(step.end.clone()));
        states
    }

    /// (q, v) at the time `t`, where there is a closed form.
    pub fn solution(&self, t: f64) -> Option<Vec<f64>> {
        self.exact.map(|exact| {
            let d = self.q.len();
            let mut state = vec![0.0; 2 * d];
            let (q, v) = state.split_at_mut(d);
            exact(self.parameter, t - self.t0, q, v);
            state
        })
    }

    /// The first-order right-hand side, its Jacobian and its time derivative at a state (q, v).
    pub fn first_order(&self, t: f64, state: &[f64]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let d = self.q.len();
        let (q, v) = state.split_at(d);
        let mut linear = Linearization::new(d);
        SmoothSystem::new(self, 1.0).linearize(t, q, v, &mut linear);
        let mut jacobian = vec![0.0; 4 * d * d];
        for i in 0..d {
            jacobian[2 * d * i + d + i] = 1.0;
            for j in 0..d {
                jacobian[2 * d * (d + i) + j] = linear.a_q[d * i + j];
                jacobian[2 * d * (d + i) + d + j] = linear.a_v[d * i + j];
            }
        }
        ([v, &linear.a].concat(), jacobian, [vec![0.0; d], linear.a_t].concat())
    }

    /// Integrates adaptively with an absolute tolerance of every coordinate and velocity.
    pub fn adaptively(&self, tableau: Tableau, tolerance: f64) -> (Outcome, Vec<f64>) {
        let mut system = SmoothSystem::new(self, tolerance);
        let (mut q, mut v) = (self.q.clone(), self.v.clone());
        let end = self.t0 + self.duration;
        let outcome = rosenbrock(&mut system, tableau, Limits::default(), self.t0, end, &mut q, &mut v);
        (outcome, [q, v].concat())
    }
}

/// A problem as the integrator sees it.
pub struct SmoothSystem<'a> {
    problem: &'a Problem,
    tolerance: f64,
}

impl<'a> SmoothSystem<'a> {
    pub fn new(problem: &'a Problem, tolerance: f64) -> Self {
        Self { problem, tolerance }
    }
}

impl HybridSystem for SmoothSystem<'_> {
    fn dimension(&self) -> usize {
        self.problem.q.len()
    }

    fn acceleration(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        (self.problem.law)(self.problem.parameter, t.time - self.problem.t0, q, v, a);
        true
    }

    fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearization) -> bool {
        (self.problem.law)(self.problem.parameter, t - self.problem.t0, q, v, &mut linear.a);
        (self.problem.derivatives)(self.problem.parameter, t - self.problem.t0, q, v, linear);
        true
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        position.fill(self.tolerance);
        velocity.fill(self.tolerance);
    }
}

/// One coordinate whose acceleration is a function of time, position and velocity.
pub struct Single {
    law: Box<dyn Fn(f64, f64, f64) -> f64>,
    /// Derivatives by position, velocity and time; an explicit method does not ask for them.
    derivatives: fn(f64, f64, f64) -> [f64; 3],
    tolerances: [f64; 2],
}

impl Single {
    pub fn explicit(law: impl Fn(f64, f64, f64) -> f64 + 'static) -> Self {
        Self::new(law, |_, _, _| unreachable!("an explicit method"), [1e-3; 2])
    }

    pub fn new(
        law: impl Fn(f64, f64, f64) -> f64 + 'static,
        derivatives: fn(f64, f64, f64) -> [f64; 3],
        tolerances: [f64; 2],
    ) -> Self {
        Self { law: Box::new(law), derivatives, tolerances }
    }
}

impl HybridSystem for Single {
    fn dimension(&self) -> usize {
        1
    }

    fn acceleration(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        a[0] = (self.law)(t.time, q[0], v[0]);
        true
    }

    fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearization) -> bool {
        [linear.a_q[0], linear.a_v[0], linear.a_t[0]] = (self.derivatives)(t, q[0], v[0]);
        self.acceleration(t.into(), q, v, &mut linear.a)
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        [position[0], velocity[0]] = self.tolerances;
    }
}

/// Largest difference of two states.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    // A NaN must not get lost.
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, |x, y| if y > x || y.is_nan() { y } else { x })
}
