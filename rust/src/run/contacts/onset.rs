//! How a contact is damped from its onset on, or from the start of a run that begins in it.

use crate::contact::clearance::Phase;
use crate::run::contacts::OpenContact;
use crate::run::recorder::Recorder;

/// First step after an onset: this times `rtol`^(1/(n + 1)) times the time scale of the impact. The force
/// begins as δ^n, which caps the order at n + 1 until the step has grown away from the onset.
/// Measured for n = 1.5 on the paper's mechanism and the ensembles of `benchmarks/stiffness.rs`: flat between 0.3 and 3.
const ONSET_STEP: f64 = 1.0;

/// How a contact begins.
pub(crate) struct Onset {
    /// Its phase.
    pub(crate) phase: Phase,
    /// Penetration rate on the surface [m/s].
    pub(crate) impact_velocity: f64,
    /// Bound of the next step [s].
    pub(crate) first_step: f64,
}

impl Recorder<'_> {
    /// The onset of a contact in a state that lies on the surface or a little beyond it.
    pub(crate) fn onset(&mut self, t: f64, q: &[f64], v: &[f64], index: usize) -> Onset {
        let mechanism = self.mechanism;
        let law = &mechanism.clearance_joints[index].law.normal;
        let mass = self.contact_mass(t, q, v, index);
        let impact_velocity = self.surface_velocity(index);
        let floor = self.tolerances.impact_velocity_floor(mechanism, index);
        self.impacts_at_floor[index] += usize::from(law.is_latched() && impact_velocity < floor);
        let latch = law.latch(impact_velocity.max(floor));
        // An approach slower than that is set by the load.
        let slowest = mechanism.scales.contacts[index].resting_velocity;
        let impact_time = law.impact_time(mass, impact_velocity.max(slowest));
        Onset {
            phase: Phase::Contact { latch, clipped: false },
            impact_velocity,
            first_step: ONSET_STEP * self.settings.rtol.powf(1.0 / (law.exponent + 1.0)) * impact_time,
        }
    }

    /// Penetration rate [m/s] with which a journal that accelerates as it does now passed the surface, after
    /// [`Recorder::contact_mass`]. A located onset lies a part of the position tolerance beyond the surface: under a load that alone
    /// makes a slow approach several times as fast.
    fn surface_velocity(&mut self, index: usize) -> f64 {
        self.dynamics.accelerate(&self.a);
        let state = self.dynamics.contact_state(index);
        let motion = self.dynamics.joint_motion(&self.mechanism.clearance_joints[index]);
        let distance = motion.eccentricity.norm();
        let tangential = motion.eccentricity.perp(&motion.rate) / distance;
        let acceleration =
            motion.eccentricity.dot(&motion.acceleration) / distance + tangential * tangential / distance;
        let square = state.penetration_rate.powi(2) - 2.0 * acceleration * state.penetration;
        if square.is_nan() { state.penetration_rate } else { square.max(0.0).sqrt() }
    }

    /// Sets the phases of the contacts in which the run starts.
    pub(crate) fn begin_contacts(&mut self, q: &[f64], v: &[f64]) {
        self.dynamics.move_to(0.0, q, v);
        for index in 0..self.dynamics.phases.len() {
            let state = self.dynamics.contact_state(index);
            let mechanism = self.mechanism;
            let joint = &mechanism.clearance_joints[index];
            let law = &joint.law.normal;
            let slowest =
                joint.impact_velocity_floor.unwrap_or(mechanism.scales.contacts[index].resting_velocity);
            // A journal that is given as touching lies on either side of the surface by rounding.
            let touches = state.penetration > -self.gap_resolution(index);
            let rests = touches && state.penetration_rate.abs() < slowest;
            if !(state.penetration > 0.0 || rests) {
                continue;
            }
            // The impact that would have come so far without loss: on the surface, that of an onset.
            let elastic = law.elastic_energy(state.penetration);
            let mass = self.contact_mass(0.0, q, v, index);
            let arrival = (state.penetration_rate.powi(2) + 2.0 * elastic / mass).sqrt().max(slowest);
            if law.is_latched() {
                self.warnings.push(format!(
                    "joint {:?} starts in contact: it has no impact velocity and is damped as an impact at \
                     {arrival:.3e} m/s, the one that would have brought it there without loss or, if that is \
                     more, one that the load of the start just damps critically",
                    joint.name
                ));
            }
            self.dynamics.phases[index] = Phase::Contact { latch: law.latch(arrival), clipped: false };
            self.open_contacts[index] = Some(OpenContact::begin(index, 0.0, f64::NAN));
        }
    }

    /// Mass [kg] that the normal force of a contact accelerates in a state.
    fn contact_mass(&mut self, t: f64, q: &[f64], v: &[f64], index: usize) -> f64 {
        if !self.dynamics.acceleration(t, q, v, &mut self.a) {
            return f64::INFINITY;
        }
        let joint = &self.mechanism.clearance_joints[index];
        let normal = self.dynamics.joint_motion(joint).eccentricity.normalize();
        self.dynamics.accelerance([joint.bearing, joint.journal]).mass_along(normal)
    }
}
