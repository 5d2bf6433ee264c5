//! The largest of many runs at every instant, and what it would be without any one of them.
//!
//! Of all runs only the one that attains the largest value of a window can leave a bound that is made from
//! the others, so the two largest values of different runs hold every leave-one-out bound. Windows grow by
//! merging: the work does not depend on the number of runs.

use super::running::{Ends, Window};

/// The label of runs that are never left out.
pub const ALWAYS: u32 = u32::MAX;

/// The largest value of some runs, the run that has it, and the largest value of the other runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Top {
    /// Largest value.
    pub first: f64,
    /// Run that has it.
    pub run: u32,
    /// Largest value of all other runs.
    pub second: f64,
}

impl Top {
    const NONE: Self = Self { first: f64::NEG_INFINITY, run: ALWAYS, second: f64::NEG_INFINITY };

    /// What two sets of values have together.
    pub fn merge(self, other: Self) -> Self {
        let (high, low) = if self.first >= other.first { (self, other) } else { (other, self) };
        // The second of the lower one can only count where both have the same run.
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
pub fn tops(rows: &[f64], columns: usize, scored: usize, block: usize) -> Vec<Top> {
    let mut tops = vec![Top::NONE; columns];
    for (index, row) in rows.chunks_exact(columns).enumerate() {
        let run = if index < scored * block { (index / block) as u32 } else { ALWAYS };
        for (top, &first) in tops.iter_mut().zip(row) {
            if first > top.second {
                *top = top.merge(Top { first, run, second: f64::NEG_INFINITY });
            }
        }
    }
    tops
}

/// Tops over windows that grow, of every `stride`-th sample only.
#[derive(Clone, Debug)]
pub struct Growing {
    half: usize,
    tops: Vec<Top>,
    ends: Ends,
    stride: usize,
}

impl Growing {
    /// Starts from single instants.
    pub fn new(tops: Vec<Top>, ends: Ends, stride: usize) -> Self {
        Self { half: 0, tops, ends, stride }
    }

    /// Tops over `half` strides to both sides; `half` must not shrink.
    pub fn grow(&mut self, half: usize) -> &[Top] {
        while self.half < half {
            // Three windows side by side leave no gap up to this step.
            let step = (half - self.half).min(2 * self.half + 1);
            self.tops = self.widened(step);
            self.half += step;
        }
        &self.tops
    }

    /// Tops over one stride more.
    pub fn next(&self) -> Vec<Top> {
        self.widened(1)
    }

    fn widened(&self, step: usize) -> Vec<Top> {
        let tops = &self.tops;
        (0..tops.len())
            .map(|at| {
                let [before, after] = self.ends.neighbors(at, step, self.stride, tops.len());
                tops[at].merge(tops[before]).merge(tops[after])
            })
            .collect()
    }
}

/// A bound at every instant, and the bound that the run of the largest value there would have had to keep.
#[derive(Clone, Debug, Default)]
pub struct Bound {
    /// With all runs.
    pub all: Vec<f64>,
    /// Without the run that has the largest value at the instant.
    pub without: Vec<f64>,
}

impl Bound {
    /// Largest values over a window, linear between whole samples. `runs` are the runs of the largest values
    /// at single instants.
    pub fn over(window: Window, growing: &mut Growing, runs: &[u32]) -> Self {
        let inner = growing.grow(window.whole);
        let mut bound = Self {
            all: inner.iter().map(|top| top.first).collect(),
            without: inner.iter().zip(runs).map(|(top, &run)| top.without(run)).collect(),
        };
        if window.rest > 0.0 {
            for (at, outer) in growing.next().iter().enumerate() {
                bound.all[at] += window.rest * (outer.first - bound.all[at]);
                bound.without[at] += window.rest * (outer.without(runs[at]) - bound.without[at]);
            }
        }
        bound
    }
}
