//! Reads a scene from JSON text: every unknown field, missing field and wrong type at once.
//!
//! A derived reader stops at the first error; here each is noted with its path and reading goes
//! on, so that the user sees all of them together with the physical problems of
//! [`Scene::check`].

use serde_json::Value;

use crate::clearance::SlidingVelocity;
use crate::contact::{Damping, NormalLaw};
use crate::error::{Problem, SceneError};
use crate::friction::FrictionLaw;
use crate::json::{Node, Problems};
use crate::scene::{Body, CENTER_OF_MASS, Drive, Force, Joint, JointKind, Scene};

/// Whether a path is another one or leads to something inside it.
fn is_at_or_below(path: &str, other: &str) -> bool {
    let rest = path.strip_prefix(other);
    rest.is_some_and(|rest| other.is_empty() || rest.is_empty() || rest.starts_with(['.', '[']))
}

/// The scene written in `text`, checked.
pub fn read_scene(text: &str) -> Result<Scene, SceneError> {
    let value: Value = serde_json::from_str(text)
        .map_err(|error| SceneError::single("scene", format!("is not valid JSON: {error}")))?;
    let mut problems = Vec::new();
    let scene = scene(Node { value: &value, path: String::new() }, &mut problems);
    if let Err(error) = scene.check() {
        // A field that could not be read stands in the scene as NaN or an empty name: its physical
        // check would only repeat the problem.
        for problem in error.problems {
            let known = problems.iter().any(|other: &Problem| is_at_or_below(&problem.path, &other.path));
            if !known {
                problems.push(problem);
            }
        }
    }
    if problems.is_empty() { Ok(scene) } else { Err(SceneError { problems }) }
}

fn scene(node: Node, problems: &mut Problems) -> Scene {
    let mut fields = node.fields(problems);
    let scene = Scene {
        ground: fields.points("ground", problems),
        bodies: fields.list("bodies", problems, body),
        joints: fields.list("joints", problems, joint),
        forces: fields.list("forces", problems, force),
        drives: fields.list("drives", problems, drive),
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
}

fn joint(node: Node, problems: &mut Problems) -> Joint {
    let mut fields = node.fields(problems);
    let types = [
        ("revolute", JointType::Revolute),
        ("prismatic", JointType::Prismatic),
        ("fixed", JointType::Fixed),
        ("clearance_revolute", JointType::Clearance),
    ];
    let kind = fields.word("type", &types, problems);
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
            impact_velocity_floor: fields.optional("impact_velocity_floor").map(|node| node.number(problems)),
        }
    } else {
        let a = fields.text("a", problems);
        let b = fields.text("b", problems);
        let kind = match kind {
            JointType::Prismatic => JointKind::Prismatic {
                axis: fields.pair("axis", problems),
                angle: fields.number_or("angle", 0.0, problems),
            },
            JointType::Fixed => JointKind::Fixed { angle: fields.number_or("angle", 0.0, problems) },
            _ => JointKind::Revolute,
        };
        Joint::Ideal { name, a, b, kind }
    };
    fields.finish(problems);
    joint
}

/// Stands for a law that could not be read; the problem is noted where it happened.
const UNREADABLE_LAW: NormalLaw =
    NormalLaw { stiffness: f64::NAN, exponent: f64::NAN, damping: Damping::Elastic };

#[derive(Clone, Copy)]
enum NormalLawName {
    LankaraniNikravesh,
    Flores,
    HuntCrossley,
    Hertz,
}

fn normal_law(node: Node, problems: &mut Problems) -> NormalLaw {
    let mut fields = node.fields(problems);
    let names = [
        ("lankarani_nikravesh", NormalLawName::LankaraniNikravesh),
        ("flores", NormalLawName::Flores),
        ("hunt_crossley", NormalLawName::HuntCrossley),
        ("hertz", NormalLawName::Hertz),
    ];
    let name = fields.word("law", &names, problems);
    let law = NormalLaw {
        stiffness: fields.number("stiffness", problems),
        exponent: fields.number_or("exponent", 1.5, problems),
        damping: match name {
            NormalLawName::LankaraniNikravesh => {
                Damping::LankaraniNikravesh { restitution: fields.number("restitution", problems) }
            }
            NormalLawName::Flores => Damping::Flores { restitution: fields.number("restitution", problems) },
            NormalLawName::HuntCrossley => {
                Damping::HuntCrossley { hysteresis_factor: fields.number("hysteresis_factor", problems) }
            }
            NormalLawName::Hertz => Damping::Elastic,
        },
    };
    fields.finish(problems);
    law
}

fn friction_law(node: Node, problems: &mut Problems) -> FrictionLaw {
    let mut fields = node.fields(problems);
    let smoothed = fields.word("law", &[("modified_coulomb", false), ("smoothed_coulomb", true)], problems);
    let law = if smoothed {
        FrictionLaw::SmoothedCoulomb {
            coefficient: fields.number("coefficient", problems),
            velocity: fields.number("velocity", problems),
        }
    } else {
        FrictionLaw::ModifiedCoulomb {
            static_coefficient: fields.number("static_coefficient", problems),
            sliding_coefficient: fields.number("sliding_coefficient", problems),
            stick_slip_velocity: fields.number("stick_slip_velocity", problems),
            static_sliding_velocity: fields.number("static_sliding_velocity", problems),
        }
    };
    fields.finish(problems);
    law
}

fn force(node: Node, problems: &mut Problems) -> Force {
    let mut fields = node.fields(problems);
    fields.word("type", &[("gravity", ())], problems);
    let force = Force::Gravity { acceleration: fields.pair("acceleration", problems) };
    fields.finish(problems);
    force
}

fn drive(node: Node, problems: &mut Problems) -> Drive {
    let mut fields = node.fields(problems);
    fields.word("type", &[("speed", ())], problems);
    let drive = Drive::Speed {
        name: fields.text("name", problems),
        joint: fields.text("joint", problems),
        speed: fields.number("speed", problems),
        angle: fields.number_or("angle", 0.0, problems),
    };
    fields.finish(problems);
    drive
}
