//! Couplings of two coordinates: gears, racks, belts, cams. In: JSON, and the scene that holds them; out: the records,
//! what is wrong with them, and their laws compiled.

use crate::numerics::accuracy::EQUAL;
use std::f64::consts::{FRAC_PI_2, TAU};

use crate::contact::normal::NormalLaw;
use crate::error::Notice;
use crate::expression::curve::{Beyond, Curve, Interpolation};
use crate::expression::dimension::{Dimension, PLAIN};
use crate::expression::grammar::Syntax;
use crate::expression::tape::Tape;
use crate::scene::check::Checker;
use crate::scene::functions::expression_in;
use crate::scene::json::{Fields, Node, finite, positive};
use crate::scene::loads::Expression;
use crate::scene::parts::{Force, GROUND, Scene};
use crate::scene::quantities::{Coordinate, Quantity, TIME};
use crate::scene::reader::normal_law;

/// Implausible backlash [m]: that of teeth is a few hundredths of their module.
/// Half and twice change no warning of the tests.
const WIDE: f64 = 5e-3;

/// One coordinate is a function of another, whatever the forces: driven = law(driver) + offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Coupling {
    /// Name, unique in the scene.
    pub name: String,
    /// Name of the driven coordinate, as that of an output.
    pub driven: String,
    /// Name of the driver.
    pub driver: String,
    /// How the one follows from the other.
    pub law: CouplingLaw,
    /// The body against which the angles of the two bodies count.
    pub carrier: Option<String>,
    /// What is added [rad or m]; `None`: for a ratio as the start has it, otherwise nothing.
    pub offset: Option<f64>,
    /// Angle of the force between teeth to the common tangent of the pitch circles [rad]; `None`: torques act alone.
    pub pressure_angle: Option<f64>,
    /// Play of the teeth; `None`: they hold both ways.
    pub backlash: Option<Backlash>,
}

/// Play between teeth, and the force of their flanks.
#[derive(Clone, Debug, PartialEq)]
pub struct Backlash {
    /// How far the driven teeth can move between their flanks, along the pitch circle [m].
    pub play: f64,
    /// Normal force of a flank along the tangent of the pitch circles.
    pub contact: NormalLaw,
}

/// How the driven coordinate follows from the driver.
#[derive(Clone, Debug, PartialEq)]
pub enum CouplingLaw {
    /// In proportion.
    Ratio(f64),
    /// By the cubic spline through points.
    Table {
        /// Values of the driver [rad or m].
        points: Vec<f64>,
        /// Values of the driven coordinate there [rad or m].
        values: Vec<f64>,
        /// Whether it repeats itself.
        periodic: bool,
    },
    /// By a formula of the driver.
    Formula(Box<Expression>),
}

/// A coordinate that a coupling may tie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coupled {
    /// Angle of the second body relative to the first; `None` is ground.
    Angle([Option<usize>; 2]),
    /// Displacement in a prismatic joint, by the index of the joint.
    Displacement(usize),
}

impl Coupled {
    fn dimension(self) -> Dimension {
        match self {
            Coupled::Angle(_) => PLAIN,
            Coupled::Displacement(_) => [0, 1, 0],
        }
    }

    fn is_angle(self) -> bool {
        matches!(self, Coupled::Angle(_))
    }
}

/// A law of motion, compiled: driven = ratio driver + law(driver).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CompiledLaw {
    /// The part in proportion.
    pub ratio: f64,
    /// The rest, of one variable.
    pub law: Option<Tape>,
    /// Whether the rest repeats itself with every turn of the driver.
    pub repeats: bool,
}

pub(super) fn coupling(fields: &mut Fields) -> Coupling {
    let driver = fields.text("driver");
    Coupling {
        name: fields.text("name"),
        driven: fields.text("driven"),
        law: fields.required("law").map_or(UNREADABLE, |node| law(node, &driver)),
        driver,
        carrier: fields.optional("carrier").map(|node| node.text()),
        offset: fields.optional_quantity("offset", finite("rad or m")),
        pressure_angle: fields.optional("pressure_angle").map(|node| node.number()),
        backlash: backlash(fields),
    }
}

fn backlash(fields: &mut Fields) -> Option<Backlash> {
    let play = fields.optional_quantity("backlash", positive("m"));
    let contact = fields.optional("contact").map(|node| node.read(normal_law));
    let missing = match (play, contact) {
        (Some(play), Some(contact)) => return Some(Backlash { play, contact }),
        (None, None) => return None,
        (None, Some(_)) => "backlash",
        (Some(_), None) => "contact",
    };
    fields.problem(missing, "is missing: backlash and contact belong together");
    None
}

/// Placeholder of a law that could not be read, for which a problem was added.
const UNREADABLE: CouplingLaw = CouplingLaw::Ratio(1.0);

fn law(node: Node, driver: &str) -> CouplingLaw {
    if !node.value.is_object() {
        return CouplingLaw::Ratio(node.number());
    }
    let law = |fields: &mut Fields| {
        if !fields.tag("function", &[("table", true), ("expression", false)]) {
            return Some(CouplingLaw::Formula(Box::new(expression_in(fields)?)));
        }
        // Jumps of the slope would be impacts, jumps of the curvature jumps of the force.
        for (field, only) in [("interpolation", "cubic"), ("beyond", "end")] {
            if fields.optional(field).is_some() {
                fields.word(field, &[(only, ())]);
            }
        }
        let over = fields.text_or("over", TIME);
        if over.trim() != TIME && over.trim() != driver {
            fields.problem("over", format!("must be left out, or the driver {driver:?}, got {over:?}"));
        }
        Some(CouplingLaw::Table {
            points: fields.numbers("points"),
            values: fields.numbers("values"),
            periodic: fields.optional("periodic").is_some_and(|node| node.truth()),
        })
    };
    node.read(|fields| fields.sound(law)).flatten().unwrap_or(UNREADABLE)
}

impl Coupling {
    /// The driven coordinate and the driver.
    ///
    /// # Errors
    /// What is wrong with the name of each.
    pub fn coordinates(&self, scene: &Scene) -> [Result<Coupled, String>; 2] {
        [&self.driven, &self.driver].map(|name| self.coordinate(scene, name))
    }

    /// The bodies that it ties, as far as their names are known.
    pub(super) fn bodies(&self, scene: &Scene) -> Vec<usize> {
        let of = |end| match end {
            Coupled::Angle(bodies) => bodies,
            Coupled::Displacement(joint) => {
                scene.ends(&scene.joints[joint]).map(|end| end.and_then(|end| end.body))
            }
        };
        self.coordinates(scene).into_iter().flatten().flat_map(of).flatten().collect()
    }

    fn coordinate(&self, scene: &Scene, name: &str) -> Result<Coupled, String> {
        if let Some(carrier) = &self.carrier {
            let body = name.strip_suffix(".angle").and_then(|owner| scene.body_index(owner).ok());
            return match (scene.body_index(carrier), body) {
                (Ok(carrier), Some(body)) if body != carrier => Ok(Coupled::Angle([carrier, body])),
                _ => Err(format!(
                    "must be the angle of another body than the carrier, such as \"planet.angle\" or \
                     \"{GROUND}.angle\", got {name:?}"
                )),
            };
        }
        let of_force =
            |force: &Force| force.name().is_some_and(|own| name.strip_prefix(own) == Some(".angle"));
        let Quantity { of, is_rate } = scene.quantity(name)?;
        match of {
            Coordinate::Angle(bodies) if !is_rate && !scene.forces.iter().any(of_force) => {
                Ok(Coupled::Angle(bodies))
            }
            Coordinate::Displacement(joint) if !is_rate => Ok(Coupled::Displacement(joint)),
            _ => Err(format!(
                "must be the angle of a body or of a revolute joint, or the displacement in a prismatic joint, got \
                 {name:?}"
            )),
        }
    }

    /// Its law, between these coordinates.
    ///
    /// # Errors
    /// Where it has no three derivatives, or does not repeat itself over an angle.
    pub fn compiled(&self, [driven, driver]: [Coupled; 2]) -> Result<CompiledLaw, String> {
        match &self.law {
            CouplingLaw::Ratio(ratio) if *ratio == 0.0 || !ratio.is_finite() => {
                Err(format!("a ratio must be a finite number other than 0, got {ratio}"))
            }
            CouplingLaw::Ratio(ratio) => Ok(CompiledLaw { ratio: *ratio, ..CompiledLaw::default() }),
            CouplingLaw::Formula(formula) => {
                let of_name = |name: &str| (name == self.driver).then(|| driver.dimension());
                if let Some(message) = formula.wrong_dimension(&of_name, driven.dimension()) {
                    return Err(message);
                }
                let tape = formula.smooth_in(&self.driver, "the law of a coupling")?;
                Ok(CompiledLaw { law: Some(tape), ..CompiledLaw::default() })
            }
            CouplingLaw::Table { points, values, periodic } => {
                let (ratio, curve) = match (driver.is_angle(), *periodic) {
                    (true, true) => repeated(points, values, driven)?,
                    (false, false) => (0.0, Curve::spline(points, values)?),
                    (true, false) => {
                        return Err("over an angle, which turns on, a table must be periodic".to_owned());
                    }
                    (false, true) => {
                        return Err("over a displacement a table must not be periodic".to_owned());
                    }
                };
                let variable = Tape::new(&Syntax::Name(String::new(), 0), &[], &mut |_| 0, None)?;
                Ok(CompiledLaw { ratio, law: Some(variable.of_curve(curve)), repeats: *periodic })
            }
        }
    }

    /// Adds what is wrong with the coupling but for its name.
    pub(super) fn check(&self, scene: &Scene, checker: &mut Checker) {
        self.check_teeth(scene, checker);
        if let Some(carrier) = &self.carrier
            && checker.result("carrier", scene.body_index(carrier)).is_none()
        {
            return;
        }
        let [driven, driver] = self.coordinates(scene);
        let ends = [checker.result("driven", driven), checker.result("driver", driver)];
        let [Some(driven), Some(driver)] = ends else { return };
        if driven == driver {
            checker.add("driver", "is the driven coordinate itself");
        }
        checker.result("law", self.compiled([driven, driver]));
    }

    fn check_teeth(&self, scene: &Scene, checker: &mut Checker) {
        if let Some(angle) = self.pressure_angle {
            if !(0.0..FRAC_PI_2).contains(&angle) {
                let message = format!("must be >= 0 and below pi/2 [rad], 20 degrees are 0.349; got {angle}");
                checker.add("pressure_angle", message);
            } else if !matches!(self.law, CouplingLaw::Ratio(_)) {
                checker.add("pressure_angle", "belongs to teeth: the law must be a ratio");
            }
        }
        let Some(Backlash { contact, .. }) = &self.backlash else { return };
        let bodies = self.bodies(scene);
        checker.inside("contact").normal_law(contact, scene, [bodies.first().copied(), None]);
        if self.pressure_angle.is_none() {
            let message = "must be given with a backlash, since the flanks touch at the pitch point";
            checker.add("pressure_angle", message);
        }
    }

    /// Warnings of lengths that look as if they were in millimeters.
    pub(super) fn implausible(&self, scene: &Scene, path: &str, longest: f64) -> Vec<Notice> {
        let mut lengths = Vec::new();
        if let ([Ok(Coupled::Displacement(_)), Ok(Coupled::Angle(_))], CouplingLaw::Ratio(radius)) =
            (self.coordinates(scene), &self.law)
        {
            lengths.push(("law", "pitch radius", radius.abs(), longest));
        }
        lengths.extend(self.backlash.as_ref().map(|backlash| ("backlash", "backlash", backlash.play, WIDE)));
        let long = lengths.into_iter().filter(|(_, _, length, most)| length > most);
        long.map(|(field, what, length, _)| {
            let message =
                format!("a {what} of {length} m: lengths are in meters, {length} mm are {}", length / 1e3);
            let path = format!("{path}.{field}");
            Notice::of_field("large_coupling", path, vec![("length", length)], message)
        })
        .collect()
    }
}

/// A table that repeats itself over an angle, as a part in proportion and the rest. What a body turns on in a period, as
/// in a Geneva drive, is that part.
fn repeated(points: &[f64], values: &[f64], driven: Coupled) -> Result<(f64, Curve), String> {
    let ([first_point, .., last_point], [first, .., last]) = (points, values) else {
        // Says what is missing.
        return Curve::spline(points, values).map(|curve| (0.0, curve));
    };
    let (span, advance) = (last_point - first_point, last - first);
    let count = (TAU / span).round();
    if !(count >= 1.0 && (count * span / TAU - 1.0).abs() <= EQUAL) {
        return Err(format!(
            "the points of a table over an angle must span a turn, 2 pi = {TAU} rad, or a whole part of it, got {span}"
        ));
    }
    let exact = if advance == 0.0 { Some(0.0) } else { whole_part_of_a_turn(advance) };
    let exact = exact.filter(|advance| *advance == 0.0 || driven.is_angle()).ok_or_else(|| {
        format!(
            "a periodic table ends with its first value, {first}, or, where it drives an angle, a whole part of a turn \
             beyond it; got {last}"
        )
    })?;
    let ratio = exact * count / TAU;
    let points: Vec<f64> = points.iter().map(|point| point * (TAU / (count * span))).collect();
    let mut rest: Vec<f64> = values.iter().zip(&points).map(|(value, point)| value - ratio * point).collect();
    let end = rest.len() - 1;
    rest[end] = rest[0];
    Curve::new(&points, &rest, Interpolation::Cubic, Beyond::Repeat).map(|curve| (ratio, curve))
}

/// The whole number of turns, or whole part of one, that an angle is but for its last digits.
fn whole_part_of_a_turn(angle: f64) -> Option<f64> {
    let turns = angle / TAU;
    let near = if turns.abs() >= 1.0 { turns.round() } else { 1.0 / (1.0 / turns).round() };
    ((turns / near - 1.0).abs() <= EQUAL).then_some(near * TAU)
}
