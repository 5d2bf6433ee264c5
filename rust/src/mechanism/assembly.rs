//! Assembly: from initial guesses of the angles to a start with every clearance joint concentric in
//! position and velocity, and the scales for error control.

use crate::numerics::accuracy::{EQUAL, NEWTON_STEPS, ROUNDING_OF_SOLUTION, SINGULAR};
use nalgebra::{DMatrix, DVector};

use crate::dynamics::Dynamics;
use crate::error::{InputError, Notice, Problem, Subject};
use crate::mechanism::branch::differs;
use crate::mechanism::closing::{Closing, given_angle};
use crate::mechanism::conditions::{Conditions, Level};
use crate::mechanism::couplings::{check_couplings, check_laws, follow_drivers, offsets};
use crate::mechanism::immovable::no_acceleration;
use crate::mechanism::nearest::Assembly;
use crate::mechanism::scales::{contact_scales, length_of_motion, levers, speed_from_rest, speed_scale};
use crate::numerics::turns::wrap;
use crate::scene::components::Components;
use crate::scene::parts::{Scene, Start};
use crate::tree::elements::{ComponentScales, Realization, Scales, State, Tree};
use crate::tree::kinematics::FrameKind;

/// An assembled mechanism.
pub(crate) struct Assembled {
    pub(crate) start: State,
    pub(crate) scales: Scales,
    /// The signs of its branch.
    pub(crate) branch: Vec<i8>,
    /// What is added in every coupling [rad or m].
    pub(crate) offsets: Vec<f64>,
    /// What should be checked: another assembly about as near, sizes that nothing gives.
    pub(crate) warnings: Vec<Notice>,
}

/// The tree of a checked scene, without the friction in its joints, and its start.
pub(crate) fn assembled_tree(scene: &Scene, preferred: &[i8]) -> Result<(Tree, Assembled), InputError> {
    let mut components = Components::of_scene(scene);
    let unknown: Vec<usize> =
        (0..components.lengths.len()).filter(|&index| components.lengths[index] == 0.0).collect();
    let mut warnings = Vec::new();
    if !unknown.is_empty() {
        // All points of these coincide: any size will do for their assembly.
        unknown.iter().for_each(|&index| components.lengths[index] = 1.0);
        let tree = Tree::span(scene, &components)?;
        let Assembled { start, .. } = assemble(&tree, scene, preferred)?;
        for index in unknown {
            components.lengths[index] = length_of_motion(&tree, &start, index).unwrap_or_else(|notice| {
                warnings.extend(notice);
                1.0
            });
        }
    }
    let tree = Tree::span(scene, &components)?;
    let mut assembled = assemble(&tree, scene, preferred)?;
    assembled.warnings.extend(warnings);
    Ok((tree, assembled))
}

/// The start of a tree nearest to the given angles; of those that are about equally near the one on a branch that is
/// preferred, if there is one.
// Long because each reason why there is no start has its message.
fn assemble(tree: &Tree, scene: &Scene, preferred: &[i8]) -> Result<Assembled, InputError> {
    let length = tree.components.largest();
    let d = tree.free.len();
    let mut dynamics = Dynamics::new(tree);
    let mut conditions = Conditions::new(tree, scene, length);
    let (q, warning) = match close_nearest(&mut dynamics, scene, &mut conditions, preferred) {
        Ok(closed) => closed,
        Err(residual) => {
            check_laws(&dynamics)?;
            let message = format!(
                "the mechanism cannot be assembled with its loops closed and its clearance joints {}: from the \
                 given angles a gap of {residual:.3e} m remains; check the lengths and the initial guesses of the \
                 angles of the bodies{}{}",
                if scene.start.is_empty() { "concentric" } else { "as the start says" },
                if scene.start.is_empty() {
                    ""
                } else {
                    "; the start may also contradict itself or the drives"
                },
                excess(tree)
            );
            return Err(Subject::Scene.error("bodies", message));
        }
    };
    dynamics.move_to(0.0, &q, &vec![0.0; d]);
    check_couplings(&dynamics, length)?;
    let offsets = offsets(&dynamics);
    conditions.open_plays(&dynamics, Level::Velocity);
    let v = close_velocities(&mut dynamics, &conditions, &q)?;
    check_directions(tree, &dynamics, length)?;
    dynamics.settle_switches();
    if let Some(fault) = dynamics.fault_of_loads() {
        return Err(Subject::Scene.error("forces", format!("at the start {fault}")));
    }
    let lengths = &tree.components.lengths;
    let mut speeds: Vec<f64> = (0..lengths.len()).map(|index| speed_scale(tree, &dynamics, index)).collect();
    check_mobility(tree, &dynamics, &conditions)?;
    let levers = levers(tree, &dynamics, &conditions.of_freedoms);
    let mut accelerations = vec![0.0; d];
    if !dynamics.acceleration(0.0, &q, &v, &mut accelerations) {
        return Err(no_acceleration(tree, &mut dynamics, &v));
    }
    dynamics.accelerate(&accelerations);
    for (index, speed) in speeds.iter_mut().enumerate().filter(|(_, speed)| **speed <= 0.0) {
        *speed = speed_from_rest(tree, &dynamics, index);
    }
    let contacts = contact_scales(&mut dynamics, &speeds);
    let components = lengths.iter().zip(speeds).map(|(&length, speed)| ComponentScales { length, speed });
    let branch = conditions.branch(&dynamics);
    Ok(Assembled {
        start: State { q, v },
        scales: Scales {
            components: components.collect(),
            of_freedoms: conditions.of_freedoms,
            levers,
            contacts,
        },
        branch,
        offsets,
        warnings: warning.into_iter().collect(),
    })
}

// Long because the ways to a start and the choice among them belong together.
/// The coordinates that close the loops nearest to the given angles, with a warning where there are two; otherwise the
/// gap [m] that remains.
///
/// Newton's method starts from the initial guess. Its result is kept where no other can be nearer, or if it is the
/// nearest one of a search.
fn close_nearest(
    dynamics: &mut Dynamics,
    scene: &Scene,
    conditions: &mut Conditions,
    preferred: &[i8],
) -> Result<(Vec<f64>, Option<Notice>), f64> {
    let mut guess = initial_guess(dynamics.tree, scene);
    dynamics.move_to(0.0, &guess, &vec![0.0; guess.len()]);
    conditions.open_plays(dynamics, Level::Position);
    follow_drivers(dynamics, conditions, &mut guess);
    let (q, residual) = close_from(dynamics, conditions, &guess);
    let tolerance = ROUNDING_OF_SOLUTION * conditions.length;
    let closes = |residual: f64| residual <= tolerance;
    // The search for nearer poses knows of no couplings.
    if closes(residual) && conditions.couplings(dynamics.tree, Level::Position).next().is_some() {
        return Ok((q, None));
    }
    let closing = Closing::new(dynamics, scene, conditions, &guess);
    let loops = &closing.loops;
    let unknowns = closing.unknowns(&q);
    let mut first = loops.assembly(&unknowns);
    let is_certain = closes(residual) && loops.is_certainly_nearest(&unknowns);
    // Where a mechanism can move, Newton's method ends beside the nearest point. Without a threshold but rounding: the
    // runs of a study must not jump from the one to the other.
    let settles = closes(residual) && (!is_certain || loops.can_move());
    let settled = if settles { loops.settled(&unknowns) } else { None };
    if let Some(nearer) =
        settled.as_ref().filter(|settled| settled.distance + ROUNDING_OF_SOLUTION < first.distance)
    {
        first = nearer.clone();
    }
    if is_certain {
        let mut at = closing.coordinates(&first.unknowns);
        let moved = first.unknowns != unknowns && closes(close_positions(dynamics, conditions, &mut at));
        return Ok((if moved { at } else { q }, None));
    }
    let found = loops.search(&unknowns);
    let mut ways: Vec<(Assembly, Vec<f64>)> = Vec::new();
    for way in found {
        let is_first = first.is_about_as_near_as(&way)
            && settled.as_ref().is_some_and(|settled| !loops.differ(settled, &way));
        let way = if is_first { first.clone() } else { way };
        let mut at = closing.coordinates(&way.unknowns);
        if is_first && way.unknowns == unknowns {
            at.copy_from_slice(&q);
        } else if !closes(close_positions(dynamics, conditions, &mut at)) {
            continue;
        }
        ways.push((way, at));
    }
    if ways.is_empty() && closes(residual) {
        ways.push((first, q));
    }
    let at_rest = vec![0.0; guess.len()];
    let is_preferred = |(_, at): &(Assembly, Vec<f64>)| {
        dynamics.move_to(0.0, at, &at_rest);
        !differs(preferred, &conditions.branch(dynamics))
    };
    let place = ways.iter().position(is_preferred).unwrap_or(0);
    if ways.is_empty() {
        return Err(residual);
    }
    let (taken, q) = ways.swap_remove(place);
    let other = ways.iter().find(|(way, _)| loops.differ(way, &taken));
    let warning = other.map(|(_, other)| two_ways(dynamics, scene, &q, other));
    Ok((q, warning))
}

/// The coordinates at which Newton's method ends from a guess, and the gap [m] that remains.
fn close_from(dynamics: &mut Dynamics, conditions: &Conditions, guess: &[f64]) -> (Vec<f64>, f64) {
    let mut q = guess.to_vec();
    slide_together(dynamics, conditions, &mut q);
    let mut residual = close_positions(dynamics, conditions, &mut q);
    if residual.is_nan() || residual > ROUNDING_OF_SOLUTION * conditions.length {
        // From the translated position Newton's method may stall where the initial guess does not.
        q.copy_from_slice(guess);
        residual = close_positions(dynamics, conditions, &mut q);
    }
    (q, residual)
}

/// Warning that loops close as well in another way, whose coordinates are given, with the body that shows it best.
fn two_ways(dynamics: &mut Dynamics, scene: &Scene, q: &[f64], other: &[f64]) -> Notice {
    let at_rest = vec![0.0; q.len()];
    let mut angles = [q, other].map(|q| {
        dynamics.move_to(0.0, q, &at_rest);
        let bodies = dynamics.tree.bodies.iter();
        bodies.map(|body| wrap(dynamics.frame(body.frame).angle + body.angle).0).collect::<Vec<f64>>()
    });
    let [taken, other] = &mut angles;
    let apart = |&body: &usize| wrap(taken[body] - other[body]).0.abs();
    // The first of those that differ by the same angle, whatever the rounding.
    let most = (0..scene.bodies.len()).map(|body| apart(&body)).fold(0.0, f64::max);
    let body = (0..scene.bodies.len()).find(|body| apart(body) >= most * (1.0 - EQUAL)).unwrap_or(0);
    let name = scene.bodies.get(body).map_or("", |body| &body.name);
    Notice::of_field(
        "two_assemblies",
        format!("bodies[{body}].angle"),
        vec![("taken", taken[body]), ("other", other[body])],
        format!(
            "two ways to close the loops are about equally near to the given angles, with {name:?} at {:.4} and at \
             {:.4} [rad]; it starts at the first: give angles nearer to the way that is meant",
            taken[body], other[body]
        ),
    )
}

/// Checks that no spring with a natural length, and no damper, starts with its two points in one place, where
/// it has no direction: that of a distance to which loops are closed is a rounding error.
fn check_directions(tree: &Tree, dynamics: &Dynamics, length: f64) -> Result<(), InputError> {
    let lost = tree.links().filter(|(_, points, link)| {
        let [a, b] = points.map(|point| dynamics.point(point).position);
        link.indistinct > 0.0 && (b - a).norm() <= ROUNDING_OF_SOLUTION * length
    });
    let problems: Vec<Problem> = lost
        .map(|(element, ..)| {
            Problem::new(
                "forces",
                format!(
                    "the two points of {:?} coincide at the start: its force has no direction there; start elsewhere",
                    element.name
                ),
            )
        })
        .collect();
    Subject::Scene.judge((), problems)
}

/// Checks that every closure adds two independent equations: otherwise a joint is redundant
/// (its forces are undetermined) or the configuration is a change point. Also checks that something can move.
fn check_mobility(tree: &Tree, dynamics: &Dynamics, conditions: &Conditions) -> Result<(), InputError> {
    let (_, jacobian) = conditions.positions(dynamics);
    for (index, closure) in tree.closures.iter().enumerate() {
        let component = tree.components.of(closure.bodies);
        let earlier = tree.closures[..=index].iter().enumerate();
        let connected = earlier.filter(|(_, other)| tree.components.of(other.bodies) == component);
        let rows: Vec<usize> = connected.flat_map(|(other, _)| [2 * other, 2 * other + 1]).collect();
        let columns = conditions.freedoms_of(component.unwrap_or_default());
        let part = jacobian.select_rows(&rows).select_columns(&columns);
        let rank = if part.ncols() == 0 { 0 } else { part.clone().rank(SINGULAR * part.amax()) };
        if rank < rows.len() {
            let message = format!(
                "joint {:?} closes a loop that the other joints and drives already keep closed, in the assembled \
                 configuration: it is redundant (remove it or give it clearance), or the mechanism starts at a \
                 change point with links in line (start it elsewhere){}",
                closure.name,
                excess(tree)
            );
            return Err(Subject::Scene.error("joints", message));
        }
    }
    // The closures are independent here, so counting decides.
    if tree.mobility() == 0 && tree.driven.is_empty() {
        return Err(Subject::Scene.error(
            "joints",
            "the scene is a structure: its joints fix every body and nothing is driven, so nothing can move; \
             remove a joint or give one clearance",
        ));
    }
    Ok(())
}

/// Addition to an error message where the loops have more equations than there are free coordinates.
fn excess(tree: &Tree) -> String {
    let (free, equations) = (tree.free.len(), tree.closed_rows().sum::<usize>());
    if equations <= free {
        return String::new();
    }
    let closures = tree.closures.iter().map(|closure| &closure.name);
    let couplings = tree.couplings.iter().map(|coupling| &coupling.name);
    let names: Vec<String> = closures.chain(couplings).map(|name| format!("{name:?}")).collect();
    format!(
        "; the loops closed by {} give {equations} equations for {free} free coordinate{}: there is one joint or drive \
         too many",
        names.join(" and "),
        if free == 1 { "" } else { "s" }
    )
}

/// Free coordinates that give the bodies the guessed angles, or those that the start gives with all their turns:
/// springs count them, and what follows meets them up to full turns only.
fn initial_guess(tree: &Tree, scene: &Scene) -> Vec<f64> {
    let mut angles = vec![0.0; tree.frames.len()];
    let mut coordinates = vec![0.0; tree.frames.len()];
    for (index, frame) in tree.frames.iter().enumerate().skip(1) {
        angles[index] = angles[frame.parent];
        if frame.kind != FrameKind::Revolute {
            continue;
        }
        let driven = tree.driven.iter().find(|driven| driven.column == index - 1);
        let wanted = tree
            .bodies
            .iter()
            .zip(&scene.bodies)
            // The body on the joint itself: bodies fixed to it have their origin elsewhere.
            .filter(|(placed, _)| placed.frame == index)
            .min_by_key(|(placed, _)| !placed.owns_frame)
            .map_or(angles[index], |(placed, body)| given_angle(scene, body) - placed.angle);
        coordinates[index] = match driven {
            Some(driven) => driven.sign * driven.motion.at(0.0)[0],
            None => given_turn(tree, scene, index - 1).unwrap_or(wanted - angles[index]),
        };
        angles[index] += coordinates[index];
    }
    tree.free.iter().map(|&column| coordinates[column + 1]).collect()
}

/// Coordinate of the revolute joint of a column in the `start` of the scene, if it is given there.
fn given_turn(tree: &Tree, scene: &Scene, column: usize) -> Option<f64> {
    scene.start.iter().find_map(|start| {
        let Start::Joint { joint: name, position: Some(position), .. } = start else { return None };
        let joint = tree.ideal_joints.iter().find(|joint| joint.name == *name)?;
        match joint.realization {
            Realization::Tree { column: Some(own), sign, .. } if own == column => Some(sign * position),
            _ => None,
        }
    })
}

/// Least-squares solution of smallest norm; directions with a relative singular value below
/// `cutoff` are left out.
pub(super) fn least_squares(jacobian: DMatrix<f64>, right: &DVector<f64>, cutoff: f64) -> DVector<f64> {
    let columns = jacobian.ncols();
    let largest = jacobian.amax();
    // The decomposition panics on NaN; the remaining gap then reports the failure.
    if largest == 0.0 || right.is_empty() || !jacobian.iter().chain(right).all(|x| x.is_finite()) {
        return DVector::zeros(columns);
    }
    jacobian.svd(true, true).solve(right, cutoff * largest).unwrap_or_else(|_| DVector::zeros(columns))
}

/// Closes the gaps as far as translations alone can: the scene gives angles and no positions, so a body
/// without ideal joints keeps its angle. Gaps are linear in the translations.
fn slide_together(dynamics: &mut Dynamics, conditions: &Conditions, q: &mut [f64]) {
    let tree = dynamics.tree;
    dynamics.move_to(0.0, q, &vec![0.0; q.len()]);
    let (residual, mut jacobian) = conditions.positions(dynamics);
    for (k, &column) in tree.free.iter().enumerate() {
        if tree.frames[column + 1].kind == FrameKind::Revolute {
            jacobian.column_mut(k).fill(0.0);
        }
    }
    let step = conditions.solve(jacobian, &residual, ROUNDING_OF_SOLUTION);
    for (k, value) in q.iter_mut().enumerate() {
        *value -= step[k] * conditions.units[k];
    }
}

/// Newton's method with step halving on the conditions; returns the remaining residual [m].
fn close_positions(dynamics: &mut Dynamics, conditions: &Conditions, q: &mut [f64]) -> f64 {
    let at_rest = vec![0.0; q.len()];
    dynamics.move_to(0.0, q, &at_rest);
    let (mut residual, mut jacobian) = conditions.positions(dynamics);
    for _ in 0..NEWTON_STEPS {
        let size = residual.norm();
        if size == 0.0 {
            break;
        }
        let step = conditions.solve(jacobian, &residual, ROUNDING_OF_SOLUTION);
        let mut trial = q.to_vec();
        let mut fraction = 1.0;
        loop {
            for (k, value) in trial.iter_mut().enumerate() {
                *value = q[k] - fraction * step[k] * conditions.units[k];
            }
            dynamics.move_to(0.0, &trial, &at_rest);
            (residual, jacobian) = conditions.positions(dynamics);
            if residual.norm() < size {
                break;
            }
            fraction *= 0.5;
            // No shorter step reduces the residual: it is at rounding level, or the gap cannot be closed.
            if fraction < 1e-6 {
                return size * conditions.unit;
            }
        }
        q.copy_from_slice(&trial);
    }
    residual.norm() * conditions.unit
}

/// Rates of a start that differ by this part of the largest from those that the joints allow are given to a few
/// digits; beyond it they contradict each other. Half and twice change nothing.
const DIGITS: f64 = 1e-2;

// Long because least squares, the check of the given rates and its words belong together.
/// Velocities of smallest norm that satisfy the conditions; where given rates do not quite agree, those that the joints
/// allow nearest to them.
fn close_velocities(
    dynamics: &mut Dynamics,
    conditions: &Conditions,
    q: &[f64],
) -> Result<Vec<f64>, InputError> {
    let tree = dynamics.tree;
    let mut v = vec![0.0; q.len()];
    // The conditions are linear in v: the second pass only removes rounding errors of the first.
    for _ in 0..2 {
        dynamics.move_to(0.0, q, &v);
        let (residual, jacobian) = conditions.velocities(dynamics);
        let step = conditions.solve(jacobian, &residual, SINGULAR);
        for (k, value) in v.iter_mut().enumerate() {
            *value -= step[k] * conditions.units[k];
        }
    }
    dynamics.move_to(0.0, q, &v);
    let (remaining, _) = conditions.velocities(dynamics);
    let speeds = (0..tree.components.lengths.len()).map(|index| speed_scale(tree, dynamics, index));
    let rounding = EQUAL * speeds.fold(0.0, f64::max) / conditions.unit;
    let is_closed = |remaining: &[f64]| remaining.iter().all(|rate| rate.abs() <= rounding);
    if is_closed(remaining.as_slice()) {
        return Ok(v);
    }
    // What the joints demand stands before what the start gives.
    dynamics.move_to(0.0, q, &vec![0.0; q.len()]);
    let (right, jacobian) = conditions.velocities(dynamics);
    let rates = conditions.given_rates(tree);
    let rows = |is_given: bool| -> Vec<usize> {
        (0..rates.len()).filter(|&row| rates[row].is_some() == is_given).collect()
    };
    let [(demands, demanded), (gives, given)] =
        [rows(false), rows(true)].map(|rows| (jacobian.select_rows(&rows), right.select_rows(&rows)));
    let least = least_squares(demands.clone(), &demanded, SINGULAR);
    let open = &demanded - &demands * &least;
    if given.is_empty() || !is_closed(open.as_slice()) {
        // The least-squares solution leaves a gap rate only where no velocity keeps the joints closed: the
        // configuration is singular and the drive acts against it.
        let message = format!(
            "the assembled configuration is singular: no velocity keeps the joints together (remaining rate {:.3e} \
             m/s); start the drive at another angle{}",
            open.amax() * conditions.unit,
            excess(tree)
        );
        return Err(Subject::Scene.error("bodies", message));
    }
    let free = free_directions(demands);
    let more = least_squares(&gives * &free, &(&given - &gives * &least), SINGULAR);
    let step = least + free * more;
    let off = (&given - &gives * &step).amax();
    let largest = rates.iter().flatten().fold(0.0_f64, |largest, rate| largest.max(rate.abs()));
    if off.is_nan() || off > rounding.max(DIGITS * largest) {
        let message = format!(
            "the start contradicts itself or the drives: the rates that the joints allow nearest to the given ones \
             differ by {:.2} % of the largest of these; give fewer rates, or such as agree to two digits",
            100.0 * off / largest
        );
        return Err(Subject::Scene.error("start", message));
    }
    for (k, value) in v.iter_mut().enumerate() {
        *value = -step[k] * conditions.units[k];
    }
    dynamics.move_to(0.0, q, &v);
    Ok(v)
}

/// Projection onto the directions that some conditions leave free.
pub(super) fn free_directions(conditions: DMatrix<f64>) -> DMatrix<f64> {
    let columns = conditions.ncols();
    let cutoff = SINGULAR * conditions.amax();
    let mut free = DMatrix::identity(columns, columns);
    if conditions.is_empty() || !conditions.iter().all(|x| x.is_finite()) {
        return free;
    }
    let svd = conditions.svd(false, true);
    for (value, direction) in svd.singular_values.iter().zip(svd.v_t.iter().flat_map(|v_t| v_t.row_iter())) {
        if *value > cutoff {
            free -= direction.transpose() * direction;
        }
    }
    free
}
