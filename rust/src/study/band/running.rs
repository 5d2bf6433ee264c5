//! Running extremes over windows in time.
//!
//! A window is a length of time, not a number of samples: values between samples are those of the straight line
//! through them. The extremes over a window then change little when the same curve is sampled twice as
//! finely.

/// A window to either side of an instant, in samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Whole samples.
    pub whole: usize,
    /// The rest, from 0 to below 1.
    pub rest: f64,
}

impl Window {
    /// A window of `samples` to either side, at least 0; it need not be a whole number.
    pub fn new(samples: f64) -> Self {
        // A whole number of samples must not lose one to rounding.
        let whole = (samples + 1e-9).floor();
        Self { whole: whole as usize, rest: (samples - whole).max(0.0) }
    }
}

/// How windows continue beyond the first and the last sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// They end there.
    Cut,
    /// They continue at the other end: the values are periodic.
    Joined,
}

impl Ends {
    /// The result of `smooth`, such as the running maximum, over a window.
    pub fn over(
        self,
        values: &[f64],
        window: Window,
        smooth: impl Fn(&[f64], Window) -> Vec<f64>,
    ) -> Vec<f64> {
        let period = values.len() - 1;
        if self == Ends::Cut || period == 0 {
            return smooth(values, window);
        }
        let more = (window.whole + 1).min(period);
        let mut longer = values[period - more..period].to_vec();
        longer.extend_from_slice(values);
        longer.extend_from_slice(&values[1..=more]);
        let found = smooth(&longer, window);
        found[more..=more + period].to_vec()
    }

    /// The samples `steps` before and after one of `count`, as far as there are any.
    pub fn neighbors(self, at: usize, steps: usize, count: usize) -> [usize; 2] {
        let last = count - 1;
        match self {
            Ends::Cut => [at.saturating_sub(steps), (at + steps).min(last)],
            Ends::Joined => [(at + last - steps % last) % last, (at + steps) % last],
        }
    }
}

/// Largest value within the window around every sample; windows are cut short at both ends.
pub fn running_maximum(values: &[f64], window: Window) -> Vec<f64> {
    let mut largest = values.to_vec();
    if window.whole > 0 {
        whole_window(&mut largest, window.whole.min(values.len()));
    }
    if window.rest > 0.0 {
        let step = window.whole;
        for (at, largest) in largest.iter_mut().enumerate() {
            if at + step + 1 < values.len() {
                let inner = values[at + step];
                *largest = largest.max(inner + window.rest * (values[at + step + 1] - inner));
            }
            if at > step {
                let inner = values[at - step];
                *largest = largest.max(inner + window.rest * (values[at - step - 1] - inner));
            }
        }
    }
    largest
}

/// Mean of the straight lines through the values over the window around every sample.
pub fn running_mean(values: &[f64], window: Window) -> Vec<f64> {
    let last = values.len() - 1;
    // Integral from the first sample to each.
    let mut integral = vec![0.0; values.len()];
    for at in 1..values.len() {
        integral[at] = integral[at - 1] + 0.5 * (values[at - 1] + values[at]);
    }
    let reach = window.whole as f64 + window.rest;
    if reach == 0.0 || last == 0 {
        return values.to_vec();
    }
    let up_to = |place: f64| {
        let at = (place.floor() as usize).min(last - 1);
        let part = place - at as f64;
        let end = values[at] + part * (values[at + 1] - values[at]);
        integral[at] + 0.5 * part * (values[at] + end)
    };
    (0..values.len())
        .map(|at| {
            let (from, to) = ((at as f64 - reach).max(0.0), (at as f64 + reach).min(last as f64));
            (up_to(to) - up_to(from)) / (to - from)
        })
        .collect()
}

/// Largest value within `half` samples to both sides: maxima over spans of 1, 2, 4, ... samples, two
/// overlapping ones of the longest span cover a window.
fn whole_window(values: &mut [f64], half: usize) {
    let (size, width) = (values.len(), 2 * half + 1);
    let mut reach = vec![f64::NEG_INFINITY; size + 2 * half];
    reach[half..half + size].copy_from_slice(values);
    let (mut span, mut length) = (1, reach.len());
    while 2 * span <= width {
        length -= span;
        for at in 0..length {
            reach[at] = larger(reach[at], reach[at + span]);
        }
        span *= 2;
    }
    for (at, value) in values.iter_mut().enumerate() {
        *value = larger(reach[at], reach[at + width - span]);
    }
}

/// The larger of two finite numbers. Unlike `f64::max`, which treats NaN, it compiles to one instruction for several
/// pairs.
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
