//! Inertia: the mass matrix, the inertial forces, and their derivatives.
//!
//! For the coordinates between ground and a frame, all bodies that the frame carries move as one composite
//! rigid body `[Featherstone2008]`. An entry of the mass matrix is then one term instead of a sum over the
//! bodies, and the cost for a chain of n bodies grows with n² instead of n³. In the plane a composite body is
//! described by its center of mass, the motion of that, its moment of inertia and two further scalars.

use super::Dynamics;
use crate::numerics::linear::{symmetric_factor, symmetric_solve};
use crate::tree::elements::{FrameInertia, Tree};
use crate::tree::kinematics::{FrameKind, FrameState, Vec2};

/// The composite body of a frame, all bodies that the frame carries, in one state.
#[derive(Clone, Copy, Debug, Default)]
struct Composite {
    /// Mass [kg].
    mass: f64,
    /// Moment of inertia about the center of mass [kg m²].
    inertia: f64,
    /// Center of mass [m].
    center: Vec2,
    /// Its velocity [m/s].
    velocity: Vec2,
    /// Its acceleration [m/s²].
    acceleration: Vec2,
    /// Rate of the angular momentum about the center of mass [N m].
    moment: f64,
    /// Σ m s·ṡ over the bodies [kg m²/s], where s is the center of mass of a body relative to that of all:
    /// half the rate of Σ m s², zero for a single body.
    spread: f64,
}

/// How the composite body of a frame that is moved by degrees of freedom is built.
#[derive(Clone, Debug)]
struct Part {
    /// Inertia of the bodies fixed to the frame itself.
    own: FrameInertia,
    /// Whether their center of mass is the origin of the frame.
    centered: bool,
    /// The composite bodies of the frames that it carries.
    merges: Vec<Merge>,
    /// Mass of the composite body [kg].
    mass: f64,
    /// The degree of freedom of the frame, if it is not driven.
    freedom: Option<usize>,
    /// The degrees of freedom between ground and the frame: their frames and indices.
    above: Vec<(usize, usize)>,
}

impl Part {
    /// The composite body in the present state; `bodies` are those of the preceding parts, among them
    /// all that the frame carries.
    ///
    /// Without `RATES` its velocity and spread are not computed: accelerations do not need them.
    #[inline(always)]
    fn compose<const RATES: bool>(&self, frame: &FrameState, bodies: &[Composite]) -> Composite {
        // Sliders and floating bodies have their center of mass at the origin.
        let center = if self.centered { frame.origin() } else { frame.point(self.own.center) };
        let mut body = Composite {
            mass: self.mass,
            inertia: self.own.inertia,
            center: center.position,
            velocity: if RATES { center.velocity } else { Vec2::zeros() },
            acceleration: center.acceleration,
            moment: self.own.inertia * frame.angular_acceleration,
            spread: 0.0,
        };
        for merge in &self.merges {
            let child = &bodies[merge.child];
            let arm = child.center - body.center;
            let acceleration = child.acceleration - body.acceleration;
            body.inertia += child.inertia + merge.reduced_mass * arm.norm_squared();
            body.moment += child.moment + merge.reduced_mass * arm.perp(&acceleration);
            body.center += merge.fraction * arm;
            body.acceleration += merge.fraction * acceleration;
            if RATES {
                let rate = child.velocity - body.velocity;
                body.spread += child.spread + merge.reduced_mass * arm.dot(&rate);
                body.velocity += merge.fraction * rate;
            }
        }
        body
    }
}

/// How a composite body is added to that of its parent frame.
#[derive(Clone, Copy, Debug)]
struct Merge {
    /// Index of the child among the parts.
    child: usize,
    /// Mass of the child over the sum of both masses.
    fraction: f64,
    /// Reduced mass: product of both masses over their sum [kg].
    reduced_mass: f64,
}

/// A single body that turns about a point which drives alone move: its moment of inertia about that point is
/// constant, and the centripetal acceleration has no moment about it.
#[derive(Clone, Copy, Debug)]
struct Hinge {
    frame: usize,
    freedom: usize,
    /// Mass times center of mass, in the frame [kg m].
    moment: Vec2,
    /// Moment of inertia about the point [kg m²].
    inertia: f64,
}

/// The constant parts of the mass matrix and of the inertial forces, and those that few numbers determine.
#[derive(Clone, Debug, Default)]
struct ConstantInertia {
    /// Single bodies on hinges.
    hinges: Vec<Hinge>,
    /// Inertial forces, with opposite sign: of what slides on ground or floats.
    forces: Vec<(usize, f64)>,
    /// Entries of the lower triangle of the mass matrix, row-major.
    entries: Vec<(usize, f64)>,
}

impl ConstantInertia {
    /// The parts (see `Composites`) whose entries of the mass matrix are constant, and what these are.
    fn new(tree: &Tree, parts: &[Part]) -> (Self, Vec<bool>) {
        let d = tree.free.len();
        let kind = |part: &Part| tree.frames[part.own.frame].kind;
        let is_hinge = |part: &Part| {
            part.freedom.is_some()
                && part.above.is_empty()
                && part.merges.is_empty()
                && kind(part) == FrameKind::Revolute
        };
        // What slides on ground, maybe on a slider of another direction, does not turn. Children come first.
        let mut translates = Vec::with_capacity(parts.len());
        let mut carrier = vec![None; parts.len()];
        for (place, part) in parts.iter().enumerate() {
            let alone = match kind(part) {
                FrameKind::Prismatic { .. } => true,
                FrameKind::Revolute => part.centered && part.merges.is_empty(),
            };
            let carries = part.merges.iter().all(|merge| translates[merge.child]);
            translates.push(part.freedom.is_some() && alone && carries && slides_on_ground(tree, part));
            part.merges.iter().for_each(|merge| carrier[merge.child] = Some(place));
        }
        let mut constant = Self::default();
        let mut is_constant = vec![false; parts.len()];
        for (place, part) in parts.iter().enumerate().rev() {
            let carried = carrier[place].is_none_or(|carrier: usize| is_constant[carrier]);
            let Some(i) = part.freedom.filter(|_| carried && (translates[place] || is_hinge(part))) else {
                continue;
            };
            is_constant[place] = true;
            let FrameInertia { frame, mass, center, inertia } = part.own;
            match kind(part) {
                FrameKind::Prismatic { axis } => {
                    constant.forces.push((i, part.mass * axis.dot(&tree.gravity)));
                    constant.entries.push((i * d + i, part.mass * axis.norm_squared()));
                    for &(other, j) in &part.above {
                        if let FrameKind::Prismatic { axis: other } = tree.frames[other].kind {
                            constant.entries.push((i * d + j, part.mass * axis.dot(&other)));
                        }
                    }
                }
                FrameKind::Revolute => {
                    let inertia = inertia + mass * center.norm_squared();
                    constant.entries.push((i * d + i, inertia));
                    constant.entries.extend(part.above.iter().map(|&(_, j)| (i * d + j, 0.0)));
                    if translates[place] {
                        constant.forces.push((i, 0.0));
                    } else {
                        constant.hinges.push(Hinge { frame, freedom: i, moment: mass * center, inertia });
                    }
                }
            }
        }
        (constant, is_constant)
    }

    /// Writes the inertial forces, with opposite sign.
    #[inline(always)]
    fn add(&self, states: &[FrameState], mass: &mut [f64], forces: &mut [f64]) {
        for &(i, force) in &self.forces {
            forces[i] = force;
        }
        for hinge in &self.hinges {
            let frame = &states[hinge.frame];
            let moment = frame.to_world(hinge.moment).perp(&frame.acceleration);
            forces[hinge.freedom] = -(moment + hinge.inertia * frame.angular_acceleration);
        }
        for &(entry, value) in &self.entries {
            mass[entry] = value;
        }
    }
}

/// Whether all that is between ground and the frame of a part slides freely.
fn slides_on_ground(tree: &Tree, part: &Part) -> bool {
    let slides = |&(frame, _): &(usize, usize)| tree.frames[frame].kind != FrameKind::Revolute;
    let own = usize::from(part.freedom.is_some());
    // No drive between them.
    tree.paths[part.own.frame].columns.len() == part.above.len() + own && part.above.iter().all(slides)
}

/// The composite bodies of a mechanism.
#[derive(Clone, Debug)]
pub(super) struct Composites {
    /// From the leaves to the root.
    parts: Vec<Part>,
    /// One for each part.
    bodies: Vec<Composite>,
    /// Places of the parts whose entries of the mass matrix change.
    changing: Vec<usize>,
    /// What does not change.
    constant: ConstantInertia,
    /// Inverse masses of all coordinates where the mass matrix is diagonal and constant, else empty.
    inverse_masses: Vec<f64>,
    /// The diagonal of the mass matrix where that may be singular, else empty.
    pub(super) diagonal: Vec<f64>,
    /// Whether it was singular in the last state.
    pub(super) is_singular: bool,
}

impl Composites {
    pub(super) fn new(tree: &Tree) -> Self {
        let (count, d) = (tree.frames.len(), tree.free.len());
        let nothing = |frame| FrameInertia { frame, mass: 0.0, center: Vec2::zeros(), inertia: 0.0 };
        let mut own: Vec<FrameInertia> = (0..count).map(nothing).collect();
        for body in &tree.inertias {
            own[body.frame] = *body;
        }
        let mut masses: Vec<f64> = own.iter().map(|body| body.mass).collect();
        let mut merges = vec![Vec::new(); count];
        let mut parts: Vec<Part> = Vec::new();
        let mut coupled = vec![false; d * d];
        // Children are listed after their parents, so in reverse order the children of a frame are done
        // before it.
        for frame in (1..count).rev().filter(|&frame| !tree.paths[frame].free.is_empty()) {
            let parent = tree.frames[frame].parent;
            let sum = masses[parent] + masses[frame];
            let fraction = if sum > 0.0 { masses[frame] / sum } else { 0.0 };
            let reduced_mass = masses[parent] * fraction;
            merges[parent].push(Merge { child: parts.len(), fraction, reduced_mass });
            masses[parent] = sum;
            let mut above = tree.paths[frame].free.clone();
            let freedom = above.pop_if(|(column, _)| *column + 1 == frame).map(|(_, freedom)| freedom);
            if let Some(i) = freedom {
                coupled[i * d + i] = true;
                above.iter().for_each(|&(_, j)| coupled[i * d + j] = true);
            }
            parts.push(Part {
                own: own[frame],
                centered: own[frame].center == Vec2::zeros(),
                merges: std::mem::take(&mut merges[frame]),
                mass: masses[frame],
                freedom,
                above: above.into_iter().map(|(column, j)| (column + 1, j)).collect(),
            });
        }
        let lower = (0..d).flat_map(|i| (0..=i).map(move |j| i * d + j));
        let (mut constant, is_constant) = ConstantInertia::new(tree, &parts);
        constant.entries.extend(lower.filter(|&entry| !coupled[entry]).map(|entry| (entry, 0.0)));
        let changing: Vec<usize> = (0..parts.len()).filter(|&place| !is_constant[place]).collect();
        let inverse_masses =
            if changing.is_empty() { inverse_masses(&constant.entries, d) } else { Vec::new() };
        if !inverse_masses.is_empty() {
            constant.entries.clear();
        }
        let is_light = tree.row_masses.is_some() && inverse_masses.is_empty();
        let diagonal = vec![0.0; if is_light { d } else { 0 }];
        Self {
            bodies: vec![Composite::default(); parts.len()],
            parts,
            changing,
            constant,
            inverse_masses,
            diagonal,
            is_singular: false,
        }
    }

    /// Whether bodies without mass or moment of inertia may make the mass matrix singular.
    #[inline(always)]
    pub(super) fn are_light(&self) -> bool {
        !self.diagonal.is_empty()
    }

    /// Memory for the mass matrix of `d` coordinates, which holds its factor where it is constant.
    pub(super) fn matrix(&self, d: usize) -> Vec<f64> {
        let mut mass = vec![0.0; d * d];
        for (i, inverse) in self.inverse_masses.iter().enumerate() {
            mass[i * d + i] = *inverse;
        }
        mass
    }

    /// Factors the mass matrix; false where it is singular.
    #[inline(always)]
    pub(super) fn factor(&self, mass: &mut [f64], d: usize) -> bool {
        !self.inverse_masses.is_empty() || symmetric_factor(mass, d)
    }

    /// Makes accelerations of forces, with the factor of the mass matrix.
    #[inline(always)]
    pub(super) fn solve(&self, mass: &[f64], forces: &mut [f64]) {
        if self.inverse_masses.is_empty() {
            symmetric_solve(mass, forces.len(), forces);
        } else {
            for (force, inverse) in forces.iter_mut().zip(&self.inverse_masses) {
                *force *= inverse;
            }
        }
    }

    /// Writes the lower triangle of the mass matrix, where it changes, to `mass`, and the generalized inertial forces at the
    /// accelerations of the frames to `forces`, with opposite sign.
    #[inline(always)]
    pub(super) fn assemble(&mut self, states: &[FrameState], mass: &mut [f64], forces: &mut [f64]) {
        let d = forces.len();
        self.constant.add(states, mass, forces);
        for &place in &self.changing {
            let part = &self.parts[place];
            let frame = &states[part.own.frame];
            let body = part.compose::<false>(frame, &self.bodies);
            self.bodies[place] = body;
            let Some(i) = part.freedom else { continue };
            let by = frame.column(body.center);
            forces[i] = -(body.mass * by.dot(&body.acceleration) + frame.rotation * body.moment);
            mass[i * d + i] = body.mass * by.norm_squared() + frame.rotation * body.inertia;
            for &(other, j) in &part.above {
                let other = &states[other];
                mass[i * d + j] = body.mass * by.dot(&other.column(body.center))
                    + frame.rotation * other.rotation * body.inertia;
            }
        }
    }
}

/// The inverse of each coordinate's mass, if no entry of the lower triangle couples two of them; else nothing.
fn inverse_masses(entries: &[(usize, f64)], d: usize) -> Vec<f64> {
    let mut inverse = vec![f64::NAN; d];
    for &(entry, value) in entries {
        if entry / d == entry % d {
            inverse[entry / d] = 1.0 / value;
        } else if value != 0.0 {
            return Vec::new();
        }
    }
    let regular = |inverse: &f64| *inverse > 0.0 && inverse.is_finite();
    if inverse.iter().all(regular) { inverse } else { Vec::new() }
}

impl Dynamics<'_> {
    /// Adds the derivatives of the inertial forces to those of the residual, after [`Dynamics::accelerate`].
    pub(super) fn add_inertia_derivatives(&mut self) {
        let tree = self.tree;
        let columns = self.coordinates.len();
        for place in 0..self.composites.parts.len() {
            let part = &self.composites.parts[place];
            let Part { own, freedom, .. } = *part;
            let body = part.compose::<true>(&self.states[own.frame], &self.composites.bodies);
            self.composites.bodies[place] = body;
            let path = &tree.paths[own.frame];
            let lower = own.frame - 1;
            // Two columns both move the composite body of the one farther from ground.
            if let Some(i) = freedom {
                for &column in &path.columns {
                    self.add_inertia_derivative(&body, (lower, i), column, columns);
                }
            }
            for &(other, i) in path.free.iter().filter(|(other, _)| *other != lower) {
                self.add_inertia_derivative(&body, (other, i), lower, columns);
            }
        }
    }

    /// Adds the derivative of the inertial force of the degree of freedom `i`, of column `other`, with
    /// respect to the position and velocity of `column`.
    ///
    /// The inertial force is Σ m B·a over the bodies of the composite plus moments, where B is column `other`
    /// of the velocity transformation at a center of mass. With the centers at C + s, Σ m s = 0, and their
    /// accelerations A + α, Σ m α = 0, the column of a revolute coordinate with its axis at p is perp(C + s -
    /// p), and the derivative with respect to its position is
    ///
    /// ```text
    /// Σ m [∂B·a + B·∂a] = m [∂B(C)·A + B(C)·∂a(C)] + Σ m [perp(perp s)·α + perp(s)·perp(α)]
    /// ```
    ///
    /// The last sum vanishes, since perp(perp s)·α = -s·α and perp(s)·perp(α) = s·α: only the common center
    /// counts. With respect to its velocity, ∂a/∂ż = 2 ∂ċ/∂z, a column for velocities, V(C) + perp(ṡ). Hence
    ///
    /// ```text
    /// Σ m B·∂a = 2 m B(C)·V(C) + 2 Σ m perp(s)·perp(ṡ),     perp(s)·perp(ṡ) = s·ṡ
    /// ```
    ///
    /// and the last sum is twice [`Composite::spread`]. Moments depend on neither: ω̇ is linear in z̈ in the
    /// plane.
    #[inline]
    fn add_inertia_derivative(
        &mut self,
        body: &Composite,
        (other, i): (usize, usize),
        column: usize,
        columns: usize,
    ) {
        let frame = &self.states[column + 1];
        let (by, rotation) = self.column(other, body.center);
        let by_position = by.dot(&frame.acceleration_column(body.acceleration))
            + self.second_column(other, column, body.center).dot(&body.acceleration);
        let by_velocity = body.mass * by.dot(&frame.velocity_column(body.velocity))
            + rotation * frame.rotation * body.spread;
        self.residual_q[i * columns + column] += body.mass * by_position;
        self.residual_v[i * columns + column] += 2.0 * by_velocity;
    }

    /// Adds ∂R/∂z̈ d³z/dt³ of the driven coordinates whose speed changes.
    pub(super) fn add_jerks(&mut self) {
        let tree = self.tree;
        for &index in &tree.accelerated {
            let (driven, jerk) = (tree.driven[index].column, self.jerks[index]);
            for (part, body) in self.composites.parts.iter().zip(&self.composites.bodies) {
                let frame = part.own.frame;
                let path = &tree.paths[frame];
                // A driven and a free column both move the composite body of the one farther from ground.
                let free = match part.freedom {
                    Some(_) if path.columns.binary_search(&driven).is_ok() => {
                        &path.free[path.free.len() - 1..]
                    }
                    None if frame == driven + 1 => &path.free[..],
                    _ => continue,
                };
                let (by, rotation) = self.column(driven, body.center);
                for &(other, i) in free {
                    let (by_other, rotation_other) = self.column(other, body.center);
                    self.residual_t[i] +=
                        (body.mass * by.dot(&by_other) + body.inertia * rotation * rotation_other) * jerk;
                }
            }
            self.add_closure_jerks(driven, jerk);
        }
    }
}
