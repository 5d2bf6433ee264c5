//! Features: scalar results of the continuous motion over the sampled time, or over each of equal pieces of
//! it.
//!
//! Extrema and means are taken over the dense output of every step, with accelerations and forces computed
//! from the state as for samples; contacts are counted in the log of events. The choice of the samples does
//! not matter.

use crate::dynamics::Dynamics;
use crate::error::{InputError, Problem, Subject, meant_or_known};
use crate::mechanism::compiled::Mechanism;
use crate::run::contacts::{Contact, Event, EventKind, Place};
use crate::run::outputs::{Column, Needs, parse_columns};
use crate::run::work::Work;

/// A full turn [rad].
const TURN: f64 = 2.0 * std::f64::consts::PI;

/// Kind of a feature of an output or a clearance joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeatureKind {
    /// Largest value of an output.
    Peak,
    /// Smallest value of an output.
    Lowest,
    /// Largest minus smallest value of an output.
    PeakToPeak,
    /// When an output is largest [s].
    TimeOfPeak,
    /// When an output is smallest [s].
    TimeOfLowest,
    /// Mean of an output over time.
    Mean,
    /// Root mean square of an output over time.
    Rms,
    /// Onsets of contact in a clearance joint.
    Impacts,
    /// Part of the time in which a clearance joint is in contact.
    ContactShare,
    /// Integral of the normal force of a clearance joint over time [N s].
    Impulse,
    /// Integral of normal force times sliding speed of a clearance joint [N m].
    Wear,
    /// Energy that impacts and friction dissipate in a clearance joint [J].
    Loss,
}

/// The words for the kinds.
pub const FEATURE_WORDS: [(&str, FeatureKind); 12] = [
    ("peak", FeatureKind::Peak),
    ("lowest", FeatureKind::Lowest),
    ("peak_to_peak", FeatureKind::PeakToPeak),
    ("time_of_peak", FeatureKind::TimeOfPeak),
    ("time_of_lowest", FeatureKind::TimeOfLowest),
    ("mean", FeatureKind::Mean),
    ("rms", FeatureKind::Rms),
    ("impacts", FeatureKind::Impacts),
    ("contact_share", FeatureKind::ContactShare),
    ("impulse", FeatureKind::Impulse),
    ("wear", FeatureKind::Wear),
    ("loss", FeatureKind::Loss),
];

/// The times of which a feature is taken: those at which a quantity is between two values.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Name of an output, or `time`. An angle is taken in every turn.
    pub of: String,
    /// The values, in the unit of the quantity; infinite where there is no end.
    pub ends: [f64; 2],
}

impl Window {
    /// A full turn if the quantity is an angle [rad]; infinite for what does not return.
    pub(crate) fn period(&self) -> f64 {
        if self.of.rsplit('.').next() == Some("angle") { TURN } else { f64::INFINITY }
    }
}

/// A feature that the settings ask for.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// Its kind.
    pub kind: FeatureKind,
    /// Name of an output; of a clearance joint for the last five kinds.
    pub of: String,
    /// Its times; all if there is none.
    pub window: Option<Window>,
}

/// A quantity that can be tracked through the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    /// An output.
    Output(Column),
    /// Normal force times sliding speed of a clearance joint [W].
    WearRate(usize),
    /// Power that impacts and friction dissipate in a clearance joint [W].
    LossRate(usize),
}

impl Quantity {
    fn value(self, dynamics: &Dynamics, work: &Work) -> f64 {
        match self {
            Quantity::Output(column) => column.value(dynamics, work),
            Quantity::WearRate(joint) => dynamics.contact_loss(joint).wear,
            Quantity::LossRate(joint) => {
                let loss = dynamics.contact_loss(joint);
                loss.impact + loss.friction - dynamics.carried_power(joint)
            }
        }
    }
}

/// A window, compiled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gate {
    /// What is between the ends; the time if it is no output.
    column: Option<Column>,
    ends: [f64; 2],
    /// A full turn for angles; infinite for what does not return.
    period: f64,
}

impl Gate {
    /// Value in the state the dynamics was last placed in, at a time.
    pub(crate) fn value(&self, time: f64, dynamics: &Dynamics, work: &Work) -> f64 {
        self.column.map_or(time, |column| column.value(dynamics, work))
    }

    /// How often a value is beyond each end: it passes one where the number changes.
    pub(crate) fn passed(&self, value: f64) -> [f64; 2] {
        self.ends.map(|end| {
            if self.period.is_finite() {
                ((value - end) / self.period).floor()
            } else {
                f64::from(u8::from(value >= end))
            }
        })
    }

    /// Whether a value is between the ends.
    pub(crate) fn holds(&self, value: f64) -> bool {
        let [lower, upper] = self.passed(value);
        lower > upper
    }
}

/// A tracked quantity and which of its extrema are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tracked {
    quantity: Quantity,
    /// The gate that must be open; always if there is none.
    pub(crate) gate: Option<usize>,
    pub(crate) highest: bool,
    pub(crate) lowest: bool,
}

impl Tracked {
    /// Value in the state the dynamics was last placed in.
    pub(crate) fn value(&self, dynamics: &Dynamics, work: &Work) -> f64 {
        self.quantity.value(dynamics, work)
    }
}

/// Where the answer to a feature is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// In the extent of a tracked quantity, by its index in the list.
    Quantity(usize),
    /// In the log of a clearance joint.
    Joint(usize),
}

/// The features of a run, compiled: the quantities to track and the source of each feature.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Plan {
    pub(crate) tracked: Vec<Tracked>,
    pub(crate) gates: Vec<Gate>,
    values: Vec<(FeatureKind, Source, Option<usize>)>,
    /// What the tracked quantities need.
    pub(crate) needs: Needs,
}

impl Plan {
    /// The plan for some features.
    ///
    /// # Errors
    /// Every name that is no output or clearance joint, with the nearest known one.
    pub(crate) fn new(mechanism: &Mechanism, features: &[Feature]) -> Result<Self, InputError> {
        let mut plan = Self::default();
        let mut problems = Vec::new();
        for (index, feature) in features.iter().enumerate() {
            let path = format!("settings.features[{index}]");
            let gate = plan.gate(mechanism, feature.window.as_ref()).unwrap_or_else(|message| {
                problems.push(Problem::new(format!("{path}.window.of"), message));
                None
            });
            match plan.source(mechanism, feature, gate) {
                Ok(source) => plan.values.push((feature.kind, source, gate)),
                Err(message) => problems.push(Problem::new(format!("{path}.of"), message)),
            }
        }
        let columns: Vec<Column> = plan.columns().collect();
        plan.needs = Needs::of(&columns);
        let has_rates = plan.tracked.iter().any(|tracked| !matches!(tracked.quantity, Quantity::Output(_)));
        plan.needs.contacts |= has_rates;
        // What a spring stores, and a contact does not lose, depends on accelerations.
        let stores = mechanism.slots.iter().any(|slot| slot.law.stick_slip().is_some());
        plan.needs.acceleration |= has_rates && stores;
        Subject::Settings.judge(plan, problems)
    }

    fn gate(&mut self, mechanism: &Mechanism, window: Option<&Window>) -> Result<Option<usize>, String> {
        let Some(window) = window else { return Ok(None) };
        let Window { of, ends } = window;
        let column = if of == "time" { None } else { Some(output(mechanism, of)?) };
        let gate = Gate { column, ends: *ends, period: window.period() };
        let known = self.gates.iter().position(|known| *known == gate);
        Ok(Some(known.unwrap_or_else(|| {
            self.gates.push(gate);
            self.gates.len() - 1
        })))
    }

    fn source(
        &mut self,
        mechanism: &Mechanism,
        feature: &Feature,
        gate: Option<usize>,
    ) -> Result<Source, String> {
        use FeatureKind::{
            ContactShare, Impacts, Impulse, Loss, Lowest, Mean, Peak, PeakToPeak, Rms, TimeOfLowest,
            TimeOfPeak, Wear,
        };
        let name = &feature.of;
        match feature.kind {
            Peak | TimeOfPeak | Lowest | TimeOfLowest | PeakToPeak | Mean | Rms => {
                let column = output(mechanism, name)?;
                let highest = matches!(feature.kind, Peak | TimeOfPeak | PeakToPeak);
                let lowest = matches!(feature.kind, Lowest | TimeOfLowest | PeakToPeak);
                Ok(self.track(Quantity::Output(column), gate, highest, lowest))
            }
            Impacts | ContactShare | Impulse | Wear | Loss => {
                let joints = || mechanism.slots.iter().map(|joint| joint.name.as_str());
                let Some(joint) = joints().position(|known| known == name) else {
                    return Err(format!(
                        "unknown clearance joint {name:?}{}",
                        meant_or_known(name, joints())
                    ));
                };
                Ok(match feature.kind {
                    Wear => self.track(Quantity::WearRate(joint), gate, false, false),
                    Loss => self.track(Quantity::LossRate(joint), gate, false, false),
                    Impulse => self.track(Quantity::Output(Column::normal_force(joint)), gate, false, false),
                    _ => Source::Joint(joint),
                })
            }
        }
    }

    /// The outputs among what is tracked, and those of the gates.
    pub(crate) fn columns(&self) -> impl Iterator<Item = Column> {
        let tracked = self.tracked.iter().filter_map(|tracked| match tracked.quantity {
            Quantity::Output(column) => Some(column),
            Quantity::WearRate(_) | Quantity::LossRate(_) => None,
        });
        tracked.chain(self.gates.iter().filter_map(|gate| gate.column))
    }

    fn track(&mut self, quantity: Quantity, gate: Option<usize>, highest: bool, lowest: bool) -> Source {
        let is_known = |tracked: &Tracked| tracked.quantity == quantity && tracked.gate == gate;
        let index = self.tracked.iter().position(is_known).unwrap_or_else(|| {
            self.tracked.push(Tracked { quantity, gate, highest: false, lowest: false });
            self.tracked.len() - 1
        });
        self.tracked[index].highest |= highest;
        self.tracked[index].lowest |= lowest;
        Source::Quantity(index)
    }

    /// The features over a piece of the run between two instants [s]; `open` are the times at which each gate is.
    /// Those of times that there are none of are NaN.
    pub(crate) fn values(
        &self,
        ends: [f64; 2],
        extents: &[RunningStats],
        open: &[Vec<[f64; 2]>],
        (events, contacts): (&[Event], &[Contact]),
    ) -> impl Iterator<Item = f64> {
        self.values.iter().map(move |&(kind, source, gate)| {
            let spans = match gate {
                None => vec![ends],
                Some(gate) => within(&open[gate], ends),
            };
            match source {
                _ if spans.is_empty() => f64::NAN,
                Source::Quantity(index) => extents[index].value(kind),
                Source::Joint(joint) if kind == FeatureKind::Impacts => {
                    spans.iter().map(|&span| impacts(joint, span, events)).sum()
                }
                Source::Joint(joint) => contact_share(joint, &spans, contacts),
            }
        })
    }

    /// The features over a piece that the run did not finish.
    pub(crate) fn unknown(&self) -> impl Iterator<Item = f64> {
        self.values.iter().map(|_| f64::NAN)
    }
}

/// Extrema and integrals of a quantity over one piece of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RunningStats {
    /// Instant [s] and value where it was largest.
    pub(crate) highest: (f64, f64),
    /// Instant [s] and value where it was smallest.
    pub(crate) lowest: (f64, f64),
    /// Integral over time.
    pub(crate) integral: f64,
    /// Integral of its square over time.
    pub(crate) square: f64,
    /// Length of the piece, or of the time at which its gate is open [s].
    pub(crate) duration: f64,
}

impl RunningStats {
    /// The empty extent of a piece of this length [s].
    pub(crate) fn new(duration: f64) -> Self {
        Self {
            highest: (f64::NAN, f64::NEG_INFINITY),
            lowest: (f64::NAN, f64::INFINITY),
            integral: 0.0,
            square: 0.0,
            duration,
        }
    }

    fn value(&self, kind: FeatureKind) -> f64 {
        match kind {
            FeatureKind::Peak => self.highest.1,
            FeatureKind::Lowest => self.lowest.1,
            FeatureKind::PeakToPeak => self.highest.1 - self.lowest.1,
            FeatureKind::TimeOfPeak => self.highest.0,
            FeatureKind::TimeOfLowest => self.lowest.0,
            FeatureKind::Mean => self.integral / self.duration,
            FeatureKind::Rms => (self.square / self.duration).sqrt(),
            _ => self.integral,
        }
    }
}

/// Onsets of contact in a clearance joint between two instants [s].
fn impacts(joint: usize, [start, end]: [f64; 2], events: &[Event]) -> f64 {
    let inside = |event: &&Event| {
        let is_onset = (event.place, event.kind) == (Place::Joint(joint), EventKind::Onset);
        is_onset && event.time >= start && event.time < end
    };
    events.iter().filter(inside).count() as f64
}

/// Fraction of some spans of time [s] in which a clearance joint is in contact [-].
fn contact_share(joint: usize, spans: &[[f64; 2]], contacts: &[Contact]) -> f64 {
    let mut touched = 0.0;
    for [start, end] in spans {
        let of_joint = contacts.iter().filter(|contact| contact.joint == joint);
        // A contact without separation has NaN there, which `min` ignores.
        touched += of_joint
            .map(|contact| (contact.separation.min(*end) - contact.onset.max(*start)).max(0.0))
            .sum::<f64>();
    }
    touched / spans.iter().map(|[start, end]| end - start).sum::<f64>()
}

/// The parts of spans of time that are between two instants [s].
fn within(spans: &[[f64; 2]], [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let cut = spans.iter().map(|&[start, end]| [start.max(from), end.min(to)]);
    cut.filter(|[start, end]| end > start).collect()
}

/// The column of an output.
fn output(mechanism: &Mechanism, name: &String) -> Result<Column, String> {
    let columns = parse_columns(mechanism, std::slice::from_ref(name));
    let [column] = columns.map_err(|error| error.problems[0].message.clone())?[..] else {
        return Err(format!("unknown output {name:?}"));
    };
    Ok(column)
}
