//! The Adams method: what it integrates exactly, how accurate its steps and its dense output are.

use chebclear::dynamics::Linearization;
use chebclear::integrators::adams::Adams;
use chebclear::integrators::dense::DenseStep;
use chebclear::integrators::dop853::Dop853;
use chebclear::integrators::{HybridSystem, Limits, StateAt, Stats, Status, Stepper, integrate};
use chebclear::numerics::instant::Instant;

use crate::integrators::problems::{Problem, Single, SmoothSystem, distance, kepler};
use crate::integrators::rattle::{self, Rattle};
use crate::support::Random;

/// Position and velocity from (0, 1) at zero where the acceleration is 1 + t + ... + t^degree.
fn polynomial(degree: i32, t: f64) -> [f64; 2] {
    let powers = (0..=degree).map(|p| (f64::from(p), t.powi(p)));
    powers.fold([t, 1.0], |[q, v], (p, power)| {
        [q + power * t * t / ((p + 1.0) * (p + 2.0)), v + power * t / (p + 1.0)]
    })
}

#[test]
fn polynomials_of_the_degree_of_the_start_are_integrated_exactly_by_steps_of_any_lengths() {
    for degree in 0..4 {
        let mut random = Random(5);
        let mut system = Single::explicit(move |t, _, _| (0..=degree).map(|p| t.powi(p)).sum());
        let mut worst = 0.0_f64;
        let mut method = Adams::new(1);
        let mut stats = Stats::default();
        let (mut t, mut q, mut v) = (0.0, [0.0], [1.0]);
        method.restart(&[1e-3], &[1e-3]);
        while t < 1.0 {
            assert!(method.begin(&mut system, StateAt { t, q: &q, v: &v }, &mut stats));
            // An attempt that is given up leaves nothing behind.
            assert!(method.attempt(&mut system, 0.05, &mut stats));
            assert!(method.attempt(&mut system, random.within(0.005, 0.03), &mut stats));
            assert!(method.finish_dense(&mut system, &mut stats));
            for theta in [0.0, 0.3, 0.7, 1.0] {
                method.step().at(theta, &mut q, &mut v);
                let instant = t + theta * method.step().h;
                worst = worst.max(distance(&[q[0], v[0]], &polynomial(degree, instant)));
            }
            t = method.step().end_time();
            (q, v) = ([method.step().end[0]], [method.step().end[1]]);
            worst = worst.max(distance(&[q[0], v[0]], &polynomial(degree, t)));
            method.next_limits(&mut system, StateAt { t, q: &q, v: &v }, &mut stats);
        }
        println!("degree {degree}: {:.1e}", worst);
        // Derivatives of the start's dense output, extrapolated over steps of other lengths: 1.3e-11.
        assert!(worst < 1e-10, "degree {degree}: {:e}", worst);
    }
}

/// A problem with a closed form whose steps are compared with it.
struct Compared<'a> {
    inner: SmoothSystem<'a>,
    problem: &'a Problem,
    ends: f64,
    inside: f64,
    last: Option<DenseStep>,
}

impl HybridSystem for Compared<'_> {
    fn dimension(&self) -> usize {
        self.inner.dimension()
    }
    fn acceleration(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        self.inner.acceleration(t, q, v, a)
    }
    fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearization) -> bool {
        self.inner.linearize(t, q, v, linear)
    }
    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        self.inner.tolerances(position, velocity);
    }
    fn accepted(&mut self, step: &DenseStep) -> Result<(), Status> {
        let d = self.dimension();
        let (mut q, mut v) = (vec![0.0; d], vec![0.0; d]);
        let mut error = |theta: f64| {
            step.at(theta, &mut q, &mut v);
            distance(&[&q[..], &v].concat(), &self.problem.solution(step.t + theta * step.h).unwrap())
        };
        self.ends = self.ends.max(error(1.0));
        self.inside = [0.2, 0.5, 0.8].into_iter().map(&mut error).fold(self.inside, f64::max);
        self.last = Some(step.clone());
        Ok(())
    }
}

fn compared(problem: &Problem, method: &mut dyn Stepper, tolerance: f64) -> (Stats, f64, f64) {
    let inner = SmoothSystem::new(problem, tolerance);
    let mut system = Compared { inner, problem, ends: 0.0, inside: 0.0, last: None };
    let (mut q, mut v) = (problem.q.clone(), problem.v.clone());
    let end = problem.t0 + problem.duration;
    let outcome = integrate(&mut system, method, Limits::default(), problem.t0, end, &mut q, &mut v);
    assert_eq!(outcome.status, Status::Done);
    assert_eq!(distance(&system.last.unwrap().end, &[q, v].concat()), 0.0);
    (outcome.stats, system.ends, system.inside)
}

#[test]
fn gate_02_the_error_of_a_multistep_method_is_proportional_to_the_tolerance_inside_the_steps_too() {
    let mut problem = kepler();
    problem.duration = 12.0;
    let mut last = f64::INFINITY;
    for exponent in 3..=11 {
        let tolerance = 10_f64.powi(-exponent);
        let (stats, ends, inside) = compared(&problem, &mut Adams::new(2), tolerance);
        println!(
            "1e-{exponent}: {:.1} and {:.1} of the tolerance, {} steps, {} evaluations",
            ends / tolerance,
            inside / tolerance,
            stats.steps,
            stats.evaluations
        );
        assert!(ends <= 300.0 * tolerance, "{ends:e} at {tolerance:e}");
        assert!(inside <= 1.5 * ends + 2e-12, "{inside:e} inside the steps, {ends:e} at their ends");
        assert!(ends < 10.0 * last, "{ends:e} at {tolerance:e} after {last:e}");
        // Two evaluations a step and one for a rejected one; seven for each of the few steps of the start.
        assert!(stats.evaluations <= 2 * stats.steps + stats.rejected + 100, "{stats:?}");
        last = ends;
    }
}

#[test]
fn events_of_a_multistep_method_are_those_of_other_methods() {
    let mut random = Random(9);
    for draw in [Rattle::sliding, Rattle::sticking].into_iter().cycle().take(12) {
        let scene = draw(&mut random);
        let (explicit, expected) = scene.run(&mut Dop853::new(3), 1e-11);
        let (multistep, end) = scene.run(&mut Adams::new(3), 1e-10);
        assert_eq!((explicit.status, multistep.status), (Status::Done, Status::Done));
        assert_eq!(explicit.stats.events, multistep.stats.events, "{scene:?}");
        assert!(rattle::distance(&end, &expected) < 1e-6, "{end:?} {expected:?}");
    }
}

#[test]
fn the_stiffness_of_a_multistep_step_is_its_length_times_the_frequency() {
    // q̈ = -ω² q + cos t, steps of equal length.
    for (product, worth) in [(0.1, 1.0), (0.5, 1.0), (0.9, 1e-3), (0.9, 1e3)] {
        let mut system = Single::explicit(|t, q, _| -300.0 * 300.0 * q + t.cos());
        let mut method = Adams::new(1);
        let mut stats = Stats::default();
        let (mut t, mut q, mut v) = (0.0, [0.7], [0.2]);
        // Whatever a position is worth against a velocity.
        method.restart(&[1e-3], &[1e-3 * worth]);
        for step in 0..8 {
            assert!(method.begin(&mut system, StateAt { t, q: &q, v: &v }, &mut stats));
            assert!(method.attempt(&mut system, product / 300.0, &mut stats));
            t = method.step().end_time();
            (q, v) = ([method.step().end[0]], [method.step().end[1]]);
            let limits = method.next_limits(&mut system, StateAt { t, q: &q, v: &v }, &mut stats);
            if step == 0 {
                assert_eq!(method.stiffness(), None);
                continue;
            }
            let found = method.stiffness().unwrap();
            assert!((found / product - 1.0).abs() < 1e-3, "{found} instead of {product}");
            // The oscillation stays stable.
            assert!(limits.largest_growth * product <= 1.001, "{limits:?}");
        }
    }
}
