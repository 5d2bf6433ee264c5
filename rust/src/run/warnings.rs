//! Notices of a run: what should be checked but did not stop it.

use crate::contact::pair::Surfaces;
use crate::error::Notice;
use crate::integrators::Stats;
use crate::mechanism::compiled::Mechanism;
use crate::numerics::accuracy::ROUNDING_OF_SOLUTION;
use crate::run::contacts::log::ContactLog;
use crate::run::contacts::{Event, EventKind, Place};
use crate::run::settings::Method;
use crate::run::tolerances::Tolerances;
use crate::run::work::balance::Balance;

/// Penetration relative to the journal radius beyond which contact laws, which assume a small contact area,
/// do not hold. Impacts of the paper's mechanism reach 1e-3; a jammed mechanism exceeds 1.
/// Half, twice: 4 notices more, one less in 81 runs.
const DEEP: f64 = 0.02;
/// Part of the time under load below the stick velocity beyond which a contact is taken to creep; reversals
/// of its sliding take less. Measured: 1e-4 to 0.01 in the paper's mechanism at 100 to 5000 r/min, 0.02 and
/// 0.03 in pendulums that swing in a bearing. Where the contact sticks: 0.11 at 10 r/min, 0.11 to 0.19 and
/// 0.47 with friction coefficients of 0.4 and 1. Half changes nothing, twice 3 of 99 runs lose a notice.
const CREEPING: f64 = 0.1;
/// Creep relative to the clearance below which there is no warning. Half, twice: the numbers of 6 notices in 98 runs.
const NOTICEABLE: f64 = 0.01;

/// Velocity tolerance, relative to the stick-slip velocity, with which the energy balance of sticking
/// contacts closes. Only the text of a notice depends on it.
const FINE_STICKING: f64 = 1e-3;

/// Part of the work that another method may need, below which the Adams method is said to be dear: half.
const DEAR: f64 = 0.5;

/// The warnings that are known at the end of a run, with the number of samples in which forces are not known.
pub(crate) fn of_run(
    mechanism: &Mechanism,
    tolerances: &Tolerances,
    log: &ContactLog,
    balance: &Balance,
    unknown_samples: usize,
) -> Vec<Notice> {
    let mut warnings = Vec::new();
    warn_of_floors(mechanism, tolerances, log, &mut warnings);
    for (joint, deepest) in mechanism.slots.iter().zip(&log.deepest) {
        if *deepest > DEEP * joint.law.size() {
            let of_what = match joint.law.surfaces {
                Surfaces::Bearing { .. } | Surfaces::Worn(_) => "the journal radius",
                Surfaces::Face(_) if joint.backlash.is_some() => "the pitch radius",
                Surfaces::Face(_) => "the size of what touches the face",
            };
            let what = format!(
                "the penetration reached {deepest:.2e} m, more than {DEEP} of {of_what}: contact laws do not \
                 hold there; the mechanism may be jammed or the stiffness too small: look at its motion there, and \
                 compare the stiffness with laws.hertz_stiffness"
            );
            let numbers = vec![("penetration", *deepest)];
            warnings.push(Notice::of_joint("deep_penetration", &joint.name, numbers, what));
        }
    }
    for (joint, stick) in mechanism.slots.iter().zip(&log.sticks) {
        if let Some(slow) = joint.law.stick_velocity()
            && stick.crept > CREEPING * stick.pressed
            && slow * stick.crept > NOTICEABLE * joint.law.clearance
        {
            let (share, crept) = (stick.crept / stick.pressed, slow * stick.crept);
            let what = format!(
                "for {:.0} % of its time in contact it slides slower than {slow:.1e} m/s, where the friction law falls \
                 to zero: a contact that should stick creeps, by at most {crept:.1e} m in all; where that matters, a \
                 smaller stick-slip velocity of the law lessens it",
                100.0 * share
            );
            let numbers = vec![("share", share), ("creep", crept)];
            warnings.push(Notice::of_joint("creep", &joint.name, numbers, what));
        }
    }
    if unknown_samples > 0 {
        warnings.push(Notice {
            code: "unknown_samples",
            about: Vec::new(),
            numbers: vec![("samples", unknown_samples as f64)],
            text: format!(
                "{unknown_samples} of the samples lie at a change point of the mechanism or next to it, where rounding \
                 errors decide the forces in its loops: these are NaN there; sample at other instants"
            ),
        });
    }
    warnings.extend(warning_of_energy(mechanism, balance));
    warnings
}

/// Warns of impacts slower than the floor of the impact velocity, which were damped as if at it.
fn warn_of_floors(
    mechanism: &Mechanism,
    tolerances: &Tolerances,
    log: &ContactLog,
    warnings: &mut Vec<Notice>,
) {
    for (index, (joint, &slow_impacts)) in mechanism.slots.iter().zip(&log.impacts_at_floor).enumerate() {
        if slow_impacts == 0 {
            continue;
        }
        let floor = tolerances.impact_velocity_floor(mechanism, index);
        let onset = |event: &&Event| (event.place, event.kind) == (Place::Joint(index), EventKind::Onset);
        let slow = match joint.impact_velocity_floor {
            Some(_) => format!("than its impact_velocity_floor of {floor:.1e} m/s"),
            None => format!("than {floor:.1e} m/s, which the tolerance cannot tell from rest,"),
        };
        let remedy = match joint.impact_velocity_floor {
            Some(_) => "a lower one, or none, leaves such impacts to the contact law",
            None => "a smaller rtol lowers that floor, and impact_velocity_floor of the joint sets it",
        };
        let impacts = log.events.iter().filter(onset).count();
        let what = format!(
            "{slow_impacts} of {impacts} impacts began slower {slow} and were damped as impacts at that velocity: {remedy}"
        );
        let numbers = vec![("slow", slow_impacts as f64), ("impacts", impacts as f64), ("floor", floor)];
        warnings.push(Notice::of_joint("impacts_at_floor", &joint.name, numbers, what));
    }
}

/// Warning that the energy balance does not close, with a remedy.
fn warning_of_energy(mechanism: &Mechanism, balance: &Balance) -> Option<Notice> {
    let laws = mechanism.slots.iter().filter_map(|joint| joint.law.friction.as_ref());
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
        let (error, share) = (balance.worst, balance.worst / balance.largest);
        Notice {
            code: "energy_balance",
            about: Vec::new(),
            numbers: vec![("error", error), ("share", share)],
            text: format!(
                "the energy balance has an error of {error:.1e} J, {:.2} % of the largest energy; forces and torques \
                 may have an error of the same size: {remedy}",
                100.0 * share
            ),
        }
    })
}

/// Warning that stability limits the steps of the Adams method, where it was asked for by its name.
pub(crate) fn of_stability(method: Method, stats: &Stats) -> Option<Notice> {
    let Stats { steps, limited, enough, .. } = *stats;
    let share = ((steps - limited.min(steps)) as f64 + enough) / steps.max(1) as f64;
    (method == Method::Adams && share < DEAR).then(|| Notice {
        code: "stability",
        about: Vec::new(),
        numbers: vec![("limited", limited as f64), ("steps", steps as f64), ("share", share)],
        text: format!(
            "stability, not accuracy, limited {limited} of {steps} steps, since forces damp or oscillate faster than the \
             motion changes: method=\"rodas5p\", or \"auto\", may need as little as {:.2} % of the work",
            100.0 * share
        ),
    })
}

/// The warnings that are known before the first step.
pub(crate) fn of_scene(mechanism: &Mechanism) -> Vec<Notice> {
    let mut warnings = mechanism.warnings.clone();
    for (joint, scales) in mechanism.slots.iter().zip(&mechanism.scales.contacts) {
        let out_of_range = joint.law.normal.out_of_range();
        warnings.extend(
            out_of_range.map(|text| Notice::of_joint("law_out_of_range", &joint.name, Vec::new(), text)),
        );
        let resting = scales.resting_penetration;
        if resting < ROUNDING_OF_SOLUTION * mechanism.scales.components[scales.component].length {
            let what = format!(
                "under the load of the start the contact rests at a penetration of {resting:.1e} m, too close to the \
                 rounding errors of positions: its contact changes may be numerical noise; do not rely on their \
                 number, or soften the contact"
            );
            let numbers = vec![("penetration", resting)];
            warnings.push(Notice::of_joint("rests_near_rounding", &joint.name, numbers, what));
        }
    }
    warnings
}
