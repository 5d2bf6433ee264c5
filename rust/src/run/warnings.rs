//! Warnings of a run.

use crate::run::contacts::{Event, EventKind};
use crate::run::recorder::Recorder;

/// Penetration relative to the journal radius beyond which contact laws, which assume a small contact area,
/// do not hold. Impacts of the paper's mechanism reach 1e-3; a jammed mechanism exceeds 1.
const DEEP: f64 = 0.02;
/// Resting penetration relative to the size of the mechanism below which rounding errors of the
/// positions (1e-16) matter: the paper's mechanism reaches it at 0.02 r/min.
const FINE_PENETRATION: f64 = 2e-12;
/// Part of the time under load below the stick velocity beyond which a contact is taken to creep; reversals
/// of its sliding take less. Measured: 1e-4 to 0.01 in the paper's mechanism at 100 to 5000 r/min, 0.02 and
/// 0.03 in pendulums that swing in a bearing. Where the contact sticks: 0.11 at 10 r/min, 0.11 to 0.19 and
/// 0.47 with friction coefficients of 0.4 and 1.
const CREEPING: f64 = 0.1;
/// Creep relative to the clearance below which there is no warning.
const NOTICEABLE: f64 = 0.01;

/// Velocity tolerance, relative to the stick-slip velocity, with which the energy balance of sticking
/// contacts closes.
const FINE_STICKING: f64 = 1e-3;

impl Recorder<'_> {
    /// All warnings of the run.
    pub(crate) fn warnings(&mut self) -> Vec<String> {
        let mut warnings = std::mem::take(&mut self.warnings);
        self.warn_of_floors(&mut warnings);
        for (joint, deepest) in self.motion.mechanism.clearance_joints.iter().zip(&self.log.deepest) {
            if *deepest > DEEP * joint.law.journal_radius {
                warnings.push(format!(
                    "joint {:?}: the penetration reached {deepest:.2e} m, more than {DEEP} of the journal radius: \
                     contact laws do not hold there; the mechanism may be jammed or the stiffness too small: look at \
                     its motion there, and compare the stiffness with mechanisms.hertz_stiffness",
                    joint.name
                ));
            }
        }
        for (joint, stick) in self.motion.mechanism.clearance_joints.iter().zip(&self.log.sticks) {
            if let Some(slow) = joint.law.stick_velocity()
                && stick.crept > CREEPING * stick.pressed
                && slow * stick.crept > NOTICEABLE * joint.law.clearance
            {
                warnings.push(format!(
                    "joint {:?}: for {:.0} % of its time in contact it slides slower than {slow:.1e} m/s, where the \
                     friction law falls to zero: a contact that should stick creeps, by at most {:.1e} m in all; where \
                     that matters, a smaller stick-slip velocity of the law lessens it",
                    joint.name,
                    100.0 * stick.crept / stick.pressed,
                    slow * stick.crept
                ));
            }
        }
        if self.unknown_samples > 0 {
            warnings.push(format!(
                "{} of the samples lie at a change point of the mechanism or next to it, where rounding errors decide the \
                 forces in its loops: these are NaN there; sample at other instants",
                self.unknown_samples
            ));
        }
        warnings.extend(self.warning_of_energy());
        warnings
    }

    /// Warns of impacts slower than the floor of the impact velocity, which were damped as if at it.
    fn warn_of_floors(&self, warnings: &mut Vec<String>) {
        let mechanism = self.motion.mechanism;
        for (index, (joint, &slow_impacts)) in
            mechanism.clearance_joints.iter().zip(&self.log.impacts_at_floor).enumerate()
        {
            if slow_impacts == 0 {
                continue;
            }
            let floor = self.tolerances.impact_velocity_floor(mechanism, index);
            let onset = |event: &&Event| event.joint == index && event.kind == EventKind::Onset;
            let slow = match joint.impact_velocity_floor {
                Some(_) => format!("than its impact_velocity_floor of {floor:.1e} m/s"),
                None => format!("than {floor:.1e} m/s, which the tolerance cannot tell from rest,"),
            };
            let remedy = match joint.impact_velocity_floor {
                Some(_) => "a lower one, or none, leaves such impacts to the contact law",
                None => "a smaller rtol lowers that floor, and impact_velocity_floor of the joint sets it",
            };
            warnings.push(format!(
                "joint {:?}: {slow_impacts} of {} impacts began slower {slow} and were damped as impacts at that \
                 velocity: {remedy}",
                joint.name,
                self.log.events.iter().filter(onset).count()
            ));
        }
    }

    /// Warning that the energy balance does not close, with a remedy.
    fn warning_of_energy(&self) -> Option<String> {
        let balance = &self.balance;
        let laws = self.motion.mechanism.clearance_joints.iter().filter_map(|joint| joint.law.friction);
        let slowest = laws.map(|law| law.stick_velocity()).fold(f64::INFINITY, f64::min);
        let remedy = if balance.is_off_in_friction() {
            format!(
                "the error arises where friction is steep, so set velocity_tolerance={:.0e}, a thousandth of the \
                 stick-slip velocity, or a smaller rtol",
                FINE_STICKING * slowest
            )
        } else {
            "set a smaller rtol".to_owned()
        };
        balance.is_off().then(|| {
            format!(
                "the energy balance has an error of {:.1e} J, {:.2} % of the largest energy; forces and torques \
                 may have an error of the same size: {remedy}",
                balance.worst,
                100.0 * balance.worst / balance.largest
            )
        })
    }

    /// Adds the warnings that are known before the first step.
    pub(crate) fn warn_of_scene(&mut self) {
        let mechanism = self.motion.mechanism;
        self.warnings.extend(mechanism.warnings.iter().map(ToString::to_string));
        for (joint, scales) in mechanism.clearance_joints.iter().zip(&mechanism.scales.contacts) {
            let caution = joint.law.normal.caution();
            self.warnings.extend(caution.map(|caution| format!("joint {:?}: {caution}", joint.name)));
            if scales.resting_penetration < FINE_PENETRATION * mechanism.scales.length {
                self.warnings.push(format!(
                    "joint {:?}: under the load of the start the contact rests at a penetration of {:.1e} m, too \
                     close to the rounding errors of positions: its contact changes may be numerical noise; do not rely \
                     on their number, or soften the contact",
                    joint.name, scales.resting_penetration
                ));
            }
        }
    }
}
