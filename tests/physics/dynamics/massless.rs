//! Bodies without mass or moment of inertia in closed loops: derivatives by differences, and what does not depend on the
//! masses of the rows.

use chebclear::dynamics::Dynamics;
use chebclear::mechanism::compiled::Mechanism;

use crate::dynamics::guides::assert_linearization;
use crate::dynamics::joint_friction::{closed_cases, dry, with_friction};
use crate::dynamics::loops::four_bar;
use crate::dynamics::random_trees::Case;
use crate::support::Random;

/// Four-bars in random states, with massless coupler, rocker or both, with the random numbers that follow.
fn cases(seed: u64) -> (Vec<Case>, Random) {
    let mut random = Random(seed);
    let mut cases = Vec::new();
    for light in [&[1][..], &[2], &[1, 2]] {
        let mut scene = four_bar(None);
        light.iter().for_each(|&body| (scene.bodies[body].mass, scene.bodies[body].inertia) = (0.0, 0.0));
        cases.extend(closed_cases(&scene, &mut random));
    }
    (cases, random)
}

/// Accelerations and reactions in the state of a case.
fn motion(case: &Case, dynamics: &mut Dynamics) -> Vec<f64> {
    let mut a = vec![0.0; case.q.len()];
    assert!(dynamics.acceleration_and_contacts(case.t, &case.q, &case.v, &mut a));
    dynamics.accelerate(&a);
    dynamics.find_reactions();
    for joint in 0..dynamics.tree.ideal_joints.len() {
        let reaction = dynamics.reaction(joint);
        a.extend([reaction.force.x, reaction.force.y, reaction.moment]);
    }
    a
}

#[test]
fn linearization_agrees_with_differences() {
    let (cases, mut random) = cases(91);
    let mut seen = 0;
    for (index, mut case) in cases.into_iter().enumerate() {
        assert_linearization(&mut Dynamics::new(&case.mechanism), &case, index, 1.0);
        let Some(mechanism) = with_friction(&case, &mut random) else { continue };
        let Some(mut dynamics) = dry(&mut case, &mechanism, &mut random) else { continue };
        assert_linearization(&mut dynamics, &case, index, 0.04);
        seen += 1;
    }
    assert!(seen > 30, "{seen}");
}

#[test]
fn motion_reactions_and_projection_do_not_depend_on_the_masses_of_rows() {
    let (cases, mut random) = cases(92);
    let mut seen = 0;
    for case in &cases {
        let Some(mechanism) = with_friction(case, &mut random) else { continue };
        let draws = Random(random.0);
        let same = |mechanism: &Mechanism| {
            let mut case = case.clone();
            let mut dynamics = dry(&mut case, mechanism, &mut Random(draws.0))?;
            let mut found = motion(&case, &mut dynamics);
            let (mut q, mut v) = (case.q.clone(), case.v.clone());
            q.iter_mut().chain(&mut v).for_each(|x| *x += 1e-3);
            dynamics.project(case.t, &mut q, &mut v, &mechanism.scales).unwrap();
            found.extend(q.into_iter().chain(v));
            Some(found)
        };
        let Some(expected) = same(&mechanism) else { continue };
        let with_masses = |factor: f64| {
            let mut other = mechanism.clone();
            let reacting = other.tree.reacting.as_mut().unwrap();
            for masses in [&mut other.tree.row_masses, &mut reacting.tree.row_masses] {
                masses.as_mut().unwrap().iter_mut().for_each(|mass| *mass *= factor);
            }
            same(&other)
        };
        // A joint that needs many times its largest friction need not have one solution: reactions that massless bodies
        // leave zero are rounding errors.
        let others: Option<Vec<_>> = [1e-3, 1e3].into_iter().map(with_masses).collect();
        let Some(others) = others else { continue };
        for (found, expected) in others.iter().flat_map(|found| found.iter().zip(&expected)) {
            assert!((found - expected).abs() <= 1e-8 * expected.abs().max(1.0), "{found} {expected}");
        }
        seen += 1;
    }
    assert!(seen > 30, "{seen}");
}
