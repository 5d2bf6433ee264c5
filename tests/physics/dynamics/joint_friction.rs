//! Friction in the ideal joints of random mechanisms: derivatives by differences, reactions and powers by their balances, the
//! law with the reactions that inverse dynamics finds.

use chebclear::contact::friction::{JointFriction, JointPhase};
use chebclear::dynamics::Dynamics;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::scene::parts::{Joint, JointKind, Scene};
use chebclear::tree::elements::Scales;

use crate::dynamics::cartesian::moving_cases;
use crate::dynamics::guides::assert_linearization;
use crate::dynamics::loops::four_bar;
use crate::dynamics::random_trees::Case;
use crate::support::{Random, compile};

/// The case with friction in most of its ideal joints.
pub(crate) fn with_friction(case: &Case, random: &mut Random) -> Option<Mechanism> {
    let mut scene = case.scene.clone();
    for joint in &mut scene.joints {
        let Joint::Ideal { kind, friction, .. } = joint else { continue };
        let (coefficient, length) = (random.within(0.0, 0.4), random.within(0.005, 0.03));
        let law = match kind {
            JointKind::Revolute => JointFriction::Journal { coefficient, journal_radius: length },
            JointKind::Prismatic { .. } => {
                JointFriction::Guide { coefficient: 0.3 * coefficient, half_length: 20.0 * length }
            }
            JointKind::Fixed { .. } => continue,
        };
        *friction = (random.unit() < 0.8).then_some(law);
    }
    Mechanism::compile(&scene).ok().filter(|mechanism| !mechanism.dry_joints.is_empty())
}

/// The dynamics in the state of a case, where every joint sticks or slides; `None` where friction has not one solution. The
/// case gets the velocities of that state: without those of the joints that stick, which may depend on one another.
pub(crate) fn dry<'m>(
    case: &mut Case,
    mechanism: &'m Mechanism,
    random: &mut Random,
) -> Option<Dynamics<'m>> {
    let mut dynamics = Dynamics::new(mechanism);
    dynamics.phases.clone_from(&case.phases);
    dynamics.move_to(case.t, &case.q, &case.v);
    for index in 0..mechanism.dry_joints.len() {
        match random.index(3) {
            0 => dynamics.stick_joint(index),
            place => dynamics.set_joint_phase(index, JointPhase::Slides(2.0 * place as f64 - 3.0)),
        }
    }
    if !dynamics.find_friction() {
        return None;
    }
    dynamics.hold_still(&mut case.q, &mut case.v);
    let mut a = vec![0.0; case.q.len()];
    let has_one = dynamics.acceleration(case.t, &case.q, &case.v, &mut a);
    // What nothing can hold does not stick.
    let holds = (0..mechanism.dry_joints.len()).all(|joint| dynamics.dry_fraction(joint).is_finite());
    (has_one && holds).then_some(dynamics)
}

/// A four-bar, whose loop is closed by a cut joint, in random states.
pub(crate) fn closed_cases(scene: &Scene, random: &mut Random) -> Vec<Case> {
    let mechanism = compile(scene);
    let mut states = std::iter::repeat_with(|| {
        let mut q: Vec<f64> = mechanism.start.q.iter().map(|q| q + random.within(-0.3, 0.3)).collect();
        let mut v: Vec<f64> = q.iter().map(|_| random.within(-3.0, 3.0)).collect();
        let scales = Scales { levers: vec![1.0; 3], ..mechanism.scales.clone() };
        Dynamics::new(&mechanism).project(0.0, &mut q, &mut v, &scales)?;
        Some((q, v))
    });
    let states: Vec<_> = states.by_ref().flatten().take(30).collect();
    let case = |(q, v)| Case {
        scene: scene.clone(),
        mechanism: mechanism.clone(),
        t: 0.0,
        q,
        v,
        phases: Vec::new(),
        inertias: Vec::new(),
        regimes: Vec::new(),
    };
    states.into_iter().map(case).collect()
}

#[test]
fn linearization_agrees_with_differences() {
    let mut random = Random(81);
    let mut seen = 0;
    let closed = closed_cases(&four_bar(None), &mut random);
    for (index, mut case) in moving_cases().into_iter().chain(closed).enumerate() {
        let Some(mechanism) = with_friction(&case, &mut random) else { continue };
        let Some(mut dynamics) = dry(&mut case, &mechanism, &mut random) else { continue };
        // Short steps, since a guide changes its law where force and moment are equal.
        assert_linearization(&mut dynamics, &case, index, 0.04);
        seen += 1;
    }
    assert!(seen > 200, "{seen}");
}

#[test]
fn friction_follows_from_the_reactions_that_balance() {
    let mut random = Random(82);
    let (mut seen, mut slides, mut sticks) = (0, 0, 0);
    let closed = closed_cases(&four_bar(None), &mut random);
    for (index, mut case) in moving_cases().into_iter().chain(closed).enumerate() {
        let Some(mechanism) = with_friction(&case, &mut random) else { continue };
        let Some(mut dynamics) = dry(&mut case, &mechanism, &mut random) else { continue };
        let mut a = vec![0.0; case.q.len()];
        assert!(dynamics.acceleration_and_contacts(case.t, &case.q, &case.v, &mut a));
        dynamics.accelerate(&a);
        dynamics.find_reactions();
        let rest = dynamics.unbalanced();
        let reactions = (0..mechanism.ideal_joints.len()).map(|joint| dynamics.reaction(joint));
        let size =
            reactions.map(|reaction| reaction.force.norm() + reaction.moment.abs()).fold(1.0, f64::max);
        assert!(rest.force.norm().max(rest.moment.abs()) <= 1e-9 * size, "case {index}: {rest:?}");
        let powers = [dynamics.input_power(), dynamics.balanced_power()];
        assert!(
            (powers[0] - powers[1]).abs() <= 1e-8 * powers[0].abs().max(size),
            "case {index}: {powers:?}"
        );
        for (dry, joint) in mechanism.dry_joints.iter().enumerate() {
            let JointPhase::Slides(direction) = dynamics.joint_phases()[dry] else {
                // Drives move what they prescribe.
                if dynamics.dry_inertia(dry).is_infinite() {
                    continue;
                }
                let turning = dynamics.dry_acceleration(dry).abs();
                let largest = a.iter().fold(1.0_f64, |largest, a| largest.max(a.abs()));
                assert!(turning <= 1e-12 * largest, "case {index}: {turning:e} of {largest:e}");
                sticks += 1;
                continue;
            };
            let reaction = dynamics.reaction(joint.joint);
            let limit = match joint.law {
                JointFriction::Journal { coefficient, journal_radius } => {
                    coefficient / (1.0 + coefficient * coefficient).sqrt()
                        * journal_radius
                        * reaction.force.norm()
                }
                JointFriction::Guide { coefficient, half_length } => {
                    let axis = dynamics.frame(joint.columns[0].0 + 1).axis;
                    coefficient * axis.perp(&reaction.force).abs().max(reaction.moment.abs() / half_length)
                }
            };
            let off = (dynamics.dry_effort(dry) + direction * limit).abs();
            assert!(off <= 1e-9 * size, "case {index}: {off:e} of {size:e}");
            slides += 1;
        }
        seen += 1;
    }
    assert!(seen > 50 && slides > 100 && sticks > 50, "{seen}, {slides} and {sticks}");
}
