//! Settings of a run: duration, samples, outputs, accuracy, limits.

use crate::error::{InputError, Subject};
use crate::integrators::adams::Adams;
use crate::integrators::auto::Auto;
use crate::integrators::dop853::Dop853;
use crate::integrators::rosenbrock::Rosenbrock;
use crate::integrators::tableaus::{RODAS4, RODAS5P};
use crate::integrators::{Limits, Stepper};
use crate::run::features::{FEATURE_WORDS, Feature, Window};
use crate::scene::json::{Fields, at_least, finite, parse, positive, read_object, within};

/// Integration method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The Adams method while no damping limits its steps, else Rodas4, or Rodas5P at a tight tolerance.
    Auto,
    /// Rodas4, order 4(3).
    Rodas4,
    /// Rodas5P, order 5(4).
    Rodas5P,
    /// DOP853, order 8(5,3), explicit.
    Dop853,
    /// The Adams method of variable order.
    Adams,
}

impl Method {
    /// The method for `d` degrees of freedom and a relative tolerance.
    pub fn stepper(self, d: usize, rtol: f64) -> Box<dyn Stepper> {
        match self {
            Method::Auto => Box::new(Auto::new(if rtol < TIGHT { RODAS5P } else { RODAS4 }, d)),
            Method::Rodas4 => Box::new(Rosenbrock::new(RODAS4, d)),
            Method::Rodas5P => Box::new(Rosenbrock::new(RODAS5P, d)),
            Method::Dop853 => Box::new(Dop853::new(d)),
            Method::Adams => Box::new(Adams::new(d)),
        }
    }
}

/// Relative tolerance below which Rodas5P needs less work than Rodas4. At equal tolerances it is equal between 1e-5 and 1e-4
/// in the geometric mean of random scenes that both finish (`benchmarks/methods.py`). Below 1e-5, 33 scenes were finished by
/// Rodas5P alone and one by Rodas4 alone; above, 15 and 4.
const TIGHT: f64 = 1e-5;

/// Default relative tolerance [-].
pub const DEFAULT_RTOL: f64 = 1e-6;

/// Exponent of the ratio of tolerances by which a companion (the tighter run of an error estimate) shortens
/// steps that no tolerance controls. At a tenth of the tolerance they are 0.56 times as long, which divides
/// the error of Rodas4 by 10 and that of DOP853 by 100. Half, twice: work 0, +4 % (39 of 41 runs).
const REFINEMENT_POWER: f64 = 0.25;

/// Words for the methods.
pub const METHOD_WORDS: [(&str, Method); 5] = [
    ("auto", Method::Auto),
    ("rodas5p", Method::Rodas5P),
    ("rodas4", Method::Rodas4),
    ("dop853", Method::Dop853),
    ("adams", Method::Adams),
];

/// Least and largest relative tolerance [-]: below, rounding errors exceed it; above, nothing is accurate.
pub const RTOL_RANGE: [f64; 2] = [1e-13, 0.1];

/// Samples of a run: with all columns of a small mechanism the most still fit into memory.
pub const SAMPLES_RANGE: [usize; 2] = [2, 10_000_000];

/// Cycles (equal pieces of the sampled time with features of their own).
const CYCLES_RANGE: [usize; 2] = [1, 1_000_000];

/// Steps and events that may be allowed: floats, in which results keep counts, are exact up to the most.
const COUNT_RANGE: [usize; 2] = [1, 1 << 53];

/// Settings of a run. Each number alone is judged where it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Simulated time [s].
    pub duration: f64,
    /// Number of samples, both ends included.
    pub samples: usize,
    /// Time simulated before the first sample [s].
    pub skip: f64,
    /// Relative tolerance of the local error [-].
    pub rtol: f64,
    /// Integration method.
    pub method: Method,
    /// Names of the columns; `None`: the default ones.
    pub outputs: Option<Vec<String>>,
    /// Features to compute.
    pub features: Vec<Feature>,
    /// Number of equal pieces of the sampled time, each with features of its own.
    pub cycles: usize,
    /// Local position error [m]; `None`: from `rtol` and the scene. Tighter while an impact lasts.
    pub position_tolerance: Option<f64>,
    /// Local velocity error [m/s]; `None`: from `rtol` and the scene. Tighter while an impact lasts and where a
    /// contact slides slowly.
    pub velocity_tolerance: Option<f64>,
    /// If this run is the companion of another (the tighter run of an error estimate), the `rtol` of that
    /// other run. All that limits the accuracy is then tightened in the ratio of both `rtol`.
    pub companion_of: Option<f64>,
    /// Limits of the work.
    pub limits: Limits,
}

impl Settings {
    /// Automatic choice of the method, a relative tolerance of 1e-6, the default columns.
    pub fn new(duration: f64, samples: usize) -> Self {
        Self {
            duration,
            samples,
            skip: 0.0,
            rtol: DEFAULT_RTOL,
            method: Method::Auto,
            outputs: None,
            features: Vec::new(),
            cycles: 1,
            position_tolerance: None,
            velocity_tolerance: None,
            companion_of: None,
            limits: Limits::default(),
        }
    }

    /// Instants of all samples of a run that begins at an instant [s].
    pub fn sample_times(&self, begin: f64) -> impl Iterator<Item = f64> + '_ {
        let first = begin + self.skip;
        (0..self.samples).map(move |index| first + self.sample_time(index))
    }

    /// Factor by which a companion shortens steps that no tolerance controls: runs with equal steps would
    /// show no difference.
    pub fn refinement(&self) -> f64 {
        self.companion_of.map_or(1.0, |rtol| (self.rtol / rtol).powf(REFINEMENT_POWER))
    }

    /// Instant of a sample after the first one [s]; the last one is the duration exactly.
    pub fn sample_time(&self, index: usize) -> f64 {
        if index + 1 == self.samples {
            self.duration
        } else {
            self.duration * index as f64 / (self.samples - 1) as f64
        }
    }
}

/// The settings written in `text`.
///
/// # Errors
/// Every unknown, missing or unacceptable field, with paths below `settings`.
pub fn read_settings(text: &str) -> Result<Settings, InputError> {
    let value = parse(Subject::Settings, "settings", text)?;
    let (settings, problems) = read_object(&value, "settings", None, read);
    Subject::Settings.judge(settings, problems)
}

fn read_window(fields: &mut Fields) -> Window {
    let of = fields.text("of");
    let lower = fields.optional_quantity("lower", finite("unit")).unwrap_or(f64::NEG_INFINITY);
    let upper = fields.optional_quantity("upper", finite("unit")).unwrap_or(f64::INFINITY);
    let window = Window { of, ends: [lower, upper] };
    if lower >= upper || upper == f64::INFINITY && lower == f64::NEG_INFINITY {
        fields.problem("lower", format!("must be below upper, {upper}, got {lower}"));
    } else if window.period().is_finite() && upper - lower >= window.period() {
        let width = upper - lower;
        fields.problem(
            "upper",
            format!("must be less than a turn above lower, and both be given, got {width} rad"),
        );
    }
    window
}

fn read(fields: &mut Fields) -> Settings {
    let limits = Limits::default();
    let rtol = fields.optional_quantity("rtol", within(RTOL_RANGE, "-")).unwrap_or(DEFAULT_RTOL);
    Settings {
        duration: fields.quantity("duration", positive("s")),
        samples: fields.required("samples").map_or(0, |node| node.count(SAMPLES_RANGE)),
        skip: fields.quantity_or("skip", at_least(0.0, "s"), 0.0),
        rtol,
        method: fields.word("method", &METHOD_WORDS),
        outputs: fields.optional("outputs").map(|node| node.texts()),
        features: fields.objects("features", |fields| Feature {
            kind: fields.word("kind", &FEATURE_WORDS),
            of: fields.text("of"),
            window: fields.optional("window").map(|node| node.read(read_window)),
        }),
        cycles: fields.count_or("cycles", 1, CYCLES_RANGE),
        position_tolerance: fields.optional_quantity("position_tolerance", positive("m")),
        velocity_tolerance: fields.optional_quantity("velocity_tolerance", positive("m/s")),
        // Of a run that is no tighter.
        companion_of: fields
            .optional_quantity("companion_of", within([rtol.max(RTOL_RANGE[0]), RTOL_RANGE[1]], "-")),
        limits: Limits {
            max_step: fields.optional_quantity("max_step", positive("s")).unwrap_or(limits.max_step),
            max_steps: fields.count_or("max_steps", limits.max_steps, COUNT_RANGE),
            max_events: fields.count_or("max_events", limits.max_events, COUNT_RANGE),
            ..limits
        },
    }
}
