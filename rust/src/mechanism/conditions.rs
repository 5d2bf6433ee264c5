//! The equations of a start: loops closed, journals where they are to be, and what the scene gives of joints and bodies.

use nalgebra::{DMatrix, DVector};

use crate::dynamics::Dynamics;
use crate::mechanism::branch::{Group, branch};
use crate::numerics::turns::wrap;
use crate::scene::parts::{Scene, Start};
use crate::tree::elements::{FramePoint, IdealKind, Realization, Tree};
use crate::tree::kinematics::{FrameKind, Vec2};

/// Unit of each free coordinate for least squares: 1 rad, or the size of the mechanism rounded to a
/// power of two, so that a scene in other units takes the same steps to the last bit.
pub(super) fn column_units(tree: &Tree, length: f64) -> Vec<f64> {
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
pub(super) struct Conditions {
    /// Pairs of points with the vector from the first to the second [m] and its rate [m/s]: loop closures,
    /// then clearance joints.
    pub(super) pairs: Vec<([FramePoint; 2], Vec2, Vec2)>,
    /// For each pair whether the start gives its vector and its rate.
    is_given: Vec<bool>,
    /// Coordinates given in the scene.
    pub(super) coordinates: Vec<GivenCoordinate>,
}

/// A coordinate of a joint or the angle of a body for which the scene gives a position, a velocity or both.
pub(super) struct GivenCoordinate {
    /// Its derivative with respect to the coordinate of every column.
    pub(super) columns: Vec<f64>,
    /// Whether it is an angle.
    pub(super) is_angle: bool,
    /// Its value [rad or m] where all coordinates are zero.
    zero: f64,
    pub(super) position: Option<f64>,
    pub(super) velocity: Option<f64>,
}

impl Conditions {
    pub(super) fn new(tree: &Tree, scene: &Scene) -> Self {
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
        let joints = tree.slots.iter().map(|joint| {
            let (eccentricity, rate) = eccentric(&joint.name);
            ([joint.points[0], joint.points[1]], eccentricity, rate)
        });
        let starts = |name: &str| {
            scene.start.iter().any(|start| matches!(start, Start::Clearance { joint, .. } if joint == name))
        };
        let by_start = tree.slots.iter().map(|joint| starts(&joint.name));
        Self {
            is_given: tree.closures.iter().map(|_| false).chain(by_start).collect(),
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
    pub(super) fn positions(
        &self,
        dynamics: &Dynamics,
        units: &[f64],
        unit: f64,
    ) -> (DVector<f64>, DMatrix<f64>) {
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
            let off = if one.is_angle { wrap(off).0 } else { off / unit };
            residual[2 * self.pairs.len() + row] = off;
        }
        (residual, self.jacobian(dynamics, units, unit, given))
    }

    /// The same for the velocities.
    pub(super) fn velocities(
        &self,
        dynamics: &Dynamics,
        units: &[f64],
        unit: f64,
    ) -> (DVector<f64>, DMatrix<f64>) {
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

    /// The rate that the start gives in each row of the velocities; none where the joints demand it.
    pub(super) fn given_rates(&self, unit: f64) -> Vec<Option<f64>> {
        let pairs = self.pairs.iter().zip(&self.is_given).flat_map(|((_, _, rate), is_given)| {
            [rate.x, rate.y].map(|rate| is_given.then_some(rate / unit))
        });
        let coordinates = self
            .coordinates
            .iter()
            .filter_map(|one| one.velocity.map(|rate| Some(if one.is_angle { rate } else { rate / unit })));
        pairs.chain(coordinates).collect()
    }

    /// The signs of the branch in the pose last moved to.
    pub(super) fn branch(&self, dynamics: &Dynamics, length: f64) -> Vec<i8> {
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
