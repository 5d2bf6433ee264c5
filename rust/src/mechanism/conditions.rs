//! The equations of a start: loops closed, journals where they are to be, and what the scene gives of joints and bodies.

use crate::numerics::accuracy::SINGULAR;
use nalgebra::{DMatrix, DVector};

use crate::contact::pair::Surfaces;
use crate::dynamics::Dynamics;
use crate::mechanism::assembly::least_squares;
use crate::mechanism::branch::{Group, branch};
use crate::numerics::turns::wrap;
use crate::scene::parts::{Scene, Start};
use crate::tree::elements::{Coupling, FramePoint, Guide, IdealKind, Realization, Tree};
use crate::tree::kinematics::{FrameKind, Vec2, perp};

/// Equations of the start.
pub(super) struct Conditions {
    /// Size of the mechanism [m].
    pub(super) length: f64,
    /// The same rounded to a power of two, so that a scene in other units takes the same steps to the last bit.
    pub(super) unit: f64,
    /// Unit of each free coordinate for least squares: 1 rad, or that size.
    pub(super) units: Vec<f64>,
    /// The component of each free coordinate, and how many there are.
    pub(super) of_freedoms: Vec<usize>,
    components: usize,
    /// Pairs of points: loop closures, then joints with clearance.
    pub(super) pairs: Vec<Pair>,
    /// Coordinates given in the scene, and the tilt of guides with play.
    pub(super) coordinates: Vec<GivenCoordinate>,
    /// The couplings with backlash that start in the middle of their play, and those without relative velocity.
    in_the_middle: [Vec<usize>; 2],
}

/// What the start asks of the second point of a pair against the first.
pub(super) struct Pair {
    pub(super) points: [FramePoint; 2],
    pub(super) place: Place,
    /// Whether the start gives it.
    is_given: bool,
}

/// The place of a point against another.
pub(super) enum Place {
    /// At the end of a vector in the axes of the world [m], with its rate [m/s].
    Vector { vector: Vec2, rate: Vec2 },
    /// In a guide that turns with the body of the first point: so far across the axis [m], with the rate [m/s]; along
    /// it so far as the start says.
    Guided { axis: Vec2, across: [f64; 2], along: [Option<f64>; 2] },
}

/// One equation of a pair: the component of the vector between its points along a direction, or its rate.
struct Row {
    pair: usize,
    /// In the axes of the world, or of the body of the first point if it turns.
    direction: Vec2,
    turns: bool,
    wanted: f64,
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
    /// Whether the start gives it; otherwise a joint demands it.
    is_given: bool,
}

/// Positions or velocities.
#[derive(Clone, Copy)]
pub(super) enum Level {
    Position,
    Velocity,
}

impl GivenCoordinate {
    fn wanted(&self, level: Level) -> Option<f64> {
        match level {
            Level::Position => self.position,
            Level::Velocity => self.velocity,
        }
    }
}

impl Conditions {
    pub(super) fn new(tree: &Tree, scene: &Scene, length: f64) -> Self {
        let unit = length.log2().ceil().exp2();
        let units = tree.free.iter().map(|&column| match tree.frames[column + 1].kind {
            FrameKind::Revolute => 1.0,
            FrameKind::Prismatic { .. } => unit,
        });
        let closures = tree.closures.iter().map(|closure| Pair {
            points: [closure.a, closure.b],
            place: Place::Vector { vector: Vec2::zeros(), rate: Vec2::zeros() },
            is_given: false,
        });
        let slots = tree.slots.iter().filter(|slot| !matches!(slot.law.surfaces, Surfaces::Face(_)));
        let bearings = slots.map(|slot| {
            let given = scene.start.iter().find_map(|start| match start {
                Start::Clearance { joint, eccentricity, rate } if *joint == slot.name => {
                    Some((Vec2::from(*eccentricity), Vec2::from(*rate)))
                }
                _ => None,
            });
            let (vector, rate) = given.unwrap_or((Vec2::zeros(), Vec2::zeros()));
            Pair { points: slot.points, place: Place::Vector { vector, rate }, is_given: given.is_some() }
        });
        let guides = tree.guides.iter().map(|guide| {
            let (across, along, is_given) = match start_of(scene, guide) {
                Some(Start::Guide { offset, displacement, .. }) => (*offset, *displacement, true),
                _ => ([0.0; 2], [None; 2], false),
            };
            let place = Place::Guided { axis: guide.axis, across, along };
            Pair { points: guide.points, place, is_given }
        });
        let tilts = tree.guides.iter().filter_map(|guide| tilt_of(tree, scene, guide));
        let given = scene.start.iter().filter_map(|start| given_coordinate(tree, start));
        Self {
            length,
            unit,
            units: units.collect(),
            of_freedoms: tree.components_of_freedoms(),
            components: tree.components.lengths.len(),
            pairs: closures.chain(bearings).chain(guides).collect(),
            coordinates: given.chain(tilts).collect(),
            in_the_middle: [Vec::new(), Vec::new()],
        }
    }

    /// Lets couplings with backlash start as those without, where the start does not say otherwise, in the pose last moved
    /// to.
    pub(super) fn open_plays(&mut self, dynamics: &Dynamics, level: Level) {
        let rank = |conditions: &Self| {
            let jacobian = conditions.jacobian(dynamics, level);
            let cutoff = SINGULAR * jacobian.amax();
            if jacobian.is_empty() || !cutoff.is_finite() { 0 } else { jacobian.rank(cutoff) }
        };
        for (index, backlash) in dynamics.tree.backlashes.iter().enumerate() {
            if let (Level::Position, None) = (level, backlash.coupling.offset) {
                continue;
            }
            let before = rank(self);
            self.in_the_middle[level as usize].push(index);
            if rank(self) == before {
                self.in_the_middle[level as usize].pop();
            }
        }
    }

    /// Least-squares solution for the free coordinates, in their units: what is not connected is solved for apart, so that
    /// not even its rounding errors meet.
    pub(super) fn solve(&self, jacobian: DMatrix<f64>, right: &DVector<f64>, cutoff: f64) -> DVector<f64> {
        if self.components == 1 {
            return least_squares(jacobian, right, cutoff);
        }
        let mut solution = DVector::zeros(jacobian.ncols());
        for component in 0..self.components {
            let columns = self.freedoms_of(component);
            let part = jacobian.select_columns(&columns);
            let rows: Vec<usize> =
                (0..part.nrows()).filter(|&row| part.row(row).iter().any(|entry| *entry != 0.0)).collect();
            let found = least_squares(part.select_rows(&rows), &right.select_rows(&rows), cutoff);
            columns.iter().zip(found.iter()).for_each(|(&column, value)| solution[column] = *value);
        }
        solution
    }

    /// The free coordinates of a component.
    pub(super) fn freedoms_of(&self, component: usize) -> Vec<usize> {
        (0..self.of_freedoms.len()).filter(|&freedom| self.of_freedoms[freedom] == component).collect()
    }

    /// The equations of the pairs.
    fn rows(&self, level: Level) -> Vec<Row> {
        let mut rows = Vec::new();
        for (pair, Pair { place, .. }) in self.pairs.iter().enumerate() {
            let mut add = |direction, turns, wanted| rows.push(Row { pair, direction, turns, wanted });
            match *place {
                Place::Vector { vector, rate } => {
                    let wanted = match level {
                        Level::Position => vector,
                        Level::Velocity => rate,
                    };
                    add(Vec2::x(), false, wanted.x);
                    add(Vec2::y(), false, wanted.y);
                }
                Place::Guided { axis, across, along } => {
                    add(perp(axis), true, across[level as usize]);
                    if let Some(wanted) = along[level as usize] {
                        add(axis, true, wanted);
                    }
                }
            }
        }
        rows
    }

    /// The given coordinates that have a value.
    fn given(&self, level: Level) -> impl Iterator<Item = (&GivenCoordinate, f64)> {
        self.coordinates.iter().filter_map(move |one| Some((one, one.wanted(level)?)))
    }

    /// The couplings that demand something: those without an offset leave the positions to the start.
    pub(super) fn couplings<'t>(&self, tree: &'t Tree, level: Level) -> impl Iterator<Item = &'t Coupling> {
        let tied = tree.couplings.iter().filter(move |coupling| match level {
            Level::Position => coupling.offset.is_some(),
            Level::Velocity => true,
        });
        tied.chain(self.in_the_middle[level as usize].iter().map(|&index| &tree.backlashes[index].coupling))
    }

    /// Row of the first given coordinate among the positions.
    pub(super) fn first_coordinate(&self) -> usize {
        self.rows(Level::Position).len()
    }

    /// The vector between the points of a pair, less that which is given in the axes of the world, and its derivatives
    /// with respect to the free coordinates, in their units.
    pub(super) fn vector(&self, dynamics: &Dynamics, pair: usize) -> (Vec2, Vec<Vec2>) {
        let Pair { points, place, .. } = &self.pairs[pair];
        let [from, to] = points.map(|point| dynamics.point(point).position);
        let given = match place {
            Place::Vector { vector, .. } => *vector,
            Place::Guided { .. } => Vec2::zeros(),
        };
        let columns = dynamics.gap_columns(*points);
        let (unit, free) = (self.unit, dynamics.tree.free.iter().zip(&self.units));
        ((to - from - given) / unit, free.map(|(&column, units)| columns[column] / unit * *units).collect())
    }

    /// Residuals of the positions, and their Jacobian with respect to the free coordinates, in their units.
    pub(super) fn positions(&self, dynamics: &Dynamics) -> (DVector<f64>, DMatrix<f64>) {
        let unit = self.unit;
        let mut residual = Vec::new();
        for Row { pair, direction, turns, wanted } in self.rows(Level::Position) {
            let points = self.pairs[pair].points;
            let [from, to] = points.map(|point| dynamics.point(point).position);
            let direction =
                if turns { dynamics.frame(points[0].frame).to_world(direction) } else { direction };
            residual.push((direction.dot(&(to - from)) - wanted) / unit);
        }
        for (one, wanted) in self.given(Level::Position) {
            let off = one.zero + one.sum(|column| dynamics.coordinate(column).position) - wanted;
            // An angle is satisfied up to full turns.
            residual.push(if one.is_angle { wrap(off).0 } else { off / unit });
        }
        for coupling in self.couplings(dynamics.tree, Level::Position) {
            let gap = dynamics.coupling_motion(coupling).gap;
            residual.push(if coupling.driven.slide.is_some() { gap / unit } else { wrap(gap).0 });
        }
        (DVector::from_vec(residual), self.jacobian(dynamics, Level::Position))
    }

    /// The same for the velocities.
    pub(super) fn velocities(&self, dynamics: &Dynamics) -> (DVector<f64>, DMatrix<f64>) {
        let unit = self.unit;
        let mut residual = Vec::new();
        for Row { pair, direction, turns, wanted } in self.rows(Level::Velocity) {
            let points = self.pairs[pair].points;
            let [from, to] = points.map(|point| dynamics.point(point));
            let mut rate = to.velocity - from.velocity;
            let mut direction = direction;
            if turns {
                let frame = dynamics.frame(points[0].frame);
                direction = frame.to_world(direction);
                rate -= frame.angular_velocity * perp(to.position - from.position);
            }
            residual.push((direction.dot(&rate) - wanted) / unit);
        }
        for (one, wanted) in self.given(Level::Velocity) {
            let off = one.sum(|column| dynamics.coordinate(column).velocity) - wanted;
            residual.push(if one.is_angle { off } else { off / unit });
        }
        for coupling in self.couplings(dynamics.tree, Level::Velocity) {
            residual.push(dynamics.coupling_motion(coupling).rate / coupling_unit(coupling, unit));
        }
        (DVector::from_vec(residual), self.jacobian(dynamics, Level::Velocity))
    }

    /// The rate that the start gives in each row of the velocities; none where the joints demand it.
    pub(super) fn given_rates(&self, tree: &Tree) -> Vec<Option<f64>> {
        let unit = self.unit;
        let rows = self.rows(Level::Velocity).into_iter();
        let pairs = rows.map(|row| self.pairs[row.pair].is_given.then_some(row.wanted / unit));
        let coordinates = self
            .given(Level::Velocity)
            .map(|(one, rate)| one.is_given.then_some(if one.is_angle { rate } else { rate / unit }));
        let couplings = self.couplings(tree, Level::Velocity).map(|_| None);
        pairs.chain(coordinates).chain(couplings).collect()
    }

    /// The signs of the branch in the pose last moved to.
    pub(super) fn branch(&self, dynamics: &Dynamics) -> Vec<i8> {
        let tree = dynamics.tree;
        let jacobian = self.jacobian(dynamics, Level::Position);
        let rows = self.rows(Level::Position);
        let pairs = self.pairs.iter().enumerate().map(|(index, Pair { points: [a, b], .. })| {
            let moves = |frame: usize, freedom: usize| {
                tree.paths[frame].free.iter().any(|&(_, other)| other == freedom)
            };
            let columns = (0..tree.free.len()).filter(|&k| moves(a.frame, k) != moves(b.frame, k)).collect();
            Group { rows: (0..rows.len()).filter(|&row| rows[row].pair == index).collect(), columns }
        });
        let given = self.given(Level::Position).enumerate().map(|(row, (one, _))| {
            let columns = (0..tree.free.len()).filter(|&k| one.columns[tree.free[k]] != 0.0).collect();
            Group { rows: vec![rows.len() + row], columns }
        });
        let first = rows.len() + self.given(Level::Position).count();
        let couplings = self.couplings(tree, Level::Position).enumerate().map(|(row, coupling)| {
            let Coupling { driven, driver, .. } = coupling;
            let mut columns: Vec<usize> = driven.free.iter().chain(&driver.free).map(|&(k, _)| k).collect();
            columns.sort_unstable();
            columns.dedup();
            Group { rows: vec![first + row], columns }
        });
        branch(&jacobian, pairs.chain(given).chain(couplings).collect())
    }

    fn jacobian(&self, dynamics: &Dynamics, level: Level) -> DMatrix<f64> {
        let Self { unit, units, .. } = self;
        let tree = dynamics.tree;
        let rows = self.rows(level);
        let given = self.given(level).count();
        let couplings = self.couplings(tree, level).count();
        let mut jacobian = DMatrix::zeros(rows.len() + given + couplings, tree.free.len());
        for (index, Row { pair, direction, turns, .. }) in rows.iter().enumerate() {
            let points = self.pairs[*pair].points;
            let columns = dynamics.gap_columns(points);
            let first = points[0].frame;
            let [from, to] = points.map(|point| dynamics.point(point).position);
            let direction = if *turns { dynamics.frame(first).to_world(*direction) } else { *direction };
            // The direction turns with the body.
            let by_turning = if *turns { perp(direction).dot(&(to - from)) } else { 0.0 };
            for (freedom, &column) in tree.free.iter().enumerate() {
                let rotates = *turns && tree.paths[first].columns.contains(&column);
                let rotation = if rotates { dynamics.frame(column + 1).rotation } else { 0.0 };
                let by = direction.dot(&columns[column]) + rotation * by_turning;
                jacobian[(index, freedom)] = by / unit * units[freedom];
            }
        }
        for (row, (one, _)) in self.given(level).enumerate() {
            let scale = if one.is_angle { 1.0 } else { 1.0 / unit };
            for (freedom, &column) in tree.free.iter().enumerate() {
                jacobian[(rows.len() + row, freedom)] = one.columns[column] * scale * units[freedom];
            }
        }
        for (row, coupling) in self.couplings(tree, level).enumerate() {
            let columns = dynamics.coupling_columns(coupling);
            for (freedom, &column) in tree.free.iter().enumerate() {
                jacobian[(rows.len() + given + row, freedom)] =
                    columns[column] / coupling_unit(coupling, *unit) * units[freedom];
            }
        }
        jacobian
    }
}

/// Unit of a coupling: 1 rad, or the size of the mechanism.
fn coupling_unit(coupling: &Coupling, unit: f64) -> f64 {
    if coupling.driven.slide.is_some() { unit } else { 1.0 }
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
        let (columns, zero) = tree.relative_angle(bodies);
        GivenCoordinate { columns, is_angle: true, zero, position, velocity, is_given: true }
    };
    match start {
        Start::Clearance { .. } | Start::Guide { .. } => None,
        Start::Body { body, angle, angular_velocity } => {
            Some(between([None, index_of(body)], *angle, *angular_velocity))
        }
        Start::Joint { joint, position, velocity } => {
            let joint = tree.ideal_joints.iter().find(|other| other.name == *joint)?;
            let mut given = between(joint.bodies, *position, *velocity);
            if let (Realization::Tree { column: Some(column), .. }, IdealKind::Prismatic) =
                (joint.realization, joint.kind)
            {
                given.columns.fill(0.0);
                given.columns[column] = 1.0;
                (given.is_angle, given.zero) = (false, 0.0);
            }
            Some(given)
        }
    }
}

/// The tilt of what slides in a guide with play, if it has corners: zero unless the start gives it.
fn tilt_of(tree: &Tree, scene: &Scene, guide: &Guide) -> Option<GivenCoordinate> {
    let angle = guide.angle?;
    let (tilt, is_given) = match start_of(scene, guide) {
        Some(Start::Guide { tilt, .. }) => (*tilt, true),
        _ => ([0.0; 2], false),
    };
    let [position, velocity] = tilt.map(Some);
    let (columns, zero) = tree.relative_angle(guide.bodies);
    Some(GivenCoordinate { columns, is_angle: true, zero: zero - angle, position, velocity, is_given })
}

/// What the start gives of a guide with play.
fn start_of<'s>(scene: &'s Scene, guide: &Guide) -> Option<&'s Start> {
    scene.start.iter().find(|start| matches!(start, Start::Guide { joint, .. } if *joint == guide.name))
}
