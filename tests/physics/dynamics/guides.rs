//! Contacts at faces, on random mechanisms: derivatives by differences, reactions and powers by their balances.

use chebclear::contact::face::Face;
use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::contact::pair::{ContactLaw, Phase, SlidingVelocity, Surfaces};
use chebclear::dynamics::{Dynamics, Linearization};
use chebclear::mechanism::compiled::Mechanism;
use chebclear::tree::elements::{ContactScales, ContactSlot, FramePoint};
use nalgebra::Vector2;

use crate::dynamics::cartesian::{added, largest, moving_cases};
use crate::dynamics::random_trees::Case;
use crate::support::{Random, derivative};

/// The radius of an edge and how far it is beyond the end of its face: a corner, a pin, a pin that rolls around an end.
type Edge = (f64, f64);
const WITHOUT_ENDS: [Edge; 2] = [(0.0, f64::NEG_INFINITY), (0.07, f64::NEG_INFINITY)];
const ALL: [Edge; 3] = [WITHOUT_ENDS[0], WITHOUT_ENDS[1], (0.07, 0.03)];

fn with_faces_and_ends(case: &Case, random: &mut Random) -> (Mechanism, Vec<Phase>) {
    with_edges(case, random, &ALL)
}

/// The case with faces without ends, of a corner and of a pin.
pub(crate) fn with_faces(case: &Case, random: &mut Random) -> (Mechanism, Vec<Phase>) {
    with_edges(case, random, &WITHOUT_ENDS)
}

/// The case with edges at faces between its first and its last body, or ground, that touch.
fn with_edges(case: &Case, random: &mut Random, edges: &[Edge]) -> (Mechanism, Vec<Phase>) {
    let mut mechanism = case.mechanism.clone();
    let mut phases = case.phases.clone();
    let last = mechanism.tree.bodies.len() - 1;
    let bodies = if random.unit() < 0.3 { [None, Some(last)] } else { [Some(last), Some(0)] };
    for &(radius, beyond) in edges {
        let points = bodies.map(|body| FramePoint {
            frame: body.map_or(0, |body| mechanism.tree.bodies[body].frame),
            offset: Vector2::new(random.within(-0.3, 0.3), random.within(-0.3, 0.3)),
        });
        let angle = random.within(-3.0, 3.0);
        let normal = [angle.cos(), angle.sin()];
        let mut dynamics = Dynamics::new(&mechanism.tree);
        dynamics.move_to(case.t, &case.q, &case.v);
        let [a, b] = points.map(|point| dynamics.point(point).position);
        let into = dynamics.frame(points[0].frame).to_world(Vector2::from(normal));
        // The edge lies a hundredth deep in the face, or is deeper than that beyond its end.
        let limit = into.dot(&(b - a)) - 0.01;
        let place = into.perp(&(b - a)).abs();
        let half_length = place - beyond.min(0.5 * place);
        let limit = if half_length.is_finite() { limit - 0.02 } else { limit };
        let friction = FrictionLaw::SmoothedCoulomb { coefficient: 0.3, velocity: 0.8 };
        let law = ContactLaw {
            surfaces: Surfaces::Face(Face { normal, limit, radius, size: 0.1, half_length }),
            clearance: 0.01,
            normal: NormalLaw {
                stiffness: 4e3,
                exponent: 1.5,
                damping: Damping::HuntCrossley { hysteresis_factor: 0.05 },
            },
            friction: (random.unit() < 0.7).then_some(friction),
            sliding: SlidingVelocity::Surface,
        };
        phases.push(Phase::Contact { latch: law.normal.latch(1.0), clipped: false, traction: None });
        let name = format!("face {radius} {beyond}");
        mechanism.tree.slots.push(ContactSlot {
            name,
            points,
            bodies,
            law,
            impact_velocity_floor: None,
            neighbor: None,
            backlash: None,
            is_aside: false,
        });
        let scales = ContactScales {
            component: 0,
            mass: 1.0,
            resting_penetration: 1.0,
            resting_speed: 1.0,
            resting_velocity: 1.0,
        };
        mechanism.scales.contacts.push(scales);
    }
    (mechanism, phases)
}

/// A case with something added to its mechanism, and the phases of all contacts.
pub(crate) type Altered = fn(&Case, &mut Random) -> (Mechanism, Vec<Phase>);

/// Checks the linearization in the state of a case by differences, with steps of a part of the usual ones.
pub(crate) fn assert_linearization(dynamics: &mut Dynamics, case: &Case, index: usize, part: f64) {
    let (t, q, v) = (case.t, &case.q, &case.v);
    let d = q.len();
    let mut exact = Linearization::new(d);
    assert!(dynamics.linearize(t, q, v, &mut exact));
    let mut acceleration = |t: f64, q: &[f64], v: &[f64]| {
        let mut a = vec![0.0; d];
        assert!(dynamics.acceleration(t, q, v, &mut a));
        a
    };
    let mut blocks =
        [(&exact.a_q, vec![0.0; d * d]), (&exact.a_v, vec![0.0; d * d]), (&exact.a_t, vec![0.0; d])];
    for k in 0..d {
        let mut unit = vec![0.0; d];
        unit[k] = part;
        let by_q = derivative(|h| acceleration(t, &added(q, h, &unit), v));
        let by_v = derivative(|h| acceleration(t, q, &added(v, h, &unit)));
        for row in 0..d {
            (blocks[0].1[row * d + k], blocks[1].1[row * d + k]) = (by_q[row], by_v[row]);
        }
    }
    blocks[2].1 = derivative(|h| acceleration(t + part * h, q, v));
    for (exact_values, differences) in blocks {
        let size = largest(exact_values).max(largest(&exact.a)).max(1.0);
        let errors = exact_values.iter().zip(&differences).map(|(exact, by)| (exact - by / part).abs());
        // One that is not finite is not the largest.
        assert!(exact_values.iter().all(|exact| exact.is_finite()), "case {index}");
        let worst = errors.fold(0.0, f64::max);
        assert!(worst <= 1e-6 * size, "case {index}: {worst:e} of {size:e}");
    }
}

#[test]
fn linearization_agrees_with_differences() {
    compare_with_differences(with_faces_and_ends);
}

/// Compares the derivatives of the accelerations of altered cases without other contacts with differences.
pub(crate) fn compare_with_differences(altered: Altered) {
    let mut random = Random(61);
    let mut seen = 0;
    for (index, case) in moving_cases().iter().enumerate() {
        if case.phases.iter().any(|phase| *phase != Phase::Free) {
            continue;
        }
        let (mechanism, phases) = altered(case, &mut random);
        let mut dynamics = Dynamics::new(&mechanism);
        dynamics.phases.clone_from(&phases);
        assert_linearization(&mut dynamics, case, index, 1.0);
        seen += 1;
    }
    assert!(seen > 20, "{seen}");
}

#[test]
fn reactions_balance_and_powers_agree() {
    check_balances(with_faces_and_ends);
}

/// Checks that the reactions of altered cases balance and that their powers agree.
pub(crate) fn check_balances(altered: Altered) {
    let mut random = Random(62);
    for (index, case) in moving_cases().iter().enumerate() {
        let (mechanism, phases) = altered(case, &mut random);
        let mut dynamics = Dynamics::new(&mechanism);
        dynamics.phases.clone_from(&phases);
        let mut a = vec![0.0; case.q.len()];
        assert!(dynamics.acceleration_and_contacts(case.t, &case.q, &case.v, &mut a));
        dynamics.accelerate(&a);
        dynamics.find_reactions();
        let rest = dynamics.unbalanced();
        let contacts = (0..phases.len()).map(|slot| dynamics.contact(slot).state.normal_force.abs());
        let size = contacts.fold(1.0, f64::max);
        assert!(rest.force.norm().max(rest.moment.abs()) <= 1e-9 * size, "case {index}: {rest:?}");
        let powers = [dynamics.input_power(), dynamics.balanced_power()];
        let off = (powers[0] - powers[1]).abs();
        assert!(off <= 1e-8 * powers[0].abs().max(size), "case {index}: {powers:?}");
    }
}
