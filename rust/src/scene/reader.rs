//! Reads a scene from JSON text: every unknown field, missing field and wrong type at once.
//!
//! A derived reader stops at the first error. Here all are collected with their paths, so that the user sees
//! them together with the physical problems of [`Scene::check`].

use std::collections::HashSet;

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
use crate::scene::json::{FRACTION, Fields, Kind, at_least, finite, parse, positive, read_object};
use crate::scene::loads::Load;
use crate::scene::parts::{
    Body, CENTER_OF_MASS, Drive, Force, ForceFrame, GROUND, GuideShape, Joint, JointKind, Scene, Start,
};

/// The fields that determine the kind of an object; without them it cannot be checked.
const TAGS: [&str; 3] = [".type", ".law", ".function"];

/// The place of a problem from which others may follow: its path, or the object whose kind is unknown.
fn place_of(path: &str) -> &str {
    TAGS.iter().find_map(|tag| path.strip_suffix(tag)).unwrap_or(path)
}

/// Whether a problem at a path follows from one at a known place: there, or inside of it.
fn follows(path: &str, known: &HashSet<String>) -> bool {
    let outer = path.match_indices(['.', '[']).map(|(end, _)| &path[..end]);
    outer.chain(["", path]).any(|place| known.contains(place))
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
        let mut known: HashSet<String> =
            problems.iter().map(|one: &Problem| place_of(&one.path).to_owned()).collect();
        for problem in error.problems {
            if !follows(&problem.path, &known) {
                known.insert(place_of(&problem.path).to_owned());
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
        mass: fields.quantity("mass", at_least(0.0, "kg")),
        inertia: fields.quantity("inertia", at_least(0.0, "kg m^2")),
        center_of_mass: fields.optional("center_of_mass").map_or([0.0, 0.0], |node| node.pair("m")),
        inertia_about: fields.text_or("inertia_about", CENTER_OF_MASS),
        points: fields.points("points"),
        angle: fields.quantity_or("angle", finite("rad"), 0.0),
    }
}

fn joint(fields: &mut Fields) -> Joint {
    fields.one_of(
        "type",
        &[
            ("revolute", &|fields| {
                let ([name, a, b], friction) = ideal(fields, "journal_friction", "journal_radius");
                let friction = friction.map(|[coefficient, journal_radius]| JointFriction::Journal {
                    coefficient,
                    journal_radius,
                });
                Joint::Ideal { name, a, b, kind: JointKind::Revolute, friction }
            }),
            ("prismatic", &|fields| {
                let ([name, a, b], friction) = ideal(fields, "guide_friction", "half_length");
                let friction = friction
                    .map(|[coefficient, half_length]| JointFriction::Guide { coefficient, half_length });
                let (axis, angle) =
                    (fields.direction("axis"), fields.quantity_or("angle", finite("rad"), 0.0));
                Joint::Ideal { name, a, b, kind: JointKind::Prismatic { axis, angle }, friction }
            }),
            ("fixed", &|fields| {
                let [name, a, b] = names(fields);
                let kind = JointKind::Fixed { angle: fields.quantity_or("angle", finite("rad"), 0.0) };
                Joint::Ideal { name, a, b, kind, friction: None }
            }),
            ("clearance_revolute", &clearance),
            ("clearance_prismatic", &|fields| {
                guide(fields, ["a", "b", "axis"], |fields| GuideShape::Block {
                    length: fields.quantity("length", positive("m")),
                    height: fields.quantity("height", positive("m")),
                    clearance: fields.quantity("clearance", positive("m")),
                    angle: fields.quantity_or("angle", finite("rad"), 0.0),
                    is_sleeve: fields.word("corners", &[("b", false), ("a", true)]),
                })
            }),
            ("pin_in_slot", &|fields| {
                guide(fields, ["slot", "pin", "axis"], |fields| GuideShape::Pin {
                    radius: fields.quantity("pin_radius", positive("m")),
                    clearance: fields.quantity("clearance", positive("m")),
                })
            }),
            ("stop", &|fields| {
                guide(fields, ["a", "b", "normal"], |fields| GuideShape::Stop {
                    radius: fields.quantity_or("radius", at_least(0.0, "m"), 0.0),
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
            [fields.quantity("coefficient", at_least(0.0, "-")), fields.quantity(size, positive("m"))]
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
        journal_radius: fields.quantity("journal_radius", positive("m")),
        clearance: fields.quantity("clearance", positive("m")),
        contact: contact(fields),
        friction: fields.optional("friction").map(|node| node.read(friction_law)),
        sliding: fields.word("sliding", &conventions),
        film: fields.optional("film").map(|node| node.read(lubricant)),
        profile: fields.optional("profile").map_or_else(Vec::new, |node| node.quantities(at_least(0.0, "m"))),
        impact_velocity_floor: fields.optional_quantity("impact_velocity_floor", positive("m/s")),
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
        axis: fields.direction(axis),
        shape: shape(fields),
        face_length: fields.optional_quantity("face_length", positive("m")),
        contact: contact(fields),
        friction: fields.optional("friction").map(|node| node.read(friction_law)),
        impact_velocity_floor: fields.optional_quantity("impact_velocity_floor", positive("m/s")),
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
        ("lankarani_nikravesh", &|fields| {
            power_law(fields, |fields| Damping::LankaraniNikravesh {
                restitution: fields.quantity("restitution", FRACTION),
            })
        }),
        ("flores", &|fields| {
            power_law(fields, |fields| Damping::Flores {
                restitution: fields.quantity("restitution", FRACTION),
            })
        }),
        ("exact_restitution", &|fields| {
            power_law(fields, |fields| Damping::exact_restitution(fields.quantity("restitution", FRACTION)))
        }),
        ("hunt_crossley", &|fields| {
            power_law(fields, |fields| Damping::HuntCrossley {
                hysteresis_factor: fields.quantity("hysteresis_factor", at_least(0.0, "s/m")),
            })
        }),
        ("kelvin_voigt", &|fields| {
            power_law(fields, |fields| Damping::KelvinVoigt {
                damping: fields.quantity("damping", at_least(0.0, "N s/m")),
            })
        }),
        ("impact", &|fields| {
            power_law(fields, |fields| Damping::Impact {
                damping: fields.quantity("damping", at_least(0.0, "N s/m")),
                depth: fields.quantity("depth", positive("m")),
            })
        }),
        ("hertz", &|fields| power_law(fields, |_| Damping::Elastic)),
        ("formula", &|fields| {
            // A sound law in the place of one that could not be read, for which a problem was added.
            let unread = NormalLaw { stiffness: 1.0, exponent: 1.0, damping: Damping::Elastic };
            law(fields, "force", &OF_NORMAL_FORCE, FORCE).map_or(unread, NormalLaw::of)
        }),
    ];
    fields.one_of("law", &damped)
}

fn power_law(fields: &mut Fields, damping: impl FnOnce(&mut Fields) -> Damping) -> NormalLaw {
    NormalLaw {
        stiffness: fields.quantity("stiffness", positive("N/m^exponent")),
        exponent: fields.quantity_or("exponent", at_least(1.0, "-"), 1.5),
        damping: damping(fields),
    }
}

fn friction_law(fields: &mut Fields) -> FrictionLaw {
    fields.one_of(
        "law",
        &[
            ("modified_coulomb", &|fields| FrictionLaw::ModifiedCoulomb {
                static_coefficient: fields.quantity("static_coefficient", at_least(0.0, "-")),
                sliding_coefficient: fields.quantity("sliding_coefficient", at_least(0.0, "-")),
                stick_slip_velocity: fields.quantity("stick_slip_velocity", positive("m/s")),
                static_sliding_velocity: fields.quantity("static_sliding_velocity", positive("m/s")),
            }),
            ("smoothed_coulomb", &|fields| FrictionLaw::SmoothedCoulomb {
                coefficient: fields.quantity("coefficient", at_least(0.0, "-")),
                velocity: fields.quantity("velocity", positive("m/s")),
            }),
            ("stick_slip", &|fields| {
                FrictionLaw::StickSlip(StickSlip {
                    static_coefficient: fields.quantity("static_coefficient", at_least(0.0, "-")),
                    sliding_coefficient: fields.quantity("sliding_coefficient", at_least(0.0, "-")),
                    stribeck_velocity: fields.quantity("stribeck_velocity", at_least(0.0, "m/s")),
                    tangential_stiffness: fields.optional_quantity("tangential_stiffness", positive("N/m")),
                    damping_ratio: fields.quantity_or("damping_ratio", at_least(0.0, "-"), 0.3),
                })
            }),
            ("formula", &|fields| {
                let unread = FrictionLaw::SmoothedCoulomb { coefficient: 0.0, velocity: 1.0 };
                law(fields, "coefficient", &OF_FRICTION, PLAIN).map_or(unread, FrictionLaw::of)
            }),
        ],
    )
}

fn lubricant(fields: &mut Fields) -> Lubricant {
    Lubricant {
        has_finite_width: fields.tag("law", &[("short_bearing", false), ("finite_bearing", true)]),
        viscosity: fields.quantity("viscosity", positive("Pa s")),
        length: fields.quantity("length", positive("m")),
        roughness: fields.quantity("roughness", positive("m")),
    }
}

fn force(fields: &mut Fields) -> Force {
    fields.one_of(
        "type",
        &[
            ("gravity", &|fields| Force::Gravity { acceleration: fields.pair("acceleration", "m/s^2") }),
            ("spring", &|fields| {
                let ([name, a, b], tension) = link(fields);
                let stiffness = fields.quantity("stiffness", at_least(0.0, "N/m"));
                let length = fields.quantity("length", at_least(0.0, "m"));
                let damping = fields.quantity_or("damping", at_least(0.0, "N s/m"), 0.0);
                Force::Spring { name, a, b, stiffness, length, damping, tension }
            }),
            // A spring without stiffness.
            ("damper", &|fields| {
                let ([name, a, b], tension) = link(fields);
                let damping = fields.quantity("damping", at_least(0.0, "N s/m"));
                Force::Spring { name, a, b, stiffness: 0.0, length: 0.0, damping, tension }
            }),
            ("bushing", &bushing),
            ("torsion_spring", &|fields| {
                let [name, a, b] = names(fields);
                let stiffness = fields.quantity("stiffness", at_least(0.0, "N m/rad"));
                let angle = fields.quantity_or("angle", finite("rad"), 0.0);
                let damping = fields.quantity_or("damping", at_least(0.0, "N m s/rad"), 0.0);
                Force::TorsionSpring { name, a, b, stiffness, angle, damping }
            }),
            ("torsion_damper", &|fields| {
                let [name, a, b] = names(fields);
                let damping = fields.quantity("damping", at_least(0.0, "N m s/rad"));
                Force::TorsionSpring { name, a, b, stiffness: 0.0, angle: 0.0, damping }
            }),
            ("force", &|fields| Force::Applied {
                name: fields.text("name"),
                point: fields.text("point"),
                x: load(fields, "x", "N"),
                y: load(fields, "y", "N"),
                frame: fields.word("frame", &[("ground", ForceFrame::Ground), ("body", ForceFrame::Body)]),
            }),
            ("torque", &|fields| Force::Torque {
                name: fields.text("name"),
                body: fields.text("body"),
                reaction: fields.text_or("reaction", GROUND),
                torque: load(fields, "torque", "N m"),
            }),
        ],
    )
}

/// Name and ends of a spring or damper, and its further tension.
fn link(fields: &mut Fields) -> ([String; 3], Load) {
    (names(fields), load_or_none(fields, "tension", "N"))
}

fn drive(fields: &mut Fields) -> Drive {
    fields.one_of(
        "type",
        &[
            ("speed", &|fields| Drive::Speed {
                name: fields.text("name"),
                joint: fields.text("joint"),
                speed: fields.quantity("speed", finite("rad/s")),
                angle: fields.quantity_or("angle", finite("rad"), 0.0),
            }),
            ("motion", &|fields| Drive::Motion {
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
            ("joint", &|fields| Start::Joint {
                joint: fields.text("joint"),
                position: fields.optional_quantity("position", finite("rad or m")),
                velocity: fields.optional_quantity("velocity", finite("rad/s or m/s")),
            }),
            ("body", &|fields| Start::Body {
                body: fields.text("body"),
                angle: fields.optional_quantity("angle", finite("rad")),
                angular_velocity: fields.optional_quantity("angular_velocity", finite("rad/s")),
            }),
            ("clearance", &|fields| Start::Clearance {
                joint: fields.text("joint"),
                eccentricity: fields.pair("eccentricity", "m"),
                rate: fields.optional("rate").map_or([0.0, 0.0], |node| node.pair("m/s")),
            }),
            ("guide", &|fields| Start::Guide {
                joint: fields.text("joint"),
                offset: [("offset", "m"), ("offset_rate", "m/s")]
                    .map(|(field, unit)| fields.quantity_or(field, finite(unit), 0.0)),
                tilt: [("tilt", "rad"), ("tilt_rate", "rad/s")]
                    .map(|(field, unit)| fields.quantity_or(field, finite(unit), 0.0)),
                displacement: [("displacement", "m"), ("velocity", "m/s")]
                    .map(|(field, unit)| fields.optional_quantity(field, finite(unit))),
            }),
        ],
    )
}
