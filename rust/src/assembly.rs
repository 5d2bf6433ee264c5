//! Assembly: from the user's rough angles to a start with every clearance joint concentric in
//! position and velocity, and the scales by which errors are judged.

use nalgebra::{DMatrix, DVector};

use crate::dynamics::Dynamics;
use crate::error::SceneError;
use crate::kinematics::{FrameKind, Vec2};
use crate::linear::symmetric_solve;
use crate::mechanism::{FramePoint, Mechanism, State};
use crate::scene::{Joint, Scene};

/// Newton steps before an assembly is given up. A rough guess needs about ten; a hundred only
/// when it creeps along a singular pose.
const ITERATIONS: usize = 100;

/// Residual of the closures relative to the size of the mechanism that counts as assembled:
/// a few hundred rounding errors, far below any clearance that could be simulated.
const CLOSED: f64 = 1e-13;

impl Mechanism {
    /// Compiles a scene: checks it, spans the tree, assembles the start.
    ///
    /// # Errors
    /// Every problem of [`Scene::check`]; otherwise bodies that are not connected, closed loops
    /// of ideal joints, or a mechanism that cannot be assembled.
    pub fn compile(scene: &Scene) -> Result<Mechanism, SceneError> {
        scene.check()?;
        let mut mechanism = Mechanism::span(scene)?;
        assemble(&mut mechanism, scene)?;
        Ok(mechanism)
    }
}

/// Computes `start`, `scales` and the joints' load-dependent constants of a mechanism.
fn assemble(mechanism: &mut Mechanism, scene: &Scene) -> Result<(), SceneError> {
    let length = length_scale(scene);
    let mut q = rough_coordinates(mechanism, scene);
    let d = q.len();
    let mut dynamics = Dynamics::new(mechanism);
    let at_rest = vec![0.0; d];
    let residual = close_positions(&mut dynamics, &mut q, &at_rest, length);
    if residual.is_nan() || residual > CLOSED * length {
        return Err(SceneError::single(
            "bodies",
            format!(
                "the mechanism cannot be assembled with its loops closed and its clearance joints \
                 concentric: from the given angles a gap of {residual:.3e} m remains; check the lengths and the rough angles of the bodies"
            ),
        ));
    }
    let (v, gap_rate) = close_velocities(&mut dynamics, &q, length);
    dynamics.move_to(0.0, &q, &v);
    let speed = speed_scale(mechanism, &dynamics, length);
    // The least-squares velocity leaves a rate only where no velocity closes the joints: the pose
    // is singular and the drive pushes against it.
    if gap_rate.is_nan() || gap_rate > 1e-9 * speed {
        return Err(SceneError::single(
            "bodies",
            format!(
                "the assembled pose is singular: no velocity keeps the joints together \
                 (remaining rate {gap_rate:.3e} m/s); start the drive at another angle"
            ),
        ));
    }
    check_redundancy(mechanism, &dynamics, length)?;
    let levers = levers(mechanism, &dynamics);
    let mut accelerations = vec![0.0; d];
    if !dynamics.acceleration(0.0, &q, &v, &mut accelerations) {
        return Err(SceneError::single("bodies", "the mass matrix is singular in the assembled pose"));
    }
    let masses: Vec<(f64, f64)> = effective_masses(mechanism, &mut dynamics, &q, &v, &accelerations);
    for (joint, (mass, load)) in mechanism.clearance_joints.iter_mut().zip(masses) {
        joint.effective_mass = mass;
        let weightless = joint.law.normal.stiffness
            * (UNLOADED_PENETRATION * joint.law.clearance).powf(joint.law.normal.exponent);
        let load = load.max(mass * speed * speed / length);
        let load = if load > 0.0 { load } else { weightless };
        joint.resting_penetration = joint.law.normal.resting_penetration(load);
        joint.resting_speed = joint.resting_penetration * joint.law.normal.contact_frequency(load, mass);
        if joint.impact_velocity_floor.is_nan() {
            joint.impact_velocity_floor = joint.law.normal.resting_velocity(load, mass);
        }
    }
    mechanism.start = State { q, v };
    mechanism.scales.length = length;
    mechanism.scales.speed = speed;
    mechanism.scales.levers = levers;
    Ok(())
}

/// Every closure must restrict the motion by two more equations: otherwise a joint is redundant
/// (its forces cannot be known) or the pose is a change point.
fn check_redundancy(mechanism: &Mechanism, dynamics: &Dynamics, length: f64) -> Result<(), SceneError> {
    let units = column_units(mechanism, length);
    let (_, jacobian) = closures(dynamics, &units, length.log2().ceil().exp2());
    for (index, closure) in mechanism.closures.iter().enumerate() {
        let rows = 2 * (index + 1);
        let part = jacobian.rows(0, rows).into_owned();
        let rank = if part.ncols() == 0 { 0 } else { part.clone().rank(SINGULAR_VELOCITY * part.amax()) };
        if rank < rows {
            return Err(SceneError::single(
                "joints",
                format!(
                    "joint {:?} closes a loop that the other joints already hold, in the assembled pose: it is \
                     redundant, or the mechanism starts at a change point",
                    closure.name
                ),
            ));
        }
    }
    Ok(())
}

/// Penetration relative to the clearance that stands for the load of a scene in which nothing
/// is driven, moves or falls at the start.
const UNLOADED_PENETRATION: f64 = 1e-6;

/// Largest distance between two points of a body, or of ground; a joint's radius if all points
/// coincide; 1 m in a scene without any length.
fn length_scale(scene: &Scene) -> f64 {
    let spread = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let points: Vec<Vec2> = points.map(Vec2::from).collect();
        let mut largest: f64 = 0.0;
        for (index, a) in points.iter().enumerate() {
            for b in &points[..index] {
                largest = largest.max((a - b).norm());
            }
        }
        largest
    };
    let mut length = spread(&mut scene.ground.iter().map(|point| point.position));
    for body in &scene.bodies {
        let points = body.points.iter().map(|point| point.position).chain([body.center_of_mass]);
        length = length.max(spread(&mut points.into_iter()));
    }
    for joint in &scene.joints {
        if let Joint::Clearance { journal_radius, .. } = joint {
            length = length.max(*journal_radius);
        }
    }
    if length > 0.0 { length } else { 1.0 }
}

/// Free coordinates that give the bodies their rough angles.
fn rough_coordinates(mechanism: &Mechanism, scene: &Scene) -> Vec<f64> {
    let mut angles = vec![0.0; mechanism.frames.len()];
    let mut coordinates = vec![0.0; mechanism.frames.len()];
    for (index, frame) in mechanism.frames.iter().enumerate().skip(1) {
        angles[index] = angles[frame.parent];
        if frame.kind != FrameKind::Revolute {
            continue;
        }
        let driven = mechanism.driven.iter().find(|driven| driven.column == index - 1);
        let wanted = mechanism
            .bodies
            .iter()
            .zip(&scene.bodies)
            // The body hung on the joint: bodies welded to it have their origin elsewhere.
            .filter(|(placed, _)| placed.frame == index)
            .min_by_key(|(placed, _)| !placed.hung)
            .map_or(angles[index], |(placed, body)| body.angle - placed.angle);
        coordinates[index] = driven.map_or(wanted - angles[index], |driven| driven.at(0.0).position);
        angles[index] += coordinates[index];
    }
    mechanism.free.iter().map(|&column| coordinates[column + 1]).collect()
}

/// Unit of each free coordinate for least squares: 1 rad, and the size of the mechanism as a
/// power of two, so that a scene in other units takes bit for bit the same steps.
fn column_units(mechanism: &Mechanism, length: f64) -> Vec<f64> {
    let unit = length.log2().ceil().exp2();
    mechanism
        .free
        .iter()
        .map(|&column| match mechanism.frames[column + 1].kind {
            FrameKind::Revolute => 1.0,
            FrameKind::Prismatic { .. } => unit,
        })
        .collect()
}

/// The pairs of points that must coincide at the start: loop closures, then clearance joints.
fn pairs(mechanism: &Mechanism) -> Vec<[FramePoint; 2]> {
    let closures = mechanism.closures.iter().map(|closure| [closure.a, closure.b]);
    let joints = mechanism.clearance_joints.iter().map(|joint| [joint.bearing, joint.journal]);
    closures.chain(joints).collect()
}

/// All gaps one below the other [m], and their Jacobian with respect to the free coordinates,
/// both divided by `unit`, the Jacobian multiplied by the coordinates' units.
fn closures(dynamics: &Dynamics, units: &[f64], unit: f64) -> (DVector<f64>, DMatrix<f64>) {
    let mechanism = dynamics.mechanism;
    let pairs = pairs(mechanism);
    let mut residual = DVector::zeros(2 * pairs.len());
    let mut jacobian = DMatrix::zeros(2 * pairs.len(), mechanism.free.len());
    for (index, &pair) in pairs.iter().enumerate() {
        let [from, to] = pair.map(|point| dynamics.point(point).position);
        let eccentricity = (to - from) / unit;
        let columns = dynamics.gap_columns(pair);
        for axis in 0..2 {
            residual[2 * index + axis] = eccentricity[axis];
            for (freedom, &column) in mechanism.free.iter().enumerate() {
                jacobian[(2 * index + axis, freedom)] = columns[column][axis] / unit * units[freedom];
            }
        }
    }
    (residual, jacobian)
}

/// Singular values relative to the largest below which a direction counts as immovable.
const SINGULAR: f64 = 1e-10;
/// The same for velocities: in a pose that just closes, positions are known to the square root of
/// rounding only, and so is the singular value that vanishes there.
const SINGULAR_VELOCITY: f64 = 1e-6;

/// Least-squares solution of smallest norm; directions with a relative singular value below
/// `cutoff` are left out.
fn least_squares(jacobian: DMatrix<f64>, right: &DVector<f64>, cutoff: f64) -> DVector<f64> {
    let columns = jacobian.ncols();
    let largest = jacobian.amax();
    // The decomposition panics over what is not a number; the remaining gap will tell.
    if largest == 0.0 || right.is_empty() || !jacobian.iter().chain(right).all(|x| x.is_finite()) {
        return DVector::zeros(columns);
    }
    jacobian.svd(true, true).solve(right, cutoff * largest).unwrap_or_else(|_| DVector::zeros(columns))
}

/// Newton's method with halved steps on "every clearance joint is concentric"; the remaining
/// gap [m].
fn close_positions(dynamics: &mut Dynamics, q: &mut [f64], v: &[f64], length: f64) -> f64 {
    let mechanism = dynamics.mechanism;
    let units = column_units(mechanism, length);
    let unit = length.log2().ceil().exp2();
    dynamics.move_to(0.0, q, v);
    let (mut residual, mut jacobian) = closures(dynamics, &units, unit);
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
            dynamics.move_to(0.0, &trial, v);
            (residual, jacobian) = closures(dynamics, &units, unit);
            if residual.norm() < size {
                break;
            }
            fraction *= 0.5;
            // No shorter step helps: rounding level, or a gap that cannot be closed.
            if fraction < 1e-6 {
                return size * unit;
            }
        }
        q.copy_from_slice(&trial);
    }
    residual.norm() * unit
}

/// Velocities of smallest norm that keep every clearance joint concentric, and the largest
/// remaining rate [m/s].
fn close_velocities(dynamics: &mut Dynamics, q: &[f64], length: f64) -> (Vec<f64>, f64) {
    let mechanism = dynamics.mechanism;
    let units = column_units(mechanism, length);
    let unit = length.log2().ceil().exp2();
    let rates = |dynamics: &Dynamics| {
        let pairs = pairs(mechanism);
        DVector::from_iterator(
            2 * pairs.len(),
            pairs.iter().flat_map(|pair| {
                let [from, to] = pair.map(|point| dynamics.point(point).velocity);
                [to.x - from.x, to.y - from.y]
            }),
        )
    };
    let mut v = vec![0.0; q.len()];
    // The closure is linear in v: the second pass only removes the rounding of the first.
    for _ in 0..2 {
        dynamics.move_to(0.0, q, &v);
        let (_, jacobian) = closures(dynamics, &units, unit);
        let step = least_squares(jacobian, &(rates(dynamics) / unit), SINGULAR_VELOCITY);
        for (k, value) in v.iter_mut().enumerate() {
            *value -= step[k] * units[k];
        }
    }
    dynamics.move_to(0.0, q, &v);
    let remaining = rates(dynamics).amax();
    (v, if pairs(mechanism).is_empty() { 0.0 } else { remaining })
}

/// Fastest of: the points at the start, the drives at the size of the mechanism, a free fall
/// over it.
fn speed_scale(mechanism: &Mechanism, dynamics: &Dynamics, length: f64) -> f64 {
    let mut speed = (mechanism.gravity.norm() * length).sqrt();
    for driven in &mechanism.driven {
        speed = speed.max(driven.speed.abs() * length);
    }
    for body in mechanism.inertias.iter().chain(&mechanism.driven_inertias) {
        speed = speed.max(dynamics.frame(body.frame).point(body.center).velocity.norm());
    }
    for joint in &mechanism.clearance_joints {
        speed = speed.max(dynamics.point(joint.journal).velocity.norm());
    }
    speed
}

/// How far [m] a unit of each degree of freedom moves the points that matter: centres of mass,
/// clearance joints and their surfaces.
fn levers(mechanism: &Mechanism, dynamics: &Dynamics) -> Vec<f64> {
    let mut levers = vec![0.0_f64; mechanism.free.len()];
    let mut raise = |frame: usize, point: Vec2, radius: f64| {
        for &(column, freedom) in &mechanism.paths[frame].free {
            let lever = match mechanism.frames[column + 1].kind {
                FrameKind::Revolute => (point - dynamics.frame(column + 1).position).norm().max(radius),
                FrameKind::Prismatic { .. } => 1.0,
            };
            levers[freedom] = levers[freedom].max(lever);
        }
    };
    for body in &mechanism.inertias {
        let gyration = (body.inertia / body.mass).sqrt();
        raise(body.frame, dynamics.frame(body.frame).point(body.center).position, gyration);
    }
    for joint in &mechanism.clearance_joints {
        raise(joint.bearing.frame, dynamics.point(joint.bearing).position, joint.law.bearing_radius);
        raise(joint.journal.frame, dynamics.point(joint.journal).position, joint.law.journal_radius);
    }
    levers
}

/// For every clearance joint the mass its contact accelerates [kg] and the load [N] that would
/// keep it concentric, in the direction in which it starts to open.
fn effective_masses(
    mechanism: &Mechanism,
    dynamics: &mut Dynamics,
    q: &[f64],
    v: &[f64],
    a: &[f64],
) -> Vec<(f64, f64)> {
    let d = a.len();
    let factor = dynamics.mass_factor().to_vec();
    dynamics.move_to(0.0, q, v);
    dynamics.accelerate(a);
    let mass_along = |columns: &[Vec2], direction: Vec2| {
        let row: Vec<f64> = mechanism.free.iter().map(|&column| columns[column].dot(&direction)).collect();
        let mut solved = row.clone();
        symmetric_solve(&factor, d, &mut solved);
        let compliance: f64 = row.iter().zip(&solved).map(|(a, b)| a * b).sum();
        1.0 / compliance
    };
    let total: f64 = mechanism.inertias.iter().map(|body| body.mass).sum();
    mechanism
        .clearance_joints
        .iter()
        .map(|joint| {
            let columns = dynamics.gap_columns([joint.bearing, joint.journal]);
            let opening = dynamics.joint_motion(joint).acceleration;
            let opens = opening.norm() > 0.0;
            let direction = if opens { opening.normalize() } else { Vec2::x() };
            let mut mass = mass_along(&columns, direction);
            if !opens || !mass.is_finite() {
                let other = mass_along(&columns, Vec2::y());
                mass = if mass.is_finite() { mass.min(other) } else { other };
            }
            // Two bodies that nothing free moves: the joint never acts, any mass will do.
            let mass = if mass.is_finite() { mass } else { total.max(f64::MIN_POSITIVE) };
            (mass, mass * opening.norm())
        })
        .collect()
}
