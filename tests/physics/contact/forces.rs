//! Force laws and force geometry of a clearance joint against numbers worked by hand.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::{Damping, Latch, NormalLaw};
use chebclear::contact::pair::{ContactLaw, Phase, RelativeMotion, SlidingVelocity, Surfaces};
use chebclear::dynamics::Dynamics;
use chebclear::numerics::dual::{Dual, Scalar};
use chebclear::run::settings::Settings;
use chebclear::run::trajectory::{simulate, simulate_from};
use chebclear::scene::parts::Scene;
use chebclear::tree::elements::State;

use crate::support::{Random, body, compile, derivative, loose, paper_friction, with_sliding};

const HERTZ: NormalLaw = NormalLaw { stiffness: 1e10, exponent: 1.5, damping: Damping::Elastic };

fn damped(restitution: f64) -> NormalLaw {
    NormalLaw { damping: Damping::LankaraniNikravesh { restitution }, ..HERTZ }
}

fn in_contact(hysteresis_factor: f64, clipped: bool) -> Phase {
    Phase::Contact { latch: Latch { hysteresis_factor, ..Latch::default() }, clipped, traction: None }
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "found {found:e}, expected {expected:e}");
}

const COULOMB: FrictionLaw = FrictionLaw::ModifiedCoulomb {
    static_coefficient: 0.6,
    sliding_coefficient: 0.5,
    stick_slip_velocity: 0.02,
    static_sliding_velocity: 0.1,
};

#[test]
fn hertz_force_is_stiffness_times_penetration_to_the_exponent() {
    // 1e10 N/m^1.5 * (1e-4 m)^1.5 = 1e4 N, at any rate.
    close(HERTZ.normal_force(1e-4, 0.0, Latch::default()), 1e4, 1e-14);
    close(HERTZ.normal_force(1e-4, -3.0, HERTZ.latch(0.1)), 1e4, 1e-14);
    // 1e10 N/m^2 * (1e-4 m)^2 = 100 N.
    close(NormalLaw { exponent: 2.0, ..HERTZ }.normal_force(1e-4, 0.0, Latch::default()), 100.0, 1e-14);
    assert_eq!(HERTZ.normal_force(0.0, 1.0, Latch::default()), 0.0);
    assert_eq!(HERTZ.normal_force(-1e-4, 1.0, Latch::default()), 0.0);
}

#[test]
fn lankarani_nikravesh_damping_follows_from_restitution_and_impact_velocity() {
    let law = damped(0.9);
    // χ = 3 (1 - 0.81) / (4 * 0.5 m/s) = 0.285 s/m.
    let latch = law.latch(0.5);
    close(latch.hysteresis_factor, 0.285, 1e-14);
    // 1e4 N (1 + 0.285 * 0.2), approaching; (1 - 0.285 * 0.2), separating.
    close(law.normal_force(1e-4, 0.2, latch), 1.057e4, 1e-14);
    close(law.normal_force(1e-4, -0.2, latch), 0.943e4, 1e-14);
    // The continuation beyond the clip: 1 - 0.285 * 10 = -1.85.
    close(law.normal_force(1e-4, -10.0, latch), -1.85e4, 1e-14);
    close(law.force_ratio(1e-4, -10.0, latch), -1.85, 1e-14);
    assert_eq!(damped(1.0).latch(0.5), Latch::default());
}

#[test]
fn resting_velocity_is_that_of_critical_damping() {
    // K = 1e9, F = 1000 N: δ = (1e-6)^(2/3) = 1e-4 m; m = 1.5 kg: ω² = 1.5e9 * 1e-2 / 1.5 = 1e7 1/s²;
    // v = 3 (1 - 0.81) 1000 / (8 * 1.5 * sqrt(1e7)).
    let law = NormalLaw { stiffness: 1e9, ..damped(0.9) };
    // An order of magnitude by nature, it is rounded to 32 bits.
    close(law.resting_velocity(1000.0, 1.5), 570.0 / (12.0 * 1e7_f64.sqrt()), 2e-10);
    // The paper's joint: m r ω² of the slider at 2000 r/min is 307 N, the floor 2.65 mm/s.
    let law = NormalLaw { stiffness: 3.3265e11, ..damped(0.9) };
    let load = 0.14 * 0.05 * (2000.0 * std::f64::consts::PI / 30.0).powi(2);
    close(load, 307.0, 1e-3);
    close(law.resting_velocity(load, 0.14), 2.65e-3, 2e-3);
}

#[test]
fn friction_coefficient_has_the_hand_values_of_equation_11() {
    let law = paper_friction();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // sin(π/4) at V_s / 2; the mean of both at the middle of the transition.
    close(law.signed_coefficient(0.5e-3), 0.04 * half, 1e-14);
    close(law.signed_coefficient(1e-3), 0.04, 1e-14);
    close(law.signed_coefficient(1.25e-3), 0.035, 1e-14);
    // A quarter of the transition: mean + amplitude cos(π/4).
    close(law.signed_coefficient(1.125e-3), 0.035 + 0.005 * half, 1e-12);
    close(law.signed_coefficient(1.5e-3), 0.03, 1e-14);
    close(law.signed_coefficient(7.0), 0.03, 1e-14);
    assert_eq!(law.signed_coefficient(0.0), 0.0);
}

#[test]
fn friction_coefficient_is_odd_and_smooth_across_both_switch_velocities() {
    let law = paper_friction();
    for switch in [1e-3_f64, 1.5e-3] {
        let at = |v: f64| law.signed_coefficient(Dual::<1>::input(v, 0));
        let (before, after) = (at(switch * (1.0 - 1e-12)), at(switch * (1.0 + 1e-12)));
        assert!((before.value - after.value).abs() < 1e-15);
        // Both slopes are zero there; elsewhere they are of the order of μ_s / V_s = 40 s/m.
        assert!(before.gradient[0].abs() < 1e-9 && after.gradient[0].abs() < 1e-9);
    }
    let mut random = Random(1);
    for _ in 0..1000 {
        let v = random.within(0.0, 2e-3);
        let (plus, minus) =
            (law.signed_coefficient(Dual::<1>::input(v, 0)), law.signed_coefficient(Dual::<1>::input(-v, 0)));
        assert_eq!(plus.value, -minus.value);
        assert_eq!(plus.gradient, minus.gradient);
        assert!(plus.value >= 0.0 && plus.value <= 0.04);
    }
}

fn law(sliding: SlidingVelocity, exponent: f64, friction: Option<FrictionLaw>) -> ContactLaw {
    ContactLaw {
        clearance: 0.02,
        surfaces: Surfaces::Bearing { journal_radius: 0.1, bearing_radius: 0.12 },
        normal: NormalLaw {
            stiffness: 1e4,
            exponent,
            damping: Damping::LankaraniNikravesh { restitution: 0.8 },
        },
        friction,
        sliding,
    }
}

#[test]
fn dual_gradients_of_the_force_agree_with_differences() {
    let mut random = Random(2);
    let mut regimes = [0; 3];
    for round in 0..600 {
        let sliding = [SlidingVelocity::Surface, SlidingVelocity::ContactPoint][round % 2];
        let friction = (round % 5 > 0).then_some(COULOMB);
        let law = law(sliding, [1.5, 1.5, 2.2, 1.1][round % 4], friction);
        let (angle, size) = (random.within(-3.0, 3.0), random.within(0.021, 0.06));
        // Speeds that visit all regimes of either convention.
        let fast = [0.02, 0.1, 0.4][round % 3];
        let input = [
            size * angle.cos(),
            size * angle.sin(),
            random.within(-fast, fast),
            random.within(-fast, fast),
            random.within(-fast, fast),
        ];
        let phase = in_contact(random.within(0.0, 2.0), false);
        let motion = |x: [f64; 5]| RelativeMotion {
            eccentricity: [x[0], x[1]],
            rate: [x[2], x[3]],
            spin: x[4],
            roll: 0.0,
        };
        let state = law.evaluate(&motion(input), phase);
        let speed = state.sliding_velocity.abs();
        // Differences across a switch velocity would see its kink in the second derivative.
        if [0.02, 0.1].iter().any(|switch| (speed / switch - 1.0).abs() < 0.05) {
            continue;
        }
        regimes[usize::from(speed > 0.02) + usize::from(speed > 0.1)] += 1;
        let exact = law.force_gradient(&motion(input), phase);
        assert_eq!(
            exact.map(|component| component.value),
            [state.force[0], state.force[1], state.friction_force]
        );
        for k in 0..5 {
            // In units of the gap or of the stick velocity, so that the steps suit the scale.
            let unit = if k < 2 { 0.03 * (size - law.clearance) } else { 1e-2 };
            let difference = derivative(|h| {
                let mut x = input;
                x[k] += 10.0 * unit * h;
                let state = law.evaluate(&motion(x), phase);
                vec![state.force[0], state.force[1], state.friction_force]
            });
            for (component, difference) in exact.iter().zip(difference) {
                let scale = state.normal_force.abs();
                let error = (component.gradient[k] * 10.0 * unit - difference).abs();
                assert!(error < 1e-8 * scale, "round {round}, input {k}: {error:e} of {scale:e}");
            }
        }
    }
    assert!(regimes.iter().all(|&count| count > 50), "{regimes:?}");
}

#[test]
fn sliding_velocity_follows_the_convention() {
    // Journal below the bearing center: n = (0, -1), t = (1, 0).
    let motion = RelativeMotion { eccentricity: [0.0, -0.03], rate: [0.5, -0.25], spin: 0.2, roll: 0.0 };
    let phase = in_contact(0.0, false);
    let state = law(SlidingVelocity::Surface, 1.5, None).evaluate(&motion, phase);
    close(state.penetration, 0.01, 1e-14);
    close(state.penetration_rate, 0.25, 1e-15);
    close(state.sliding_velocity, 0.7, 1e-15);
    assert_eq!(state.friction_force, 0.0);
    // 0.5 (1 - 0.02 / 0.03), without the rotation.
    let state = law(SlidingVelocity::ContactPoint, 1.5, None).evaluate(&motion, phase);
    close(state.sliding_velocity, 0.5 / 3.0, 1e-14);
}

#[test]
fn no_force_acts_without_contact_or_while_the_damping_would_pull() {
    let law = law(SlidingVelocity::Surface, 1.5, Some(COULOMB));
    let motion = RelativeMotion { eccentricity: [0.03, 0.0], rate: [-9.0, 1.0], spin: 0.2, roll: 0.0 };
    for phase in [Phase::Free, in_contact(1.0, true)] {
        let state = law.evaluate(&motion, phase);
        assert_eq!(state.force, [0.0, 0.0]);
        assert_eq!((state.normal_force, state.friction_force), (0.0, 0.0));
        // The geometry is reported as it is.
        close(state.penetration, 0.01, 1e-14);
        close(state.penetration_rate, -9.0, 1e-15);
    }
    let flying = RelativeMotion { eccentricity: [0.0, 0.005], ..motion };
    let state = law.evaluate(&flying, Phase::Free);
    close(state.penetration, -0.015, 1e-14);
}

#[test]
fn concentric_journal_feels_no_force_and_nothing_is_divided_by_zero() {
    for sliding in [SlidingVelocity::Surface, SlidingVelocity::ContactPoint] {
        let law = law(sliding, 1.5, Some(COULOMB));
        let motion = RelativeMotion { eccentricity: [0.0, 0.0], rate: [0.3, 0.4], spin: 0.2, roll: 0.0 };
        for phase in [Phase::Free, in_contact(1.0, false)] {
            let state = law.evaluate(&motion, phase);
            assert_eq!(state.penetration, -0.02);
            assert_eq!(state.force, [0.0, 0.0]);
            assert!(state.penetration_rate.is_finite() && state.sliding_velocity.is_finite());
            for component in law.force_gradient(&motion, phase) {
                assert_eq!((component.value(), component.gradient), (0.0, [0.0; 5]));
            }
        }
    }
    // However small the eccentricity, all is a number; where it is one, the normal has the length 1.
    let law = law(SlidingVelocity::Surface, 1.5, Some(COULOMB));
    for exponent in (-320..=-2).filter(|exponent| *exponent != -70) {
        let distance = 10_f64.powi(exponent);
        let motion = RelativeMotion {
            eccentricity: [0.6 * distance, 0.8 * distance],
            rate: [3.0, 4.0],
            spin: 0.2,
            roll: 0.0,
        };
        for phase in [Phase::Free, in_contact(1.0, false)] {
            let state = law.evaluate(&motion, phase);
            let rate = if exponent < -70 { 0.0 } else { 5.0 };
            assert!((state.penetration_rate - rate).abs() < 1e-14, "{distance:e}: {state:?}");
            for component in law.force_gradient(&motion, phase) {
                assert!(
                    component.gradient.iter().all(|slope| slope.is_finite()),
                    "{distance:e}: {component:?}"
                );
            }
        }
    }
    let scene = pair(false, SlidingVelocity::Surface);
    for scene in [&scene, &pair(true, SlidingVelocity::ContactPoint)] {
        let mechanism = compile(scene);
        let run = simulate(&mechanism, &Settings::new(1.0, 11), &|_| true).unwrap();
        assert_eq!(run.status.word(), "done");
        assert!(run.values.iter().all(|value| value.is_finite()));
        // Launched from the center the journal must find the bearing.
        let mut start = mechanism.start.clone();
        start.v[0] += 0.1;
        let run = simulate_from(&mechanism, &start, &Settings::new(1.0, 11), &|_| true).unwrap();
        assert_eq!(run.status.word(), "done");
        assert!(run.values.iter().all(|value| value.is_finite()) && !run.events.is_empty());
    }
}

/// A journal in a fixed bearing, or in a bearing on a free body.
fn pair(free_bearing: bool, sliding: SlidingVelocity) -> Scene {
    let bearing = if free_bearing { "housing" } else { "ground" };
    let law = NormalLaw { stiffness: 1e4, ..HERTZ };
    let mut bodies = vec![body("shaft", 2.0, 0.5, [0.0, 0.0], Vec::new())];
    if free_bearing {
        bodies.push(body("housing", 4.0, 0.6, [0.0, 0.0], Vec::new()));
    }
    Scene {
        bodies,
        joints: vec![with_sliding(
            loose("joint", [bearing, "shaft"], [0.1, 0.02], law, Some(COULOMB)),
            sliding,
        )],
        ..Scene::default()
    }
}

#[test]
fn contact_forces_and_moments_on_both_bodies_have_the_hand_values() {
    // Shaft 0.03 m below the housing's center, turning at 2 rad/s, all else at rest:
    // δ = 0.01 m, F_N = 1e4 * 0.01^1.5 = 10 N, n = (0, -1), t = (1, 0),
    // v_T = 2 * 0.1 = 0.2 m/s > V_d: F_t = -0.5 * 10 N, force on the shaft (-5, 10) N.
    // Moment on the shaft: (0, -0.1) x (-5, 10) = -0.5 N m, on the housing:
    // (0, -0.12) x (5, -10) = 0.6 N m: friction brakes the shaft and drags the housing along.
    for free_bearing in [false, true] {
        let mechanism = compile(&pair(free_bearing, SlidingVelocity::Surface));
        let mut dynamics = Dynamics::new(&mechanism);
        dynamics.phases[0] = in_contact(0.0, false);
        let state = if free_bearing {
            // x, y, angle of the shaft, then of the housing (whose rotation at rest is no matter).
            State { q: vec![0.5, -0.53, 0.7, 0.5, -0.5, 0.3], v: vec![0.0, 0.0, 2.0, 0.0, 0.0, 0.0] }
        } else {
            State { q: vec![0.0, -0.03, 0.7], v: vec![0.0, 0.0, 2.0] }
        };
        let mut a = vec![0.0; state.q.len()];
        assert!(dynamics.acceleration(0.0, &state.q, &state.v, &mut a));
        let expected = [-5.0 / 2.0, 10.0 / 2.0, -0.5 / 0.5, 5.0 / 4.0, -10.0 / 4.0, 0.6 / 0.6];
        for (found, expected) in a.iter().zip(expected) {
            close(*found, expected, 1e-12);
        }
    }
    // As printed, a turning shaft at rest in its place does not slide.
    let mechanism = compile(&pair(false, SlidingVelocity::ContactPoint));
    let mut dynamics = Dynamics::new(&mechanism);
    dynamics.phases[0] = in_contact(0.0, false);
    let mut a = [0.0; 3];
    assert!(dynamics.acceleration(0.0, &[0.0, -0.03, 0.7], &[0.0, 0.0, 2.0], &mut a));
    close(a[1], 5.0, 1e-12);
    assert_eq!((a[0], a[2]), (0.0, 0.0));
}

#[test]
fn the_other_laws_have_their_hand_values() {
    let flores = NormalLaw { damping: Damping::Flores { restitution: 0.5 }, ..HERTZ };
    // χ = 8 (1 - 0.5) / (5 * 0.5 * 2).
    close(flores.latch(2.0).hysteresis_factor, 0.8, 1e-15);
    let fixed = NormalLaw { damping: Damping::HuntCrossley { hysteresis_factor: 0.3 }, ..HERTZ };
    close(fixed.latch(2.0).hysteresis_factor, 0.3, 1e-15);
    assert!(flores.is_latched() && !fixed.is_latched() && fixed.resting_velocity(100.0, 1.0) == 0.0);
    let smoothed = FrictionLaw::SmoothedCoulomb { coefficient: 0.2, velocity: 1e-3 };
    // tanh(ln 3) = 0.8.
    close(smoothed.signed_coefficient(1e-3 * 3.0_f64.ln()), 0.16, 1e-14);
    close(smoothed.signed_coefficient(-1.0), -0.2, 1e-14);
    let slope = smoothed.signed_coefficient(Dual::<1>::input(1e-3 * 3.0_f64.ln(), 0));
    close(slope.gradient[0], 0.2 / 1e-3 * (1.0 - 0.64), 1e-13);
}
