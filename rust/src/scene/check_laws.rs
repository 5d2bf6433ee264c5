//! Checks of the laws of contact and friction.

use crate::contact::friction::FrictionLaw;
use crate::contact::normal::{Damping, NormalLaw};
use crate::error::refused;
use crate::scene::check::Checker;

impl Checker {
    pub(super) fn normal_law(&mut self, path: &str, law: &NormalLaw) {
        self.positive(&format!("{path}.stiffness"), "N/m^exponent", law.stiffness);
        self.at_least(&format!("{path}.exponent"), "-", law.exponent, 1.0);
        match law.damping {
            Damping::Elastic => {}
            Damping::LankaraniNikravesh { restitution }
            | Damping::Flores { restitution }
            | Damping::ExactRestitution { restitution, .. } => {
                self.fraction(&format!("{path}.restitution"), restitution);
            }
            Damping::KelvinVoigt { damping } => {
                self.at_least(&format!("{path}.damping"), "N s/m", damping, 0.0);
            }
            Damping::Impact { damping, depth } => {
                self.at_least(&format!("{path}.damping"), "N s/m", damping, 0.0);
                self.positive(&format!("{path}.depth"), "m", depth);
            }
            Damping::HuntCrossley { hysteresis_factor } => {
                self.at_least(&format!("{path}.hysteresis_factor"), "s/m", hysteresis_factor, 0.0);
            }
        }
    }

    pub(super) fn friction(&mut self, path: &str, law: &FrictionLaw) {
        let (static_coefficient, sliding_coefficient, stick_slip_velocity, static_sliding_velocity) =
            match *law {
                FrictionLaw::SmoothedCoulomb { coefficient, velocity } => {
                    self.at_least(&format!("{path}.coefficient"), "-", coefficient, 0.0);
                    return self.positive(&format!("{path}.velocity"), "m/s", velocity);
                }
                FrictionLaw::ModifiedCoulomb {
                    static_coefficient,
                    sliding_coefficient,
                    stick_slip_velocity,
                    static_sliding_velocity,
                } => (static_coefficient, sliding_coefficient, stick_slip_velocity, static_sliding_velocity),
            };
        self.at_least(&format!("{path}.static_coefficient"), "-", static_coefficient, 0.0);
        self.at_least(&format!("{path}.sliding_coefficient"), "-", sliding_coefficient, 0.0);
        self.positive(&format!("{path}.stick_slip_velocity"), "m/s", stick_slip_velocity);
        self.positive(&format!("{path}.static_sliding_velocity"), "m/s", static_sliding_velocity);
        if static_sliding_velocity <= stick_slip_velocity {
            self.add(
                format!("{path}.static_sliding_velocity"),
                format!(
                    "must be > stick_slip_velocity = {} [m/s], got {}",
                    refused(stick_slip_velocity, static_sliding_velocity),
                    refused(static_sliding_velocity, stick_slip_velocity)
                ),
            );
        }
    }
}
