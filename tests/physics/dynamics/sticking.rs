//! Friction that sticks, on random mechanisms: derivatives by differences, powers by their balance.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::pair::{Phase, SlidingVelocity};
use chebclear::contact::sticking::{StickSlip, Traction};
use chebclear::dynamics::{Dynamics, Linearization};
use chebclear::mechanism::compiled::Mechanism;

use crate::dynamics::cartesian::{added, moving_cases};
use crate::dynamics::guides::with_faces;
use crate::dynamics::random_trees::Case;
use crate::support::{Random, derivative};

/// The case with faces, where all contacts can stick: each sticks or slides. Bodies have turned many times.
fn sticking<'m>(case: &Case, mechanism: &'m mut Mechanism, random: &mut Random) -> (Dynamics<'m>, usize) {
    let (with_faces, phases) = with_faces(case, random);
    *mechanism = with_faces;
    for slot in &mut mechanism.tree.slots {
        slot.law.sliding = SlidingVelocity::Surface;
        slot.law.friction = Some(FrictionLaw::StickSlip(StickSlip {
            static_coefficient: 0.6,
            sliding_coefficient: 0.3,
            stribeck_velocity: [0.0, 2.0][random.index(2)],
            tangential_stiffness: None,
            damping_ratio: 0.3,
        }));
    }
    let mechanism: &'m Mechanism = mechanism;
    let mut dynamics = Dynamics::new(mechanism);
    for turns in &mut dynamics.turns {
        *turns = random.index(2000) as f64;
    }
    dynamics.move_to(case.t, &case.q, &case.v);
    dynamics.phases = phases;
    let mut stuck = 0;
    for (index, slot) in mechanism.slots.iter().enumerate() {
        let Phase::Contact { latch, clipped, .. } = dynamics.phases[index] else { continue };
        let new = Traction {
            stiffness: 1.0,
            damping: random.within(1.0, 3.0),
            load: 2.0,
            direction: random.index(3) as f64 - 1.0,
            anchor: 0.0,
            arm: 0.0,
            turns: [0.0; 2],
        };
        let sliding = Phase::Contact { latch, clipped, traction: Some(Traction { direction: 1.0, ..new }) };
        let normal_force = dynamics.contact_of(slot, sliding).state.normal_force;
        let force = random.within(-0.3, 0.3) * normal_force;
        // Stretched by at most 5 mm, less than any clearance.
        let new = Traction { stiffness: (100.0 * normal_force.abs()).max(1.0), ..new };
        let traction = if new.sticks() { dynamics.anchored(slot, force, new) } else { new };
        stuck += usize::from(new.sticks() && !clipped);
        dynamics.phases[index] = Phase::Contact { latch, clipped, traction: Some(traction) };
        let state = dynamics.contact_of(slot, dynamics.phases[index]).state;
        if new.sticks() && !clipped {
            let damping = state.friction_force - force;
            assert!(damping * state.sliding_velocity <= 1e-9 * force.abs(), "{damping}");
        }
    }
    (dynamics, stuck)
}

/// Derivative by steps that are so short that they do not reach Coulomb's limit.
fn slope(mut f: impl FnMut(f64) -> Vec<f64>) -> Vec<f64> {
    derivative(|h| f(0.04 * h)).iter().map(|change| 25.0 * change).collect()
}

#[test]
fn linearization_agrees_with_differences() {
    let mut random = Random(71);
    let (mut in_bearings, mut stuck_faces) = (0, 0);
    for (index, case) in moving_cases().iter().enumerate() {
        let mut mechanism = case.mechanism.clone();
        let bearings = mechanism.slots.len();
        let (mut dynamics, stuck) = sticking(case, &mut mechanism, &mut random);
        let of_bearings = dynamics.phases[..bearings].iter().filter(|phase| {
            matches!(phase, Phase::Contact { clipped: false, traction: Some(traction), .. } if traction.sticks())
        });
        in_bearings += of_bearings.clone().count();
        stuck_faces += stuck - of_bearings.count();
        let (t, q, v) = (case.t, &case.q, &case.v);
        let d = q.len();
        let mut exact = Linearization::new(d);
        assert!(dynamics.linearize(t, q, v, &mut exact));
        let mut acceleration = |t: f64, q: &[f64], v: &[f64]| {
            let mut a = vec![0.0; d];
            assert!(dynamics.acceleration(t, q, v, &mut a));
            a
        };
        let mut unit = vec![0.0; d];
        let (mut worst, mut size) = (0.0_f64, 1.0_f64);
        for k in 0..d {
            unit.fill(0.0);
            unit[k] = 1.0;
            let by_q = slope(|h| acceleration(t, &added(q, h, &unit), v));
            let by_v = slope(|h| acceleration(t, q, &added(v, h, &unit)));
            for row in 0..d {
                size = size.max(by_q[row].abs()).max(by_v[row].abs());
                worst = worst.max((by_q[row] - exact.a_q[row * d + k]).abs());
                worst = worst.max((by_v[row] - exact.a_v[row * d + k]).abs());
            }
        }
        let by_t = slope(|h| acceleration(t + h, q, v));
        for row in 0..d {
            size = size.max(by_t[row].abs());
            worst = worst.max((by_t[row] - exact.a_t[row]).abs());
        }
        assert!(worst <= 1e-6 * size, "case {index}: {worst} of {size}");
    }
    assert!(in_bearings > 20 && stuck_faces > 20, "{in_bearings} and {stuck_faces}");
}

#[test]
fn powers_agree() {
    let mut random = Random(72);
    for (index, case) in moving_cases().iter().enumerate() {
        let mut mechanism = case.mechanism.clone();
        let (mut dynamics, _) = sticking(case, &mut mechanism, &mut random);
        let mut a = vec![0.0; case.q.len()];
        assert!(dynamics.acceleration_and_contacts(case.t, &case.q, &case.v, &mut a));
        dynamics.accelerate(&a);
        dynamics.find_reactions();
        let contacts = (0..dynamics.phases.len()).map(|slot| dynamics.contact(slot).state.normal_force.abs());
        let size = contacts.fold(1.0, f64::max);
        let powers = [dynamics.input_power(), dynamics.balanced_power()];
        let off = (powers[0] - powers[1]).abs();
        assert!(off <= 1e-8 * powers[0].abs().max(size), "case {index}: {powers:?}");
    }
}
