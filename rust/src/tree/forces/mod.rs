//! Force elements: what acts between two bodies besides contacts. In: the relative motion of the two ends; out: force,
//! moments and what becomes of their power. Uses the laws of `contact` for films. Each kind is a [`Law`] in a file of its
//! own, written once for any scalar.

mod applied;
mod elastic;
mod film;
mod link;

pub use applied::Applied;
pub use elastic::Elastic;
pub use link::Link;

use crate::contact::film::FilmLaw;
use crate::numerics::dual::Scalar;
use crate::tree::elements::FramePoint;
use crate::tree::loads::Load;

/// Relative motion of the two ends of a force element, in the axes of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<S> {
    /// Vector from the first end to the second [m]; between frames the deflection as its first component [rad].
    pub apart: [S; 2],
    /// Its rate [m/s or rad/s].
    pub rate: [S; 2],
    /// Angular velocities of both bodies [rad/s]; zero between frames.
    pub turning: [S; 2],
    /// Cosine and sine of the angle of the frame of the second end.
    pub axes: [S; 2],
}

/// What a force element exerts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exerted<S> {
    /// Force on the second end [N], whose reaction acts on the first; between frames the torque as its first component [N m].
    pub force: [S; 2],
    /// Moment on the first body about its end, reversed, and on the second about its own [N m].
    pub moments: [S; 2],
}

/// What becomes of the power of a force element: it is input - lost - d(stored)/dt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Work<S> {
    /// Energy that it stores, a function of positions alone [J].
    pub stored: S,
    /// Power that it dissipates [W].
    pub lost: S,
    /// Power that formulas and functions of time put in [W].
    pub input: S,
}

/// How a force follows from the relative motion of two ends, and from the values of up to two loads.
pub trait Law {
    /// Force and moments.
    fn exerted<S: Scalar>(&self, motion: &Motion<S>, loads: [Option<S>; 2]) -> Exerted<S>;
    /// What becomes of their power.
    fn work<S: Scalar>(&self, motion: &Motion<S>, loads: [Option<S>; 2]) -> Work<S>;
    /// Whether the force depends on velocities, loads apart.
    fn damps(&self) -> bool;
    /// Names of its outputs, if it has any.
    fn outputs(&self) -> &'static [&'static str] {
        &[]
    }
    /// The output with this place among the names.
    fn output(&self, _motion: &Motion<f64>, _loads: [Option<f64>; 2], _place: usize) -> f64 {
        f64::NAN
    }
}

/// All kinds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ForceLaw {
    /// A spring and a damper along the line through two points.
    Link(Link),
    /// A spring and a damper in all directions.
    Elastic(Elastic),
    /// An oil film.
    Film(FilmLaw),
    /// An applied force or torque.
    Applied(Applied),
}

/// Between what a force element acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ends {
    /// Between two points.
    Points([FramePoint; 2]),
    /// Between two frames, as a torque; with the angle of the second relative to the first without deflection [rad].
    Frames([usize; 2], f64),
}

/// A force element of a tree.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceElement {
    /// Name.
    pub name: String,
    /// Its ends.
    pub ends: Ends,
    /// Indices of the bodies that carry them; `None` is ground.
    pub bodies: [Option<usize>; 2],
    /// What its law takes as given by a formula or a function of time.
    pub loads: [Option<Load>; 2],
    /// Its law.
    pub law: ForceLaw,
}

impl<S: Scalar> Motion<S> {
    /// The same of other numbers.
    #[inline]
    pub fn map<T>(self, of: impl Fn(S) -> T) -> Motion<T> {
        let Motion { apart, rate, turning, axes } = self;
        Motion { apart: apart.map(&of), rate: rate.map(&of), turning: turning.map(&of), axes: axes.map(&of) }
    }

    /// Distance of the ends.
    #[inline]
    fn distance(&self) -> S {
        let [x, y] = self.apart;
        (x * x + y * y).sqrt()
    }
}

impl<S: Scalar> Exerted<S> {
    /// Power of the force and of the moments [W].
    #[inline]
    pub fn power(&self, motion: &Motion<S>) -> S {
        let Motion { rate, turning, .. } = motion;
        let Self { force, moments } = self;
        force[0] * rate[0] + force[1] * rate[1] + moments[1] * turning[1] - moments[0] * turning[0]
    }
}

impl Law for ForceLaw {
    #[inline]
    fn exerted<S: Scalar>(&self, motion: &Motion<S>, loads: [Option<S>; 2]) -> Exerted<S> {
        match self {
            ForceLaw::Link(law) => law.exerted(motion, loads),
            ForceLaw::Elastic(law) => law.exerted(motion, loads),
            ForceLaw::Film(law) => law.exerted(motion, loads),
            ForceLaw::Applied(law) => law.exerted(motion, loads),
        }
    }

    fn work<S: Scalar>(&self, motion: &Motion<S>, loads: [Option<S>; 2]) -> Work<S> {
        match self {
            ForceLaw::Link(law) => law.work(motion, loads),
            ForceLaw::Elastic(law) => law.work(motion, loads),
            ForceLaw::Film(law) => law.work(motion, loads),
            ForceLaw::Applied(law) => law.work(motion, loads),
        }
    }

    fn damps(&self) -> bool {
        match self {
            ForceLaw::Link(law) => law.damps(),
            ForceLaw::Elastic(law) => law.damps(),
            ForceLaw::Film(law) => law.damps(),
            ForceLaw::Applied(law) => law.damps(),
        }
    }

    fn outputs(&self) -> &'static [&'static str] {
        match self {
            ForceLaw::Link(law) => law.outputs(),
            ForceLaw::Elastic(law) => law.outputs(),
            ForceLaw::Film(law) => law.outputs(),
            ForceLaw::Applied(law) => law.outputs(),
        }
    }

    fn output(&self, motion: &Motion<f64>, loads: [Option<f64>; 2], place: usize) -> f64 {
        match self {
            ForceLaw::Link(law) => law.output(motion, loads, place),
            ForceLaw::Elastic(law) => law.output(motion, loads, place),
            ForceLaw::Film(law) => law.output(motion, loads, place),
            ForceLaw::Applied(law) => law.output(motion, loads, place),
        }
    }
}

impl ForceElement {
    /// Names of its outputs.
    pub fn outputs(&self) -> &'static [&'static str] {
        match (&self.law, &self.ends) {
            (ForceLaw::Elastic(_), Ends::Frames(..)) => &["angle", "torque"],
            (law, _) => law.outputs(),
        }
    }

    /// Its place among all kinds: the order in which forces are added and outputs are named.
    pub(super) fn rank(&self) -> usize {
        match (&self.law, &self.ends) {
            (ForceLaw::Link(_), _) => 0,
            (ForceLaw::Elastic(_), Ends::Points(_)) => 1,
            (ForceLaw::Film(_), _) => 2,
            (ForceLaw::Elastic(_), Ends::Frames(..)) => 3,
            (ForceLaw::Applied(_), Ends::Points(_)) => 4,
            (ForceLaw::Applied(_), Ends::Frames(..)) => 5,
        }
    }
}
