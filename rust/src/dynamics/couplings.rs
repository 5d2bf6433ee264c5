//! Couplings: one row a coupling among those of the closed loops.
//!
//! With the coordinates u of driven and driver, which are sums of coordinates of columns, a coupling demands
//!
//! ```text
//! φ  = u_d - s(u_r) = 0        row  ∂φ/∂z = w_d - s' w_r
//! φ' = u_d' - s' u_r'          φ'' = u_d'' - s' u_r'' - s'' u_r'²
//! ```
//!
//! Its multiplier λ acts on the driven coordinate with -λ and on the driver with s' λ. Where teeth are known, their force
//! at the pitch point stands for both: it does the same work, whatever its part that separates the wheels.
//!
//! A coupling with backlash has no row. Along the pitch line its driven teeth are u = r φ ahead of those of the driver;
//! its flanks are contacts of this one coordinate.

use super::Dynamics;
use super::contacts::SlotMotion;
use super::reactions::{PairForce, Wrench};
use crate::contact::pair::{ContactState, Phase};
use crate::numerics::instant::exact_product;
use crate::numerics::jet::Jet;
use crate::numerics::turns::with_turns;
use crate::tree::elements::{
    Backlash, CLOSURE_ROWS, ContactSlot, CoupledCoordinate, Coupling, FramePoint, IdealJoint, IdealKind,
    Mesh, Realization,
};
use crate::tree::kinematics::Vec2;

/// A coupled coordinate, its full turns apart, and its rates.
#[derive(Clone, Copy, Debug, Default)]
struct CoupledMotion {
    position: f64,
    turns: f64,
    velocity: f64,
    acceleration: f64,
}

/// How far a coupling is from what it demands.
#[derive(Clone, Copy, Debug)]
pub struct CouplingMotion {
    /// φ [rad or m].
    pub gap: f64,
    /// Its rate [rad/s or m/s].
    pub rate: f64,
    driven: CoupledMotion,
    driver: CoupledMotion,
    /// The first three derivatives of the law.
    slopes: [f64; 3],
}

impl CouplingMotion {
    /// Sizes of the numbers of which the gap and its rate are differences. A coordinate is a sum of others, whose rounding
    /// errors count at the size [m] and the speed [m/s] of all points in a mechanism of a length [m].
    pub(super) fn reach(&self, coupling: &Coupling, [size, speed, length]: [f64; 3]) -> [f64; 2] {
        let Self { driven, driver, slopes, .. } = self;
        let of = |end: &CoupledCoordinate, own: f64, whole: f64| {
            own.abs() + if end.slide.is_some() { whole } else { whole / length }
        };
        let reach = |own: f64, other: f64, whole: f64| {
            of(&coupling.driven, own, whole) + slopes[0].abs() * of(&coupling.driver, other, whole)
        };
        [reach(driven.position, driver.position, size), reach(driven.velocity, driver.velocity, speed)]
    }
}

impl Dynamics<'_> {
    fn coupled(&self, end: &CoupledCoordinate) -> CoupledMotion {
        let mut motion = CoupledMotion { position: end.zero, ..CoupledMotion::default() };
        for &(column, factor) in &end.columns {
            let coordinate = &self.coordinates[column];
            motion.position += factor * coordinate.position;
            motion.turns += factor * self.turns[column];
            motion.velocity += factor * coordinate.velocity;
            motion.acceleration += factor * coordinate.acceleration;
        }
        motion
    }

    /// What a coupling lacks, after [`Dynamics::move_to`].
    pub fn coupling_motion(&self, coupling: &Coupling) -> CouplingMotion {
        let [driven, driver] = [&coupling.driven, &coupling.driver].map(|end| self.coupled(end));
        // The law without its part in proportion.
        let [value, slope, bend, third] = coupling.law.map_or([0.0; 4], |index| {
            let load = &self.tree.motion_loads[index];
            // Full turns, which would cost digits, are nothing to a law that repeats itself.
            let turns = if coupling.repeats { 0.0 } else { driver.turns };
            let at = Jet::variable(with_turns(driver.position, turns));
            load.tape.value(&[at], &self.switches[load.switches()]).0
        });
        let Coupling { ratio, offset, .. } = coupling;
        let near = driven.position - ratio * driver.position - value - offset.unwrap_or(0.0);
        // The difference of large numbers of turns, exactly.
        let (turns, rest) = exact_product(*ratio, driver.turns);
        CouplingMotion {
            gap: with_turns(near, (driven.turns - turns) - rest),
            rate: driven.velocity - (ratio + slope) * driver.velocity,
            driven,
            driver,
            slopes: [ratio + slope, bend, third],
        }
    }

    /// Derivatives of φ with respect to the coordinates of all columns.
    pub fn coupling_columns(&self, coupling: &Coupling) -> Vec<f64> {
        let [slope, ..] = self.coupling_motion(coupling).slopes;
        let mut columns = vec![0.0; self.coordinates.len()];
        for (end, factor) in [(&coupling.driven, 1.0), (&coupling.driver, -slope)] {
            end.columns.iter().for_each(|&(column, by)| columns[column] += factor * by);
        }
        columns
    }

    /// Writes the rows of the couplings, and what the accelerations of φ are without those of the free coordinates.
    #[inline(never)]
    pub(super) fn write_coupling_rows(&mut self, d: usize) {
        let tree = self.tree;
        for (row, coupling) in (CLOSURE_ROWS * tree.closures.len()..).zip(&tree.couplings) {
            let CouplingMotion { driven, driver, slopes: [slope, bend, _], .. } =
                self.coupling_motion(coupling);
            for (end, factor) in [(&coupling.driven, 1.0), (&coupling.driver, -slope)] {
                end.free.iter().for_each(|&(freedom, by)| self.loops.e[row * d + freedom] += factor * by);
            }
            self.loops.right[row] =
                driven.acceleration - slope * driver.acceleration - bend * driver.velocity * driver.velocity;
        }
    }

    /// Adds the derivatives of Eᵀ λ with fixed λ to the residual, and computes those of the accelerations of φ.
    pub(super) fn add_coupling_derivatives(&mut self) {
        let tree = self.tree;
        let columns = self.coordinates.len();
        for (row, coupling) in (CLOSURE_ROWS * tree.closures.len()..).zip(&tree.couplings) {
            let CouplingMotion { driver, slopes: [_, bend, third], .. } = self.coupling_motion(coupling);
            let CoupledMotion { velocity, acceleration, .. } = driver;
            for &(column, by) in &coupling.driver.columns {
                let place = row * columns + column;
                self.loops.acceleration_q[place] -= (bend * acceleration + third * velocity * velocity) * by;
                self.loops.acceleration_v[place] -= 2.0 * bend * velocity * by;
                for &(freedom, factor) in &coupling.driver.free {
                    self.residual_q[freedom * columns + column] -=
                        self.loops.multipliers[row] * bend * factor * by;
                }
            }
        }
    }

    /// Adds what the third time derivative of a driven coordinate contributes to the time derivative of the
    /// accelerations of φ.
    pub(super) fn add_coupling_jerks(&mut self, driven: usize, jerk: f64) {
        let tree = self.tree;
        let first = tree.free.len() + CLOSURE_ROWS * tree.closures.len();
        for (row, coupling) in (first..).zip(&tree.couplings) {
            self.residual_t[row] += self.coupling_columns(coupling)[driven] * jerk;
        }
    }

    /// Torque [N m] or force [N] of a coupling, by its index among all, on its driven coordinate and on its driver, after
    /// [`Dynamics::acceleration_and_contacts`].
    pub fn coupling_efforts(&self, index: usize) -> [f64; 2] {
        if let Some(index) = index.checked_sub(self.tree.couplings.len()) {
            let Backlash { coupling, mesh, slots, .. } = &self.tree.backlashes[index];
            let along: f64 = slots.clone().map(|slot| self.contact(slot).state.force[0]).sum();
            let effort = mesh.lever * along;
            return [effort, -coupling.ratio * effort];
        }
        let coupling = &self.tree.couplings[index];
        let multiplier = self.loops.multipliers[CLOSURE_ROWS * self.tree.closures.len() + index];
        [-multiplier, self.coupling_motion(coupling).slopes[0] * multiplier]
    }

    /// Where the teeth of two wheels touch [m], and their force on the driven ones [N], which is so large along the pitch
    /// line.
    pub(super) fn tooth_force(&self, mesh: &Mesh, along: f64) -> PairForce {
        let frame = &self.states[mesh.pitch_point.frame];
        let force = frame.to_world(along * mesh.tangent + along.abs() * mesh.separating);
        PairForce { positions: [self.point(mesh.pitch_point).position; 2], force, moments: [0.0; 2] }
    }

    /// Force of the teeth of a coupling on the driven ones [N], after [`Dynamics::acceleration_and_contacts`].
    pub fn force_on_teeth(&self, index: usize, mesh: &Mesh) -> Vec2 {
        self.tooth_force(mesh, self.coupling_efforts(index)[0] / mesh.lever).force
    }

    /// What the forces of teeth add to that of a closure on its second point [N].
    pub(super) fn teeth_on_closure(&self, closure: usize) -> Vec2 {
        let mut sum = Vec2::zeros();
        for (index, (_, mesh)) in self.tree.all_couplings().enumerate() {
            let Some(mesh) = mesh else { continue };
            for (_, factor) in mesh.cut.iter().filter(|(cut, _)| *cut == closure) {
                sum += *factor * self.force_on_teeth(index, mesh);
            }
        }
        sum
    }

    /// How far the driven teeth are ahead of those of the driver along the pitch line [m], without play: the transmission
    /// error.
    pub fn transmission_error(&self, backlash: &Backlash) -> f64 {
        backlash.mesh.lever * self.coupling_motion(&backlash.coupling).gap
    }

    /// The motion of a flank, after [`Dynamics::move_to`].
    pub(super) fn motion_of_flank(&self, Backlash { coupling, mesh, .. }: &Backlash) -> SlotMotion {
        let CouplingMotion { gap, rate, driven, driver, .. } = self.coupling_motion(coupling);
        let acceleration = driven.acceleration - coupling.ratio * driver.acceleration;
        let along = |value: f64| Vec2::new(mesh.lever * value, 0.0);
        SlotMotion {
            eccentricity: along(gap),
            rate: along(rate),
            acceleration: along(acceleration),
            spin: 0.0,
        }
    }

    /// Adds the generalized force of a flank. The part that separates the wheels has none.
    pub(super) fn add_flank(&self, backlash: &Backlash, state: &ContactState<f64>, forces: &mut [f64]) {
        for &(freedom, by) in &backlash.free {
            forces[freedom] += by * state.force[0];
        }
    }

    /// Adds its derivatives to the residual.
    pub(super) fn add_flank_derivatives(&mut self, slot: &ContactSlot, backlash: &Backlash, phase: Phase) {
        let [along, ..] = slot.law.force_gradient(&self.contact_motion(slot), phase);
        let columns = self.coordinates.len();
        for &(freedom, of) in &backlash.free {
            for &(column, by) in &backlash.columns {
                self.residual_q[freedom * columns + column] -= of * by * along.gradient[0];
                self.residual_v[freedom * columns + column] -= of * by * along.gradient[2];
            }
        }
    }

    /// The pitch point as a point of the bodies of both teeth.
    pub(super) fn flank_points(&self, slot: &ContactSlot, mesh: &Mesh) -> [FramePoint; 2] {
        let place = self.point(mesh.pitch_point).position;
        slot.points.map(|point| self.at_place(point, place))
    }

    /// Calls `supply` with what the couplings exert on bodies, but for the flanks.
    pub(super) fn each_coupling_load(&self, supply: &mut impl FnMut(Option<usize>, Wrench)) {
        for (index, coupling) in self.tree.couplings.iter().enumerate() {
            let efforts = self.coupling_efforts(index);
            if let Some(mesh) = &coupling.mesh {
                let PairForce { positions: [place, _], force, .. } =
                    self.tooth_force(mesh, efforts[0] / mesh.lever);
                for (body, sign) in mesh.bodies.into_iter().zip([-1.0, 1.0]) {
                    supply(body, Wrench::at(place, sign * force, 0.0));
                }
                continue;
            }
            for (end, effort) in [&coupling.driven, &coupling.driver].into_iter().zip(efforts) {
                let slide = end.slide.map(|slide| &self.tree.ideal_joints[slide]);
                self.supply_effort(slide, end.bodies, effort, supply);
            }
        }
    }

    /// Calls `supply` with a torque between two bodies, or a force along the guide of a prismatic joint.
    pub(super) fn supply_effort(
        &self,
        joint: Option<&IdealJoint>,
        bodies: [Option<usize>; 2],
        effort: f64,
        supply: &mut impl FnMut(Option<usize>, Wrench),
    ) {
        let mut wrench = Wrench { force: Vec2::zeros(), moment: effort };
        if let Some(joint) = joint.filter(|joint| joint.kind == IdealKind::Prismatic)
            && let Realization::Tree { column: Some(column), sign, .. } = joint.realization
        {
            let force = effort * sign * self.states[column + 1].axis;
            wrench = Wrench::at(self.point(joint.points[1]).position, force, 0.0);
        }
        for (body, sign) in bodies.into_iter().zip([-1.0, 1.0]) {
            supply(body, Wrench { force: sign * wrench.force, moment: sign * wrench.moment });
        }
    }

    /// Power that the couplings add, zero but for errors of the velocities [W].
    pub(super) fn coupling_power(&self) -> f64 {
        let power = |(index, coupling): (usize, &Coupling)| {
            self.coupling_efforts(index)[0] * self.coupling_motion(coupling).rate
        };
        self.tree.couplings.iter().enumerate().map(power).sum()
    }
}
