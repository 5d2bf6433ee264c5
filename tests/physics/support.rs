//! Scenes and helpers shared by the tests.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::contact::pair::SlidingVelocity;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::scene::parts::{Body, CENTER_OF_MASS, Drive, Joint, JointKind, Point, Scene};

/// A point with a name.
pub fn point(name: &str, x: f64, y: f64) -> Point {
    Point { name: name.to_owned(), position: [x, y] }
}

/// A body with its moment of inertia about its center of mass and an initial guess of zero for its angle.
pub fn body(name: &str, mass: f64, inertia: f64, center_of_mass: [f64; 2], points: Vec<Point>) -> Body {
    Body {
        name: name.to_owned(),
        mass,
        inertia,
        center_of_mass,
        inertia_about: CENTER_OF_MASS.to_owned(),
        points,
        angle: 0.0,
    }
}

/// An ideal joint.
pub fn ideal(name: &str, a: &str, b: &str, kind: JointKind) -> Joint {
    Joint::Ideal { name: name.to_owned(), a: a.to_owned(), b: b.to_owned(), kind, friction: None }
}

/// A revolute joint with clearance and the sliding velocity of the surfaces.
pub fn loose(
    name: &str,
    [bearing, journal]: [&str; 2],
    [journal_radius, clearance]: [f64; 2],
    contact: NormalLaw,
    friction: Option<FrictionLaw>,
) -> Joint {
    Joint::Clearance {
        name: name.to_owned(),
        bearing: bearing.to_owned(),
        journal: journal.to_owned(),
        journal_radius,
        clearance,
        contact,
        friction,
        sliding: SlidingVelocity::Surface,
        film: None,
        profile: Vec::new(),
        impact_velocity_floor: None,
    }
}

/// Another floor of the impact velocity of a joint with clearance.
pub fn with_floor(mut joint: Joint, floor: Option<f64>) -> Joint {
    let Joint::Clearance { impact_velocity_floor, .. } = &mut joint else { panic!("no clearance") };
    *impact_velocity_floor = floor;
    joint
}

/// Another sliding velocity of a joint with clearance.
pub fn with_sliding(mut joint: Joint, convention: SlidingVelocity) -> Joint {
    let Joint::Clearance { sliding, .. } = &mut joint else { panic!("no clearance") };
    *sliding = convention;
    joint
}

/// Eq. (11) with the numbers of Table 2.
pub fn paper_friction() -> FrictionLaw {
    FrictionLaw::ModifiedCoulomb {
        static_coefficient: 0.04,
        sliding_coefficient: 0.03,
        stick_slip_velocity: 1e-3,
        static_sliding_velocity: 1.5e-3,
    }
}

/// The paper's slider-crank, with the stiffness and rod inertia of one of the two conventions;
/// the numbers stand in the headers of the reference trajectories.
pub fn slider_crank(as_printed: bool) -> Scene {
    let (crank, rod) = (0.05, 0.12);
    let (stiffness, rod_inertia, sliding) = if as_printed {
        (1.045060301713e12, 0.21 * rod * rod / 3.0, SlidingVelocity::ContactPoint)
    } else {
        (3.326530256934e11, 0.21 * rod * rod / 12.0, SlidingVelocity::Surface)
    };
    let damping = Damping::LankaraniNikravesh { restitution: 0.9 };
    let contact = NormalLaw { stiffness, exponent: 1.5, damping };
    let wrist = loose("wrist", ["rod.C", "slider"], [9.8e-3, 2e-5], contact, Some(paper_friction()));
    Scene {
        ground: Vec::new(),
        bodies: vec![
            body(
                "crank",
                0.3,
                2.5e-4,
                [0.5 * crank, 0.0],
                vec![point("A", 0.0, 0.0), point("B", crank, 0.0)],
            ),
            body(
                "rod",
                0.21,
                rod_inertia,
                [0.5 * rod, 0.0],
                vec![point("B", 0.0, 0.0), point("C", rod, 0.0)],
            ),
            body("slider", 0.14, 1e-4, [0.0, 0.0], Vec::new()),
        ],
        joints: vec![
            ideal("crank_bearing", "ground", "crank.A", JointKind::Revolute),
            ideal("crank_pin", "crank.B", "rod.B", JointKind::Revolute),
            ideal("guide", "ground", "slider", JointKind::Prismatic { axis: [1.0, 0.0], angle: 0.0 }),
            with_floor(with_sliding(wrist, sliding), Some(1e-6)),
        ],
        forces: Vec::new(),
        drives: vec![Drive::Speed {
            name: "drive".to_owned(),
            joint: "crank_bearing".to_owned(),
            speed: 2000.0 * std::f64::consts::PI / 30.0,
            angle: 0.0,
        }],
        start: Vec::new(),
        couplings: Vec::new(),
    }
}

/// Compiles a scene that is known to be good.
pub fn compile(scene: &Scene) -> Mechanism {
    Mechanism::compile(scene).expect("the scene is good")
}

/// Splitmix64: the tests' deterministic random numbers.
pub struct Random(pub u64);

impl Random {
    /// A number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Numbers in [-1, 1).
    pub fn vector(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.within(-1.0, 1.0)).collect()
    }

    /// An index below `count`.
    pub fn index(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}

/// Derivative of `f` at zero: central differences extrapolated twice (error h^6), for each
/// component from the step whose own error estimate is smallest.
pub fn derivative(mut f: impl FnMut(f64) -> Vec<f64>) -> Vec<f64> {
    let mut difference = |h: f64| -> Vec<f64> {
        f(h).iter().zip(f(-h)).map(|(after, before)| (after - before) / (2.0 * h)).collect()
    };
    let mut best: Vec<(f64, f64)> = Vec::new();
    for start in [3e-2, 6e-3, 1e-3, 2e-4, 4e-5] {
        let [d1, d2, d3] = [start, 0.5 * start, 0.25 * start].map(&mut difference);
        best.resize(d1.len(), (f64::INFINITY, f64::NAN));
        for (k, best) in best.iter_mut().enumerate() {
            let (once, again) = ((4.0 * d2[k] - d1[k]) / 3.0, (4.0 * d3[k] - d2[k]) / 3.0);
            // Rounding and a kink inside the step both show in the disagreement.
            let estimate = (once - again).abs();
            if estimate < best.0 {
                *best = (estimate, again + (again - once) / 15.0);
            }
        }
    }
    best.into_iter().map(|(_, value)| value).collect()
}
