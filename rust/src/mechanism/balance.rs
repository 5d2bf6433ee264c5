//! Starts at rest in an unstable equilibrium, which only rounding errors set in motion.

use crate::numerics::accuracy::{EQUAL, NEWTON_STEPS};
use nalgebra::{DMatrix, Schur};

use crate::dynamics::{Dynamics, Linearization};
use crate::error::Notice;
use crate::mechanism::assembly::{Assembled, assemble};
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
    let rests =
        start.v.iter().zip(&scales.levers).all(|(v, lever)| (v * lever).abs() <= EQUAL * scales.speed);
    if !rests || scales.speed == 0.0 {
        return None;
    }
    let growth = if tree.slots.is_empty() {
        growth(tree, start, scales)?
    } else {
        let scene = without_play(scene);
        let ideal = Tree::span(&scene).ok()?;
        let Assembled { start, scales, .. } = assemble(&ideal, &scene, &[]).ok()?;
        growth(&ideal, &start, &scales)?
    };
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

/// Rate [1/s] at which a deviation from the start grows, if the start is an unstable equilibrium.
fn growth(tree: &Tree, start: &State, scales: &Scales) -> Option<f64> {
    let d = tree.degrees_of_freedom();
    let State { q, v } = start;
    let mut dynamics = Dynamics::new(tree);
    dynamics.move_to(0.0, q, v);
    dynamics.settle_switches();
    let mut linear = Linearization::new(d);
    let crossing = scales.length / scales.speed;
    let solved = dynamics.linearize(0.0, q, v, &mut linear);
    let acceleration = scales.length / (crossing * crossing);
    let balanced =
        linear.a.iter().zip(&scales.levers).all(|(a, lever)| (a * lever).abs() <= EQUAL * acceleration);
    if d == 0 || !solved || !balanced {
        return None;
    }
    // (q, v)' = (v, a_q q + a_v v), in units of the crossing time.
    let matrix =
        DMatrix::from_fn(2 * d, 2 * d, |row, column| match (row.checked_sub(d), column.checked_sub(d)) {
            (None, Some(column)) => f64::from(u8::from(row == column)),
            (None, None) => 0.0,
            (Some(row), None) => linear.a_q[row * d + column] * crossing * crossing,
            (Some(row), Some(column)) => linear.a_v[row * d + column] * crossing,
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
