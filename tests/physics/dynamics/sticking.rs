//! Friction that sticks, on random mechanisms: derivatives by differences, powers by their balance.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::pair::{Phase, SlidingVelocity};
use chebclear::contact::sticking::{StickSlip, Traction};
use chebclear::dynamics::Dynamics;
use chebclear::mechanism::compiled::Mechanism;

use crate::dynamics::cartesian::moving_cases;
use crate::dynamics::guides::{assert_linearization, with_faces};
use crate::dynamics::random_trees::Case;
use crate::support::Random;

/// The case with faces, where all contacts can stick: each sticks or slides. Bodies have turned many times.
fn sticking<'m>(case: &Case, mechanism: &'m mut Mechanism, random: &mut Random) -> (Dynamics<'m>, usize) {
    let (with_faces, phases) = with_faces(case, random);
    *mechanism = with_faces;
    for slot in &mut mechanism.tree.slots {
        slot.is_aside = true;
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
        // Longer steps would reach Coulomb's limit.
        assert_linearization(&mut dynamics, case, index, 0.04);
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
