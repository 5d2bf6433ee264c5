//! The table of samples of a run: which instants are due, and the row of outputs at each.

use crate::dynamics::Dynamics;
use crate::run::outputs::Column;
use crate::run::settings::Settings;
use crate::run::work::Work;

/// The samples of a run, taken in the order of their instants.
pub(crate) struct Samples<'a> {
    settings: &'a Settings,
    columns: Vec<Column>,
    /// A row for each instant, a column for each output.
    values: &'a mut [f64],
    /// Instant of the first sample [s], after the time that the settings skip.
    pub(crate) from: f64,
    taken: usize,
    /// Instant of the next one [s].
    due: Option<f64>,
}

impl<'a> Samples<'a> {
    /// No sample yet of a run that begins at an instant [s].
    pub(crate) fn new(
        settings: &'a Settings,
        (columns, values): (Vec<Column>, &'a mut [f64]),
        begin: f64,
    ) -> Self {
        let mut samples =
            Self { settings, columns, values, from: begin + settings.skip, taken: 0, due: None };
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

    /// Instant of the next sample [s]; `None` after the last one.
    pub(crate) fn next_due(&self) -> Option<f64> {
        self.due
    }

    /// Instant of the last sample taken [s]; minus infinity before the first.
    pub(crate) fn last_taken(&self) -> f64 {
        self.taken.checked_sub(1).map_or(f64::NEG_INFINITY, |index| self.time(index))
    }

    /// Whether a sample has been taken.
    pub(crate) fn have_begun(&self) -> bool {
        self.taken > 0
    }

    /// Whether an instant [s] lies in the skipped time.
    pub(crate) fn skips(&self, t: f64) -> bool {
        self.settings.skip > 0.0 && t <= self.from
    }

    /// Writes the next row, from the state of the dynamics and the work up to there.
    pub(crate) fn take(&mut self, dynamics: &Dynamics, work: &Work) {
        let width = self.columns.len();
        let row = &mut self.values[self.taken * width..][..width];
        for (value, column) in row.iter_mut().zip(&self.columns) {
            *value = column.value(dynamics, work);
        }
        self.taken += 1;
        self.find_due();
    }
}
