//! The table of samples of a run, an observer of its steps: which instants are due, and the row of outputs at each.

use crate::integrators::dense::DenseStep;
use crate::run::motion::Motion;
use crate::run::outputs::{Column, Needs};
use crate::run::settings::Settings;
use crate::run::work::{GAUSS, Work};

/// The samples of a run, taken in the order of their instants.
pub(crate) struct Samples<'a> {
    settings: &'a Settings,
    columns: Vec<Column>,
    /// A row for each instant, a column for each output.
    values: &'a mut [f64],
    /// Instant of the first sample [s], after the time that the settings skip.
    pub(crate) from: f64,
    pub(crate) taken: usize,
    /// Instant of the next one [s]; none after the last.
    pub(crate) due: Option<f64>,
    /// What must be computed for a row.
    needs: Needs,
    /// Rows near a change point, where forces in the loops are not known.
    pub(crate) unknown: usize,
    /// The first other row with an output that is no finite number: forces or energies that overflow.
    lost: Option<usize>,
    /// The work up to the present step, while that of the motion is up to a sample inside it.
    work_of_steps: Work,
}

impl<'a> Samples<'a> {
    /// No sample yet of a run that begins at an instant [s].
    pub(crate) fn new(
        settings: &'a Settings,
        (columns, values): (Vec<Column>, &'a mut [f64]),
        begin: f64,
    ) -> Self {
        let mut samples = Self {
            needs: Needs::of(&columns),
            settings,
            columns,
            values,
            from: begin + settings.skip,
            taken: 0,
            due: None,
            unknown: 0,
            lost: None,
            work_of_steps: Work::default(),
        };
        samples.find_due();
        samples
    }

    fn find_due(&mut self) {
        self.due = (self.taken < self.settings.samples).then(|| self.time(self.taken));
    }

    fn time(&self, index: usize) -> f64 {
        self.from + self.settings.sample_time(index)
    }

    /// Instant of the last of all samples [s].
    pub(crate) fn end(&self) -> f64 {
        self.time(self.settings.samples - 1)
    }

    /// Instant of the last sample taken [s]; minus infinity before the first.
    pub(crate) fn last_taken(&self) -> f64 {
        self.taken.checked_sub(1).map_or(f64::NEG_INFINITY, |index| self.time(index))
    }

    /// Instant of the first row with an output that is no finite number [s]; it is taken back with those after it.
    pub(crate) fn first_lost(&mut self) -> Option<f64> {
        self.taken = self.lost?;
        Some(self.time(self.taken))
    }

    /// Makes the samples that were not taken NaN.
    pub(crate) fn forget_the_rest(&mut self) {
        self.values[self.taken * self.columns.len()..].fill(f64::NAN);
    }

    /// Whether an instant [s] lies in the skipped time.
    pub(crate) fn skips(&self, t: f64) -> bool {
        self.settings.skip > 0.0 && t <= self.from
    }

    /// Whether a sample is due up to an instant [s].
    pub(crate) fn wants(&self, until: f64) -> bool {
        self.due.is_some_and(|due| due <= until)
    }

    /// Takes the samples that are due in an accepted step.
    pub(crate) fn accepted(&mut self, step: &DenseStep, motion: &mut Motion) {
        let end = step.end_time();
        if self.wants(end) {
            motion.visit_inside(|motion| self.take_until(end, step, motion));
        }
    }

    fn take_until(&mut self, end: f64, step: &DenseStep, motion: &mut Motion) {
        while let Some(t) = self.due.filter(|&due| due <= end) {
            if motion.counts_work {
                // Saved, so that the sum over the steps does not depend on the samples.
                self.work_of_steps.clone_from(&motion.work);
                motion.add_work_of(&GAUSS, step, t);
            }
            if motion.goes_on(step.t).is_err() {
                // This step is the last one.
                break;
            }
            motion.move_inside(step, t);
            self.take(motion, t);
            if motion.counts_work {
                std::mem::swap(&mut motion.work, &mut self.work_of_steps);
            }
        }
    }

    /// Takes the next sample in a given state.
    pub(crate) fn take_state(&mut self, motion: &mut Motion, t: f64, q: &[f64], v: &[f64]) {
        motion.q.copy_from_slice(q);
        motion.v.copy_from_slice(v);
        self.take(motion, t);
    }

    /// Writes the next row, from the state of the motion.
    fn take(&mut self, motion: &mut Motion, t: f64) {
        motion.place(t, self.needs);
        let asked = self.needs.reactions || self.needs.acceleration;
        let unknown = asked && motion.dynamics.is_near_change_point();
        self.unknown += usize::from(unknown);
        let width = self.columns.len();
        let row = &mut self.values[self.taken * width..][..width];
        for (value, column) in row.iter_mut().zip(&self.columns) {
            *value = column.value(&motion.dynamics, &motion.work);
        }
        let is_lost = |value: &f64| value.is_infinite() || value.is_nan() && !motion.work.is_unknown();
        if self.lost.is_none() && row.iter().any(is_lost) && !motion.dynamics.is_near_change_point() {
            self.lost = Some(self.taken);
        }
        self.taken += 1;
        self.find_due();
    }
}
