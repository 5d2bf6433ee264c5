//! Quantities tracked through the dense output of every step, for the features of a run; an observer of its steps.

use crate::integrators::dense::DenseStep;
use crate::numerics::accuracy::ROUNDING_OF_CHAIN;
use crate::numerics::extremum::highest_within;
use crate::run::contacts::{Contact, Event};
use crate::run::features::{Plan, RunningStats};
use crate::run::motion::Motion;
use crate::run::settings::Settings;
use crate::run::work::{GAUSS as GAUSS_OF_WORK, Work};

/// Nodes and weights of Gauss's quadrature with six points on [0, 1]. An explicit step may cover 5 rad of the
/// oscillation of a contact, 10 rad of its square. The error of four points is then 6 % of the amplitude, of
/// six 2e-4. Extrema are searched between the same points, at most a quarter of the step apart.
const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_2, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];
/// Number of values on a part of a step: at its ends and the nodes.
const ROWS: usize = GAUSS.len() + 2;
/// Distance from an end at which the slope there is evaluated, relative to that to the next value.
/// Half and twice change one of 8 features, in its last digits.
const EDGE: f64 = 1e-3;
/// Writes the state at an instant and updates the work up to it, if that is needed; false where the state
/// does not exist.
pub(crate) type StateAt<'s> = dyn FnMut(&mut Motion, f64, &mut [f64], &mut [f64]) -> bool + 's;

/// Extents of the tracked quantities so far.
#[derive(Clone, Debug)]
pub(crate) struct Tracking {
    plan: Plan,
    /// Ends of the pieces of the run [s], its start first.
    bounds: Vec<f64>,
    /// Extents of all quantities, a row for each piece.
    extents: Vec<RunningStats>,
    /// The times at which each gate is open [s].
    open: Vec<Vec<[f64; 2]>>,
    /// Instant up to which the quantities have been tracked [s].
    reached: f64,
    /// The piece that starts or continues there.
    piece: usize,
    /// Values at the ends and nodes of a part of a step, row-major.
    values: Vec<f64>,
    /// Whether the last row is also the first of the next part: no phase has changed since.
    continuous: bool,
    /// State and work at an instant.
    q: Vec<f64>,
    v: Vec<f64>,
    work: Work,
}

impl Tracking {
    /// Empty extents, for a run of `d` coordinates whose samples begin at `from` [s].
    pub(crate) fn new(plan: Plan, settings: &Settings, from: f64, d: usize) -> Self {
        let cycles = settings.cycles;
        // The last piece ends where the run does, to the last digit.
        let bounds: Vec<f64> = (0..cycles)
            .map(|k| settings.duration * k as f64 / cycles as f64)
            .chain([settings.duration])
            .map(|passed| from + passed)
            .collect();
        let mut extents = Vec::new();
        for ends in bounds.windows(2) {
            extents.extend(plan.tracked.iter().map(|tracked| {
                RunningStats::new(if tracked.gate.is_some() { 0.0 } else { ends[1] - ends[0] })
            }));
        }
        Self {
            values: vec![f64::NAN; ROWS * plan.tracked.len()],
            open: vec![Vec::new(); plan.gates.len()],
            plan,
            bounds,
            extents,
            reached: from,
            piece: 0,
            continuous: false,
            q: vec![0.0; d],
            v: vec![0.0; d],
            work: Work::default(),
        }
    }

    /// Whether the motion up to an instant [s] must be tracked.
    pub(crate) fn wants(&self, until: f64) -> bool {
        !(self.plan.tracked.is_empty() && self.plan.gates.is_empty()) && until > self.reached
    }

    /// A phase has changed, so that values may jump.
    pub(crate) fn interrupt(&mut self) {
        self.continuous = false;
    }

    /// All features, a row for each piece; NaN for pieces that the run, which ended at `end` [s], did not
    /// finish.
    pub(crate) fn values(&self, end: f64, events: &[Event], contacts: &[Contact]) -> Vec<f64> {
        let width = self.plan.tracked.len();
        let mut values = Vec::new();
        for (piece, ends) in self.bounds.windows(2).enumerate() {
            if end >= ends[1] {
                let extents = &self.extents[piece * width..][..width];
                values.extend(self.plan.values([ends[0], ends[1]], extents, &self.open, (events, contacts)));
            } else {
                values.extend(self.plan.unknown());
            }
        }
        values
    }

    /// Tracks the quantities through an accepted step.
    pub(crate) fn accepted(&mut self, step: &DenseStep, motion: &mut Motion) {
        if !self.wants(step.end_time()) {
            return;
        }
        let needs_work = self.plan.needs.work;
        let state = &mut |motion: &mut Motion, t: f64, q: &mut [f64], v: &mut [f64]| {
            if needs_work {
                motion.add_work_of(&GAUSS_OF_WORK, step, t);
            }
            motion.state_inside(step, t, q, v);
            true
        };
        motion.visit_inside(|motion| {
            self.track_to(step.end_time(), motion, state);
        });
    }

    /// Tracks the quantities to `end` [s]; false where there is no state.
    pub(crate) fn track_to(&mut self, end: f64, motion: &mut Motion, state: &mut StateAt) -> bool {
        while self.wants(end) {
            let from = self.reached;
            let bound = self.bounds[self.piece + 1];
            // A drive may make many turns in one step.
            let to = end.min(bound).min(from + motion.piece_of_work(from, end - from));
            let to = self.next_edge(from, to, motion, state);
            if !self.track_part(from, to, motion, state) {
                return false;
            }
            self.reached = to;
            if to >= bound {
                self.piece += 1;
            }
            if self.wants(end) && !motion.visits_further_piece(from) {
                // This step is the last one.
                break;
            }
        }
        true
    }

    /// Tracks the quantities through a part of a step.
    fn track_part(&mut self, from: f64, to: f64, motion: &mut Motion, state: &mut StateAt) -> bool {
        let width = self.plan.tracked.len();
        let mut times = [from; ROWS];
        for (time, (place, _)) in times[1..].iter_mut().zip(GAUSS) {
            *time = from + place * (to - from);
        }
        times[ROWS - 1] = to;
        let is_open = self.open_gates([from, times[ROWS / 2], to], motion, state);
        let mut values = std::mem::take(&mut self.values);
        values.copy_within((ROWS - 1) * width.., 0);
        let known = usize::from(self.continuous);
        let mut defined = true;
        for (row, time) in times.iter().enumerate().skip(known) {
            defined &= self.place_at(*time, motion, state);
            for (value, tracked) in values[row * width..][..width].iter_mut().zip(&self.plan.tracked) {
                *value = tracked.value(&motion.dynamics, &self.work);
            }
        }
        for index in 0..width {
            let gate = self.plan.tracked[index].gate;
            if gate.is_some_and(|gate| !is_open[gate]) {
                continue;
            }
            let column: [f64; ROWS] = std::array::from_fn(|row| values[row * width + index]);
            let place = self.piece * width + index;
            let mut extent = self.extents[place];
            if gate.is_some() {
                extent.duration += to - from;
            }
            for ((_, weight), value) in GAUSS.iter().zip(&column[1..]) {
                extent.integral += weight * (to - from) * value;
                extent.square += weight * (to - from) * value * value;
            }
            let tracked = self.plan.tracked[index];
            if tracked.highest {
                extent.highest = self.raised(extent.highest, index, (&times, &column), 1.0, motion, state);
            }
            if tracked.lowest {
                let (time, value) = extent.lowest;
                let opposite = column.map(|value| -value);
                let (time, value) =
                    self.raised((time, -value), index, (&times, &opposite), -1.0, motion, state);
                extent.lowest = (time, -value);
            }
            self.extents[place] = extent;
        }
        self.values = values;
        self.continuous = true;
        defined
    }

    /// Which gates are open over a part of a step inside which none opens or closes: an instant within tells.
    fn open_gates(
        &mut self,
        [from, within, to]: [f64; 3],
        motion: &mut Motion,
        state: &mut StateAt,
    ) -> Vec<bool> {
        let mut is_open = Vec::with_capacity(self.plan.gates.len());
        for gate in 0..self.plan.gates.len() {
            let value = self.gate_value(gate, within, motion, state);
            is_open.push(self.plan.gates[gate].holds(value));
            match self.open[gate].last_mut() {
                _ if !is_open[gate] => {}
                Some([_, end]) if *end == from => *end = to,
                _ => self.open[gate].push([from, to]),
            }
        }
        is_open
    }

    /// The first instant of a part of a step at which a gate opens or closes; its end if none does.
    fn next_edge(&mut self, from: f64, to: f64, motion: &mut Motion, state: &mut StateAt) -> f64 {
        let mut first = to;
        for gate in 0..self.plan.gates.len() {
            let nodes = GAUSS.iter().map(|(place, _)| from + place * (to - from));
            let times: Vec<f64> = std::iter::once(from).chain(nodes).chain([to]).collect();
            let mut known: Vec<(f64, f64)> =
                times.iter().map(|&time| (time, self.gate_value(gate, time, motion, state))).collect();
            // Between two values it may pass an end and return.
            for k in 1..ROWS - 1 {
                let [before, here, after] = [k - 1, k, k + 1].map(|k| known[k]);
                let sign = if here.1 >= before.1 && here.1 >= after.1 { 1.0 } else { -1.0 };
                let way =
                    sign * (here.1 - if sign > 0.0 { before.1.min(after.1) } else { before.1.max(after.1) });
                let is_extremum = sign * here.1 >= sign * before.1 && sign * here.1 >= sign * after.1;
                let passed = |value: f64| self.plan.gates[gate].passed(value);
                if is_extremum && way > 0.0 && passed(here.1) != passed(here.1 + sign * way) {
                    let (time, value) =
                        highest_within([before.0, after.0], (here.0, sign * here.1), |time| {
                            sign * self.gate_value(gate, time, motion, state)
                        });
                    known.push((time, sign * value));
                }
            }
            known.sort_by(|a, b| a.0.total_cmp(&b.0));
            for pair in known.windows(2) {
                let [mut low, mut high] = [pair[0].0, pair[1].0];
                let before = self.plan.gates[gate].passed(pair[0].1);
                if before == self.plan.gates[gate].passed(pair[1].1) {
                    continue;
                }
                while low < 0.5 * (low + high) && 0.5 * (low + high) < high {
                    let middle = 0.5 * (low + high);
                    let value = self.gate_value(gate, middle, motion, state);
                    if self.plan.gates[gate].passed(value) == before { low = middle } else { high = middle }
                }
                first = first.min(high);
                break;
            }
        }
        first
    }

    fn gate_value(&mut self, gate: usize, time: f64, motion: &mut Motion, state: &mut StateAt) -> f64 {
        self.place_at(time, motion, state);
        self.plan.gates[gate].value(time, &motion.dynamics, &self.work)
    }

    /// The maximum of a quantity times `sign`: the one known so far, or a higher one on a part of a step. It
    /// is searched beside values that are no lower than their neighbors, unless the differences to these are
    /// too small: a parabola through three values exceeds the highest by at most an eighth of the larger
    /// difference.
    fn raised(
        &mut self,
        mut best: (f64, f64),
        index: usize,
        (times, values): (&[f64; ROWS], &[f64; ROWS]),
        sign: f64,
        motion: &mut Motion,
        state: &mut StateAt,
    ) -> (f64, f64) {
        const LAST: usize = ROWS - 1;
        for (k, (&time, &value)) in times.iter().zip(values).enumerate() {
            // NaN stays: the extremum is then not known.
            if value > best.1 || value.is_nan() {
                best = (time, value);
            }
            let (left, right) = (k.saturating_sub(1), (k + 1).min(LAST));
            let way = value - values[left].min(values[right]);
            let top = value >= values[left] && (value > values[right] || k == LAST);
            if !top || way <= ROUNDING_OF_CHAIN * value.abs() || value + way <= best.1 {
                continue;
            }
            let mut at = |time: f64| sign * self.tracked_value(index, time, motion, state);
            let inside = match k {
                // At an end that is higher than the node beside it, the quantity may still rise toward that
                // node.
                0 | LAST => {
                    let other = if k == 0 { times[right] } else { times[left] };
                    let edge = time + EDGE * (other - time);
                    let inside = (edge, at(edge));
                    if inside.1 <= value {
                        continue;
                    }
                    inside
                }
                _ => (time, value),
            };
            let found = highest_within([times[left], times[right]], inside, at);
            if found.1 > best.1 {
                best = found;
            }
        }
        best
    }

    fn tracked_value(&mut self, index: usize, time: f64, motion: &mut Motion, state: &mut StateAt) -> f64 {
        if self.place_at(time, motion, state) {
            self.plan.tracked[index].value(&motion.dynamics, &self.work)
        } else {
            f64::NAN
        }
    }

    /// Computes the dynamics in the state at an instant, with the work done until then.
    fn place_at(&mut self, time: f64, motion: &mut Motion, state: &mut StateAt) -> bool {
        // The state may bring the work up to its instant, also where an output alone needs it: the work of the step must
        // not count twice.
        let before = motion.counts_work.then(|| motion.work.clone());
        let defined = state(motion, time, &mut self.q, &mut self.v);
        motion.q.copy_from_slice(&self.q);
        motion.v.copy_from_slice(&self.v);
        if let Some(before) = before {
            self.work = std::mem::replace(&mut motion.work, before);
        }
        motion.place(time, self.plan.needs);
        defined
    }
}
