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
use crate::scene::json::{Fields, Kind, parse, read_object};
use crate::scene::loads::Load;
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
    checked(&parse(Subject::Scene, "scene", text)?, None)
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
        Ok(Structure { value: parse(Subject::Scene, "scene", text)? })
    }

    /// The scene with these numbers, checked.
    ///
    /// # Errors
    /// As [`read_scene`].
    pub fn scene(&self, numbers: &[f64]) -> Result<Scene, InputError> {
        checked(&self.value, Some(numbers))
    }
}

fn checked(value: &Value, numbers: Option<&[f64]>) -> Result<Scene, InputError> {
    let (scene, mut problems) = read_object(value, "", numbers, scene);
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

fn scene(fields: &mut Fields) -> Scene {
    Scene {
        ground: fields.points("ground"),
        bodies: fields.objects("bodies", body),
        joints: fields.objects("joints", joint),
        forces: fields.objects("forces", force),
        drives: fields.objects("drives", drive),
        start: fields.objects("start", start),
        couplings: fields.objects("couplings", coupling),
    }
}

fn body(fields: &mut Fields) -> Body {
    Body {
        name: fields.text("name"),
        mass: fields.number("mass"),
        inertia: fields.number("inertia"),
        center_of_mass: fields.optional("center_of_mass").map_or([0.0, 0.0], |node| node.pair()),
        inertia_about: fields.text_or("inertia_about", CENTER_OF_MASS),
        points: fields.points("points"),
        angle: fields.number_or("angle", 0.0),
    }
}

fn joint(fields: &mut Fields) -> Joint {
    fields.one_of(
        "type",
        &[
            ("revolute", |fields| {
                let ([name, a, b], friction) = ideal(fields, "journal_friction", "journal_radius");
                let friction = friction.map(|[coefficient, journal_radius]| JointFriction::Journal {
                    coefficient,
                    journal_radius,
                });
                Joint::Ideal { name, a, b, kind: JointKind::Revolute, friction }
            }),
            ("prismatic", |fields| {
                let ([name, a, b], friction) = ideal(fields, "guide_friction", "half_length");
                let friction = friction
                    .map(|[coefficient, half_length]| JointFriction::Guide { coefficient, half_length });
                let (axis, angle) = (fields.pair("axis"), fields.number_or("angle", 0.0));
                Joint::Ideal { name, a, b, kind: JointKind::Prismatic { axis, angle }, friction }
            }),
            ("fixed", |fields| {
                let [name, a, b] = names(fields);
                let kind = JointKind::Fixed { angle: fields.number_or("angle", 0.0) };
                Joint::Ideal { name, a, b, kind, friction: None }
            }),
            ("clearance_revolute", clearance),
            ("clearance_prismatic", |fields| {
                guide(fields, ["a", "b", "axis"], |fields| GuideShape::Block {
                    length: fields.number("length"),
                    height: fields.number("height"),
                    clearance: fields.number("clearance"),
                    angle: fields.number_or("angle", 0.0),
                    is_sleeve: fields.word("corners", &[("b", false), ("a", true)]),
                })
            }),
            ("pin_in_slot", |fields| {
                guide(fields, ["slot", "pin", "axis"], |fields| GuideShape::Pin {
                    radius: fields.number("pin_radius"),
                    clearance: fields.number("clearance"),
                })
            }),
            ("stop", |fields| {
                guide(fields, ["a", "b", "normal"], |fields| GuideShape::Stop {
                    radius: fields.number_or("radius", 0.0),
                })
            }),
        ],
    )
}

/// Name and ends of a joint or force.
fn names(fields: &mut Fields) -> [String; 3] {
    ["name", "a", "b"].map(|field| fields.text(field))
}

/// Name and ends of an ideal joint, with coefficient and size in its friction law.
fn ideal(fields: &mut Fields, law: &'static str, size: &'static str) -> ([String; 3], Option<[f64; 2]>) {
    let names = names(fields);
    let friction = fields.optional("friction").map(|node| {
        node.read(|fields| {
            fields.tag("law", &[(law, ())]);
            ["coefficient", size].map(|name| fields.number(name))
        })
    });
    (names, friction)
}

fn clearance(fields: &mut Fields) -> Joint {
    let conventions =
        [("surface", SlidingVelocity::Surface), ("contact_point", SlidingVelocity::ContactPoint)];
    Joint::Clearance {
        name: fields.text("name"),
        bearing: fields.text("bearing"),
        journal: fields.text("journal"),
        journal_radius: fields.number("journal_radius"),
        clearance: fields.number("clearance"),
        contact: contact(fields),
        friction: fields.optional("friction").map(|node| node.read(friction_law)),
        sliding: fields.word("sliding", &conventions),
        film: fields.optional("film").map(|node| node.read(lubricant)),
        profile: fields.optional("profile").map_or_else(Vec::new, |node| node.numbers()),
        impact_velocity_floor: fields.optional_number("impact_velocity_floor"),
    }
}

/// A guide with play, a pin in a slot or a stop: the names of the fields of its ends and its direction, and its shape.
fn guide(
    fields: &mut Fields,
    [a, b, axis]: [&'static str; 3],
    shape: impl FnOnce(&mut Fields) -> GuideShape,
) -> Joint {
    Joint::Guide {
        name: fields.text("name"),
        a: fields.text(a),
        b: fields.text(b),
        axis: fields.pair(axis),
        shape: shape(fields),
        face_length: fields.optional_number("face_length"),
        contact: contact(fields),
        friction: fields.optional("friction").map(|node| node.read(friction_law)),
        impact_velocity_floor: fields.optional_number("impact_velocity_floor"),
    }
}

/// The normal-force law of a joint.
fn contact(fields: &mut Fields) -> NormalLaw {
    // A law that could not be read, for which a problem was added.
    let unread = NormalLaw { stiffness: f64::NAN, exponent: f64::NAN, damping: Damping::Elastic };
    fields.required("contact").map_or(unread, |node| node.read(normal_law))
}

pub(super) fn normal_law(fields: &mut Fields) -> NormalLaw {
    let damped: [Kind<NormalLaw>; 8] = [
        ("lankarani_nikravesh", |fields| {
            power_law(fields, |fields| Damping::LankaraniNikravesh {
                restitution: fields.number("restitution"),
            })
        }),
        ("flores", |fields| {
            power_law(fields, |fields| Damping::Flores { restitution: fields.number("restitution") })
        }),
        ("exact_restitution", |fields| {
            power_law(fields, |fields| Damping::exact_restitution(fields.number("restitution")))
        }),
        ("hunt_crossley", |fields| {
            power_law(fields, |fields| Damping::HuntCrossley {
                hysteresis_factor: fields.number("hysteresis_factor"),
            })
        }),
        ("kelvin_voigt", |fields| {
            power_law(fields, |fields| Damping::KelvinVoigt { damping: fields.number("damping") })
        }),
        ("impact", |fields| {
            power_law(fields, |fields| Damping::Impact {
                damping: fields.number("damping"),
                depth: fields.number("depth"),
            })
        }),
        ("hertz", |fields| power_law(fields, |_| Damping::Elastic)),
        ("formula", |fields| {
            // A sound law in the place of one that could not be read, for which a problem was added.
            let unread = NormalLaw { stiffness: 1.0, exponent: 1.0, damping: Damping::Elastic };
            law(fields, "force", &OF_NORMAL_FORCE, FORCE).map_or(unread, NormalLaw::of)
        }),
    ];
    fields.one_of("law", &damped)
}

fn power_law(fields: &mut Fields, damping: impl FnOnce(&mut Fields) -> Damping) -> NormalLaw {
    NormalLaw {
        stiffness: fields.number("stiffness"),
        exponent: fields.number_or("exponent", 1.5),
        damping: damping(fields),
    }
}

fn friction_law(fields: &mut Fields) -> FrictionLaw {
    fields.one_of(
        "law",
        &[
            ("modified_coulomb", |fields| FrictionLaw::ModifiedCoulomb {
                static_coefficient: fields.number("static_coefficient"),
                sliding_coefficient: fields.number("sliding_coefficient"),
                stick_slip_velocity: fields.number("stick_slip_velocity"),
                static_sliding_velocity: fields.number("static_sliding_velocity"),
            }),
            ("smoothed_coulomb", |fields| FrictionLaw::SmoothedCoulomb {
                coefficient: fields.number("coefficient"),
                velocity: fields.number("velocity"),
            }),
            ("stick_slip", |fields| {
                FrictionLaw::StickSlip(StickSlip {
                    static_coefficient: fields.number("static_coefficient"),
                    sliding_coefficient: fields.number("sliding_coefficient"),
                    stribeck_velocity: fields.number("stribeck_velocity"),
                    tangential_stiffness: fields.optional_number("tangential_stiffness"),
                    damping_ratio: fields.number_or("damping_ratio", 0.3),
                })
            }),
            ("formula", |fields| {
                let unread = FrictionLaw::SmoothedCoulomb { coefficient: 0.0, velocity: 1.0 };
                law(fields, "coefficient", &OF_FRICTION, PLAIN).map_or(unread, FrictionLaw::of)
            }),
        ],
    )
}

fn lubricant(fields: &mut Fields) -> Lubricant {
    Lubricant {
        has_finite_width: fields.tag("law", &[("short_bearing", false), ("finite_bearing", true)]),
        viscosity: fields.number("viscosity"),
        length: fields.number("length"),
        roughness: fields.number("roughness"),
    }
}

fn force(fields: &mut Fields) -> Force {
    fields.one_of(
        "type",
        &[
            ("gravity", |fields| Force::Gravity { acceleration: fields.pair("acceleration") }),
            ("spring", |fields| {
                let ([name, a, b], tension) = link(fields);
                let [stiffness, length] = ["stiffness", "length"].map(|field| fields.number(field));
                let damping = fields.number_or("damping", 0.0);
                Force::Spring { name, a, b, stiffness, length, damping, tension }
            }),
            // A spring without stiffness.
            ("damper", |fields| {
                let ([name, a, b], tension) = link(fields);
                let damping = fields.number("damping");
                Force::Spring { name, a, b, stiffness: 0.0, length: 0.0, damping, tension }
            }),
            ("bushing", bushing),
            ("torsion_spring", |fields| {
                let [name, a, b] = names(fields);
                let stiffness = fields.number("stiffness");
                let [angle, damping] = ["angle", "damping"].map(|field| fields.number_or(field, 0.0));
                Force::TorsionSpring { name, a, b, stiffness, angle, damping }
            }),
            ("torsion_damper", |fields| {
                let [name, a, b] = names(fields);
                let damping = fields.number("damping");
                Force::TorsionSpring { name, a, b, stiffness: 0.0, angle: 0.0, damping }
            }),
            ("force", |fields| Force::Applied {
                name: fields.text("name"),
                point: fields.text("point"),
                x: load(fields, "x"),
                y: load(fields, "y"),
                frame: fields.word("frame", &[("ground", ForceFrame::Ground), ("body", ForceFrame::Body)]),
            }),
            ("torque", |fields| Force::Torque {
                name: fields.text("name"),
                body: fields.text("body"),
                reaction: fields.text_or("reaction", GROUND),
                torque: load(fields, "torque"),
            }),
        ],
    )
}

/// Name and ends of a spring or damper, and its further tension.
fn link(fields: &mut Fields) -> ([String; 3], Load) {
    (names(fields), load_or_none(fields, "tension"))
}

fn drive(fields: &mut Fields) -> Drive {
    fields.one_of(
        "type",
        &[
            ("speed", |fields| Drive::Speed {
                name: fields.text("name"),
                joint: fields.text("joint"),
                speed: fields.number("speed"),
                angle: fields.number_or("angle", 0.0),
            }),
            ("motion", |fields| Drive::Motion {
                name: fields.text("name"),
                joint: fields.text("joint"),
                motion: time_function(fields, "motion"),
            }),
        ],
    )
}

fn start(fields: &mut Fields) -> Start {
    fields.one_of(
        "type",
        &[
            ("joint", |fields| Start::Joint {
                joint: fields.text("joint"),
                position: fields.optional_number("position"),
                velocity: fields.optional_number("velocity"),
            }),
            ("body", |fields| Start::Body {
                body: fields.text("body"),
                angle: fields.optional_number("angle"),
                angular_velocity: fields.optional_number("angular_velocity"),
            }),
            ("clearance", |fields| Start::Clearance {
                joint: fields.text("joint"),
                eccentricity: fields.pair("eccentricity"),
                rate: fields.optional("rate").map_or([0.0, 0.0], |node| node.pair()),
            }),
            ("guide", |fields| Start::Guide {
                joint: fields.text("joint"),
                offset: ["offset", "offset_rate"].map(|field| fields.number_or(field, 0.0)),
                tilt: ["tilt", "tilt_rate"].map(|field| fields.number_or(field, 0.0)),
                displacement: ["displacement", "velocity"].map(|field| fields.optional_number(field)),
            }),
        ],
    )
}
