//! Reads a scene from JSON text: every unknown field, missing field and wrong type at once.
//!
//! A derived reader stops at the first error; here each is noted with its path and reading goes
//! on, so that the user sees all of them together with the physical problems of
//! [`Scene::check`].

use serde_json::{Map, Value};

use crate::clearance::SlidingVelocity;
use crate::contact::{Damping, NormalLaw};
use crate::error::{Problem, SceneError};
use crate::friction::FrictionLaw;
use crate::scene::{Body, CENTER_OF_MASS, Drive, Force, Joint, JointKind, Point, Scene, did_you_mean};

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
            let known = problems.iter().any(|other: &Problem| problem.path.starts_with(other.path.as_str()));
            if !known {
                problems.push(problem);
            }
        }
    }
    if problems.is_empty() { Ok(scene) } else { Err(SceneError { problems }) }
}

type Problems = Vec<Problem>;

/// A JSON value and where it stands.
struct Node<'a> {
    value: &'a Value,
    path: String,
}

/// An object whose fields are taken one by one; what is left over is unknown.
struct Fields<'a> {
    object: Option<&'a Map<String, Value>>,
    path: String,
    taken: Vec<&'static str>,
}

impl<'a> Node<'a> {
    fn fields(&self, problems: &mut Problems) -> Fields<'a> {
        let object = self.value.as_object();
        if object.is_none() {
            problems.push(Problem::new(&self.path, format!("must be an object, got {}", self.value)));
        }
        Fields { object, path: self.path.clone(), taken: Vec::new() }
    }

    /// A number; NaN and the infinities arrive as words, which JSON has no numbers for.
    fn number(&self, problems: &mut Problems) -> f64 {
        if let Some(number) = self.value.as_f64() {
            return number;
        }
        match self.value.as_str() {
            Some("NaN") => f64::NAN,
            Some("Infinity") => f64::INFINITY,
            Some("-Infinity") => f64::NEG_INFINITY,
            _ => {
                problems.push(Problem::new(&self.path, format!("must be a number, got {}", self.value)));
                f64::NAN
            }
        }
    }

    fn pair(&self, problems: &mut Problems) -> [f64; 2] {
        match self.value.as_array().map(Vec::as_slice) {
            Some([first, second]) => [(0, first), (1, second)].map(|(index, value)| {
                Node { value, path: format!("{}[{index}]", self.path) }.number(problems)
            }),
            _ => {
                problems.push(Problem::new(
                    &self.path,
                    format!("must be a pair of numbers [x, y], got {}", self.value),
                ));
                [f64::NAN; 2]
            }
        }
    }

    fn text(&self, problems: &mut Problems) -> String {
        match self.value.as_str() {
            Some(text) => text.to_owned(),
            None => {
                problems.push(Problem::new(&self.path, format!("must be a text, got {}", self.value)));
                String::new()
            }
        }
    }
}

impl<'a> Fields<'a> {
    fn path_of(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }

    /// The field, unless it is absent or null.
    fn optional(&mut self, name: &'static str) -> Option<Node<'a>> {
        self.taken.push(name);
        let value = self.object?.get(name).filter(|value| !value.is_null())?;
        Some(Node { value, path: self.path_of(name) })
    }

    fn required(&mut self, name: &'static str, problems: &mut Problems) -> Option<Node<'a>> {
        let node = self.optional(name);
        if node.is_none() && self.object.is_some() {
            problems.push(Problem::new(self.path_of(name), "is missing"));
        }
        node
    }

    fn number(&mut self, name: &'static str, problems: &mut Problems) -> f64 {
        self.required(name, problems).map_or(f64::NAN, |node| node.number(problems))
    }

    fn number_or(&mut self, name: &'static str, default: f64, problems: &mut Problems) -> f64 {
        self.optional(name).map_or(default, |node| node.number(problems))
    }

    fn pair(&mut self, name: &'static str, problems: &mut Problems) -> [f64; 2] {
        self.required(name, problems).map_or([f64::NAN; 2], |node| node.pair(problems))
    }

    fn text(&mut self, name: &'static str, problems: &mut Problems) -> String {
        self.required(name, problems).map_or_else(String::new, |node| node.text(problems))
    }

    /// One of the given words, or the first one after a problem was noted.
    fn word<T: Copy>(
        &mut self,
        name: &'static str,
        words: &[(&'static str, T)],
        problems: &mut Problems,
    ) -> T {
        if let Some(node) = self.required(name, problems) {
            let text = node.text(problems);
            if let Some(&(_, value)) = words.iter().find(|(word, _)| *word == text) {
                return value;
            }
            if node.value.is_string() {
                let all: Vec<String> = words.iter().map(|(word, _)| format!("{word:?}")).collect();
                problems.push(Problem::new(
                    &node.path,
                    format!("must be one of {}, got {text:?}", all.join(", ")),
                ));
            }
        }
        words[0].1
    }

    fn list<T>(
        &mut self,
        name: &'static str,
        problems: &mut Problems,
        read: impl Fn(Node<'a>, &mut Problems) -> T,
    ) -> Vec<T> {
        let Some(node) = self.optional(name) else { return Vec::new() };
        let Some(values) = node.value.as_array() else {
            problems.push(Problem::new(&node.path, format!("must be a list, got {}", node.value)));
            return Vec::new();
        };
        values
            .iter()
            .enumerate()
            .map(|(index, value)| read(Node { value, path: format!("{}[{index}]", node.path) }, problems))
            .collect()
    }

    fn points(&mut self, name: &'static str, problems: &mut Problems) -> Vec<Point> {
        let Some(node) = self.optional(name) else { return Vec::new() };
        let Some(object) = node.value.as_object() else {
            problems.push(Problem::new(
                &node.path,
                format!("must be an object of points {{\"name\": [x, y]}}, got {}", node.value),
            ));
            return Vec::new();
        };
        object
            .iter()
            .map(|(name, value)| Point {
                name: name.clone(),
                position: Node { value, path: format!("{}.{name}", node.path) }.pair(problems),
            })
            .collect()
    }

    /// Notes every field that nobody asked for.
    fn finish(self, problems: &mut Problems) {
        let Some(object) = self.object else { return };
        for name in object.keys() {
            if !self.taken.contains(&name.as_str()) {
                let hint = did_you_mean(name, self.taken.iter().copied());
                problems.push(Problem::new(self.path_of(name), format!("unknown field{hint}")));
            }
        }
    }
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

fn normal_law(node: Node, problems: &mut Problems) -> NormalLaw {
    let mut fields = node.fields(problems);
    let damped = fields.word("law", &[("lankarani_nikravesh", true), ("hertz", false)], problems);
    let law = NormalLaw {
        stiffness: fields.number("stiffness", problems),
        exponent: fields.number_or("exponent", 1.5, problems),
        damping: if damped {
            Damping::LankaraniNikravesh { restitution: fields.number("restitution", problems) }
        } else {
            Damping::Elastic
        },
    };
    fields.finish(problems);
    law
}

fn friction_law(node: Node, problems: &mut Problems) -> FrictionLaw {
    let mut fields = node.fields(problems);
    fields.word("law", &[("modified_coulomb", ())], problems);
    let law = FrictionLaw::ModifiedCoulomb {
        static_coefficient: fields.number("static_coefficient", problems),
        sliding_coefficient: fields.number("sliding_coefficient", problems),
        stick_slip_velocity: fields.number("stick_slip_velocity", problems),
        static_sliding_velocity: fields.number("static_sliding_velocity", problems),
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
