//! The couplings of a scene on the columns of its tree.

use crate::scene::couplings::{CompiledLaw, Coupled};
use crate::scene::parts::Scene;
use crate::tree::elements::{CoupledCoordinate, Coupling, Realization, Tree};
use crate::tree::loads::{MotionLoad, Variable};

impl Tree {
    /// Adds the couplings of a checked scene. Their laws become functions of the motion, whose tables may end.
    pub(super) fn add_couplings(&mut self, scene: &Scene) {
        for coupling in &scene.couplings {
            let [Ok(driven), Ok(driver)] = coupling.coordinates(scene) else { continue };
            let CompiledLaw { ratio, law, repeats } = coupling.compiled([driven, driver]).unwrap_or_default();
            let [driven, driver] = [driven, driver].map(|end| self.coupled(scene, end));
            // In proportion the start decides how the wheels stand.
            let offset = coupling.offset.or(law.as_ref().map(|_| 0.0));
            let law = law.map(|tape| {
                let variables = vec![(coupling.driver.clone(), self.variable_of(&driver))];
                let (name, text) = (coupling.name.clone(), coupling.driver.clone());
                let first_switch = self.switch_count();
                self.motion_loads.push(MotionLoad { name, text, tape, variables, first_switch });
                self.motion_loads.len() - 1
            });
            let name = coupling.name.clone();
            self.couplings.push(Coupling { name, driven, driver, ratio, law, repeats, offset });
        }
    }

    fn coupled(&self, scene: &Scene, end: Coupled) -> CoupledCoordinate {
        let (factors, zero, bodies, slide) = match end {
            Coupled::Angle(bodies) => {
                let (factors, zero) = self.relative_angle(bodies);
                (factors, zero, bodies, None)
            }
            Coupled::Displacement(joint) => {
                let name = scene.joints[joint].name();
                // A prismatic joint is never cut.
                let slide = self.ideal_joints.iter().position(|other| other.name == name).unwrap_or_default();
                let mut factors = vec![0.0; self.frames.len() - 1];
                let joint = &self.ideal_joints[slide];
                if let Realization::Tree { column: Some(column), .. } = joint.realization {
                    factors[column] = 1.0;
                }
                (factors, 0.0, joint.bodies, Some(slide))
            }
        };
        let columns = factors.iter().copied().enumerate().filter(|(_, factor)| *factor != 0.0);
        let free = self.free.iter().enumerate().map(|(freedom, &column)| (freedom, factors[column]));
        CoupledCoordinate {
            columns: columns.collect(),
            free: free.filter(|(_, factor)| *factor != 0.0).collect(),
            zero,
            bodies,
            slide,
        }
    }

    /// The same as a variable of a function of the motion.
    fn variable_of(&self, end: &CoupledCoordinate) -> Variable {
        match (end.slide, end.columns.first()) {
            (Some(_), Some(&(column, _))) => Variable::Coordinate(column),
            _ => {
                let frame = |body: Option<usize>| body.map_or(0, |body| self.bodies[body].frame);
                Variable::Angle(end.bodies.map(frame), end.zero)
            }
        }
    }
}
