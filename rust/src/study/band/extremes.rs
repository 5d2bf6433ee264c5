//! The largest of many runs at every instant, and what it would be without any one of them.
//!
//! Only the run that attains the largest value of a window can be outside of a bound that is made from the other
//! runs. The two largest values of different runs therefore give every leave-one-out bound. Windows grow by
//! merging, so that the work does not depend on the number of runs.

use super::running::Ends;

/// The label of runs that are never left out.
pub const NEVER_LEFT_OUT: u32 = u32::MAX;

/// The largest value of some runs, the run that has it, and the largest value of the other runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TopTwo {
    /// Largest value.
    pub first: f64,
    /// Run that has it.
    pub run: u32,
    /// Largest value of all other runs.
    pub second: f64,
}

impl TopTwo {
    const NONE: Self = Self { first: f64::NEG_INFINITY, run: NEVER_LEFT_OUT, second: f64::NEG_INFINITY };

    /// What two sets of values have together.
    pub fn merge(self, other: Self) -> Self {
        let (high, low) = if self.first >= other.first { (self, other) } else { (other, self) };
        // Where both have the same run, the other runs reach the second value of the lower one.
        let rival = if high.run == low.run { low.second } else { low.first };
        Self { second: if rival > high.second { rival } else { high.second }, ..high }
    }

    /// Largest value of all runs but one.
    pub fn without(self, run: u32) -> f64 {
        if self.run == run { self.second } else { self.first }
    }
}

/// The two largest values at every instant of `rows`, each `columns` long; `block` rows are a run. The first
/// `scored` runs can be left out, the others always count.
pub fn top_two(rows: &[f64], columns: usize, scored: usize, block: usize) -> Vec<TopTwo> {
    let mut top_two = vec![TopTwo::NONE; columns];
    for (index, row) in rows.chunks_exact(columns).enumerate() {
        let run = if index < scored * block { (index / block) as u32 } else { NEVER_LEFT_OUT };
        for (top, &first) in top_two.iter_mut().zip(row) {
            if first > top.second {
                *top = top.merge(TopTwo { first, run, second: f64::NEG_INFINITY });
            }
        }
    }
    top_two
}

/// The two largest values over windows that grow.
#[derive(Clone, Debug)]
pub struct GrowingWindow {
    half: usize,
    top_two: Vec<TopTwo>,
    ends: Ends,
}

impl GrowingWindow {
    /// Starts from single instants.
    pub fn new(top_two: Vec<TopTwo>, ends: Ends) -> Self {
        Self { half: 0, top_two, ends }
    }

    /// The two largest values over `half` samples to both sides; `half` must not decrease.
    pub fn grow(&mut self, half: usize) -> &[TopTwo] {
        while self.half < half {
            // Three windows side by side leave no gap up to this step.
            let step = (half - self.half).min(2 * self.half + 1);
            let top_two = &self.top_two;
            let over = |at: usize| {
                let [before, after] = self.ends.neighbors(at, step, top_two.len());
                top_two[at].merge(top_two[before]).merge(top_two[after])
            };
            self.top_two = (0..top_two.len()).map(over).collect();
            self.half += step;
        }
        &self.top_two
    }
}

/// A bound at every instant, and the same made without the run of the largest value there.
#[derive(Clone, Debug, Default)]
pub struct Bound {
    /// With all runs.
    pub all: Vec<f64>,
    /// Without the run that has the largest value at the instant.
    pub without: Vec<f64>,
}

impl Bound {
    /// Largest values over `half` samples to both sides. `runs` are the runs of the largest values at single instants.
    pub fn over(half: usize, growing: &mut GrowingWindow, runs: &[u32]) -> Self {
        let inner = growing.grow(half);
        Self {
            all: inner.iter().map(|top| top.first).collect(),
            without: inner.iter().zip(runs).map(|(top, &run)| top.without(run)).collect(),
        }
    }
}
