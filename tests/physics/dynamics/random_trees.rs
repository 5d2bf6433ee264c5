//! Random tree mechanisms for the identities that must hold for every mechanism.

use chebclear::contact::friction::FrictionLaw;
use chebclear::contact::normal::{Damping, NormalLaw};
use chebclear::contact::pair::{Phase, SlidingVelocity};
use chebclear::expression::curve::Curve;
use chebclear::mechanism::compiled::Mechanism;
use chebclear::scene::loads::Load;
use chebclear::scene::parts::{
    Body, CENTER_OF_MASS, Drive, Force, ForceFrame, Joint, JointKind, Point, Scene,
};
use chebclear::scene::time_function::TimeFunction;
use nalgebra::{Rotation2, Vector2};

use crate::support::{Random, ideal, point};

type Vec2 = Vector2<f64>;

/// Regimes of Eq. (11) by which the friction velocities are set around the sliding velocity.
pub const REGIMES: [&str; 3] = ["below V_s", "between", "above V_d"];

/// A random mechanism in a random state.
#[derive(Clone)]
pub struct Case {
    pub scene: Scene,
    pub mechanism: Mechanism,
    /// Moments of inertia about the centers of mass, as they were drawn.
    pub inertias: Vec<f64>,
    pub t: f64,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub phases: Vec<Phase>,
    /// Regime of every clearance joint's friction, index into [`REGIMES`].
    pub regimes: Vec<usize>,
}

/// The mechanisms of all identity tests; the second number counts the scenes that were drawn
/// and could not be started (over-determined velocities).
pub fn cases(count: usize) -> (Vec<Case>, usize) {
    let mut random = Random(20);
    let (mut cases, mut refused) = (Vec::new(), 0);
    while cases.len() < count {
        let (scene, inertias) = Builder::new(&mut random).scene();
        match Mechanism::compile(&scene) {
            Ok(mechanism) => cases.push(in_motion(scene, mechanism, inertias, &mut random)),
            Err(_) => refused += 1,
        }
    }
    (cases, refused)
}

fn in_motion(scene: Scene, mut mechanism: Mechanism, inertias: Vec<f64>, random: &mut Random) -> Case {
    let spread = if random.unit() < 0.5 { 0.1 } else { 2.0 };
    let q = mechanism.start.q.iter().map(|q| q + random.within(-spread, spread)).collect();
    let v = mechanism.start.q.iter().map(|_| random.within(-2.0, 2.0)).collect();
    let regimes = mechanism.slots.iter().map(|_| random.index(3)).collect();
    let phases = mechanism
        .tree
        .slots
        .iter_mut()
        .map(|joint| {
            let latch = joint.law.normal.latch(random.within(0.3, 3.0));
            match random.index(10) {
                0 => Phase::Free,
                1 => Phase::Contact { latch, clipped: true, traction: None },
                _ => Phase::Contact { latch, clipped: false, traction: None },
            }
        })
        .collect();
    let t = random.within(0.0, 2.0);
    Case { scene, mechanism, inertias, t, q, v, phases, regimes }
}

impl Case {
    /// Sets the switch velocities of a joint's friction so that `sliding`, unless it is nearly
    /// zero, lies well inside the joint's regime.
    pub fn set_friction(&mut self, joint: usize, sliding: f64) {
        let (low, high) = [(1.5, 2.0), (0.6, 1.6), (0.3, 0.7)][self.regimes[joint]];
        if let Some(FrictionLaw::ModifiedCoulomb { stick_slip_velocity, static_sliding_velocity, .. }) =
            &mut self.mechanism.tree.slots[joint].law.friction
        {
            *stick_slip_velocity = low * sliding.abs().max(1e-3);
            *static_sliding_velocity = high * sliding.abs().max(1e-3);
        }
    }
}

/// Draws bodies in poses that satisfy every joint; the scene is written from the poses, so it
/// can be assembled.
struct Builder<'a> {
    random: &'a mut Random,
    scene: Scene,
    inertias: Vec<f64>,
    poses: Vec<(Vec2, f64)>,
    grounded: bool,
    freedoms: usize,
    closures: usize,
}

/// A body by index, or ground.
type Node = Option<usize>;

impl<'a> Builder<'a> {
    fn new(random: &'a mut Random) -> Self {
        let grounded = random.unit() < 0.85;
        Self {
            random,
            scene: Scene::default(),
            inertias: Vec::new(),
            poses: Vec::new(),
            grounded,
            freedoms: 0,
            closures: 0,
        }
    }

    fn scene(mut self) -> (Scene, Vec<f64>) {
        let count = 1 + self.random.index(8);
        for _ in 0..count {
            self.add_body();
        }
        for _ in 0..self.random.index(3) {
            if 2 * (self.closures + 1) <= self.freedoms {
                self.close(None);
            }
        }
        let acceleration = [self.random.within(-5.0, 5.0), self.random.within(-10.0, 0.0)];
        self.scene.forces.push(Force::Gravity { acceleration });
        for number in 0..self.random.index(5) {
            self.add_force(number);
        }
        (self.scene, self.inertias)
    }

    /// A function of time that starts with `value`.
    fn function(&mut self, value: f64) -> TimeFunction {
        let (rate, bend) = (self.random.within(-2.0, 2.0), self.random.within(-1.0, 1.0));
        match self.random.index(3) {
            0 => TimeFunction::Polynomial(vec![value, rate, bend, 0.3 * bend]),
            1 => TimeFunction::Harmonic {
                mean: value - rate * bend.sin(),
                amplitude: rate,
                angular_frequency: self.random.within(0.5, 3.0),
                phase: bend,
            },
            _ => {
                let times = [0.0, 0.7, 1.1, 2.5, 3.0];
                let values = times.map(|t| value + rate * t + bend * t * t * (3.0 - t));
                TimeFunction::Table(Curve::spline(&times, &values).unwrap())
            }
        }
    }

    fn add_force(&mut self, number: usize) {
        let count = self.scene.bodies.len();
        let body = self.random.index(count);
        let name = format!("force{number}");
        let mut other = self.random.index(count + 1);
        if other == body {
            other = count;
        }
        let owner = |node: usize| if node == count { "ground".to_owned() } else { format!("body{node}") };
        let (mut a, mut b) = (owner(other), owner(body));
        if self.random.unit() < 0.5 {
            std::mem::swap(&mut a, &mut b);
        }
        let (stiffness, damping) = (self.random.within(0.0, 20.0), self.random.within(0.0, 5.0));
        let force = match self.random.index(4) {
            0 => {
                let (near, far) = (self.vector(0.5), self.vector(2.0));
                let first = self.add_point(Some(body), near);
                let second = self.add_point((other < count).then_some(other), far);
                let plain = self.random.unit() < 0.3;
                Force::Spring {
                    name,
                    a: first,
                    b: second,
                    stiffness,
                    length: if plain { 0.0 } else { self.random.within(0.0, 1.0) },
                    damping: if plain { 0.0 } else { damping },
                    tension: Load::NONE,
                }
            }
            1 => {
                Force::TorsionSpring { name, a, b, stiffness, angle: self.random.within(-1.0, 1.0), damping }
            }
            2 => {
                let place = self.vector(0.5);
                let point = self.add_point(Some(body), place);
                let (x, y) = (self.function(stiffness), self.function(damping));
                let turning = self.random.unit() < 0.5;
                let frame = if turning { ForceFrame::Body } else { ForceFrame::Ground };
                Force::Applied { name, point, x: x.into(), y: y.into(), frame }
            }
            _ => Force::Torque { name, body: a, reaction: b, torque: self.function(damping).into() },
        };
        self.scene.forces.push(force);
    }

    /// Perhaps drives the joint that is added next, from `value` on; whether it did.
    fn drive(&mut self, joint: &str, value: f64, can_turn: bool) -> bool {
        let chance = self.random.unit();
        let (name, joint) = (format!("drive of {joint}"), joint.to_owned());
        if can_turn && chance < 0.15 {
            let speed = self.random.within(-3.0, 3.0);
            self.scene.drives.push(Drive::Speed { name, joint, speed, angle: value });
        } else if chance < 0.27 {
            let motion = self.function(value);
            self.scene.drives.push(Drive::Motion { name, joint, motion });
        } else {
            return false;
        }
        true
    }

    fn vector(&mut self, size: f64) -> Vec2 {
        Vec2::new(self.random.within(-size, size), self.random.within(-size, size))
    }

    /// An earlier body or ground.
    fn earlier(&mut self, count: usize) -> Node {
        let pick = self.random.index(count + usize::from(self.grounded));
        (pick < count).then_some(pick)
    }

    fn pose(&self, node: Node) -> (Vec2, f64) {
        node.map_or((Vec2::zeros(), 0.0), |body| self.poses[body])
    }

    /// Adds a point to a body or ground; its reference.
    fn add_point(&mut self, node: Node, position: Vec2) -> String {
        let (points, owner) = match node {
            Some(body) => (&mut self.scene.bodies[body].points, format!("body{body}")),
            None => (&mut self.scene.ground, "ground".to_owned()),
        };
        let name = format!("p{}", points.len());
        points.push(point(&name, position.x, position.y));
        format!("{owner}.{name}")
    }

    fn add_body(&mut self) {
        let index = self.scene.bodies.len();
        let (mass, inertia) = (self.random.within(0.5, 2.0), self.random.within(0.05, 0.3));
        let (center, other) = (self.vector(0.3), self.vector(0.5));
        let about_other = self.random.unit() < 0.5;
        self.inertias.push(inertia);
        self.scene.bodies.push(Body {
            name: format!("body{index}"),
            mass,
            inertia: if about_other { inertia + mass * (other - center).norm_squared() } else { inertia },
            center_of_mass: center.into(),
            inertia_about: if about_other { "p0".to_owned() } else { CENTER_OF_MASS.to_owned() },
            points: vec![Point { name: "p0".to_owned(), position: other.into() }],
            angle: 0.0,
        });
        if (index == 0 && !self.grounded) || self.random.unit() < 0.2 {
            let pose = (self.vector(1.0), self.random.within(-3.0, 3.0));
            self.poses.push(pose);
            self.freedoms += 3;
            if index > 0 || self.grounded {
                self.close(Some(index));
            }
        } else {
            self.hang(index);
        }
        self.scene.bodies[index].angle = self.poses[index].1;
    }

    /// Hangs a body on an earlier one or ground by an ideal joint.
    fn hang(&mut self, index: usize) {
        let parent = self.earlier(index);
        let (at_parent, at_child) = (self.vector(0.7), self.vector(0.7));
        let (origin, parent_angle) = self.pose(parent);
        let pivot = origin + Rotation2::new(parent_angle) * at_parent;
        let turn = self.random.within(-3.0, 3.0);
        let child_is_b = self.random.unit() < 0.5;
        let relative = if child_is_b { turn } else { -turn };
        let name = format!("joint{index}");
        let mut slide = Vec2::zeros();
        let angle = parent_angle + turn;
        let kind = match self.random.index(10) {
            0..5 => {
                if !self.drive(&name, relative, true) {
                    self.freedoms += 1;
                }
                JointKind::Revolute
            }
            5..8 => {
                let axis = self.vector(3.0);
                let angle_a = if child_is_b { parent_angle } else { angle };
                let offset = self.random.within(-0.5, 0.5);
                slide = (if child_is_b { offset } else { -offset })
                    * (Rotation2::new(angle_a) * axis.normalize());
                if !self.drive(&name, offset, false) {
                    self.freedoms += 1;
                }
                JointKind::Prismatic { axis: axis.into(), angle: relative }
            }
            _ => JointKind::Fixed { angle: relative },
        };
        self.poses.push((pivot + slide - Rotation2::new(angle) * at_child, angle));
        let ends = (self.add_point(parent, at_parent), self.add_point(Some(index), at_child));
        let (a, b) = if child_is_b { ends } else { (ends.1, ends.0) };
        self.scene.joints.push(ideal(&name, &a, &b, kind));
    }

    /// Adds a clearance joint, at `body` if one is given, concentric in the drawn poses.
    fn close(&mut self, body: Node) {
        let count = self.scene.bodies.len();
        let first = body.or_else(|| Some(self.random.index(count)));
        let pool = if body.is_some() { count - 1 } else { count };
        let second = self.earlier(pool);
        if first == second {
            return;
        }
        let place = self.vector(1.0);
        let ends = [first, second].map(|node| {
            let (origin, angle) = self.pose(node);
            self.add_point(node, Rotation2::new(-angle) * (place - origin))
        });
        let [bearing, journal] =
            if self.random.unit() < 0.5 { ends } else { [ends[1].clone(), ends[0].clone()] };
        let exponent = if self.random.unit() < 0.5 { 1.5 } else { self.random.within(1.2, 2.5) };
        let elastic = self.random.unit() < 0.4;
        let restitution = self.random.within(0.3, 0.95);
        let friction = FrictionLaw::ModifiedCoulomb {
            static_coefficient: self.random.within(0.2, 0.6),
            sliding_coefficient: self.random.within(0.1, 0.4),
            stick_slip_velocity: 1.0,
            static_sliding_velocity: 2.0,
        };
        self.closures += 1;
        self.scene.joints.push(Joint::Clearance {
            name: format!("clearance{}", self.closures),
            bearing,
            journal,
            journal_radius: self.random.within(0.05, 0.2),
            clearance: self.random.within(0.01, 0.05),
            contact: NormalLaw {
                stiffness: self.random.within(50.0, 500.0),
                exponent,
                damping: if elastic { Damping::Elastic } else { Damping::LankaraniNikravesh { restitution } },
            },
            friction: (self.random.unit() < 0.8).then_some(friction),
            sliding: if self.random.unit() < 0.5 {
                SlidingVelocity::Surface
            } else {
                SlidingVelocity::ContactPoint
            },
            film: None,
            profile: Vec::new(),
            impact_velocity_floor: None,
        });
    }
}
