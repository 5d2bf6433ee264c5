//! Events of systems whose motion, and so every instant of an event, is known in closed form.

use chebclear::dynamics::Linearization;
use chebclear::integrators::dense::DenseStep;
use chebclear::integrators::events::Guard;
use chebclear::integrators::rosenbrock::Rosenbrock;
use chebclear::integrators::tableaus::{RODAS4, RODAS5P};
use chebclear::integrators::{HybridSystem, Limits, Outcome, StateAt, Stats, Status, Stepper};
use chebclear::numerics::instant::Instant;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

use crate::integrators::problems::rosenbrock;

/// Value and rate of a guard in its first phase: of t, q, v.
type GuardLaw = Box<dyn Fn(f64, f64, f64) -> (f64, f64)>;

/// One coordinate; every event turns the sign of its guard.
struct Switching {
    /// Acceleration and its derivative by q: of q and the number of events of guard 0.
    law: fn(f64, usize) -> (f64, f64),
    guards: Vec<GuardLaw>,
    counts: Vec<usize>,
    rates_known: bool,
    resolution: f64,
    overshoot: f64,
    tolerance: f64,
    /// Instant of the guards read last, and by what it divides the velocity tolerance where it is past zero and no event
    /// was.
    latest: f64,
    refinement: f64,
    /// Guard, time and value where an event was reported.
    events: Vec<(usize, f64, f64)>,
    evaluations: usize,
}

impl Switching {
    fn new(law: fn(f64, usize) -> (f64, f64), guards: Vec<GuardLaw>) -> Self {
        Self {
            law,
            counts: vec![0; guards.len()],
            guards,
            rates_known: true,
            resolution: 0.0,
            overshoot: 4.0 * f64::EPSILON,
            tolerance: 1e-9,
            latest: 0.0,
            refinement: 1.0,
            events: Vec::new(),
            evaluations: 0,
        }
    }

    /// A clock: uniform motion, for guards that only depend on the time.
    fn clock(guards: Vec<GuardLaw>) -> Self {
        Self::new(|_, _| (0.0, 0.0), guards)
    }

    /// Integrates over `t`, the whole of it in one step if there are no events.
    fn run(&mut self, t: [f64; 2], q: f64, v: f64) -> (Outcome, [f64; 2]) {
        self.run_within(Limits { first_step: Some(t[1] - t[0]), ..Limits::default() }, t, q, v)
    }

    fn run_within(&mut self, limits: Limits, t: [f64; 2], q: f64, v: f64) -> (Outcome, [f64; 2]) {
        let (mut q, mut v) = ([q], [v]);
        let outcome = rosenbrock(self, RODAS5P, limits, t[0], t[1], &mut q, &mut v);
        (outcome, [q[0], v[0]])
    }

    /// A clock from zero to `end` that must get there.
    fn tick(&mut self, end: f64) {
        let (outcome, state) = self.run([0.0, end], 0.0, 1.0);
        assert_eq!((outcome.status, outcome.time), (Status::Done, end));
        assert!((state[0] - end).abs() <= 1e-13 * end);
        assert_eq!(outcome.stats.events, self.events.len());
    }

    /// Compares the events with guards and instants.
    fn expect(&self, expected: &[(usize, f64)], tolerance: f64) {
        assert_eq!(self.events.len(), expected.len(), "{:?} instead of {expected:?}", self.events);
        for (&(guard, t, _), &(index, instant)) in self.events.iter().zip(expected) {
            assert_eq!(guard, index, "{:?} instead of {expected:?}", self.events);
            assert!((t - instant).abs() <= tolerance, "{t} instead of {instant}: {:e}", t - instant);
        }
    }
}

impl HybridSystem for Switching {
    fn dimension(&self) -> usize {
        1
    }

    fn acceleration(&mut self, _: Instant, q: &[f64], _: &[f64], a: &mut [f64]) -> bool {
        a[0] = (self.law)(q[0], self.counts[0]).0;
        true
    }

    fn linearize(&mut self, _: f64, q: &[f64], _: &[f64], linear: &mut Linearization) -> bool {
        (linear.a[0], linear.a_q[0]) = (self.law)(q[0], self.counts[0]);
        true
    }

    fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
        position.fill(self.tolerance);
        velocity.fill(self.tolerance);
    }

    fn guard_count(&self) -> usize {
        self.guards.len()
    }

    fn guards(&mut self, t: Instant, q: &[f64], v: &[f64], guards: &mut [Guard]) {
        (self.evaluations, self.latest) = (self.evaluations + 1, t.time);
        assert!(self.evaluations < 1_000_000, "the run does not end");
        for ((out, guard), count) in guards.iter_mut().zip(&self.guards).zip(&self.counts) {
            let sign = if count % 2 == 0 { 1.0 } else { -1.0 };
            let (value, rate) = guard(t.time, q[0], v[0]);
            *out = Guard {
                value: sign * value,
                rate: if self.rates_known { sign * rate } else { f64::NAN },
                margin: 0.25,
                resolution: self.resolution,
                overshoot: self.overshoot,
            };
        }
    }

    fn velocity_refinement(&self) -> f64 {
        if self.latest > 0.0 && self.events.is_empty() { self.refinement } else { 1.0 }
    }

    fn cross(&mut self, index: usize, t: f64, q: &[f64], v: &mut [f64]) -> Result<f64, Status> {
        let sign = if self.counts[index].is_multiple_of(2) { 1.0 } else { -1.0 };
        self.events.push((index, t, sign * self.guards[index](t, q[0], v[0]).0));
        self.counts[index] += 1;
        Ok(f64::INFINITY)
    }
}

/// A guard that only depends on the coordinate.
fn of_position(law: impl Fn(f64) -> (f64, f64) + 'static) -> GuardLaw {
    Box::new(move |_, q, v| {
        let (value, slope) = law(q);
        (value, slope * v)
    })
}

/// A guard that only depends on the time.
fn of_time(law: impl Fn(f64) -> (f64, f64) + 'static) -> GuardLaw {
    Box::new(move |t, _, _| law(t))
}

fn height() -> GuardLaw {
    of_position(|q| (q, 1.0))
}

#[test]
fn gate_08_a_ball_that_falls_through_a_surface_and_back_crosses_it_at_the_closed_form_instants() {
    // Gravity pulls to the surface with 8 from above and with 2 from below: parabolas. From height 1
    // at rest it arrives after 1/2 with the speed 4, stays 4 below and 1 above.
    let law = |_, count: usize| (if count.is_multiple_of(2) { -8.0 } else { 2.0 }, 0.0);
    for first_step in [1e-3, 0.3, 0.5, 24.5, 1e3] {
        let mut system = Switching::new(law, vec![height()]);
        let limits = Limits { first_step: Some(first_step), ..Limits::default() };
        let (outcome, state) = system.run_within(limits, [0.0, 24.5], 1.0, 0.0);
        let instants: Vec<(usize, f64)> = (0..10)
            .map(|k| (0, 0.5 + f64::from(k / 2) * 5.0 + if k % 2 == 1 { 4.0 } else { 0.0 }))
            .filter(|(_, t)| *t < 24.5)
            .collect();
        assert_eq!(outcome.status, Status::Done);
        // Rounding errors of steps that move it by 100 units, through ten flights.
        system.expect(&instants, 1e-10);
        // Where it is 4 after the last crossing downwards: at the surface, going up.
        assert!(state[0].abs() < 1e-9 && (state[1] - 4.0).abs() < 1e-10, "{state:?}");
    }
}

#[test]
fn an_oscillator_crosses_zero_at_the_odd_multiples_of_a_quarter_period() {
    let instants: Vec<(usize, f64)> = (0..20).map(|k| (0, (f64::from(k) + 0.5) * PI)).collect();
    for rates_known in [true, false] {
        for tolerance in [1e-6, 1e-9, 1e-12] {
            let mut system = Switching::new(|q, _| (-q, -1.0), vec![height()]);
            system.tolerance = tolerance;
            system.rates_known = rates_known;
            let (outcome, _) = system.run([0.0, 20.0 * PI], 1.0, 0.0);
            assert_eq!(outcome.status, Status::Done);
            // The error of the method over ten periods, and rounding.
            system.expect(&instants, 100.0 * tolerance + 4.0 * f64::EPSILON * 20.0 * PI);
        }
    }
}

#[test]
fn every_relocation_ends_behind_the_event_by_no_more_than_allowed() {
    for tableau in [RODAS4, RODAS5P] {
        for rates_known in [true, false] {
            for overshoot in [1e-2, 1e-5, 1e-9, 1e-13] {
                for tolerance in [1e-3, 1e-6, 1e-9] {
                    let mut system = Switching::new(|q, _| (-q.sin(), -q.cos()), vec![height()]);
                    (system.tolerance, system.overshoot) = (tolerance, overshoot);
                    system.rates_known = rates_known;
                    let (mut q, mut v) = ([2.0], [0.0]);
                    let limits = Limits::default();
                    let outcome = rosenbrock(&mut system, tableau, limits, 0.0, 40.0, &mut q, &mut v);
                    assert_eq!(outcome.status, Status::Done);
                    assert!(system.events.len() >= 8, "{:?}", system.events);
                    for (_, _, value) in &system.events {
                        assert!(*value <= 0.0 && -value <= overshoot, "{value:e} beyond {overshoot:e}");
                    }
                    let relocations = outcome.stats.relocations as f64 / outcome.stats.events as f64;
                    assert!(relocations <= 6.0, "{relocations} steps for an event");
                }
            }
        }
    }
}

#[test]
fn gate_08_three_crossings_in_one_step_are_all_found_in_order() {
    for rates_known in [true, false] {
        // cos(3πq + 0.7) has its zeros where 3πq + 0.7 is an odd multiple of π/2.
        let roots = [1.0, 3.0, 5.0].map(|odd| (0, (odd * PI / 2.0 - 0.7) / (3.0 * PI)));
        let mut system = Switching::clock(vec![of_time(|t| {
            let (sine, cosine) = (3.0 * PI * t + 0.7).sin_cos();
            (cosine, -3.0 * PI * sine)
        })]);
        system.rates_known = rates_known;
        system.tick(1.0);
        system.expect(&roots, 1e-14);
    }
}

#[test]
fn a_dip_between_flat_ends_of_a_step_is_found() {
    // 1 - 20 t² (1 - t)²: of the degree of a dense output, 1 and flat at 0 and 1, and negative between
    // the solutions of t (1 - t) = 1/√20.
    let mut system = Switching::clock(vec![of_time(|t| {
        let product = t * (1.0 - t);
        (1.0 - 20.0 * product * product, -40.0 * product * (1.0 - 2.0 * t))
    })]);
    system.tick(1.0);
    let half = (0.25 - 20.0_f64.sqrt().recip()).sqrt();
    system.expect(&[(0, 0.5 - half), (0, 0.5 + half)], 1e-14);
}

#[test]
fn a_crossing_and_return_between_two_samples_are_both_found() {
    let widths = [1e-1, 1e-2, 1e-3, 1e-4];
    for (width, rates_known) in widths.into_iter().flat_map(|width| [(width, true), (width, false)]) {
        for k in 1..20 {
            let center = f64::from(k) / 20.0 + 0.001;
            let dip = of_time(move |t| ((t - center).powi(2) - width * width, 2.0 * (t - center)));
            let mut system = Switching::clock(vec![dip]);
            system.overshoot = 1e-15;
            system.rates_known = rates_known;
            system.tick(1.0);
            let inside: Vec<(usize, f64)> = [center - width, center + width]
                .into_iter()
                .filter(|root| (0.0..1.0).contains(root))
                .map(|root| (0, root))
                .collect();
            if center > width {
                system.expect(&inside, 4e-15 / width);
            }
        }
    }
}

#[test]
fn gate_08_a_guard_that_is_zero_at_the_start_is_crossed_once_if_it_falls_and_not_if_it_rises() {
    let mut falling = Switching::clock(vec![of_time(|t| (-t, -1.0))]);
    falling.tick(1.0);
    falling.expect(&[(0, 0.0)], 0.0);
    let mut rising = Switching::clock(vec![of_time(|t| (t, 1.0))]);
    rising.tick(1.0);
    rising.expect(&[], 0.0);
    // Rising, and falling again within the step.
    let mut arch = Switching::clock(vec![of_time(|t| (t * (0.375 - t), 0.375 - 2.0 * t))]);
    arch.tick(1.0);
    arch.expect(&[(0, 0.375)], 1e-14);
}

#[test]
fn an_event_at_the_start_of_a_step_does_not_depend_on_the_error_of_the_end_that_is_given_up() {
    // An oscillator whose end of any step asks for a tolerance that no step keeps.
    let mut oscillator = Switching::new(|q, _| (-q, -1.0), vec![of_time(|t| (-t, -1.0))]);
    oscillator.refinement = 1e12;
    let (outcome, state) = oscillator.run([0.0, PI], 1.0, 0.0);
    assert_eq!(outcome.status, Status::Done);
    oscillator.expect(&[(0, 0.0)], 0.0);
    assert!((state[0] + 1.0).abs() < 1e-7);
}

#[test]
fn gate_08_a_guard_that_is_zero_at_the_end_of_a_step_is_crossed_once() {
    for resolution in [0.0, 1e-15] {
        let mut system = Switching::clock(vec![of_time(|t| (0.5 - t, -1.0))]);
        system.resolution = resolution;
        let limits = Limits { first_step: Some(0.25), max_step: 0.25, ..Limits::default() };
        assert_eq!(system.run_within(limits, [0.0, 1.0], 0.0, 1.0).0.status, Status::Done);
        system.expect(&[(0, 0.5)], 1e-14);
    }
    // At the very end of the run: once or, as the phase has nothing left to last for, not at all.
    let mut system = Switching::clock(vec![of_time(|t| (0.5 - t, -1.0))]);
    system.tick(0.5);
    assert!(system.events.len() <= 1, "{:?}", system.events);
}

#[test]
fn gate_08_a_grazed_guard_ends_in_no_event_or_in_two() {
    // Depths below the resolution, just beyond it, and clearly beyond it.
    for depth in [0.0, 1e-30, 1e-18, -1e-18, 1.1e-16, 3e-16, 1e-15, 1e-14, 1e-12, -1e-12] {
        for center in [0.5, 0.3, 1.0 / 3.0, 0.123_456] {
            let touch = of_time(move |t| ((t - center).powi(2) - depth, 2.0 * (t - center)));
            let mut system = Switching::clock(vec![touch]);
            system.resolution = 1e-16;
            system.tick(1.0);
            assert!([0, 2].contains(&system.events.len()), "{depth:e}: {:?}", system.events);
            assert!(system.events.iter().all(|(_, t, _)| (t - center).abs() < 2e-6));
        }
    }
}

#[test]
fn gate_08_guards_that_fall_at_one_instant_are_all_crossed_whatever_their_numbers() {
    // All are zero at 1/√2, reached by different roundings.
    let laws: [fn(f64) -> (f64, f64); 3] = [
        |t| (FRAC_1_SQRT_2 - t, -1.0),
        |t| (0.5 - t * t, -2.0 * t),
        |t| ((PI * t * t).cos(), -2.0 * PI * t * (PI * t * t).sin()),
    ];
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let guards = order.map(|law| of_time(laws[law])).into_iter().collect();
        let mut system = Switching::clock(guards);
        system.resolution = 1e-16;
        system.tick(1.0);
        assert_eq!(system.events.len(), 3, "{:?}", system.events);
        assert!(system.events.iter().all(|(_, t, _)| (t - FRAC_1_SQRT_2).abs() < 1e-15));
        let mut crossed: Vec<usize> = system.events.iter().map(|event| order[event.0]).collect();
        crossed.sort_unstable();
        assert_eq!(crossed, [0, 1, 2]);
    }
}

#[test]
fn gate_08_events_of_several_guards_in_one_step_come_in_the_order_of_time() {
    let instants = [0.3, 0.300_000_01, 0.71, 0.05];
    for rotation in 0..4 {
        let mut numbers = [0, 1, 2, 3];
        numbers.rotate_left(rotation);
        let guards = numbers.map(|k| of_time(move |t| (instants[k] - t, -1.0)));
        let mut system = Switching::clock(guards.into_iter().collect());
        system.tick(1.0);
        let number = |k: usize| numbers.iter().position(|other| *other == k).unwrap();
        let expected = [3, 0, 1, 2].map(|k| (number(k), instants[k]));
        system.expect(&expected, 1e-14);
    }
}

#[test]
fn gate_08_a_restart_next_to_an_event_does_not_repeat_it() {
    let law = |_, count: usize| (if count.is_multiple_of(2) { -8.0 } else { 2.0 }, 0.0);
    for nudge in [0.0, 1e-16, 1e-14, -1e-14] {
        // Just below the surface or, by the nudge, still above it, and falling.
        let mut system = Switching::new(law, vec![height()]);
        system.counts[0] = 1;
        let (outcome, _) = system.run([0.5 - nudge, 5.0], 4.0 * nudge, -4.0);
        assert_eq!(outcome.status, Status::Done);
        system.expect(&[(0, 4.5)], 1e-12);
    }
}

#[test]
fn gate_06_a_guard_that_is_not_a_number_ends_the_run_with_its_index() {
    for window in [0.0..2.0, 0.4..2.0, 0.45..0.55] {
        for index in 0..3 {
            let mut guards: Vec<GuardLaw> = (0..3).map(|_| of_time(|t| (2.0 + t, 1.0))).collect();
            let bad = window.clone();
            guards[index] =
                of_time(move |t| (if bad.contains(&t) { f64::NAN } else { (t - 0.3).powi(2) + 0.01 }, 0.0));
            let mut system = Switching::clock(guards);
            system.rates_known = false;
            let (outcome, state) = system.run([0.0, 1.0], 0.0, 1.0);
            assert_eq!((outcome.status, outcome.guard), (Status::EventLocation, Some(index)), "{window:?}");
            assert!(outcome.time < 1.0 && state[0].is_finite());
        }
    }
}

#[test]
fn gate_16_too_many_events_end_the_run_with_max_events() {
    let run = |max_events| {
        let mut system = Switching::new(|q, _| (-q, -1.0), vec![height()]);
        let limits = Limits { max_events, ..Limits::default() };
        system.run_within(limits, [0.0, 20.0], 1.0, 0.0).0
    };
    // Zeros of the cosine below 20: 6.
    assert_eq!((run(6).status, run(6).stats.events), (Status::Done, 6));
    let outcome = run(5);
    assert_eq!((outcome.status, outcome.guard), (Status::MaxEvents, Some(0)));
    assert!((outcome.time - 5.5 * PI).abs() < 1e-6, "{outcome:?}");
}

#[test]
fn gate_16_events_that_accumulate_end_the_run_with_a_status() {
    // Gravity doubles at every crossing: the flights halve, all of them last 1/2 + 2.
    let law = |_, count: usize| {
        let gravity = 8.0 * 2_f64.powi(count as i32);
        (if count.is_multiple_of(2) { -gravity } else { gravity }, 0.0)
    };
    let mut system = Switching::new(law, vec![height()]);
    let (outcome, _) = system.run_within(Limits::default(), [0.0, 10.0], 1.0, 0.0);
    assert!(
        [Status::MaxEvents, Status::StepUnderflow, Status::EventLocation].contains(&outcome.status),
        "{outcome:?}"
    );
    assert!((outcome.time - 1.5).abs() < 1e-9, "{outcome:?}");
}

fn energy(q: f64, v: f64) -> f64 {
    q * q + v * v
}

/// Energy of an oscillator at the fraction `theta` of a step: on its dense output, and after a
/// step that ends there.
fn interpolated_and_retaken(h: f64, theta: f64) -> [f64; 2] {
    let mut system = Switching::new(|q, _| (-q, -1.0), vec![height()]);
    let mut method = Rosenbrock::new(RODAS5P, 1);
    let (mut q, mut v) = ([0.0], [0.0]);
    let start = StateAt { t: 0.0, q: &[1.0], v: &[0.0] };
    let mut stats = Stats::default();
    assert!(method.begin(&mut system, start, &mut stats) && method.attempt(&mut system, h, &mut stats));
    assert!(method.finish_dense(&mut system, &mut stats));
    method.step.at(theta, &mut q, &mut v);
    assert!(method.attempt(&mut system, theta * h, &mut stats));
    [energy(q[0], v[0]), energy(method.step.end[0], method.step.end[1])]
}

#[test]
fn a_guard_that_only_the_dense_output_crosses_hides_no_event_of_another() {
    // Between the lowest energy on the dense output of a long step, and the lowest of steps that end
    // inside it.
    let h = 3.0;
    let lowest = (1..=1000)
        .map(|k| interpolated_and_retaken(h, f64::from(k) / 1000.0))
        .fold([1.0_f64; 2], |low, now| [low[0].min(now[0]), low[1].min(now[1])]);
    assert!(lowest[0] < lowest[1] - 0.01, "{lowest:?}");
    let bottom = 0.5 * (lowest[0] + lowest[1]);
    let seeming: GuardLaw = Box::new(move |_, q, v| (energy(q, v) - bottom, f64::NAN));
    let dip: GuardLaw = Box::new(|t, _, _| ((t - 2.7).powi(2) - 0.01, 2.0 * (t - 2.7)));
    let mut system = Switching::new(|q, _| (-q, -1.0), vec![seeming, dip]);
    system.tolerance = 1e3;
    let (outcome, _) = system.run([0.0, h], 1.0, 0.0);
    assert_eq!(outcome.status, Status::Done);
    system.expect(&[(1, 2.6), (1, 2.8)], 1e-13);
}

#[test]
fn a_relocation_on_a_guard_that_draws_the_secant_to_one_side_is_not_given_up() {
    // In a long step of an oscillator the dense output is inaccurate, so that the relocation is found by
    // bracketing; beyond its zero the guard falls like exp(k q).
    for steepness in [20.0, 60.0, 200.0] {
        for place in [-0.6, -0.3, 0.1, 0.4] {
            let cliff: GuardLaw = Box::new(move |_, q, _| (1.0 - (steepness * (place - q)).exp(), f64::NAN));
            let mut system = Switching::new(|q, _| (-q, -1.0), vec![cliff]);
            system.tolerance = 1e3;
            system.overshoot = 1e-9;
            let limits = Limits { first_step: Some(3.0), max_events: 1, ..Limits::default() };
            system.run_within(limits, [0.0, 3.0], 1.0, 0.0);
            let (_, t, value) = system.events[0];
            assert!((-1e-9..=0.0).contains(&value), "{steepness} {place}: {value:e} at {t}");
        }
    }
}

#[test]
fn a_relocation_is_a_step_like_any_other() {
    // Every accepted step joins the one before, events included, and ends where the state is.
    struct Seen(Switching, Vec<DenseStep>);
    impl HybridSystem for Seen {
        fn dimension(&self) -> usize {
            1
        }
        fn acceleration(&mut self, t: Instant, q: &[f64], v: &[f64], a: &mut [f64]) -> bool {
            self.0.acceleration(t, q, v, a)
        }
        fn linearize(&mut self, t: f64, q: &[f64], v: &[f64], linear: &mut Linearization) -> bool {
            self.0.linearize(t, q, v, linear)
        }
        fn tolerances(&self, position: &mut [f64], velocity: &mut [f64]) {
            self.0.tolerances(position, velocity);
        }
        fn guard_count(&self) -> usize {
            self.0.guard_count()
        }
        fn guards(&mut self, t: Instant, q: &[f64], v: &[f64], guards: &mut [Guard]) {
            self.0.guards(t, q, v, guards);
        }
        fn cross(&mut self, index: usize, t: f64, q: &[f64], v: &mut [f64]) -> Result<f64, Status> {
            let last = self.1.last().expect("a relocation");
            assert_eq!((last.end_time(), &last.end[..]), (t, &[q[0], v[0]][..]));
            self.0.cross(index, t, q, v)
        }
        fn accepted(&mut self, step: &DenseStep) -> Result<(), Status> {
            self.1.push(step.clone());
            Ok(())
        }
    }
    let mut system = Seen(Switching::new(|q, _| (-q, -1.0), vec![height()]), Vec::new());
    let outcome = rosenbrock(&mut system, RODAS5P, Limits::default(), 0.0, 20.0, &mut [1.0], &mut [0.0]);
    assert_eq!((outcome.status, outcome.stats.steps), (Status::Done, system.1.len()));
    for pair in system.1.windows(2) {
        assert_eq!((pair[0].end_time(), &pair[0].end), (pair[1].t, &pair[1].start));
    }
    // The dense output after a relocation is that of the shortened step.
    for step in system.1.iter().filter(|step| step.h > 1e-3) {
        let (mut q, mut v) = ([0.0], [0.0]);
        step.at(0.5, &mut q, &mut v);
        assert!((q[0] - (step.t + 0.5 * step.h).cos()).abs() < 1e-6);
    }
}

#[test]
fn gate_07_events_do_not_depend_on_the_time_at_which_the_clock_starts() {
    let law = |_, count: usize| (if count.is_multiple_of(2) { -8.0 } else { 2.0 }, 0.0);
    for start in [0.0, 1e3, 1e6] {
        let mut system = Switching::new(law, vec![height()]);
        let limits = Limits { first_step: Some(0.3), ..Limits::default() };
        let (outcome, _) = system.run_within(limits, [start, start + 24.0], 1.0, 0.0);
        assert_eq!(outcome.status, Status::Done);
        let instants: Vec<(usize, f64)> = (0..10)
            .map(|k| (0, start + 0.5 + f64::from(k / 2) * 5.0 + if k % 2 == 1 { 4.0 } else { 0.0 }))
            .filter(|(_, t)| *t < start + 24.0)
            .collect();
        // Each of ten relocations ends within the shortest step, 16 roundings of the clock; being late
        // makes it faster, and all later flights longer.
        system.expect(&instants, 1e-10 + 30.0 * 16.0 * f64::EPSILON * start);
    }
}

#[test]
fn gate_05_a_step_cut_by_an_event_is_as_accurate_as_any_other() {
    // q'' = q grows, by so little that the whole run in one step is within the tolerance. The event ends a
    // step where γh = 1 makes the linear equations all but singular.
    let (gamma, small, end) = (RODAS5P.gamma, 1e-15, 6.0);
    let instant = 1.0 / gamma;
    let mut system = Switching::new(|q, _| (q, 1.0), vec![Box::new(move |t, _, _| (instant - t, -1.0))]);
    let (outcome, state) = system.run([0.0, end], small, small);
    assert_eq!((outcome.status, outcome.stats.events), (Status::Done, 1));
    system.expect(&[(0, instant)], 1e-14);
    let exact = small * end.exp();
    println!("{state:?} instead of {exact}, {:?}", outcome.stats);
    assert!(state.iter().all(|y| (y - exact).abs() < 1e-9), "{state:?} instead of {exact}");
}

#[test]
fn a_relocation_whose_equations_are_singular_is_refused_and_not_the_end() {
    // As above, with relocations of RODAS4 where its linear equations, those of hγ = 1, have no solution at all.
    let (small, end) = (1e-15, 6.0);
    for ulps in -8..=8 {
        let instant = 4.0 + f64::from(ulps) * 2.0 * f64::EPSILON;
        let mut system = Switching::new(|q, _| (q, 1.0), vec![Box::new(move |t, _, _| (instant - t, -1.0))]);
        let limits = Limits { first_step: Some(end), ..Limits::default() };
        let (mut q, mut v) = ([small], [small]);
        let outcome = rosenbrock(&mut system, RODAS4, limits, 0.0, end, &mut q, &mut v);
        assert_eq!((outcome.status, outcome.stats.events), (Status::Done, 1), "{ulps}");
        system.expect(&[(0, instant)], 1e-14);
        assert!((q[0] - small * end.exp()).abs() < 1e-9, "{q:?}");
    }
}
