//! Springs, dampers, applied forces and torques: generalized forces and their exact derivatives.

use super::Dynamics;
use crate::numerics::dual::{Dual, Scalar};
use crate::tree::elements::FramePoint;
use crate::tree::forces::{AppliedForce, Bushing, Link, Pull, Torsion};
use crate::tree::kinematics::{Vec2, perp, rotated};
use crate::tree::loads::Load;

/// Force of a spring or damper on its second point, where `e` is the vector from the first to the second
/// point and `rate` its rate.
///
/// Where only rounding errors keep the points apart, the force of a spring with a natural length has no
/// direction: it is NaN. A damper has none there either, and does not act.
#[inline]
fn force_of<S: Scalar>(link: &Link, e: [S; 2], rate: [S; 2]) -> [S; 2] {
    let isotropic = || e.map(|component| component * -link.stiffness);
    if link.length == 0.0 && link.damping == 0.0 {
        return isotropic();
    }
    let length = (e[0] * e[0] + e[1] * e[1]).sqrt();
    if length.value() <= link.indistinct {
        return if link.length == 0.0 { isotropic() } else { e.map(|_| S::constant(f64::NAN)) };
    }
    let inverse = S::constant(1.0) / length;
    let normal = e.map(|component| component * inverse);
    let lengthening = rate[0] * normal[0] + rate[1] * normal[1];
    let tension = link.tension(length, lengthening);
    normal.map(|component| -(component * tension))
}

/// Force of a bushing on its second point, and the moment about its first point of the reaction, where `e` is the vector
/// from the first to the second point, `rate` its rate and `spin` minus the angular velocity of the first body.
#[inline]
fn force_of_bushing<S: Scalar>([stiffness, damping]: [f64; 2], e: [S; 2], rate: [S; 2], spin: S) -> [S; 3] {
    // Velocity of the second point against the first body.
    let against = [rate[0] - spin * e[1], rate[1] + spin * e[0]];
    let force = [0, 1].map(|k| -(e[k] * stiffness + against[k] * damping));
    [force[0], force[1], e[0] * force[1] - e[1] * force[0]]
}

/// A vector between two points and its rate as the first four inputs.
#[inline]
pub(super) fn inputs<const N: usize>([e, rate]: [Vec2; 2]) -> [[Dual<N>; 2]; 2] {
    [[Dual::input(e.x, 0), Dual::input(e.y, 1)], [Dual::input(rate.x, 2), Dual::input(rate.y, 3)]]
}

/// Unit vector along a spring or damper; NaN where only rounding errors keep its points apart.
fn direction_of(link: &Link, e: Vec2) -> Vec2 {
    let length = e.norm();
    if length <= link.indistinct { Vec2::repeat(f64::NAN) } else { e / length }
}

impl Dynamics<'_> {
    /// Adds the generalized forces of springs, dampers and applied forces.
    #[inline]
    pub(super) fn add_forces(&self, forces: &mut [f64]) {
        let tree = self.tree;
        let positions = |points: [FramePoint; 2]| points.map(|point| self.point(point).position);
        for link in &tree.links {
            self.add_pair(link.points, positions(link.points), self.link_force(link), [0.0; 2], forces);
        }
        for bushing in &tree.bushings {
            let (force, moment) = self.bushing_force(bushing);
            self.add_pair(bushing.points, positions(bushing.points), force, [moment, 0.0], forces);
        }
        self.add_films(forces);
        for pull in &tree.pulls {
            let points = tree.links[pull.link].points;
            self.add_pair(points, positions(points), self.pull_force(pull), [0.0; 2], forces);
        }
        for torsion in &tree.torsions {
            self.add_couple(torsion.frames, self.torsion_torque(torsion), forces);
        }
        for applied in &tree.applied_forces {
            let position = self.point(applied.point).position;
            let force = self.applied_force(applied);
            for &(column, i) in &tree.paths[applied.point.frame].free {
                forces[i] += self.column(column, position).0.dot(&force);
            }
        }
        for applied in &tree.applied_torques {
            self.add_couple(applied.frames, self.load(&applied.torque), forces);
        }
        self.add_friction(forces);
    }

    /// Adds the generalized force of a torque on the second frame and its reaction on the first.
    pub(super) fn add_couple(&self, frames: [usize; 2], torque: f64, forces: &mut [f64]) {
        for (frame, sign) in frames.into_iter().zip([-1.0, 1.0]) {
            for &(column, i) in &self.tree.paths[frame].free {
                forces[i] += sign * self.states[column + 1].rotation * torque;
            }
        }
    }

    /// Deflection of a torsion spring [rad], the relative angle of its bodies less that of the unloaded
    /// spring, and its rate [rad/s].
    pub fn torsion_motion(&self, torsion: &Torsion) -> [f64; 2] {
        let [a, b] = torsion.frames;
        let rate = self.states[b].angular_velocity - self.states[a].angular_velocity;
        [self.angle(b) - self.angle(a) - torsion.angle, rate]
    }

    /// Torque of a torsion spring on its second body [N m].
    pub fn torsion_torque(&self, torsion: &Torsion) -> f64 {
        let [angle, rate] = self.torsion_motion(torsion);
        let [stiffness, damping] = self.coefficients([torsion.stiffness, torsion.damping], torsion.formulas);
        -stiffness * angle - damping * rate
    }

    /// Stiffness and damping in the present motion.
    #[inline]
    pub fn coefficients(&self, numbers: [f64; 2], formulas: [Option<usize>; 2]) -> [f64; 2] {
        [0, 1]
            .map(|k| formulas[k].map_or(numbers[k], |index| self.motion_load(&self.tree.motion_loads[index])))
    }

    /// Those of a bushing.
    pub fn bushing_coefficients(&self, bushing: &Bushing) -> [f64; 2] {
        self.coefficients([bushing.stiffness, bushing.damping], bushing.formulas)
    }

    /// Length of a spring [m] and its rate [m/s].
    pub fn link_motion(&self, link: &Link) -> [f64; 2] {
        let [e, rate] = self.between(link.points);
        let length = e.norm();
        [length, if length > link.indistinct { rate.dot(&e) / length } else { 0.0 }]
    }

    /// Vector from the first to the second point of a bushing [m], its rate [m/s], and the angular velocity of the first
    /// body [rad/s] as the first component.
    fn bushing_motion(&self, bushing: &Bushing) -> [Vec2; 3] {
        let [e, rate] = self.between(bushing.points);
        [e, rate, Vec2::new(self.states[bushing.points[0].frame].angular_velocity, 0.0)]
    }

    /// Force of a bushing on its second point [N], and its moment about the first point [N m].
    pub fn bushing_force(&self, bushing: &Bushing) -> (Vec2, f64) {
        let [e, rate, turning] = self.bushing_motion(bushing);
        let [x, y, moment] =
            force_of_bushing(self.bushing_coefficients(bushing), e.into(), rate.into(), -turning.x);
        (Vec2::new(x, y), moment)
    }

    /// Deflection of a bushing [m], and the square of the speed that its damper sees [m²/s²].
    pub fn bushing_deflection(&self, bushing: &Bushing) -> (f64, f64) {
        let [e, rate, turning] = self.bushing_motion(bushing);
        (e.norm(), (rate - turning.x * perp(e)).norm_squared())
    }

    /// Tension of a spring or damper [N], its further tension included.
    pub fn link_tension(&self, index: usize) -> f64 {
        let link = &self.tree.links[index];
        let [length, rate] = self.link_motion(link);
        let pulls = self.tree.pulls.iter().filter(|pull| pull.link == index);
        pulls.fold(link.tension(length, rate), |sum, pull| sum + self.load(&pull.tension))
    }

    /// Force of a further tension on the second point of its spring or damper [N].
    pub fn pull_force(&self, pull: &Pull) -> Vec2 {
        let link = &self.tree.links[pull.link];
        -self.load(&pull.tension) * direction_of(link, self.between(link.points)[0])
    }

    /// Force of a spring or damper on its second point [N], without its further tension.
    pub fn link_force(&self, link: &Link) -> Vec2 {
        let [e, rate] = self.between(link.points);
        force_of(link, e.into(), rate.into()).into()
    }

    /// An applied force in the world frame [N].
    pub fn applied_force(&self, applied: &AppliedForce) -> Vec2 {
        let [x, y] = applied.components.each_ref().map(|component| self.load(component));
        self.in_world(applied, Vec2::new(x, y))
    }

    /// The unit vector of a component of an applied force in the world frame.
    pub(super) fn component(&self, applied: &AppliedForce, axis: usize) -> Vec2 {
        let mut unit = Vec2::zeros();
        unit[axis] = 1.0;
        self.in_world(applied, unit)
    }

    /// A vector along the axes of an applied force in the world frame.
    fn in_world(&self, applied: &AppliedForce, vector: Vec2) -> Vec2 {
        match applied.body_axes {
            Some([cosine, sine]) => self.states[applied.point.frame].to_world(rotated(vector, cosine, sine)),
            None => vector,
        }
    }

    /// Adds the derivatives of the same forces to those of the force residual.
    pub(super) fn add_force_derivatives(&mut self) {
        let tree = self.tree;
        let columns = self.coordinates.len();
        for link in &tree.links {
            let [e, rate] = inputs(self.between(link.points));
            self.add_pair_derivatives(link.points, [], force_of::<Dual<5>>(link, e, rate), []);
        }
        for bushing in &tree.bushings {
            let [e, rate] = inputs(self.between(bushing.points));
            let spin = Dual::<5>::input(-self.states[bushing.points[0].frame].angular_velocity, 4);
            let [x, y, moment] = force_of_bushing(self.bushing_coefficients(bushing), e, rate, spin);
            self.add_pair_derivatives(bushing.points, [[1.0, 0.0]], [x, y], [moment]);
        }
        self.add_film_derivatives();
        for pull in &tree.pulls {
            self.add_pull_derivatives(pull);
        }
        for torsion in &tree.torsions {
            self.add_torsion_derivatives(torsion);
        }
        for applied in &tree.applied_forces {
            let position = self.point(applied.point).position;
            let force = self.applied_force(applied);
            let [x, y] = applied.components.each_ref().map(|component| self.load_rate(component));
            let rate = self.in_world(applied, Vec2::new(x, y));
            let path = &tree.paths[applied.point.frame];
            for &(column, i) in &path.free {
                let (by, _) = self.column(column, position);
                self.residual_t[i] -= by.dot(&rate);
                for &k in &path.columns {
                    let rotation = self.states[k + 1].rotation;
                    let rotating =
                        if applied.body_axes.is_some() { rotation * by.dot(&perp(force)) } else { 0.0 };
                    self.residual_q[i * columns + k] -=
                        self.second_column(column, k, position).dot(&force) + rotating;
                }
            }
        }
        for applied in &tree.applied_torques {
            let rate = self.load_rate(&applied.torque);
            for (frame, sign) in applied.frames.into_iter().zip([-1.0, 1.0]) {
                for &(column, i) in &tree.paths[frame].free {
                    let rotation = sign * self.states[column + 1].rotation;
                    self.residual_t[i] -= rotation * rate;
                }
            }
        }
        if !tree.dry_joints.is_empty() {
            self.add_friction_derivatives();
        }
        if !tree.motion_loads.is_empty() {
            self.add_derivatives_by_motion();
        }
    }

    /// The same for a torsion spring and damper.
    fn add_torsion_derivatives(&mut self, torsion: &Torsion) {
        let tree = self.tree;
        let columns = self.coordinates.len();
        let [stiffness, damping] = self.coefficients([torsion.stiffness, torsion.damping], torsion.formulas);
        let ends = || torsion.frames.into_iter().zip([-1.0, 1.0]);
        for (frame, sign) in ends() {
            for &(column, i) in &tree.paths[frame].free {
                let rotation = sign * self.states[column + 1].rotation;
                for (other, other_sign) in ends() {
                    for &k in &tree.paths[other].columns {
                        let by = rotation * other_sign * self.states[k + 1].rotation;
                        self.residual_q[i * columns + k] += stiffness * by;
                        self.residual_v[i * columns + k] += damping * by;
                    }
                }
            }
        }
    }

    /// The same for a further tension of a spring or damper, without its change with the motion.
    fn add_pull_derivatives(&mut self, pull: &Pull) {
        let tree = self.tree;
        let link = &tree.links[pull.link];
        let [a, b] = link.points.map(|point| self.point(point));
        let e = b.position - a.position;
        let tension = self.load(&pull.tension);
        let [[x, y], _] = inputs::<5>([e, Vec2::zeros()]);
        let inverse = Dual::constant(-tension) / (x * x + y * y).sqrt();
        self.add_pair_derivatives(link.points, [], [x * inverse, y * inverse], []);
        // The change of the tension itself with time.
        let rate = -self.load_rate(&pull.tension) * direction_of(link, e);
        for (point, motion, sign) in [(link.points[1], b, 1.0), (link.points[0], a, -1.0)] {
            for &(column, i) in &tree.paths[point.frame].free {
                self.residual_t[i] -= sign * self.column(column, motion.position).0.dot(&rate);
            }
        }
    }

    /// The same for the change of applied forces and torques with the motion.
    fn add_derivatives_by_motion(&mut self) {
        let tree = self.tree;
        for pull in &tree.pulls {
            let link = &tree.links[pull.link];
            let [a, b] = link.points.map(|point| self.point(point).position);
            let normal = direction_of(link, b - a);
            for (point, position, sign) in [(link.points[1], b, -1.0), (link.points[0], a, 1.0)] {
                let by = |this: &Self, column| sign * this.column(column, position).0.dot(&normal);
                self.add_derivatives_of(&pull.tension, point.frame, by);
            }
        }
        for applied in &tree.applied_forces {
            let position = self.point(applied.point).position;
            for (component, axis) in applied.components.iter().zip([Vec2::x(), Vec2::y()]) {
                let axis = self.in_world(applied, axis);
                let by = |this: &Self, column| this.column(column, position).0.dot(&axis);
                self.add_derivatives_of(component, applied.point.frame, by);
            }
        }
        for applied in &tree.applied_torques {
            for (frame, sign) in applied.frames.into_iter().zip([-1.0, 1.0]) {
                let by = |this: &Self, column: usize| sign * this.states[column + 1].rotation;
                self.add_derivatives_of(&applied.torque, frame, by);
            }
        }
        for torsion in &tree.torsions {
            for (load, motion) in torsion.formulas.into_iter().zip(self.torsion_motion(torsion)) {
                let Some(load) = load.map(Load::Motion) else { continue };
                for (frame, sign) in torsion.frames.into_iter().zip([motion, -motion]) {
                    let by = |this: &Self, column: usize| sign * this.states[column + 1].rotation;
                    self.add_derivatives_of(&load, frame, by);
                }
            }
        }
        for bushing in &tree.bushings {
            let [e, rate, turning] = self.bushing_motion(bushing);
            let [a, b] = bushing.points;
            // Both forces act at the second point.
            let place = self.point(b).position;
            for (load, vector) in bushing.formulas.into_iter().zip([e, rate - turning.x * perp(e)]) {
                let Some(load) = load.map(Load::Motion) else { continue };
                for (frame, force) in [(a.frame, vector), (b.frame, -vector)] {
                    let by = |this: &Self, column| this.column(column, place).0.dot(&force);
                    self.add_derivatives_of(&load, frame, by);
                }
            }
        }
    }

    /// The same for a load on a frame; `by` is the generalized force of a unit load for a column.
    fn add_derivatives_of(&mut self, load: &Load, frame: usize, by: impl Fn(&Self, usize) -> f64) {
        let Load::Motion(index) = load else { return };
        let tree = self.tree;
        let (by_position, by_velocity, by_time) = self.load_derivatives(&tree.motion_loads[*index]);
        let columns = by_position.len();
        for &(column, i) in &tree.paths[frame].free {
            let force = by(self, column);
            self.residual_t[i] -= force * by_time;
            for k in 0..columns {
                self.residual_q[i * columns + k] -= force * by_position[k];
                self.residual_v[i * columns + k] -= force * by_velocity[k];
            }
        }
    }
}
