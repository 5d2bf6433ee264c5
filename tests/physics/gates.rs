//! Promises of the integrator that belong to no single part of it. The number in a name is that of the
//! row in docs/reliability.md, here and wherever else a test is called `gate_...`.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::integrators::Status;
use chebclear::integrators::tableaus::{RODAS4, RODAS5P};
use chebclear::run::settings::{Method, Settings};
use chebclear::run::trajectory::{Trajectory, simulate, simulate_from};
use chebclear::scene::parts::Scene;
use chebclear::tree::elements::State;

use crate::integrators::problems::{distance, kepler, van_der_pol};
use crate::support::{Random, body, compile, loose, slider_crank};

const METHODS: [Method; 4] = [Method::Rodas5P, Method::Rodas4, Method::Dop853, Method::Adams];

#[test]
fn gate_05_a_step_that_the_clock_cannot_resolve_ends_the_run() {
    // The later the clock starts, the longer is the shortest step, 16 roundings of the time. None of
    // these problems knows the time, so being late is a floor of the step and nothing else.
    let mut refused = 0;
    for problem in [kepler(), van_der_pol(1.0, -0.66), van_der_pol(1e-3, 0.0)] {
        let reference = problem.reference(8192).pop().unwrap();
        for tableau in [RODAS4, RODAS5P] {
            for exponent in 8..=16 {
                for tolerance in [1e-4, 1e-7, 1e-10] {
                    let mut late = problem.clone();
                    late.t0 = 10_f64.powi(exponent);
                    let (outcome, end) = late.adaptively(tableau, tolerance);
                    let floor = 16.0 * f64::EPSILON * late.t0;
                    match outcome.status {
                        Status::Done => {
                            // As good as at time zero, but for the rounding of the end itself.
                            let error = distance(&end, &reference);
                            let rounding = f64::EPSILON * late.t0 * 1e3;
                            assert!(error <= 100.0 * tolerance + rounding, "{error:e} at {floor:e} s");
                        }
                        Status::StepUnderflow => refused += 1,
                        status => panic!("{}: {status:?}", problem.name),
                    }
                    if floor > 0.5 * problem.duration {
                        assert_ne!((outcome.status, tolerance < 1e-9), (Status::Done, true), "{floor:e} s");
                    }
                }
            }
        }
    }
    assert!(refused >= 20, "{refused} runs met the floor");
}

/// A journal in a bearing of ground.
fn journal(mass: f64, clearance: f64, contact: NormalLaw, friction: Option<FrictionLaw>) -> Scene {
    let radius = 0.01;
    Scene {
        bodies: vec![body("journal", mass, 0.5 * mass * radius * radius, [0.0, 0.0], Vec::new())],
        joints: vec![loose("bearing", ["ground", "journal"], [radius, clearance], contact, friction)],
        ..Scene::default()
    }
}

fn lankarani_nikravesh(stiffness: f64, restitution: f64) -> NormalLaw {
    NormalLaw { stiffness, exponent: 1.5, damping: Damping::LankaraniNikravesh { restitution } }
}

/// Whether the samples are finite up to the end of the run and nothing afterwards.
fn samples_are_honest(run: &Trajectory) -> bool {
    run.t.iter().zip(run.values.chunks_exact(run.columns.len())).all(|(t, row)| {
        let reached = run.status == Status::Done || *t <= run.time;
        row.iter().all(|value| if reached { value.is_finite() } else { value.is_nan() })
    })
}

#[test]
fn gate_06_a_mechanism_started_with_no_number_or_a_huge_one_ends_typed() {
    let mechanism = compile(&slider_crank(false));
    for method in METHODS {
        let mut settings = Settings::new(0.002, 11);
        settings.method = method;
        settings.limits.max_steps = 20_000;
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 1e160] {
            for place in 0..4 {
                let mut start = mechanism.start.clone();
                if place < 2 {
                    start.q[place] = bad
                } else {
                    start.v[place - 2] = bad
                }
                let run = simulate_from(&mechanism, &start, &settings, &|_| true).unwrap();
                if bad.is_finite() {
                    // A part that is far away may fly on: then the joint that it left says so.
                    let said = run.warnings.iter().any(|notice| notice.code == "deep_penetration");
                    assert!(run.status != Status::Done || said, "{bad:e} in place {place}");
                } else {
                    let typed = [Status::NonFinite, Status::SingularMechanism].contains(&run.status);
                    assert!(typed && run.time == 0.0, "{:?} at {}", run.status, run.time);
                    assert!(run.values[run.columns.len()..].iter().all(|value| value.is_nan()));
                }
            }
        }
    }
}

#[test]
fn gate_10_elastic_motion_runs_back_to_where_it_came_from() {
    let law = NormalLaw { stiffness: 1e10, exponent: 1.5, damping: Damping::Elastic };
    let mechanism = compile(&journal(0.5, 1e-3, law, None));
    let start = State { q: vec![2e-4, 3e-4, 0.1], v: vec![0.9, -0.5, 7.0] };
    for method in METHODS {
        for rtol in [1e-6, 1e-9] {
            // The journal is in flight at the end.
            let mut settings = Settings::new(0.0075, 2);
            (settings.rtol, settings.method) = (rtol, method);
            let there = simulate_from(&mechanism, &start, &settings, &|_| true).unwrap();
            assert!(
                there.events.len() >= 6 && there.events.len().is_multiple_of(2),
                "{}",
                there.events.len()
            );
            let mut turned = there.end.clone();
            turned.v.iter_mut().for_each(|v| *v = -*v);
            let back = simulate_from(&mechanism, &turned, &settings, &|_| true).unwrap();
            let position = distance(&back.end.q[..2], &start.q[..2]) / 1e-3;
            let velocity: Vec<f64> = back.end.v.iter().map(|v| -v).collect();
            let velocity = distance(&velocity[..2], &start.v[..2]);
            println!("{method:?} {rtol:e}: {:.1e} c, {velocity:.1e} m/s", position);
            // Three impacts on a round wall, there and back, multiply the errors.
            assert!(position < 100.0 * rtol && velocity < 100.0 * rtol, "{position:e} {velocity:e}");
        }
    }
}

#[test]
fn gate_15_starts_in_contact_end_typed_and_gain_no_energy() {
    let mut random = Random(15);
    let mut decades = |low: f64, high: f64| 10_f64.powf(random.within(low.log10(), high.log10()));
    let (mut done, mut worst) = (0, 0.0_f64);
    for index in 0..150 {
        let (mass, clearance) = (decades(1e-4, 1e4), decades(1e-7, 1e-3));
        let stiffness = 3e11 * decades(1e-3, 1e3);
        let slip = decades(1e-6, 1e-2);
        let friction = FrictionLaw::ModifiedCoulomb {
            static_coefficient: decades(1e-3, 1.0),
            sliding_coefficient: 1e-3,
            stick_slip_velocity: slip,
            static_sliding_velocity: 1.5 * slip,
        };
        let law = lankarani_nikravesh(stiffness, decades(1e-2, 0.999));
        let mechanism = compile(&journal(mass, clearance, law, Some(friction)));
        let speed = decades(1e-3, 10.0);
        let depth = clearance * decades(1e-6, 1.0);
        let (sine, cosine) = decades(0.1, 10.0).sin_cos();
        let start = State {
            q: vec![(clearance + depth) * cosine, (clearance + depth) * sine, 0.0],
            v: vec![speed, -0.3 * speed, 50.0 * speed],
        };
        let mut settings = Settings::new(decades(1.0, 100.0) * clearance / speed, 101);
        (settings.rtol, settings.method) = (decades(1e-10, 1e-3), METHODS[index % 3]);
        settings.limits.max_steps = 5_000;
        let run = simulate_from(&mechanism, &start, &settings, &|_| true).unwrap();
        assert!([Status::Done, Status::MaxSteps].contains(&run.status), "{index}: {}", run.message());
        assert!(samples_are_honest(&run), "{index}: {}", run.message());
        done += usize::from(run.status == Status::Done);
        let energy = |state: &State| {
            let [vx, vy, rate] = [state.v[0], state.v[1], state.v[2]];
            let depth = (state.q[0].hypot(state.q[1]) - clearance).max(0.0);
            0.5 * mass * (vx * vx + vy * vy + 0.5e-4 * rate * rate) + 0.4 * stiffness * depth.powf(2.5)
        };
        let onsets = run.events.len() / 2 + 1;
        let gain = (energy(&run.end) / energy(&start) - 1.0) / (settings.rtol * onsets as f64);
        worst = worst.max(gain);
        assert!(gain <= 10.0, "{index}: {gain} tolerances per onset, {:?}", settings.method);
    }
    println!("{done} of 150 done, the energy grew by {worst:.2} tolerances per onset at most");
    assert!(done >= 50, "{done} of 150 done");
}

#[test]
fn gate_17_the_counters_add_up() {
    let mechanism = compile(&slider_crank(false));
    // Stages of an attempt: all of a Rosenbrock step, all but the first of an explicit one.
    for (method, stages) in [(Method::Rodas4, 6), (Method::Rodas5P, 8)] {
        let mut settings = Settings::new(0.01, 101);
        settings.method = method;
        let run = simulate(&mechanism, &settings, &|_| true).unwrap();
        let stats = run.stats;
        let attempts = stats.steps + stats.rejected + stats.relocations;
        // A relocation is a repeated attempt: the first one was a step that passed.
        assert!(stats.relocations >= stats.events && stats.events == run.events.len());
        assert_eq!(stats.factorizations, attempts, "{stats:?}");
        assert_eq!(stats.stages, stages * attempts, "{stats:?}");
        assert_eq!(stats.jacobians, stats.steps, "{stats:?}");
        // The first stage of an attempt is the evaluation that comes with the Jacobian.
        assert_eq!(stats.evaluations, stats.jacobians + (stages - 1) * attempts, "{stats:?}");
        assert!(stats.smallest_step > 0.0 && stats.smallest_step_time < run.time);
        assert!(run.impacts_at_floor <= stats.events && run.largest_projection == 0.0);
    }
}

#[test]
fn a_run_costs_no_more_the_longer_it_has_gone_on() {
    // The same state of the paper's mechanism at the end of one revolution and, as far as anyone can tell,
    // of 1001, at a tolerance that feels 1e-14 m. Rounding every instant to the nearest number cost 36 % more
    // steps there, and ten times the refusals.
    let mechanism = compile(&slider_crank(false));
    let revolution = 0.03;
    for method in METHODS {
        let mut settings = Settings::new(revolution, 2);
        (settings.rtol, settings.method) = (1e-8, method);
        let first = simulate(&mechanism, &settings, &|_| true).unwrap();
        let mut end = first.restart.expect("the run reached its end");
        end.memory.contacts.fill(None);
        let [early, late] = [0.0, 1000.0 * revolution].map(|later| {
            let mut restart = end.clone();
            restart.time += later;
            let run = simulate_from(&mechanism, &restart, &settings, &|_| true).unwrap();
            assert_eq!(run.status.word(), "done", "{}", run.message());
            run.stats
        });
        println!(
            "{method:?}: {} and {} steps, {} and {} refused",
            early.steps, late.steps, early.rejected, late.rejected
        );
        assert!(late.steps.abs_diff(early.steps) <= early.steps / 100, "{early:?}\n{late:?}");
        assert!(late.rejected.abs_diff(early.rejected) <= 5 + early.rejected / 2, "{early:?}\n{late:?}");
    }
}
