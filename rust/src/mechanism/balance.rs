//! Starts at rest in an unstable equilibrium, which only rounding errors set in motion.

use crate::numerics::accuracy::{EQUAL, NEWTON_STEPS};
use nalgebra::{DMatrix, Schur};

use crate::dynamics::{Dynamics, Linearization};
use crate::error::Notice;
use crate::mechanism::assembly::{Assembled, assembled_tree};
use crate::scene::parts::{GuideShape, Joint, JointKind, Scene, Start};
use crate::tree::elements::{Scales, State, Tree};

/// Growth rate of a deviation that counts as unstable, times the time in which the mechanism moves by its own
/// size. A slider pushed along its dead center has 0.3 to 3; in neutral equilibrium rounding gives 1e-8.
/// Half and twice change nothing.
const UNSTABLE: f64 = 1e-3;
/// Warning of a start at rest in an unstable equilibrium. It is judged without clearances: a journal in free
/// flight carries no load, but later carries that of the ideal joint.
pub(crate) fn warning_of_equilibrium(
    tree: &Tree,
    start: &State,
    scales: &Scales,
    scene: &Scene,
) -> Option<Notice> {
    let rests = |scales: &Scales, start: &State, index: usize| {
        let speed = scales.components[index].speed;
        speed > 0.0 && scales.largest(index, &start.v) <= EQUAL * speed
    };
    if !(0..scales.components.len()).any(|index| rests(scales, start, index)) {
        return None;
    }
    let ideal =
        if tree.slots.is_empty() { None } else { Some(assembled_tree(&without_play(scene), &[]).ok()?) };
    let (tree, start, scales) = match &ideal {
        None => (tree, start, scales),
        Some((tree, Assembled { start, scales, .. })) => (tree, start, scales),
    };
    let linear = linearized(tree, start)?;
    let resting = (0..scales.components.len()).filter(|&index| rests(scales, start, index));
    let growth = resting.filter_map(|index| growth(&linear, scales, index)).reduce(f64::max)?;
    let tenfold = std::f64::consts::LN_10 / growth;
    Some(Notice::of_field(
        "unstable_start",
        "start",
        vec![("tenfold", tenfold)],
        format!(
            "the mechanism starts at rest in an unstable equilibrium, such as an upright pendulum or a crank at \
             a dead center: a deviation grows tenfold in {tenfold:.2e} s, and rounding errors alone decide when and in \
             which direction it leaves; start it a little beside"
        ),
    ))
}

/// The motion of a tree linearized about its start, if that has accelerations.
fn linearized(tree: &Tree, State { q, v }: &State) -> Option<Linearization> {
    let mut dynamics = Dynamics::new(tree);
    dynamics.move_to(0.0, q, v);
    dynamics.settle_switches();
    let mut linear = Linearization::new(tree.degrees_of_freedom());
    dynamics.linearize(0.0, q, v, &mut linear).then_some(linear)
}

/// Rate [1/s] at which a deviation of a component from the start grows, if that is an unstable equilibrium.
fn growth(linear: &Linearization, scales: &Scales, component: usize) -> Option<f64> {
    let freedoms: Vec<usize> =
        (0..scales.levers.len()).filter(|&k| scales.of_freedoms[k] == component).collect();
    let (d, all) = (freedoms.len(), scales.levers.len());
    let of = &scales.components[component];
    let crossing = of.crossing();
    let acceleration = of.length / (crossing * crossing);
    if d == 0 || scales.largest(component, &linear.a) > EQUAL * acceleration {
        return None;
    }
    // (q, v)' = (v, a_q q + a_v v), in units of the crossing time.
    let matrix =
        DMatrix::from_fn(2 * d, 2 * d, |row, column| match (row.checked_sub(d), column.checked_sub(d)) {
            (None, Some(column)) => f64::from(u8::from(row == column)),
            (None, None) => 0.0,
            (Some(row), None) => linear.a_q[freedoms[row] * all + freedoms[column]] * crossing * crossing,
            (Some(row), Some(column)) => linear.a_v[freedoms[row] * all + freedoms[column]] * crossing,
        });
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let eigenvalues = Schur::try_new(matrix, f64::EPSILON, NEWTON_STEPS * d)?.complex_eigenvalues();
    let growth = eigenvalues.iter().map(|value| value.re).fold(0.0, f64::max);
    (growth > UNSTABLE).then_some(growth / crossing)
}

/// The scene with ideal joints in place of clearance joints.
fn without_play(scene: &Scene) -> Scene {
    let joints = scene.joints.iter().map(|joint| match joint {
        Joint::Clearance { name, bearing, journal, .. } => Joint::Ideal {
            name: name.clone(),
            a: bearing.clone(),
            b: journal.clone(),
            kind: JointKind::Revolute,
            friction: None,
        },
        // Without its faces a pin in a slot would be free, and a stop never acts in an equilibrium.
        Joint::Guide { name, a, b, axis, shape: GuideShape::Block { angle, .. }, .. } => Joint::Ideal {
            name: name.clone(),
            a: a.clone(),
            b: b.clone(),
            kind: JointKind::Prismatic { axis: *axis, angle: *angle },
            friction: None,
        },
        Joint::Ideal { .. } | Joint::Guide { .. } => joint.clone(),
    });
    let with_play = |start: &&Start| matches!(start, Start::Clearance { .. } | Start::Guide { .. });
    let start = scene.start.iter().filter(|start| !with_play(start)).cloned();
    Scene { joints: joints.collect(), start: start.collect(), ..scene.clone() }
}
