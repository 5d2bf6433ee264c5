//! The damping of a contact, fixed at its onset or at the start of a run that begins in contact.

use crate::contact::clearance::Phase;
use crate::run::contacts::OpenContact;
use crate::run::recorder::Recorder;

/// First step after an onset: this times `rtol`^(1/(n + 1)) times the time scale of the impact. The force
/// grows as δ^n, which limits the order to n + 1 in the steps next to the onset. Measured for n = 1.5 on the
/// paper's mechanism and the ensembles of `benchmarks/stiffness.rs`: factors of 0.3 to 3 need the same work.
const ONSET_STEP: f64 = 1.0;

/// The onset of a contact.
pub(crate) struct Onset {
    /// The phase that begins.
    pub(crate) phase: Phase,
    /// Penetration rate at zero penetration [m/s].
    pub(crate) impact_velocity: f64,
    /// Bound of the next step [s].
    pub(crate) first_step: f64,
}

impl Recorder<'_> {
    /// The onset of a contact in a state with zero or slightly positive penetration.
    pub(crate) fn onset(&mut self, t: f64, q: &[f64], v: &[f64], index: usize) -> Onset {
        let mechanism = self.motion.mechanism;
        let law = &mechanism.clearance_joints[index].law.normal;
        let mass = self.contact_mass(t, q, v, index);
        let impact_velocity = self.surface_velocity(index);
        let floor = self.tolerances.impact_velocity_floor(mechanism, index);
        self.log.impacts_at_floor[index] += usize::from(law.is_latched() && impact_velocity < floor);
        let latch = law.latch(impact_velocity.max(floor));
        // In slower impacts the load determines the time scale.
        let slowest = mechanism.scales.contacts[index].resting_velocity;
        let impact_time = law.impact_time(mass, impact_velocity.max(slowest));
        Onset {
            phase: Phase::Contact { latch, clipped: false },
            impact_velocity,
            first_step: ONSET_STEP * self.settings.rtol.powf(1.0 / (law.exponent + 1.0)) * impact_time,
        }
    }

    /// Penetration rate [m/s] at zero penetration, extrapolated with the present acceleration; called after
    /// [`Recorder::contact_mass`]. A located onset has a penetration of up to a part of the position
    /// tolerance. Over this distance a load can make a slow approach several times faster.
    fn surface_velocity(&mut self, index: usize) -> f64 {
        self.motion.dynamics.accelerate(&self.motion.a);
        let state = self.motion.dynamics.contact_state(index);
        let motion = self.motion.dynamics.joint_motion(&self.motion.mechanism.clearance_joints[index]);
        let distance = motion.eccentricity.norm();
        let tangential = motion.eccentricity.perp(&motion.rate) / distance;
        let acceleration =
            motion.eccentricity.dot(&motion.acceleration) / distance + tangential * tangential / distance;
        let square = state.penetration_rate.powi(2) - 2.0 * acceleration * state.penetration;
        if square.is_nan() { state.penetration_rate } else { square.max(0.0).sqrt() }
    }

    /// Sets the phases of the contacts in which the run starts.
    pub(crate) fn begin_contacts(&mut self, q: &[f64], v: &[f64]) {
        self.motion.dynamics.move_to(0.0, q, v);
        for index in 0..self.motion.dynamics.phases.len() {
            let state = self.motion.dynamics.contact_state(index);
            let mechanism = self.motion.mechanism;
            let joint = &mechanism.clearance_joints[index];
            let law = &joint.law.normal;
            let slowest =
                joint.impact_velocity_floor.unwrap_or(mechanism.scales.contacts[index].resting_velocity);
            // A journal that the scene places on the surface may lie on either side by a rounding error.
            let touches = state.penetration > -self.gap_resolution(&self.motion.dynamics.joint_ends(joint));
            let rests = touches && state.penetration_rate.abs() < slowest;
            if !(state.penetration > 0.0 || rests) {
                continue;
            }
            // Velocity of the impact that would have reached this state without loss.
            let elastic = law.elastic_energy(state.penetration);
            let mass = self.contact_mass(0.0, q, v, index);
            let arrival = (state.penetration_rate.powi(2) + 2.0 * elastic / mass).sqrt().max(slowest);
            if law.is_latched() {
                self.warnings.push(format!(
                    "joint {:?} starts in contact: it has no impact velocity and is damped as after an impact at \
                     {arrival:.3e} m/s. This is the velocity that leads to its start without loss or, if larger, \
                     the one for which it is critically damped under the load of the start",
                    joint.name
                ));
            }
            self.motion.dynamics.phases[index] = Phase::Contact { latch: law.latch(arrival), clipped: false };
            self.log.open[index] = Some(OpenContact::begin(index, 0.0, f64::NAN));
        }
    }

    /// Effective mass [kg] for the normal force of a contact in a state.
    fn contact_mass(&mut self, t: f64, q: &[f64], v: &[f64], index: usize) -> f64 {
        if !self.motion.dynamics.acceleration(t, q, v, &mut self.motion.a) {
            return f64::INFINITY;
        }
        let joint = &self.motion.mechanism.clearance_joints[index];
        let normal = self.motion.dynamics.joint_motion(joint).eccentricity.normalize();
        self.motion.dynamics.accelerance([joint.bearing, joint.journal]).mass_along(normal)
    }
}
