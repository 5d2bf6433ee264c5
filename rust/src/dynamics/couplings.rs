//! Couplings: one row a coupling among those of the closed loops.
//!
//! With the coordinates u of driven and driver, which are sums of coordinates of columns, a coupling demands
//!
//! ```text
//! φ  = u_d - s(u_r) = 0        row  ∂φ/∂z = w_d - s' w_r
//! φ' = u_d' - s' u_r'          φ'' = u_d'' - s' u_r'' - s'' u_r'²
//! ```
//!
//! Its multiplier λ acts on the driven coordinate with -λ and on the driver with s' λ.

use super::Dynamics;
use super::reactions::Wrench;
use crate::numerics::instant::exact_product;
use crate::numerics::jet::Jet;
use crate::numerics::turns::with_turns;
use crate::tree::elements::{CLOSURE_ROWS, CoupledCoordinate, Coupling, Realization};
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CouplingGap {
    /// φ [rad or m].
    pub(super) gap: f64,
    /// Its rate [rad/s or m/s].
    pub(super) rate: f64,
    /// Sizes of the numbers of which each is a difference.
    pub(super) reach: [f64; 2],
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

    /// The law at the driver without the value of its part in proportion, and the first three derivatives of the whole.
    fn law(&self, coupling: &Coupling, driver: &CoupledMotion) -> [f64; 4] {
        let mut law = [0.0; 4];
        if let Some(index) = coupling.law {
            let load = &self.tree.motion_loads[index];
            // Full turns, which would cost digits, are nothing to a law that repeats itself.
            let turns = if coupling.repeats { 0.0 } else { driver.turns };
            let at = Jet::variable(with_turns(driver.position, turns));
            law = load.tape.value(&[at], &self.switches[load.switches()]).0;
        }
        law[1] += coupling.ratio;
        law
    }

    /// What a coupling lacks, after [`Dynamics::move_to`].
    /// Positions have the size `size` [m] and velocities `speed` [m/s] in a mechanism of the size `length` [m].
    pub(super) fn coupling_gap(&self, coupling: &Coupling, [size, speed, length]: [f64; 3]) -> CouplingGap {
        let [driven, driver] = [&coupling.driven, &coupling.driver].map(|end| self.coupled(end));
        let [_, slope, ..] = self.law(coupling, &driver);
        // A coordinate is a sum of others, whose rounding errors count at the size of the mechanism.
        let of = |end: &CoupledCoordinate, own: f64, whole: f64| {
            own.abs() + if end.slide.is_some() { whole } else { whole / length }
        };
        let reach = |own: f64, other: f64, whole: f64| {
            of(&coupling.driven, own, whole) + slope.abs() * of(&coupling.driver, other, whole)
        };
        CouplingGap {
            gap: self.coupling_position(coupling),
            rate: self.coupling_velocity(coupling),
            reach: [
                reach(driven.position, driver.position, size),
                reach(driven.velocity, driver.velocity, speed),
            ],
        }
    }

    /// φ [rad or m], after [`Dynamics::move_to`].
    pub fn coupling_position(&self, coupling: &Coupling) -> f64 {
        let [driven, driver] = [&coupling.driven, &coupling.driver].map(|end| self.coupled(end));
        let [value, ..] = self.law(coupling, &driver);
        let near =
            driven.position - coupling.ratio * driver.position - value - coupling.offset.unwrap_or(0.0);
        // The difference of large numbers of turns, exactly.
        let (turns, rest) = exact_product(coupling.ratio, driver.turns);
        with_turns(near, (driven.turns - turns) - rest)
    }

    /// Its rate [rad/s or m/s].
    pub fn coupling_velocity(&self, coupling: &Coupling) -> f64 {
        let [driven, driver] = [&coupling.driven, &coupling.driver].map(|end| self.coupled(end));
        driven.velocity - self.law(coupling, &driver)[1] * driver.velocity
    }

    /// Derivatives of φ with respect to the coordinates of all columns.
    pub fn coupling_columns(&self, coupling: &Coupling) -> Vec<f64> {
        let [_, slope, ..] = self.law(coupling, &self.coupled(&coupling.driver));
        let mut columns = vec![0.0; self.coordinates.len()];
        for (end, factor) in [(&coupling.driven, 1.0), (&coupling.driver, -slope)] {
            for &(column, by) in &end.columns {
                columns[column] += factor * by;
            }
        }
        columns
    }

    /// Writes the rows of the couplings, which stand in `e`, and what their accelerations are without those of the free
    /// coordinates.
    #[inline(never)]
    pub(super) fn write_coupling_rows(&mut self, d: usize) {
        let tree = self.tree;
        let first = CLOSURE_ROWS * tree.closures.len();
        for (row, coupling) in (first..).zip(&tree.couplings) {
            let [driven, driver] = [&coupling.driven, &coupling.driver].map(|end| self.coupled(end));
            let [_, slope, bend, _] = self.law(coupling, &driver);
            for (end, factor) in [(&coupling.driven, 1.0), (&coupling.driver, -slope)] {
                for &(freedom, by) in &end.free {
                    self.loops.e[row * d + freedom] += factor * by;
                }
            }
            self.loops.right[row] =
                driven.acceleration - slope * driver.acceleration - bend * driver.velocity * driver.velocity;
        }
    }

    /// Adds the derivatives of Eᵀ λ with fixed λ to the residual, and computes those of the accelerations of φ.
    pub(super) fn add_coupling_derivatives(&mut self) {
        let tree = self.tree;
        let columns = self.coordinates.len();
        let first = CLOSURE_ROWS * tree.closures.len();
        for (row, coupling) in (first..).zip(&tree.couplings) {
            let driver = self.coupled(&coupling.driver);
            let [_, _, bend, third] = self.law(coupling, &driver);
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

    /// Torque [N m] or force [N] of a coupling on its driven coordinate and on its driver, after
    /// [`Dynamics::acceleration`].
    pub fn coupling_efforts(&self, index: usize) -> [f64; 2] {
        let coupling = &self.tree.couplings[index];
        let multiplier = self.loops.multipliers[CLOSURE_ROWS * self.tree.closures.len() + index];
        let [_, slope, ..] = self.law(coupling, &self.coupled(&coupling.driver));
        [-multiplier, slope * multiplier]
    }

    /// Calls `supply` with what the couplings exert on bodies.
    pub(super) fn each_coupling_load(&self, supply: &mut impl FnMut(Option<usize>, Wrench)) {
        for (index, coupling) in self.tree.couplings.iter().enumerate() {
            let efforts = self.coupling_efforts(index);
            for (end, effort) in [&coupling.driven, &coupling.driver].into_iter().zip(efforts) {
                // A force along the guide, or a torque.
                let (force, point) = match end.slide.map(|slide| &self.tree.ideal_joints[slide]) {
                    Some(joint) => match joint.realization {
                        Realization::Tree { column: Some(column), sign, .. } => {
                            let axis = sign * self.states[column + 1].axis;
                            (effort * axis, self.point(joint.points[1]).position)
                        }
                        _ => (Vec2::zeros(), Vec2::zeros()),
                    },
                    None => (Vec2::zeros(), Vec2::zeros()),
                };
                let torque = if end.slide.is_some() { 0.0 } else { effort };
                for (body, sign) in end.bodies.into_iter().zip([-1.0, 1.0]) {
                    supply(body, Wrench::at(point, sign * force, sign * torque));
                }
            }
        }
    }

    /// Power that the couplings add, zero but for errors of the velocities [W].
    pub(super) fn coupling_power(&self) -> f64 {
        let couplings = self.tree.couplings.iter().enumerate();
        let powers = couplings
            .map(|(index, coupling)| self.coupling_efforts(index)[0] * self.coupling_velocity(coupling));
        powers.sum()
    }
}
