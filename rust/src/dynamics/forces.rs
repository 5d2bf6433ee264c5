//! Force elements: generalized forces, their exact derivatives and wrenches, all from the law of each element.

use super::Dynamics;
use super::reactions::Wrench;
use crate::numerics::dual::{Dual, Scalar};
use crate::tree::elements::FramePoint;
use crate::tree::forces::{Ends, Exerted, ForceElement, ForceLaw, Law, Motion, Work};
use crate::tree::kinematics::Vec2;
use crate::tree::loads::Load;

/// A vector between two points and its rate as the first four inputs.
#[inline]
pub(super) fn inputs<const N: usize>([e, rate]: [Vec2; 2]) -> [[Dual<N>; 2]; 2] {
    [[Dual::input(e.x, 0), Dual::input(e.y, 1)], [Dual::input(rate.x, 2), Dual::input(rate.y, 3)]]
}

impl Dynamics<'_> {
    /// Relative motion of two points, and where they are [m].
    #[inline]
    fn motion_of_points(&self, points: [FramePoint; 2]) -> (Motion<f64>, [Vec2; 2]) {
        let [first, second] = points.map(|point| self.point(point));
        let [a, b] = points.map(|point| &self.states[point.frame]);
        let motion = Motion {
            apart: (second.position - first.position).into(),
            rate: (second.velocity - first.velocity).into(),
            turning: [a.angular_velocity, b.angular_velocity],
            axes: [b.cosine, b.sine],
        };
        (motion, [first.position, second.position])
    }

    /// Relative motion of two frames, from the angle of the second relative to the first without deflection [rad].
    #[inline]
    fn motion_of_frames(&self, [a, b]: [usize; 2], unloaded: f64) -> Motion<f64> {
        Motion {
            apart: [self.angle(b) - self.angle(a) - unloaded, 0.0],
            rate: [self.states[b].angular_velocity - self.states[a].angular_velocity, 0.0],
            turning: [0.0; 2],
            axes: [1.0, 0.0],
        }
    }

    /// Relative motion of the ends of a force element, after [`Dynamics::move_to`].
    pub fn relative_motion(&self, element: &ForceElement) -> Motion<f64> {
        match element.ends {
            Ends::Points(points) => self.motion_of_points(points).0,
            Ends::Frames(frames, unloaded) => self.motion_of_frames(frames, unloaded),
        }
    }

    /// Values of the loads of a force element, after [`Dynamics::move_to`].
    #[inline]
    pub fn loads(&self, ForceElement { loads: [first, second], .. }: &ForceElement) -> [Option<f64>; 2] {
        let value = |load: &Option<Load>| load.as_ref().map(|load| self.load(load));
        [value(first), value(second)]
    }

    /// What a force element exerts, after [`Dynamics::move_to`].
    #[inline]
    pub fn exerted(&self, element: &ForceElement) -> Exerted<f64> {
        element.law.exerted(&self.relative_motion(element), self.loads(element))
    }

    /// What becomes of its power, after [`Dynamics::move_to`].
    pub fn work_of(&self, element: &ForceElement) -> Work<f64> {
        element.law.work(&self.relative_motion(element), self.loads(element))
    }

    /// The output of a force element with this place among its names, after [`Dynamics::move_to`].
    pub fn force_output(&self, element: &ForceElement, place: usize) -> f64 {
        element.law.output(&self.relative_motion(element), self.loads(element), place)
    }

    /// Adds the generalized forces of all force elements and of friction in ideal joints.
    #[inline]
    pub(super) fn add_forces(&self, forces: &mut [f64]) {
        for element in &self.tree.forces {
            // The kind is asked once, so that each law computes of the motion only what it needs.
            match &element.law {
                ForceLaw::Link(law) => self.add_force_of(law, element, forces),
                ForceLaw::Elastic(law) => self.add_force_of(law, element, forces),
                ForceLaw::Film(law) => self.add_force_of(law, element, forces),
                ForceLaw::Applied(law) => self.add_force_of(law, element, forces),
            }
        }
        self.add_friction(forces);
    }

    /// Adds the generalized force of a force element by its law.
    fn add_force_of<L: Law>(&self, law: &L, element: &ForceElement, forces: &mut [f64]) {
        let loads = self.loads(element);
        match element.ends {
            Ends::Points(points) => {
                let (motion, positions) = self.motion_of_points(points);
                let Exerted { force, moments } = law.exerted(&motion, loads);
                self.add_pair(points, positions, force.into(), moments, forces);
            }
            Ends::Frames(frames, unloaded) => {
                let motion = self.motion_of_frames(frames, unloaded);
                self.add_couple(frames, law.exerted(&motion, loads).force[0], forces);
            }
        }
    }

    /// Adds the generalized force of a torque on the second frame and its reaction on the first.
    fn add_couple(&self, frames: [usize; 2], torque: f64, forces: &mut [f64]) {
        for (frame, sign) in frames.into_iter().zip([-1.0, 1.0]) {
            for &(column, i) in &self.tree.paths[frame].free {
                forces[i] += sign * self.states[column + 1].rotation * torque;
            }
        }
    }

    /// Adds the generalized force per unit of a load of a force element, by the place of the load.
    pub(super) fn add_per_unit(&self, element: &ForceElement, place: usize, forces: &mut [f64]) {
        let mut loads = self.loads(element).map(|load| load.map(Dual::<1>::constant));
        loads[place] = loads[place].map(|load| Dual::input(load.value, 0));
        let motion = self.relative_motion(element).map(Dual::constant);
        let Exerted { force, moments } = element.law.exerted(&motion, loads);
        let slopes = |of: [Dual<1>; 2]| of.map(|one| one.gradient[0]);
        match element.ends {
            Ends::Points(points) => {
                let positions = points.map(|point| self.point(point).position);
                self.add_pair(points, positions, slopes(force).into(), slopes(moments), forces);
            }
            Ends::Frames(frames, _) => self.add_couple(frames, force[0].gradient[0], forces),
        }
    }

    /// Adds the derivatives of all these forces to those of the force residual.
    pub(super) fn add_force_derivatives(&mut self) {
        for element in &self.tree.forces {
            match &element.law {
                ForceLaw::Link(law) => self.add_derivatives_of::<5, _>(law, element),
                ForceLaw::Elastic(law) => self.add_derivatives_of::<7, _>(law, element),
                ForceLaw::Film(law) => self.add_derivatives_of::<7, _>(law, element),
                ForceLaw::Applied(law) if law.body_axes.is_none() => {
                    self.add_derivatives_of::<5, _>(law, element);
                }
                ForceLaw::Applied(law) => self.add_derivatives_of::<8, _>(law, element),
            }
            for (place, load) in element.loads.iter().enumerate() {
                if let Some(load) = load {
                    self.add_derivatives_by_load(element, place, load);
                }
            }
        }
        if !self.tree.dry_joints.is_empty() {
            self.add_friction_derivatives();
        }
    }

    /// Those by the motion of the ends of a force element, with its loads kept, from a number of inputs that its law needs:
    /// 5 without angular velocities, 7 without the axes of the second frame.
    fn add_derivatives_of<const N: usize, L: Law>(&mut self, law: &L, element: &ForceElement) {
        let values = self.loads(element);
        match element.ends {
            Ends::Points(points) => {
                let (Motion { apart, rate, turning: [first, second], axes: [cosine, sine] }, _) =
                    self.motion_of_points(points);
                let [apart, rate] = inputs::<N>([apart.into(), rate.into()]);
                let by_angle = |value, slope| match N {
                    8 => Dual::constant(value) + Dual::input(0.0, 7) * slope,
                    _ => Dual::constant(value),
                };
                // A pair has the angular velocity of its first body with a minus.
                let turning = match N {
                    5 => [first, second].map(Dual::constant),
                    _ => [-Dual::input(-first, 4), Dual::input(second, 5)],
                };
                let axes = [by_angle(cosine, -sine), by_angle(sine, cosine)];
                let loads = values.map(|load| load.map(Dual::constant));
                let Exerted { force, moments } = law.exerted(&Motion { apart, rate, turning, axes }, loads);
                if N == 5 {
                    self.add_pair_derivatives(points, [], force, []);
                } else {
                    self.add_pair_derivatives(points, [[1.0, 0.0], [0.0, 1.0]], force, moments);
                }
            }
            // A torque does not follow the motion of its frames.
            Ends::Frames(..) if N == 5 => {}
            Ends::Frames(frames, unloaded) => {
                let Motion { apart: [angle, _], rate: [rate, _], .. } =
                    self.motion_of_frames(frames, unloaded);
                let [zero, one] = [0.0, 1.0].map(Dual::<2>::constant);
                let motion = Motion {
                    apart: [Dual::input(angle, 0), zero],
                    rate: [Dual::input(rate, 1), zero],
                    turning: [zero; 2],
                    axes: [one, zero],
                };
                let torque = law.exerted(&motion, values.map(|load| load.map(Dual::constant))).force[0];
                if torque.gradient != [0.0; 2] {
                    self.add_couple_derivatives(frames, torque.gradient);
                }
            }
        }
    }

    /// Those of a torque on the second frame and its reaction on the first, by the relative angle and its rate.
    fn add_couple_derivatives(&mut self, frames: [usize; 2], [by_angle, by_rate]: [f64; 2]) {
        let tree = self.tree;
        let columns = self.coordinates.len();
        let ends = || frames.into_iter().zip([-1.0, 1.0]);
        for (frame, sign) in ends() {
            for &(column, i) in &tree.paths[frame].free {
                let rotation = sign * self.states[column + 1].rotation;
                for (other, other_sign) in ends() {
                    for &k in &tree.paths[other].columns {
                        let by = rotation * other_sign * self.states[k + 1].rotation;
                        self.residual_q[i * columns + k] -= by_angle * by;
                        self.residual_v[i * columns + k] -= by_rate * by;
                    }
                }
            }
        }
    }

    /// Those by the change of a load with time and with the motion.
    fn add_derivatives_by_load(&mut self, element: &ForceElement, place: usize, load: &Load) {
        let (by_position, by_velocity, by_time) = match load {
            Load::Time(function) => (Vec::new(), Vec::new(), function.at(self.t)[1]),
            Load::Motion(index) => self.load_derivatives(&self.tree.motion_loads[*index]),
        };
        if by_position.is_empty() && by_time == 0.0 {
            return;
        }
        let mut forces = std::mem::take(&mut self.scratch);
        forces.fill(0.0);
        self.add_per_unit(element, place, &mut forces);
        for (i, force) in forces.iter().enumerate() {
            self.residual_t[i] -= force * by_time;
            let row = i * by_position.len();
            for (k, (by_position, by_velocity)) in by_position.iter().zip(&by_velocity).enumerate() {
                self.residual_q[row + k] -= force * by_position;
                self.residual_v[row + k] -= force * by_velocity;
            }
        }
        self.scratch = forces;
    }

    /// Calls `supply` with what all force elements exert on bodies.
    pub(super) fn each_force(&self, supply: &mut impl FnMut(Option<usize>, Wrench)) {
        for element in &self.tree.forces {
            let Exerted { force, moments } = self.exerted(element);
            let wrench = |point: FramePoint, sign: f64, moment: f64| {
                Wrench::at(self.point(point).position, sign * Vec2::from(force), sign * moment)
            };
            let [first, second] = match element.ends {
                Ends::Points([a, b]) => [wrench(a, -1.0, moments[0]), wrench(b, 1.0, moments[1])],
                Ends::Frames(..) => {
                    [-1.0, 1.0].map(|sign| Wrench { force: Vec2::zeros(), moment: sign * force[0] })
                }
            };
            supply(element.bodies[0], first);
            supply(element.bodies[1], second);
        }
    }
}
