//! Energies, and the powers in their balance.
//!
//! ```text
//! kinetic + potential + contact = start + input - impact loss - friction loss - damping loss
//! ```
//!
//! holds exactly for exact solutions of the equations of motion, whatever the laws.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{Dynamics, SlotContact};
use crate::contact::pair::{ContactState, Phase, SlidingVelocity, Surfaces};
use crate::contact::sticking::Traction;
use crate::tree::elements::ContactSlot;

/// Power dissipated in a clearance joint.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct ContactLoss {
    /// Power of the hysteresis damping [W].
    pub impact: f64,
    /// Power of friction [W].
    pub friction: f64,
    /// Normal force times sliding speed of the surfaces [N m/s]: the integrand of Archard's wear.
    pub wear: f64,
}

impl Dynamics<'_> {
    /// Kinetic energy of all bodies [J].
    pub fn kinetic_energy(&self) -> f64 {
        let tree = self.tree;
        tree.inertias
            .iter()
            .chain(&tree.driven_inertias)
            .map(|body| {
                let frame = &self.states[body.frame];
                let velocity = frame.point(body.center).velocity;
                0.5 * (body.mass * velocity.norm_squared() + body.inertia * frame.angular_velocity.powi(2))
            })
            .sum()
    }

    /// Potential energy of gravity, zero at the origin, and of the springs [J].
    pub fn potential_energy(&self) -> f64 {
        let tree = self.tree;
        let bodies = tree.inertias.iter().chain(&tree.driven_inertias);
        let heights = bodies
            .map(|body| -body.mass * tree.gravity.dot(&self.states[body.frame].point(body.center).position));
        heights.sum::<f64>() + tree.forces.iter().map(|element| self.work_of(element).stored).sum::<f64>()
    }

    /// Elastic energy of a contact [J], after [`Dynamics::find_contacts`].
    pub fn contact_energy(&self, index: usize) -> f64 {
        let SlotContact { motion, state: ContactState { penetration, .. } } = &self.contacts[index];
        match self.phases[index] {
            Phase::Free | Phase::Beyond => 0.0,
            Phase::Contact { traction: None, .. } => {
                self.tree.slots[index].law.elastic(motion, *penetration).1
            }
            Phase::Contact { .. } => {
                self.tree.slots[index].law.normal.elastic_energy(*penetration)
                    + self.spring_energy(&self.tree.slots[index], self.phases[index])
            }
        }
    }

    /// Energy of the tangential spring of a slot in a phase [J], after [`Dynamics::move_to`]; zero where it has none.
    pub fn spring_energy(&self, slot: &ContactSlot, phase: Phase) -> f64 {
        let Phase::Contact { traction: Some(traction), clipped: false, .. } = phase else { return 0.0 };
        let SlotContact { motion, state } = self.contact_of(slot, phase);
        let force = slot.law.spring_force(&traction, &motion, state.friction_force);
        0.5 * force * force / traction.stiffness
    }

    /// The part of that energy which a contact carries along while it slides [J]. It is a function of the state, so that
    /// its change needs no quadrature: losses are the integral of [`Dynamics::contact_loss`] less this energy.
    pub fn carried_energy(&self, index: usize) -> f64 {
        match self.phases[index] {
            Phase::Contact { traction: Some(traction), .. } if !traction.sticks() => {
                self.spring_energy(&self.tree.slots[index], self.phases[index])
            }
            _ => 0.0,
        }
    }

    /// Its rate [W], after [`Dynamics::find_contacts`] and [`Dynamics::accelerate`].
    pub fn carried_power(&self, index: usize) -> f64 {
        match self.phases[index] {
            Phase::Contact { traction: Some(traction), clipped: false, .. } if !traction.sticks() => {
                let state = &self.contacts[index].state;
                let slider = self.slider_velocity(&self.tree.slots[index], self.phases[index], &traction);
                state.friction_force * (slider - state.sliding_velocity)
            }
            _ => 0.0,
        }
    }

    /// The same of all contacts together [J].
    pub fn carried_energies(&self) -> f64 {
        (0..self.phases.len()).map(|index| self.carried_energy(index)).sum()
    }

    /// Elastic energy of all contacts [J], after [`Dynamics::find_contacts`].
    pub fn contact_energies(&self) -> f64 {
        (0..self.phases.len()).map(|index| self.contact_energy(index)).sum()
    }

    /// Kinetic, potential and elastic contact energy together [J], after [`Dynamics::find_contacts`].
    pub fn total_energy(&self) -> f64 {
        self.kinetic_energy() + self.potential_energy() + self.contact_energies()
    }

    /// Power dissipated in a contact, after [`Dynamics::find_contacts`].
    pub fn contact_loss(&self, index: usize) -> ContactLoss {
        if !self.phases[index].touches() {
            return ContactLoss::default();
        }
        let law = &self.tree.slots[index].law;
        let SlotContact { motion, state } = &self.contacts[index];
        // Without the energy, which takes a quadrature where the law is a formula.
        let elastic = match &law.surfaces {
            Surfaces::Worn(worn) => worn.elastic(motion.eccentricity).0,
            _ => law.normal.elastic_force(state.penetration),
        };
        let impact = (state.normal_force - elastic) * state.penetration_rate;
        if let Phase::Contact { traction: Some(traction), clipped: false, .. } = self.phases[index] {
            return self.stick_slip_loss(index, &traction, impact);
        }
        // The physical sliding velocity, whichever convention the friction law uses.
        let sliding = match law.sliding {
            SlidingVelocity::Surface => state.sliding_velocity,
            SlidingVelocity::ContactPoint => law.surface_velocity(motion),
        };
        ContactLoss {
            impact,
            friction: -state.friction_force * sliding,
            wear: state.normal_force.max(0.0) * sliding.abs(),
        }
    }

    /// The power dissipated in a contact that may stick, beside that of the impact [W]. While it slides this is the power of
    /// friction, with what the spring carries along: see [`Dynamics::carried_energy`].
    fn stick_slip_loss(&self, index: usize, traction: &Traction, impact: f64) -> ContactLoss {
        let SlotContact { motion, state } = &self.contacts[index];
        if traction.sticks() {
            let spring = self.tree.slots[index].law.spring_force(traction, motion, state.friction_force);
            let friction = (spring - state.friction_force) * state.sliding_velocity;
            return ContactLoss { impact, friction, wear: 0.0 };
        }
        ContactLoss {
            impact,
            friction: -state.friction_force * state.sliding_velocity,
            wear: state.normal_force.max(0.0) * state.sliding_velocity.abs(),
        }
    }

    /// Adds a wear of a contact [N m] to the sectors of its bearing in which the surfaces touch; after
    /// [`Dynamics::find_contacts`]. Sectors count from the x axis of the body of the bearing, counterclockwise.
    pub fn add_wear_by_sector(&self, index: usize, wear: f64, sectors: &mut [f64]) {
        if sectors.is_empty() || wear == 0.0 {
            return;
        }
        let slot = &self.tree.slots[index];
        let motion = &self.contacts[index].motion;
        if let Surfaces::Worn(worn) = &slot.law.surfaces {
            return worn.distribute(motion.eccentricity, wear, sectors);
        }
        let angle = slot.bodies[0].map_or(0.0, |body| self.tree.bodies[body].angle)
            + self.states[slot.points[0].frame].angle;
        let [x, y] = motion.eccentricity;
        let turns = (y.atan2(x) - angle) / TAU;
        let count = sectors.len();
        sectors[(turns.rem_euclid(1.0) * count as f64) as usize % count] += wear;
    }

    /// Power of the drives, and of what formulas and functions of time exert [W]; after
    /// [`Dynamics::find_reactions`].
    pub fn input_power(&self) -> f64 {
        let drives = (0..self.tree.driven.len()).map(|index| self.drive_power(index));
        let forces = self.tree.forces.iter().map(|element| self.work_of(element).input);
        drives.sum::<f64>() + forces.sum::<f64>()
    }

    /// The same by the balance of power: that of the inertial forces and gravity less that of contacts, springs
    /// and loop closures; after [`Dynamics::acceleration_and_contacts`] and [`Dynamics::accelerate`].
    ///
    /// It needs no reactions. Where the equations of motion do not hold, which only reactions would tell, the two
    /// differ.
    pub fn balanced_power(&self) -> f64 {
        let tree = self.tree;
        // Accelerations of frames are relative to free fall.
        let inertial = tree.inertias.iter().chain(&tree.driven_inertias).map(|body| {
            let frame = &self.states[body.frame];
            let center = frame.point(body.center);
            body.mass * center.acceleration.dot(&center.velocity)
                + body.inertia * frame.angular_acceleration * frame.angular_velocity
        });
        let contacts = self.contacts.iter().map(|SlotContact { motion, state }| {
            let [force_x, force_y] = state.force;
            force_x * motion.rate[0] + force_y * motion.rate[1] + state.friction_force * motion.spin
        });
        let forces = tree.forces.iter().map(|element| {
            self.exerted(element).power(&self.relative_motion(element)) - self.work_of(element).input
        });
        let closures =
            tree.closures.iter().enumerate().map(|(index, closure)| {
                self.closure_force(index).dot(&self.between([closure.a, closure.b])[1])
            });
        inertial.sum::<f64>()
            - contacts.sum::<f64>()
            - forces.sum::<f64>()
            - closures.sum::<f64>()
            - self.coupling_power()
            - (0..tree.dry_joints.len())
                .map(|index| self.dry_effort(index) * self.dry_velocity(index))
                .sum::<f64>()
    }

    /// Power of a drive [W]; after [`Dynamics::find_reactions`].
    pub fn drive_power(&self, index: usize) -> f64 {
        let driven = &self.tree.driven[index];
        self.drive_effort(index) * driven.sign * self.coordinates[driven.column].velocity
    }

    /// Power dissipated in dampers and oil films [W].
    pub fn damping_loss(&self) -> f64 {
        self.tree.forces.iter().map(|element| self.work_of(element).lost).sum()
    }
}
