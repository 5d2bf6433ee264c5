//! The couplings of a scene on the columns of its tree.

use crate::contact::face::Face;
use crate::contact::pair::{ContactLaw, SlidingVelocity, Surfaces};
use crate::error::{InputError, Problem, Subject};
use crate::scene::couplings::{Backlash as SceneBacklash, CompiledLaw, Coupled};
use crate::scene::parts::Scene;
use crate::tree::elements::{
    Backlash, ContactSlot, CoupledCoordinate, Coupling, FramePoint, Mesh, Realization, Tree,
};
use crate::tree::kinematics::Vec2;
use crate::tree::loads::{Measure, MotionLoad, Variable};

impl Tree {
    /// Adds the couplings of a checked scene. Their laws become functions of the motion, whose tables may end.
    ///
    /// # Errors
    /// Teeth whose pitch point is not at rest on a body.
    pub(super) fn add_couplings(&mut self, scene: &Scene) -> Result<(), InputError> {
        let mut problems = Vec::new();
        for (index, coupling) in scene.couplings.iter().enumerate() {
            let [Ok(driven), Ok(driver)] = coupling.coordinates(scene) else { continue };
            let CompiledLaw { ratio, law, repeats } = coupling.compiled([driven, driver]).unwrap_or_default();
            let [driven, driver] = [driven, driver].map(|end| self.coupled(scene, end));
            // In proportion the start decides how the wheels stand.
            let offset = coupling.offset.or(law.as_ref().map(|_| 0.0));
            let law = law.map(|tape| {
                let variables = vec![(coupling.driver.clone(), self.variable_of(&driver))];
                let (name, text) = (coupling.name.clone(), coupling.driver.clone());
                let first_switch = self.switch_count();
                self.motion_loads.push(MotionLoad {
                    name,
                    text,
                    tape,
                    variables,
                    component: self.components.of(driven.bodies).unwrap_or_default(),
                    first_switch,
                    law_of: None,
                });
                self.motion_loads.len() - 1
            });
            let name = coupling.name.clone();
            let mut tied = Coupling { name, driven, driver, ratio, law, repeats, offset, mesh: None, index };
            if let Some(pressure_angle) = coupling.pressure_angle {
                let component = self.components.of(tied.driven.bodies).unwrap_or_default();
                match self.mesh(&tied, pressure_angle, self.components.lengths[component]) {
                    Err(message) => {
                        problems.push(Problem::new(format!("couplings[{index}].pressure_angle"), message));
                    }
                    Ok(mesh) => tied.mesh = Some(mesh),
                }
            }
            match (&coupling.backlash, tied.mesh.take()) {
                (Some(backlash), Some(mesh)) => self.add_backlash(tied, mesh, backlash),
                (_, mesh) => self.couplings.push(Coupling { mesh, ..tied }),
            }
        }
        Subject::Scene.judge((), problems)
    }

    /// Adds a coupling with backlash and its flanks.
    fn add_backlash(&mut self, coupling: Coupling, mesh: Mesh, backlash: &SceneBacklash) {
        let Coupling { driven, driver, ratio, .. } = &coupling;
        let along = |driven: &[(usize, f64)], driver: &[(usize, f64)]| {
            let driven = driven.iter().map(|&(place, by)| (place, mesh.lever * by));
            driven.chain(driver.iter().map(|&(place, by)| (place, -mesh.lever * ratio * by))).collect()
        };
        let (columns, free) = (along(&driven.columns, &driver.columns), along(&driven.free, &driver.free));
        let first = self.slots.len();
        for (place, side) in [("ahead", 1.0), ("behind", -1.0)] {
            let clearance = 0.5 * backlash.play;
            self.add_slot(ContactSlot {
                name: format!("{}.{place}", coupling.name),
                points: mesh.bodies.map(|body| {
                    body.map_or(FramePoint { frame: 0, offset: Vec2::zeros() }, |body| {
                        let placed = &self.bodies[body];
                        FramePoint { frame: placed.frame, offset: placed.origin }
                    })
                }),
                bodies: mesh.bodies,
                law: ContactLaw {
                    surfaces: Surfaces::Face(Face {
                        normal: [side, 0.0],
                        limit: clearance,
                        radius: 0.0,
                        size: mesh.radius,
                        half_length: f64::INFINITY,
                    }),
                    clearance,
                    normal: backlash.contact.clone(),
                    friction: None,
                    sliding: SlidingVelocity::Surface,
                },
                impact_velocity_floor: None,
                neighbor: None,
                backlash: Some(self.backlashes.len()),
                is_aside: backlash.contact.formula().is_some(),
            });
        }
        self.backlashes.push(Backlash { coupling, mesh, slots: first..first + 2, columns, free });
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
        let of = match (end.slide, end.columns.first()) {
            (Some(_), Some(&(column, _))) => Measure::Coordinate(column),
            _ => {
                let frame = |body: Option<usize>| body.map_or(0, |body| self.bodies[body].frame);
                Measure::Angle(end.bodies.map(frame), end.zero)
            }
        };
        Variable { of, is_rate: false }
    }
}
