//! Reads a scene from JSON text: every unknown field, missing field and wrong type at once.
//!
//! A derived reader stops at the first error. Here all are collected with their paths, so that the user sees
//! them together with the physical problems of [`Scene::check`].

use serde_json::Value;

use crate::contact::film::Lubricant;
use crate::contact::formula::{OF_FRICTION, OF_NORMAL_FORCE};
use crate::contact::friction::{FrictionLaw, JointFriction};
use crate::contact::normal::{Damping, NormalLaw};
use crate::contact::pair::SlidingVelocity;
use crate::contact::sticking::StickSlip;
use crate::error::{InputError, Problem, Subject};
use crate::expression::dimension::{FORCE, PLAIN};
use crate::scene::couplings::coupling;
use crate::scene::functions::{bushing, law, load, load_or_none, time_function};
use crate::scene::json::{Fields, Node, Problems};
use crate::scene::parts::{
    Body, CENTER_OF_MASS, Drive, Force, ForceFrame, GROUND, GuideShape, Joint, JointKind, Scene, Start,
};

/// The fields that determine the kind of an object; without them it cannot be checked.
const TAGS: [&str; 3] = [".type", ".law", ".function"];

/// Whether a problem at a path follows from a known one: at the same place, inside it, or inside an
/// object of unknown kind.
fn follows(path: &str, known: &str) -> bool {
    let place = TAGS.iter().find_map(|tag| known.strip_suffix(tag)).unwrap_or(known);
    let rest = path.strip_prefix(place);
    rest.is_some_and(|rest| place.is_empty() || rest.is_empty() || rest.starts_with(['.', '[']))
}

/// The scene written in `text`, checked.
pub fn read_scene(text: &str) -> Result<Scene, InputError> {
    checked(Node::root(&parse(text)?, ""))
}

/// What scenes of one structure share: parts, names and connections. It is parsed once for all of them.
#[derive(Debug)]
pub struct Structure {
    value: Value,
}

impl Structure {
    /// Reads a scene that has, in the place of each number, its index in the numbers of a scene.
    ///
    /// # Errors
    /// Text that is no JSON.
    pub fn read(text: &str) -> Result<Structure, InputError> {
        Ok(Structure { value: parse(text)? })
    }

    /// The scene with these numbers, checked.
    ///
    /// # Errors
    /// As [`read_scene`].
    pub fn scene(&self, numbers: &[f64]) -> Result<Scene, InputError> {
        checked(Node::root(&self.value, "").with_numbers(numbers))
    }
}

fn parse(text: &str) -> Result<Value, InputError> {
    serde_json::from_str(text)
        .map_err(|error| Subject::Scene.error("scene", format!("is not valid JSON: {error}")))
}

fn checked(node: Node) -> Result<Scene, InputError> {
    let mut problems = Vec::new();
    let scene = scene(node, &mut problems);
    if let Err(error) = scene.check() {
        // A field that could not be read is NaN or an empty name in the scene: its physical
        // check would only repeat the problem.
        for problem in error.problems {
            let known = problems.iter().any(|other: &Problem| follows(&problem.path, &other.path));
            if !known {
                problems.push(problem);
            }
        }
    }
    Subject::Scene.judge(scene, problems)
}

fn scene(node: Node, problems: &mut Problems) -> Scene {
    let mut fields = node.fields(problems);
    let scene = Scene {
        ground: fields.points("ground", problems),
        bodies: fields.list("bodies", problems, body),
        joints: fields.list("joints", problems, joint),
        forces: fields.list("forces", problems, force),
        drives: fields.list("drives", problems, drive),
        start: fields.list("start", problems, start),
        couplings: fields.list("couplings", problems, coupling),
    };
    fields.finish(problems);
    scene
}

fn body(node: Node, problems: &mut Problems) -> Body {
    let mut fields = node.fields(problems);
    let body = Body {
        name: fields.text("name", problems),
        mass: fields.number("mass", problems),
        inertia: fields.number("inertia", problems),
        center_of_mass: fields.optional("center_of_mass").map_or([0.0, 0.0], |node| node.pair(problems)),
        inertia_about: fields
            .optional("inertia_about")
            .map_or_else(|| CENTER_OF_MASS.to_owned(), |node| node.text(problems)),
        points: fields.points("points", problems),
        angle: fields.number_or("angle", 0.0, problems),
    };
    fields.finish(problems);
    body
}

#[derive(Clone, Copy)]
enum JointType {
    Revolute,
    Prismatic,
    Fixed,
    Clearance,
    Guide,
    Pin,
    Stop,
}

fn joint(node: Node, problems: &mut Problems) -> Joint {
    let mut fields = node.fields(problems);
    let types = [
        ("revolute", JointType::Revolute),
        ("prismatic", JointType::Prismatic),
        ("fixed", JointType::Fixed),
        ("clearance_revolute", JointType::Clearance),
        ("clearance_prismatic", JointType::Guide),
        ("pin_in_slot", JointType::Pin),
        ("stop", JointType::Stop),
    ];
    let kind = fields.tag("type", &types, problems);
    let name = fields.text("name", problems);
    let joint = if let JointType::Clearance = kind {
        let conventions =
            [("surface", SlidingVelocity::Surface), ("contact_point", SlidingVelocity::ContactPoint)];
        Joint::Clearance {
            name,
            bearing: fields.text("bearing", problems),
            journal: fields.text("journal", problems),
            journal_radius: fields.number("journal_radius", problems),
            clearance: fields.number("clearance", problems),
            contact: fields
                .required("contact", problems)
                .map_or(UNREADABLE_LAW, |node| normal_law(node, problems)),
            friction: fields.optional("friction").map(|node| friction_law(node, problems)),
            sliding: fields.word("sliding", &conventions, problems),
            film: fields.optional("film").map(|node| lubricant(node, problems)),
            profile: fields.optional("profile").map_or_else(Vec::new, |node| node.numbers(problems)),
            impact_velocity_floor: fields.optional_number("impact_velocity_floor", problems),
        }
    } else if let JointType::Guide | JointType::Pin | JointType::Stop = kind {
        guide(kind, name, &mut fields, problems)
    } else {
        let a = fields.text("a", problems);
        let b = fields.text("b", problems);
        let mut friction = |law, size| {
            let node = fields.optional("friction")?;
            Some(joint_friction(node, law, size, problems))
        };
        let friction = match kind {
            JointType::Revolute => friction("journal_friction", "journal_radius")
                .map(|[coefficient, journal_radius]| JointFriction::Journal { coefficient, journal_radius }),
            JointType::Prismatic => friction("guide_friction", "half_length")
                .map(|[coefficient, half_length]| JointFriction::Guide { coefficient, half_length }),
            _ => None,
        };
        let kind = match kind {
            JointType::Prismatic => JointKind::Prismatic {
                axis: fields.pair("axis", problems),
                angle: fields.number_or("angle", 0.0, problems),
            },
            JointType::Fixed => JointKind::Fixed { angle: fields.number_or("angle", 0.0, problems) },
            _ => JointKind::Revolute,
        };
        Joint::Ideal { name, a, b, kind, friction }
    };
    fields.finish(problems);
    joint
}

/// A guide with play, a pin in a slot or a stop.
fn guide(kind: JointType, name: String, fields: &mut Fields, problems: &mut Problems) -> Joint {
    let ends = if let JointType::Pin = kind { ["slot", "pin"] } else { ["a", "b"] };
    let [a, b] = ends.map(|end| fields.text(end, problems));
    let axis = fields.pair(if let JointType::Stop = kind { "normal" } else { "axis" }, problems);
    let shape = match kind {
        JointType::Pin => GuideShape::Pin {
            radius: fields.number("pin_radius", problems),
            clearance: fields.number("clearance", problems),
        },
        JointType::Stop => GuideShape::Stop { radius: fields.number_or("radius", 0.0, problems) },
        _ => GuideShape::Block {
            length: fields.number("length", problems),
            height: fields.number("height", problems),
            clearance: fields.number("clearance", problems),
            angle: fields.number_or("angle", 0.0, problems),
            is_sleeve: fields.word("corners", &[("b", false), ("a", true)], problems),
        },
    };
    Joint::Guide {
        name,
        a,
        b,
        axis,
        shape,
        face_length: fields.optional_number("face_length", problems),
        contact: fields
            .required("contact", problems)
            .map_or(UNREADABLE_LAW, |node| normal_law(node, problems)),
        friction: fields.optional("friction").map(|node| friction_law(node, problems)),
        impact_velocity_floor: fields.optional_number("impact_velocity_floor", problems),
    }
}

/// Placeholder of a law that could not be read, for which a problem was added.
const UNREADABLE_LAW: NormalLaw =
    NormalLaw { stiffness: f64::NAN, exponent: f64::NAN, damping: Damping::Elastic };

#[derive(Clone, Copy)]
enum NormalLawName {
    LankaraniNikravesh,
    Flores,
    ExactRestitution,
    HuntCrossley,
    KelvinVoigt,
    Impact,
    Hertz,
    Formula,
}

pub(super) fn normal_law(node: Node, problems: &mut Problems) -> NormalLaw {
    let mut fields = node.fields(problems);
    let names = [
        ("lankarani_nikravesh", NormalLawName::LankaraniNikravesh),
        ("flores", NormalLawName::Flores),
        ("exact_restitution", NormalLawName::ExactRestitution),
        ("hunt_crossley", NormalLawName::HuntCrossley),
        ("kelvin_voigt", NormalLawName::KelvinVoigt),
        ("impact", NormalLawName::Impact),
        ("hertz", NormalLawName::Hertz),
        ("formula", NormalLawName::Formula),
    ];
    let name = fields.tag("law", &names, problems);
    if let NormalLawName::Formula = name {
        let formula = law(&mut fields, "force", &OF_NORMAL_FORCE, FORCE, problems);
        fields.finish(problems);
        // A sound law in the place of one that could not be read, for which a problem was added.
        let unread = NormalLaw { stiffness: 1.0, exponent: 1.0, damping: Damping::Elastic };
        return formula.map_or(unread, NormalLaw::of);
    }
    let law = NormalLaw {
        stiffness: fields.number("stiffness", problems),
        exponent: fields.number_or("exponent", 1.5, problems),
        damping: match name {
            NormalLawName::LankaraniNikravesh => {
                Damping::LankaraniNikravesh { restitution: fields.number("restitution", problems) }
            }
            NormalLawName::Flores => Damping::Flores { restitution: fields.number("restitution", problems) },
            NormalLawName::ExactRestitution => {
                Damping::exact_restitution(fields.number("restitution", problems))
            }
            NormalLawName::HuntCrossley => {
                Damping::HuntCrossley { hysteresis_factor: fields.number("hysteresis_factor", problems) }
            }
            NormalLawName::KelvinVoigt => {
                Damping::KelvinVoigt { damping: fields.number("damping", problems) }
            }
            NormalLawName::Impact => Damping::Impact {
                damping: fields.number("damping", problems),
                depth: fields.number("depth", problems),
            },
            NormalLawName::Hertz | NormalLawName::Formula => Damping::Elastic,
        },
    };
    fields.finish(problems);
    law
}

#[derive(Clone, Copy)]
enum FrictionName {
    ModifiedCoulomb,
    SmoothedCoulomb,
    StickSlip,
    Formula,
}

fn friction_law(node: Node, problems: &mut Problems) -> FrictionLaw {
    let mut fields = node.fields(problems);
    let laws = [
        ("modified_coulomb", FrictionName::ModifiedCoulomb),
        ("smoothed_coulomb", FrictionName::SmoothedCoulomb),
        ("stick_slip", FrictionName::StickSlip),
        ("formula", FrictionName::Formula),
    ];
    let friction = match fields.tag("law", &laws, problems) {
        FrictionName::ModifiedCoulomb => FrictionLaw::ModifiedCoulomb {
            static_coefficient: fields.number("static_coefficient", problems),
            sliding_coefficient: fields.number("sliding_coefficient", problems),
            stick_slip_velocity: fields.number("stick_slip_velocity", problems),
            static_sliding_velocity: fields.number("static_sliding_velocity", problems),
        },
        FrictionName::SmoothedCoulomb => FrictionLaw::SmoothedCoulomb {
            coefficient: fields.number("coefficient", problems),
            velocity: fields.number("velocity", problems),
        },
        FrictionName::StickSlip => FrictionLaw::StickSlip(StickSlip {
            static_coefficient: fields.number("static_coefficient", problems),
            sliding_coefficient: fields.number("sliding_coefficient", problems),
            stribeck_velocity: fields.number("stribeck_velocity", problems),
            tangential_stiffness: fields.optional_number("tangential_stiffness", problems),
            damping_ratio: fields.number_or("damping_ratio", 0.3, problems),
        }),
        FrictionName::Formula => {
            let formula = law(&mut fields, "coefficient", &OF_FRICTION, PLAIN, problems);
            let unread = FrictionLaw::SmoothedCoulomb { coefficient: 0.0, velocity: 1.0 };
            formula.map_or(unread, FrictionLaw::of)
        }
    };
    fields.finish(problems);
    friction
}

/// Coefficient and size in the friction law of an ideal joint.
fn joint_friction(node: Node, law: &'static str, size: &'static str, problems: &mut Problems) -> [f64; 2] {
    let mut fields = node.fields(problems);
    fields.tag("law", &[(law, ())], problems);
    let numbers = ["coefficient", size].map(|name| fields.number(name, problems));
    fields.finish(problems);
    numbers
}

fn lubricant(node: Node, problems: &mut Problems) -> Lubricant {
    let mut fields = node.fields(problems);
    let laws = [("short_bearing", false), ("finite_bearing", true)];
    let lubricant = Lubricant {
        has_finite_width: fields.tag("law", &laws, problems),
        viscosity: fields.number("viscosity", problems),
        length: fields.number("length", problems),
        roughness: fields.number("roughness", problems),
    };
    fields.finish(problems);
    lubricant
}

#[derive(Clone, Copy, PartialEq)]
enum ForceType {
    Gravity,
    Spring,
    Damper,
    Bushing,
    TorsionSpring,
    TorsionDamper,
    Applied,
    Torque,
}

fn force(node: Node, problems: &mut Problems) -> Force {
    let mut fields = node.fields(problems);
    let types = [
        ("gravity", ForceType::Gravity),
        ("spring", ForceType::Spring),
        ("damper", ForceType::Damper),
        ("bushing", ForceType::Bushing),
        ("torsion_spring", ForceType::TorsionSpring),
        ("torsion_damper", ForceType::TorsionDamper),
        ("force", ForceType::Applied),
        ("torque", ForceType::Torque),
    ];
    let kind = fields.tag("type", &types, problems);

    let force = match kind {
        ForceType::Gravity => Force::Gravity { acceleration: fields.pair("acceleration", problems) },
        ForceType::Spring | ForceType::Damper => link(kind == ForceType::Spring, &mut fields, problems),
        ForceType::Bushing => bushing(&mut fields, problems),
        ForceType::TorsionSpring | ForceType::TorsionDamper => {
            torsion(kind == ForceType::TorsionSpring, &mut fields, problems)
        }
        ForceType::Applied => {
            let axes = [("ground", ForceFrame::Ground), ("body", ForceFrame::Body)];
            Force::Applied {
                name: fields.text("name", problems),
                point: fields.text("point", problems),
                x: load(&mut fields, "x", problems),
                y: load(&mut fields, "y", problems),
                frame: fields.word("frame", &axes, problems),
            }
        }
        ForceType::Torque => Force::Torque {
            name: fields.text("name", problems),
            body: fields.text("body", problems),
            reaction: fields
                .optional("reaction")
                .map_or_else(|| GROUND.to_owned(), |node| node.text(problems)),
            torque: load(&mut fields, "torque", problems),
        },
    };
    fields.finish(problems);
    force
}

/// A spring with its damper; a damper alone is a spring without stiffness.
fn link(is_spring: bool, fields: &mut Fields, problems: &mut Problems) -> Force {
    let name = fields.text("name", problems);
    let [a, b] = ["a", "b"].map(|end| fields.text(end, problems));
    let tension = load_or_none(fields, "tension", problems);
    if is_spring {
        let stiffness = fields.number("stiffness", problems);
        let length = fields.number("length", problems);
        let damping = fields.number_or("damping", 0.0, problems);
        Force::Spring { name, a, b, stiffness, length, damping, tension }
    } else {
        let damping = fields.number("damping", problems);
        Force::Spring { name, a, b, stiffness: 0.0, length: 0.0, damping, tension }
    }
}

/// The same between two bodies.
fn torsion(is_spring: bool, fields: &mut Fields, problems: &mut Problems) -> Force {
    let name = fields.text("name", problems);
    let [a, b] = ["a", "b"].map(|end| fields.text(end, problems));
    if is_spring {
        let stiffness = fields.number("stiffness", problems);
        let angle = fields.number_or("angle", 0.0, problems);
        let damping = fields.number_or("damping", 0.0, problems);
        Force::TorsionSpring { name, a, b, stiffness, angle, damping }
    } else {
        let damping = fields.number("damping", problems);
        Force::TorsionSpring { name, a, b, stiffness: 0.0, angle: 0.0, damping }
    }
}

fn drive(node: Node, problems: &mut Problems) -> Drive {
    let mut fields = node.fields(problems);
    let by_function = fields.tag("type", &[("speed", false), ("motion", true)], problems);
    let name = fields.text("name", problems);
    let joint = fields.text("joint", problems);
    let drive = if by_function {
        Drive::Motion { name, joint, motion: time_function(&mut fields, "motion", problems) }
    } else {
        Drive::Speed {
            name,
            joint,
            speed: fields.number("speed", problems),
            angle: fields.number_or("angle", 0.0, problems),
        }
    };
    fields.finish(problems);
    drive
}

#[derive(Clone, Copy)]
enum StartType {
    Joint,
    Body,
    Clearance,
    Guide,
}

fn start(node: Node, problems: &mut Problems) -> Start {
    let mut fields = node.fields(problems);
    let types = [
        ("joint", StartType::Joint),
        ("body", StartType::Body),
        ("clearance", StartType::Clearance),
        ("guide", StartType::Guide),
    ];
    let kind = fields.tag("type", &types, problems);
    let start = match kind {
        StartType::Joint => Start::Joint {
            joint: fields.text("joint", problems),
            position: fields.optional_number("position", problems),
            velocity: fields.optional_number("velocity", problems),
        },
        StartType::Body => Start::Body {
            body: fields.text("body", problems),
            angle: fields.optional_number("angle", problems),
            angular_velocity: fields.optional_number("angular_velocity", problems),
        },
        StartType::Clearance => Start::Clearance {
            joint: fields.text("joint", problems),
            eccentricity: fields.pair("eccentricity", problems),
            rate: fields.optional("rate").map_or([0.0, 0.0], |node| node.pair(problems)),
        },
        StartType::Guide => Start::Guide {
            joint: fields.text("joint", problems),
            offset: ["offset", "offset_rate"].map(|field| fields.number_or(field, 0.0, problems)),
            tilt: ["tilt", "tilt_rate"].map(|field| fields.number_or(field, 0.0, problems)),
            displacement: ["displacement", "velocity"].map(|field| fields.optional_number(field, problems)),
        },
    };
    fields.finish(problems);
    start
}
