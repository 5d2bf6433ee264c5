//! Checks of guides with play, slots with pins and stops, and of how they start.

use crate::scene::check::Checker;
use crate::scene::parts::{GuideShape, Joint, Start};

impl Checker {
    /// Checks the numbers of a guide.
    pub(super) fn guide(&mut self, path: &str, joint: &Joint) {
        let Joint::Guide { axis, shape, contact, friction, impact_velocity_floor, .. } = joint else {
            return;
        };
        let direction = if let GuideShape::Stop { .. } = shape { "normal" } else { "axis" };
        self.finite_pair(&format!("{path}.{direction}"), "-", axis);
        if *axis == [0.0, 0.0] {
            self.add(format!("{path}.{direction}"), "must not be the zero vector");
        }
        match *shape {
            GuideShape::Block { length, height, clearance, angle, is_sleeve } => {
                self.positive(&format!("{path}.length"), "m", length);
                self.positive(&format!("{path}.height"), "m", height);
                self.positive(&format!("{path}.clearance"), "m", clearance);
                self.finite(&format!("{path}.angle"), "rad", angle);
                // Half the diagonal fits between the faces then.
                let most = 0.5 * (length.hypot(height) - height);
                if !is_sleeve && clearance >= most {
                    self.add(
                        format!("{path}.clearance"),
                        format!(
                            "must be < {most:e} [m]: with more, a block of this length and height can turn over between \
                             the faces; got {clearance:e}"
                        ),
                    );
                }
            }
            GuideShape::Pin { radius, clearance } => {
                self.positive(&format!("{path}.pin_radius"), "m", radius);
                self.positive(&format!("{path}.clearance"), "m", clearance);
            }
            GuideShape::Stop { radius } => self.at_least(&format!("{path}.radius"), "m", radius, 0.0),
        }
        self.normal_law(&format!("{path}.contact"), contact);
        if let Some(law) = friction {
            self.friction(&format!("{path}.friction"), law);
        }
        if let Some(floor) = impact_velocity_floor {
            self.positive(&format!("{path}.impact_velocity_floor"), "m/s", *floor);
        }
    }

    /// Checks the numbers of the start of a guide, and that the joint is one.
    pub(super) fn guide_start(&mut self, path: &str, joint: &Joint, start: &Start) -> Result<(), String> {
        let Start::Guide { offset, tilt, displacement, .. } = start else { return Ok(()) };
        let numbers = [
            ("offset", "m", offset[0]),
            ("offset_rate", "m/s", offset[1]),
            ("tilt", "rad", tilt[0]),
            ("tilt_rate", "rad/s", tilt[1]),
            ("displacement", "m", displacement[0].unwrap_or(0.0)),
            ("velocity", "m/s", displacement[1].unwrap_or(0.0)),
        ];
        for (field, unit, value) in numbers {
            self.finite(&format!("{path}.{field}"), unit, value);
        }
        match joint {
            Joint::Guide { shape: GuideShape::Pin { .. }, .. } if *tilt != [0.0, 0.0] => {
                Err(format!("the pin of {:?} has no tilt: it may turn", joint.name()))
            }
            Joint::Guide { shape: GuideShape::Block { .. } | GuideShape::Pin { .. }, .. } => Ok(()),
            _ => Err(format!("joint {:?} must be a guide with play or a pin in a slot", joint.name())),
        }
    }
}
