//! Assembly: from initial guesses of the angles to a start with every clearance joint concentric in
//! position and velocity, and the scales for error control.

use nalgebra::{DMatrix, DVector};

use crate::dynamics::Dynamics;
use crate::error::{InputError, Problem, Subject};
use crate::mechanism::branch::{Group, branch};
use crate::mechanism::immovable::no_acceleration;
use crate::mechanism::scales::{contact_scales, length_scale, levers, speed_from_rest, speed_scale};
use crate::numerics::turns::unwind;
use crate::scene::parts::{Scene, Start};
use crate::tree::elements::{FramePoint, IdealKind, Realization, Scales, State, Tree};
use crate::tree::kinematics::{FrameKind, Vec2};

/// Newton steps after which an assembly fails. A poor initial guess needs about ten; a hundred are needed
/// only next to a singular configuration.
const ITERATIONS: usize = 100;

/// Residual of the closures relative to the size of the mechanism that counts as assembled:
/// a few hundred rounding errors, far below any clearance that could be simulated.
const CLOSED: f64 = 1e-13;

/// The start of a tree, its scales, and the signs of its branch.
pub(crate) fn assemble(tree: &Tree, scene: &Scene) -> Result<(State, Scales, Vec<i8>), InputError> {
    let length = length_scale(scene);
    let guess = initial_guess(tree, scene);
    let d = guess.len();
    let mut dynamics = Dynamics::new(tree);
    let conditions = Conditions::new(tree, scene);
    let mut q = guess.clone();
    slide_together(&mut dynamics, &conditions, &mut q, length);
    let mut residual = close_positions(&mut dynamics, &conditions, &mut q, length);
    if residual.is_nan() || residual > CLOSED * length {
        // From the translated position Newton's method may stall where the initial guess does not.
        q = guess;
        residual = close_positions(&mut dynamics, &conditions, &mut q, length);
    }
    if residual.is_nan() || residual > CLOSED * length {
        return Err(Subject::Scene.error(
            "bodies",
            format!(
                "the mechanism cannot be assembled with its loops closed and its clearance joints {}: from the \
                 given angles a gap of {residual:.3e} m remains; check the lengths and the initial guesses of the angles of the \
                 bodies{}{}",
                if scene.start.is_empty() { "concentric" } else { "as the start says" },
                if scene.start.is_empty() {
                    ""
                } else {
                    "; the start may also contradict itself or the drives"
                },
                excess(tree)
            ),
        ));
    }
    let (v, gap_rate) = close_velocities(&mut dynamics, &conditions, &q, length);
    dynamics.move_to(0.0, &q, &v);
    check_directions(tree, &dynamics, length)?;
    let speed = speed_scale(tree, &dynamics, length);
    // The least-squares solution leaves a gap rate only where no velocity keeps the joints closed: the
    // configuration is singular and the drive acts against it.
    if gap_rate.is_nan() || gap_rate > 1e-9 * speed {
        return Err(Subject::Scene.error(
            "bodies",
            format!(
                "the assembled configuration is singular{}: no velocity keeps the joints together \
                 (remaining rate {gap_rate:.3e} m/s); start the drive at another angle{}",
                if scene.start.is_empty() { "" } else { ", or the start contradicts itself or the drives" },
                excess(tree)
            ),
        ));
    }
    check_mobility(tree, &dynamics, &conditions, length)?;
    let levers = levers(tree, &dynamics);
    let mut accelerations = vec![0.0; d];
    if !dynamics.acceleration(0.0, &q, &v, &mut accelerations) {
        return Err(no_acceleration(tree, &mut dynamics, &v));
    }
    dynamics.accelerate(&accelerations);
    let speed = if speed > 0.0 { speed } else { speed_from_rest(tree, &dynamics, length) };
    let contacts = contact_scales(&mut dynamics, speed, length);
    let branch = conditions.branch(&dynamics, length);
    Ok((State { q, v }, Scales { length, speed, levers, contacts }, branch))
}

/// Checks that no spring with a natural length, and no damper, starts with its two points in one place, where
/// it has no direction: that of a distance to which loops are closed is a rounding error.
fn check_directions(tree: &Tree, dynamics: &Dynamics, length: f64) -> Result<(), InputError> {
    let lost = tree.links.iter().filter(|link| {
        let [a, b] = link.points.map(|point| dynamics.point(point).position);
        let needs_direction = link.length != 0.0 || link.damping != 0.0;
        needs_direction && (b - a).norm() <= CLOSED * length
    });
    let problems: Vec<Problem> = lost
        .map(|link| {
            Problem::new(
                "forces",
                format!(
                    "the two points of {:?} coincide at the start: its force has no direction there; start elsewhere",
                    link.name
                ),
            )
        })
        .collect();
    Subject::Scene.judge((), problems)
}

/// Checks that every closure adds two independent equations: otherwise a joint is redundant
/// (its forces are undetermined) or the configuration is a change point. Also checks that something can move.
fn check_mobility(
    tree: &Tree,
    dynamics: &Dynamics,
    conditions: &Conditions,
    length: f64,
) -> Result<(), InputError> {
    let units = column_units(tree, length);
    let (_, jacobian) = conditions.positions(dynamics, &units, length.log2().ceil().exp2());
    for (index, closure) in tree.closures.iter().enumerate() {
        let rows = 2 * (index + 1);
        let part = jacobian.rows(0, rows).into_owned();
        let rank = if part.ncols() == 0 { 0 } else { part.clone().rank(SINGULAR_VELOCITY * part.amax()) };
        if rank < rows {
            return Err(Subject::Scene.error(
                "joints",
                format!(
                    "joint {:?} closes a loop that the other joints and drives already keep closed, in the assembled \
                     configuration: it is redundant (remove it or give it clearance), or the mechanism starts at a \
                     change point with links in line (start it elsewhere){}",
                    closure.name,
                    excess(tree)
                ),
            ));
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
    let (free, equations) = (tree.free.len(), 2 * tree.closures.len());
    if equations <= free {
        return String::new();
    }
    let names: Vec<String> = tree.closures.iter().map(|closure| format!("{:?}", closure.name)).collect();
    format!(
        "; the loops closed by {} give {equations} equations for {free} free coordinate{}: there is one joint or drive \
         too many",
        names.join(" and "),
        if free == 1 { "" } else { "s" }
    )
}

/// Free coordinates that give the bodies the guessed angles, or those that the start gives with all their
/// is_angle: springs count them, and what follows meets them up to full turns only.
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
            .map_or(angles[index], |(placed, body)| {
                let given = scene.start.iter().find_map(|start| match start {
                    Start::Body { body: name, angle, .. } if *name == body.name => *angle,
                    _ => None,
                });
                given.unwrap_or(body.angle) - placed.angle
            });
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

/// Unit of each free coordinate for least squares: 1 rad, or the size of the mechanism rounded to a
/// power of two, so that a scene in other units takes the same steps to the last bit.
fn column_units(tree: &Tree, length: f64) -> Vec<f64> {
    let unit = length.log2().ceil().exp2();
    tree.free
        .iter()
        .map(|&column| match tree.frames[column + 1].kind {
            FrameKind::Revolute => 1.0,
            FrameKind::Prismatic { .. } => unit,
        })
        .collect()
}

/// Equations of the start.
struct Conditions {
    /// Pairs of points with the vector from the first to the second [m] and its rate [m/s]: loop closures,
    /// then clearance joints.
    pairs: Vec<([FramePoint; 2], Vec2, Vec2)>,
    /// Coordinates given in the scene.
    coordinates: Vec<GivenCoordinate>,
}

/// A coordinate of a joint or the angle of a body for which the scene gives a position, a velocity or both.
struct GivenCoordinate {
    /// Its derivative with respect to the coordinate of every column.
    columns: Vec<f64>,
    /// Whether it is an angle.
    is_angle: bool,
    /// Its value [rad or m] where all coordinates are zero.
    zero: f64,
    position: Option<f64>,
    velocity: Option<f64>,
}

impl Conditions {
    fn new(tree: &Tree, scene: &Scene) -> Self {
        let eccentric = |name: &str| {
            let given = scene.start.iter().find_map(|start| match start {
                Start::Clearance { joint, eccentricity, rate } if joint == name => {
                    Some((Vec2::from(*eccentricity), Vec2::from(*rate)))
                }
                _ => None,
            });
            given.unwrap_or((Vec2::zeros(), Vec2::zeros()))
        };
        let closures =
            tree.closures.iter().map(|closure| ([closure.a, closure.b], Vec2::zeros(), Vec2::zeros()));
        let joints = tree.clearance_joints.iter().map(|joint| {
            let (eccentricity, rate) = eccentric(&joint.name);
            ([joint.bearing, joint.journal], eccentricity, rate)
        });
        Self {
            pairs: closures.chain(joints).collect(),
            coordinates: scene.start.iter().filter_map(|start| given_coordinate(tree, start)).collect(),
        }
    }

    /// Number of equations of the pairs and the given coordinates.
    fn rows(&self, given: impl Fn(&GivenCoordinate) -> Option<f64>) -> usize {
        2 * self.pairs.len() + self.coordinates.iter().filter(|one| given(one).is_some()).count()
    }

    /// Residuals of the positions, and their Jacobian with respect to the free
    /// coordinates. Lengths are divided by `unit`, columns multiplied by the `units` of the coordinates.
    fn positions(&self, dynamics: &Dynamics, units: &[f64], unit: f64) -> (DVector<f64>, DMatrix<f64>) {
        let given = |one: &GivenCoordinate| one.position;
        let mut residual = DVector::zeros(self.rows(given));
        for (index, (pair, gap, _)) in self.pairs.iter().enumerate() {
            let [from, to] = pair.map(|point| dynamics.point(point).position);
            let off = (to - from - gap) / unit;
            (residual[2 * index], residual[2 * index + 1]) = (off.x, off.y);
        }
        let wanted = self.coordinates.iter().filter_map(|one| Some((one, one.position?)));
        for (row, (one, wanted)) in wanted.enumerate() {
            let off = one.zero + one.sum(|column| dynamics.coordinate(column).position) - wanted;
            // An angle is satisfied up to full turns.
            let off = if one.is_angle { unwind(off).0 } else { off / unit };
            residual[2 * self.pairs.len() + row] = off;
        }
        (residual, self.jacobian(dynamics, units, unit, given))
    }

    /// The same for the velocities.
    fn velocities(&self, dynamics: &Dynamics, units: &[f64], unit: f64) -> (DVector<f64>, DMatrix<f64>) {
        let given = |one: &GivenCoordinate| one.velocity;
        let mut residual = DVector::zeros(self.rows(given));
        for (index, (pair, _, rate)) in self.pairs.iter().enumerate() {
            let [from, to] = pair.map(|point| dynamics.point(point).velocity);
            let off = (to - from - rate) / unit;
            (residual[2 * index], residual[2 * index + 1]) = (off.x, off.y);
        }
        let wanted = self.coordinates.iter().filter_map(|one| Some((one, one.velocity?)));
        for (row, (one, wanted)) in wanted.enumerate() {
            let off = one.sum(|column| dynamics.coordinate(column).velocity) - wanted;
            residual[2 * self.pairs.len() + row] = if one.is_angle { off } else { off / unit };
        }
        (residual, self.jacobian(dynamics, units, unit, given))
    }

    /// The signs of the branch in the pose last moved to.
    fn branch(&self, dynamics: &Dynamics, length: f64) -> Vec<i8> {
        let tree = dynamics.tree;
        let (_, jacobian) =
            self.positions(dynamics, &column_units(tree, length), length.log2().ceil().exp2());
        let pairs = self.pairs.iter().enumerate().map(|(index, ([a, b], ..))| {
            let moves = |frame: usize, freedom: usize| {
                tree.paths[frame].free.iter().any(|&(_, other)| other == freedom)
            };
            let columns = (0..tree.free.len()).filter(|&k| moves(a.frame, k) != moves(b.frame, k)).collect();
            Group { rows: vec![2 * index, 2 * index + 1], columns }
        });
        let given =
            self.coordinates.iter().filter(|one| one.position.is_some()).enumerate().map(|(row, one)| {
                let columns = (0..tree.free.len()).filter(|&k| one.columns[tree.free[k]] != 0.0).collect();
                Group { rows: vec![2 * self.pairs.len() + row], columns }
            });
        branch(&jacobian, pairs.chain(given).collect())
    }

    fn jacobian(
        &self,
        dynamics: &Dynamics,
        units: &[f64],
        unit: f64,
        given: impl Fn(&GivenCoordinate) -> Option<f64>,
    ) -> DMatrix<f64> {
        let tree = dynamics.tree;
        let mut jacobian = DMatrix::zeros(self.rows(&given), tree.free.len());
        for (index, &(pair, ..)) in self.pairs.iter().enumerate() {
            let columns = dynamics.gap_columns(pair);
            for axis in 0..2 {
                for (freedom, &column) in tree.free.iter().enumerate() {
                    jacobian[(2 * index + axis, freedom)] = columns[column][axis] / unit * units[freedom];
                }
            }
        }
        for (row, one) in self.coordinates.iter().filter(|one| given(one).is_some()).enumerate() {
            let scale = if one.is_angle { 1.0 } else { 1.0 / unit };
            for (freedom, &column) in tree.free.iter().enumerate() {
                jacobian[(2 * self.pairs.len() + row, freedom)] =
                    one.columns[column] * scale * units[freedom];
            }
        }
        jacobian
    }
}

impl GivenCoordinate {
    fn sum(&self, of: impl Fn(usize) -> f64) -> f64 {
        let moving = self.columns.iter().enumerate().filter(|(_, by)| **by != 0.0);
        moving.map(|(column, by)| by * of(column)).sum()
    }
}

fn given_coordinate(tree: &Tree, start: &Start) -> Option<GivenCoordinate> {
    // Names were checked with the scene.
    let index_of = |name: &str| tree.bodies.iter().position(|body| body.name == name);
    let between = |bodies: [Option<usize>; 2], position, velocity| {
        let mut columns = vec![0.0; tree.frames.len() - 1];
        let mut zero = 0.0;
        for (body, sign) in bodies.into_iter().zip([-1.0, 1.0]) {
            let Some(placed) = body.map(|body| &tree.bodies[body]) else { continue };
            zero += sign * placed.angle;
            for &column in &tree.paths[placed.frame].columns {
                columns[column] += sign * tree.frames[column + 1].kind.rotation();
            }
        }
        Some(GivenCoordinate { columns, is_angle: true, zero, position, velocity })
    };
    match start {
        Start::Clearance { .. } => None,
        Start::Body { body, angle, angular_velocity } => {
            between([None, index_of(body)], *angle, *angular_velocity)
        }
        Start::Joint { joint, position, velocity } => {
            let joint = tree.ideal_joints.iter().find(|other| other.name == *joint)?;
            match joint.realization {
                Realization::Tree { column: Some(column), .. } if joint.kind == IdealKind::Prismatic => {
                    let mut columns = vec![0.0; tree.frames.len() - 1];
                    columns[column] = 1.0;
                    let (position, velocity) = (*position, *velocity);
                    Some(GivenCoordinate { columns, is_angle: false, zero: 0.0, position, velocity })
                }
                _ => between(joint.bodies, *position, *velocity),
            }
        }
    }
}

/// Singular values relative to the largest below which a direction counts as immovable.
const SINGULAR: f64 = 1e-10;
/// The same for velocities. In a singular configuration positions are known to the square root of
/// the machine epsilon only, and so is the singular value that vanishes there.
const SINGULAR_VELOCITY: f64 = 1e-6;

/// Least-squares solution of smallest norm; directions with a relative singular value below
/// `cutoff` are left out.
fn least_squares(jacobian: DMatrix<f64>, right: &DVector<f64>, cutoff: f64) -> DVector<f64> {
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
fn slide_together(dynamics: &mut Dynamics, conditions: &Conditions, q: &mut [f64], length: f64) {
    let tree = dynamics.tree;
    let units = column_units(tree, length);
    let unit = length.log2().ceil().exp2();
    dynamics.move_to(0.0, q, &vec![0.0; q.len()]);
    let (residual, mut jacobian) = conditions.positions(dynamics, &units, unit);
    for (k, &column) in tree.free.iter().enumerate() {
        if tree.frames[column + 1].kind == FrameKind::Revolute {
            jacobian.column_mut(k).fill(0.0);
        }
    }
    let step = least_squares(jacobian, &residual, SINGULAR);
    for (k, value) in q.iter_mut().enumerate() {
        *value -= step[k] * units[k];
    }
}

/// Newton's method with step halving on the conditions; returns the remaining residual [m].
fn close_positions(dynamics: &mut Dynamics, conditions: &Conditions, q: &mut [f64], length: f64) -> f64 {
    let tree = dynamics.tree;
    let at_rest = vec![0.0; q.len()];
    let units = column_units(tree, length);
    let unit = length.log2().ceil().exp2();
    dynamics.move_to(0.0, q, &at_rest);
    let (mut residual, mut jacobian) = conditions.positions(dynamics, &units, unit);
    for _ in 0..ITERATIONS {
        let size = residual.norm();
        if size == 0.0 {
            break;
        }
        let step = least_squares(jacobian, &residual, SINGULAR);
        let mut trial = q.to_vec();
        let mut fraction = 1.0;
        loop {
            for (k, value) in trial.iter_mut().enumerate() {
                *value = q[k] - fraction * step[k] * units[k];
            }
            dynamics.move_to(0.0, &trial, &at_rest);
            (residual, jacobian) = conditions.positions(dynamics, &units, unit);
            if residual.norm() < size {
                break;
            }
            fraction *= 0.5;
            // No shorter step reduces the residual: it is at rounding level, or the gap cannot be closed.
            if fraction < 1e-6 {
                return size * unit;
            }
        }
        q.copy_from_slice(&trial);
    }
    residual.norm() * unit
}

/// Velocities of smallest norm that satisfy the conditions, and the largest remaining gap rate [m/s].
fn close_velocities(
    dynamics: &mut Dynamics,
    conditions: &Conditions,
    q: &[f64],
    length: f64,
) -> (Vec<f64>, f64) {
    let units = column_units(dynamics.tree, length);
    let unit = length.log2().ceil().exp2();
    let mut v = vec![0.0; q.len()];
    // The conditions are linear in v: the second pass only removes rounding errors of the first.
    for _ in 0..2 {
        dynamics.move_to(0.0, q, &v);
        let (residual, jacobian) = conditions.velocities(dynamics, &units, unit);
        let step = least_squares(jacobian, &residual, SINGULAR_VELOCITY);
        for (k, value) in v.iter_mut().enumerate() {
            *value -= step[k] * units[k];
        }
    }
    dynamics.move_to(0.0, q, &v);
    let (remaining, _) = conditions.velocities(dynamics, &units, unit);
    (v, if remaining.is_empty() { 0.0 } else { remaining.amax() * unit })
}
