//! Adaptive integration: error against tolerance, and how a run ends when something goes wrong.

use chebclear::dynamics::Linearization;
use chebclear::integrators::dense::DenseStep;
use chebclear::integrators::tableaus::{RODAS4, RODAS5P, Tableau};
use chebclear::integrators::{HybridSystem, Limits, Outcome, Projection, Status};
use chebclear::numerics::instant::Instant;

use crate::integrators::problems::{
    Problem, Single, SmoothSystem, distance, kepler, pendulum, prothero_robinson, rosenbrock, van_der_pol,
};
use crate::support::Random;

/// What goes wrong with an evaluation.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    Nothing,
    Value(f64),
    Refusal,
}

/// A problem whose evaluations can be spoilt and whose accepted steps can be watched.
struct Watched<'a> {
    inner: SmoothSystem<'a>,
    calls: usize,
    fault: Fault,
    /// Calls that go wrong.
    spoilt: std::ops::Range<usize>,
    steps: Vec<(f64, f64)>,
    /// Errors of the accepted steps, where the solution has a closed form.
    errors: Vec<f64>,
    problem: &'a Problem,
    cancel_after: usize,
}

impl<'a> Watched<'a> {
    fn new(problem: &'a Problem, tolerance: f64) -> Self {
        Self {
            inner: SmoothSystem::new(problem, tolerance),
            calls: 0,
            fault: Fault::Nothing,
            spoilt: 0..0,
            steps: Vec::new(),
            errors: Vec::new(),
            problem,
            cancel_after: usize::MAX,
        }
    }

    fn run(&mut self, limits: Limits) -> (Outcome, Vec<f64>) {
        self.run_with(RODAS5P, limits)
    }

    fn run_with(&mut self, tableau: Tableau, limits: Limits) -> (Outcome, Vec<f64>) {
        let problem = self.problem;
        let (mut q, mut v) = (problem.q.clone(), problem.v.clone());
        let end = problem.t0 + problem.duration;
        let outcome = rosenbrock(self, tableau, limits, problem.t0, end, &mut q, &mut v);
        (outcome, [q, v].concat())
    }

    /// Spoils `values` if it is the turn of this call; false refuses the evaluation.
    fn spoil(&mut self, values: &mut [f64]) -> bool {
        self.calls += 1;
        assert!(self.calls < 10_000_000, "the run does not end");
        match self.fault {
            Fault::Value(bad) if self.spoilt.contains(&self.calls) => {
                let last = values.len() - 1;
                values[last] = bad;
                true
            }
            Fault::Refusal => !self.spoilt.contains(&self.calls),
            _ => true,
        }
    }
}

impl HybridSystem for Watched<'_> {
    fn dimension(&self) -> usize {
        self.inner.dimension()
    }

    fn acceleration(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        self.inner.acceleration(t, q, v, a) && self.spoil(a)
    }

    fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearization) -> bool {
        self.inner.linearize(t, q, v, linear);
        // In turn the accelerations and each of their derivatives.
        let fields = [&mut linear.a, &mut linear.a_q, &mut linear.a_v, &mut linear.a_t];
        let [a, a_q, a_v, a_t] = fields;
        match self.calls % 4 {
            0 => self.spoil(a),
            1 => self.spoil(a_q),
            2 => self.spoil(a_v),
            _ => self.spoil(a_t),
        }
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        self.inner.tolerances(position, velocity);
    }

    fn accepted(&mut self, step: &DenseStep) -> Result<(), Status> {
        self.steps.push((step.t, step.end_time()));
        self.errors.extend(self.problem.solution(step.end_time()).map(|exact| distance(&step.end, &exact)));
        if self.steps.len() < self.cancel_after { Ok(()) } else { Err(Status::Cancelled) }
    }
}

/// Smooth problems, some of them stiff.
fn problems() -> [Problem; 6] {
    [
        prothero_robinson(1.0),
        prothero_robinson(1e3),
        prothero_robinson(1e6),
        van_der_pol(1.0, -0.66),
        pendulum(),
        kepler(),
    ]
}

#[test]
fn gate_02_the_error_is_proportional_to_the_tolerance() {
    for problem in problems() {
        let reference = problem.reference(8192);
        for tableau in [RODAS4, RODAS5P] {
            let mut last = f64::INFINITY;
            let mut line = format!("{} on {}:", tableau.name, problem.name);
            for exponent in 3..=10 {
                let tolerance = 10_f64.powi(-exponent);
                let mut system = Watched::new(&problem, tolerance);
                let (outcome, end) = system.run_with(tableau, Limits::default());
                assert_eq!(outcome.status, Status::Done);
                // Over all steps where there is a closed form.
                let at_steps = system.errors.iter().fold(0.0_f64, |a, b| a.max(*b));
                let error = distance(&end, &reference[8192]).max(at_steps);
                line += &format!(" {:.2}", error / tolerance);
                assert!(error <= 100.0 * tolerance, "{line}: {error:e} at {tolerance:e}");
                assert!(error <= 3.0 * last, "{line}: {error:e} at {tolerance:e} after {last:e}");
                last = error;
            }
            println!("{line} of the tolerance");
        }
    }
}

#[test]
fn gate_02_a_relaxation_oscillation_is_followed_through_its_jumps() {
    // ε = 1e-6, from (2, 0) to t = 2: the reference of the Test Set for IVP Solvers `[MazziaMagherini2008]`.
    let reference = [1.706_167_732_170_483, -0.892_809_701_024_797_5];
    for tableau in [RODAS4, RODAS5P] {
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10] {
            let (outcome, end) = van_der_pol(1e-6, 0.0).adaptively(tableau, tolerance);
            let error = distance(&end, &reference);
            println!("{} at {tolerance:e}: {error:.1e}, {} steps", tableau.name, outcome.stats.steps);
            assert_eq!(outcome.status, Status::Done);
            assert!(error <= 100.0 * tolerance, "{}: {error:e} at {tolerance:e}", tableau.name);
        }
    }
}

#[test]
fn the_end_is_met_exactly_and_the_steps_join() {
    for (t0, duration) in [(0.0, 2.0), (0.1, 0.7), (1e3, 0.3), (-5.0, 5.0)] {
        let mut problem = pendulum();
        (problem.t0, problem.duration) = (t0, duration);
        let mut system = Watched::new(&problem, 1e-6);
        let (outcome, _) = system.run(Limits::default());
        assert_eq!((outcome.status, outcome.time), (Status::Done, t0 + duration));
        assert_eq!(outcome.stats.steps, system.steps.len());
        assert_eq!(system.steps[0].0, t0);
        let slack = 16.0 * f64::EPSILON * (t0.abs() + duration);
        assert!((system.steps.last().unwrap().1 - outcome.time).abs() <= slack);
        for pair in system.steps.windows(2) {
            assert_eq!(pair[0].1, pair[1].0);
        }
    }
}

#[test]
fn gate_07_the_result_does_not_depend_on_the_time_at_which_the_clock_starts() {
    let mut ends = Vec::new();
    for t0 in [0.0, 1e3, 1e6] {
        let mut problem = pendulum();
        problem.t0 = t0;
        let (outcome, end) = problem.adaptively(RODAS5P, 1e-8);
        assert_eq!((outcome.status, outcome.time), (Status::Done, t0 + 2.0));
        ends.push(end);
    }
    // An instant near 1e6 is known to 1e-10 only.
    assert!(distance(&ends[0], &ends[1]) < 1e-8, "{ends:?}");
    assert!(distance(&ends[0], &ends[2]) < 1e-8, "{ends:?}");
}

#[test]
fn an_interval_of_length_zero_leaves_the_state_alone() {
    let mut problem = pendulum();
    problem.duration = 0.0;
    let mut system = Watched::new(&problem, 1e-6);
    let (outcome, end) = system.run(Limits::default());
    assert_eq!((outcome.status, outcome.time, outcome.stats.steps), (Status::Done, 0.0, 0));
    assert_eq!(end, [problem.q.clone(), problem.v.clone()].concat());
    assert!(system.steps.is_empty());
}

#[test]
fn an_interval_of_a_few_roundings_is_integrated() {
    for (t0, duration) in [(0.0, 1e-300), (0.0, 1e-12), (1.0, 2.0 * f64::EPSILON), (1.0, 1e-13), (1e6, 1e-8)]
    {
        let mut problem = pendulum();
        (problem.t0, problem.duration) = (t0, duration);
        let (outcome, end) = problem.adaptively(RODAS5P, 1e-6);
        assert_eq!((outcome.status, outcome.time), (Status::Done, t0 + duration), "{t0} + {duration:e}");
        assert!(distance(&end, &[1.0, 0.5]) < 1e-6, "{end:?}");
    }
}

#[test]
fn gate_04_too_few_steps_end_the_run_with_max_steps() {
    let problem = pendulum();
    let mut system = Watched::new(&problem, 1e-10);
    let (outcome, end) = system.run(Limits { max_steps: 20, ..Limits::default() });
    assert_eq!(outcome.status, Status::MaxSteps);
    assert_eq!(outcome.stats.steps + outcome.stats.rejected, 20);
    // What was reached is a point of the solution.
    let mut shorter = problem.clone();
    shorter.duration = outcome.time;
    assert!(distance(&end, &shorter.reference(256)[256]) < 1e-9);
}

#[test]
fn gate_04_a_pole_of_the_solution_ends_the_run_in_front_of_it() {
    // v' = v², v = 1 / (1 - t).
    let mut pole = Single::new(|_, _, v| v * v, |_, _, v| [0.0, 2.0 * v, 0.0], [1e-6; 2]);
    for tableau in [RODAS4, RODAS5P] {
        let (mut q, mut v) = ([0.0], [1.0]);
        let outcome = rosenbrock(&mut pole, tableau, Limits::default(), 0.0, 2.0, &mut q, &mut v);
        assert_eq!(outcome.status, Status::StepUnderflow, "{outcome:?}");
        assert!((outcome.time - 1.0).abs() < 1e-5, "{outcome:?}");
    }
}

/// A pendulum whose constraints allow steps up to a length [s] only.
struct Constrained<'a> {
    inner: SmoothSystem<'a>,
    longest: f64,
    refusal: fn(f64) -> Projection,
    start: f64,
    refused: usize,
}

impl<'a> Constrained<'a> {
    fn run(problem: &'a Problem, longest: f64, refusal: fn(f64) -> Projection) -> (Outcome, usize) {
        let inner = SmoothSystem::new(problem, 1e-4);
        let mut system = Self { inner, longest, refusal, start: 0.0, refused: 0 };
        let (mut q, mut v) = (problem.q.clone(), problem.v.clone());
        let limits = Limits { max_steps: 2000, ..Limits::default() };
        let outcome = rosenbrock(&mut system, RODAS5P, limits, 0.0, problem.duration, &mut q, &mut v);
        (outcome, system.refused)
    }
}

impl HybridSystem for Constrained<'_> {
    fn dimension(&self) -> usize {
        self.inner.dimension()
    }

    fn acceleration(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        self.inner.acceleration(t, q, v, a)
    }

    fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearization) -> bool {
        self.inner.linearize(t, q, v, linear)
    }

    fn begin(&mut self, t: f64, _: &[f64], _: &[f64], _: &[f64]) {
        self.start = t;
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        self.inner.tolerances(position, velocity);
    }

    fn project(&mut self, t: f64, _: &mut [f64], _: &mut [f64]) -> Projection {
        let length = t - self.start;
        if length <= self.longest {
            return Projection::Done;
        }
        self.refused += 1;
        (self.refusal)(length / self.longest)
    }
}

#[test]
fn a_correction_that_is_too_large_shortens_the_step() {
    let problem = pendulum();
    for refusal in [Projection::TooLarge, |_| Projection::Singular] {
        let (outcome, refused) = Constrained::run(&problem, 0.011, refusal);
        assert_eq!((outcome.status, outcome.time), (Status::Done, problem.duration));
        assert!(refused > 10 && outcome.stats.rejected >= refused, "{refused}");
        assert!(outcome.stats.steps as f64 >= problem.duration / 0.011, "{:?}", outcome.stats);
    }
}

#[test]
fn gate_04_a_correction_that_stays_too_large_ends_the_run_and_says_so() {
    let problem = pendulum();
    let refusals: [fn(f64) -> Projection; 2] = [|_| Projection::TooLarge(1e3), |_| Projection::Singular];
    for (refusal, status) in refusals.into_iter().zip([Status::Projection, Status::SingularMechanism]) {
        let (outcome, refused) = Constrained::run(&problem, 0.0, refusal);
        assert_eq!((outcome.status, outcome.time, outcome.stats.steps), (status, 0.0, 0));
        assert_eq!(outcome.stats.rejected, refused);
    }
}

#[test]
fn gate_05_no_step_is_accepted_because_it_cannot_be_made_shorter() {
    // Accelerations without any smoothness: the bits of the state, stirred.
    let stirred = |t: f64, q: f64, v: f64| {
        let seed = t.to_bits() ^ q.to_bits().rotate_left(21) ^ v.to_bits().rotate_left(42);
        Random(seed).within(-1e12, 1e12)
    };
    let mut noise = Single::new(stirred, |_, _, _| [0.0; 3], [1e-9; 2]);
    let (mut q, mut v) = ([0.0], [0.0]);
    let outcome = rosenbrock(&mut noise, RODAS5P, Limits::default(), 1.0, 2.0, &mut q, &mut v);
    assert_eq!((outcome.status, outcome.stats.steps), (Status::StepUnderflow, 0));
    assert_eq!((q, v, outcome.time), ([0.0], [0.0], 1.0));
}

#[test]
fn gate_06_one_spoilt_evaluation_costs_a_rejection_or_ends_the_run_honestly() {
    let mut random = Random(20);
    for problem in problems() {
        let reference = problem.reference(8192);
        let clean = Watched::new(&problem, 1e-6).run(Limits::default()).0.stats.evaluations;
        for _ in 0..200 {
            let mut system = Watched::new(&problem, 1e-6);
            let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][random.index(3)];
            system.fault = if random.index(4) == 0 { Fault::Refusal } else { Fault::Value(bad) };
            let call = 1 + random.index(clean);
            system.spoilt = call..call + 1;
            let (outcome, end) = system.run(Limits::default());
            match outcome.status {
                Status::Done => assert!(distance(&end, &reference[8192]) < 1e-4, "{}", problem.name),
                // The Jacobian is not evaluated again.
                Status::NonFinite | Status::SingularMechanism => {
                    assert!(outcome.time < problem.duration);
                    assert!(end.iter().all(|y| y.is_finite()), "{end:?}");
                }
                status => panic!("{}: {status:?}", problem.name),
            }
        }
    }
}

#[test]
fn gate_06_evaluations_that_stay_spoilt_end_the_run_as_not_finite() {
    let mut random = Random(21);
    for problem in problems() {
        let clean = Watched::new(&problem, 1e-6).run(Limits::default()).0.stats.evaluations;
        for fault in [Fault::Value(f64::NAN), Fault::Value(f64::INFINITY), Fault::Refusal] {
            for _ in 0..20 {
                let mut system = Watched::new(&problem, 1e-6);
                system.fault = fault;
                system.spoilt = 1 + random.index(clean)..usize::MAX;
                let (outcome, end) = system.run(Limits::default());
                let expected = [Status::NonFinite, Status::SingularMechanism];
                assert!(expected.contains(&outcome.status), "{}: {outcome:?}", problem.name);
                assert!(outcome.time < problem.duration && end.iter().all(|y| y.is_finite()));
                assert!(outcome.stats.rejected < 200, "{}: {outcome:?}", problem.name);
            }
        }
    }
}

#[test]
fn gate_06_a_start_that_is_not_finite_ends_the_run_at_once() {
    for bad in [f64::NAN, f64::INFINITY] {
        for place in 0..2 {
            let mut problem = pendulum();
            if place == 0 {
                problem.q[0] = bad
            } else {
                problem.v[0] = bad
            }
            let mut system = Watched::new(&problem, 1e-6);
            let (outcome, _) = system.run(Limits::default());
            assert_eq!((outcome.status, outcome.time), (Status::NonFinite, 0.0));
            assert!(system.steps.is_empty());
        }
    }
}

#[test]
fn gate_16_a_run_is_cancelled_after_the_step_that_was_refused() {
    let problem = pendulum();
    let mut system = Watched::new(&problem, 1e-6);
    system.cancel_after = 7;
    let (outcome, end) = system.run(Limits::default());
    assert_eq!((outcome.status, outcome.stats.steps), (Status::Cancelled, 7));
    assert_eq!(outcome.time, system.steps[6].1);
    let mut shorter = problem.clone();
    shorter.duration = outcome.time;
    assert!(distance(&end, &shorter.reference(256)[256]) < 1e-5);
}

#[test]
fn no_step_is_longer_than_allowed() {
    let problem = prothero_robinson(1.0);
    let mut system = Watched::new(&problem, 1e-2);
    let limits = Limits { max_step: 0.03, first_step: Some(10.0), ..Limits::default() };
    assert_eq!(system.run(limits).0.status, Status::Done);
    assert!(system.steps.iter().all(|(start, end)| end - start <= 0.03 * (1.0 + 1e-12)));
}
