//! A compiled scene for Python: compiled once, asked for its names and simulated any number of times. In: text of Python;
//! out: facts as JSON, dicts and arrays of a run.

use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{new_array, sample_times};
use super::{abandoned_on_signal, input_error, stats, wait_for};
use crate::dynamics::Dynamics;
use crate::error::Notice;
use crate::mechanism::compiled::Mechanism;
use crate::mechanism::small_motions::small_motions;
use crate::run::outputs::{column_names, further_column_names, sector_column_names};
use crate::run::restart::Restart;
use crate::run::settings::read_settings;
use crate::run::tolerances::default_impact_velocity_floors;
use crate::run::trajectory::{Begin, Contact, Event, check_restart, columns, event_joint, record};
use crate::scene::reader::read_scene;
use crate::tree::elements::{ContactSlot, State};

/// Length of a scene in text [bytes] from which it may take longer to compile than to start a thread.
/// Half and twice change nothing but signals.
const LONG: usize = 20_000;

/// A compiled scene.
#[pyclass(frozen, name = "Mechanism", module = "chebclear._core")]
pub struct CompiledMechanism {
    mechanism: Mechanism,
}

#[pymethods]
impl CompiledMechanism {
    /// Compiles a scene (JSON).
    #[new]
    fn new(py: Python<'_>, scene: &str) -> PyResult<Self> {
        let text = scene.to_owned();
        let compile = move || read_scene(&text).and_then(|scene| Mechanism::compile(&scene));
        let compiled = if scene.len() < LONG { compile() } else { abandoned_on_signal(py, compile)? };
        Ok(Self { mechanism: compiled.map_err(|error| input_error(py, error))? })
    }

    /// Describes the mechanism as JSON.
    fn facts(&self) -> String {
        let mechanism = &self.mechanism;
        let names: Vec<&str> =
            mechanism.free.iter().map(|&column| mechanism.coordinate_names[column].as_str()).collect();
        // A guide has several contacts, each with the name of its place after that of the joint.
        let joint_of = |slot: &'_ ContactSlot| slot.name.split('.').next().unwrap_or_default().to_owned();
        let joints = mechanism.slots.iter().filter(|slot| slot.backlash.is_none());
        let mut cut: Vec<String> = joints.map(joint_of).collect();
        cut.dedup();
        cut.extend(mechanism.closures.iter().map(|closure| closure.name.clone()));
        let mut dynamics = Dynamics::new(mechanism);
        dynamics.move_to(0.0, &mechanism.start.q, &mechanism.start.v);
        let poses: Vec<[f64; 3]> = mechanism.bodies.iter().map(|body| dynamics.body_pose(body)).collect();
        serde_json::json!({
            "degrees_of_freedom": mechanism.mobility(),
            "coordinates": names,
            "bodies": mechanism.bodies.iter().map(|body| &body.name).collect::<Vec<_>>(),
            "poses": poses,
            "cut_joints": cut,
            "notices": notices(&mechanism.warnings),
            "impact_velocity_floors": default_impact_velocity_floors(mechanism),
            "columns": column_names(mechanism),
            "further_columns": further_column_names(mechanism),
            "sector_columns": sector_column_names(mechanism),
            "branch": mechanism.branch,
        })
        .to_string()
    }

    /// The mechanism linearized about its start, or about the end of a run (JSON).
    #[pyo3(signature = (start=None))]
    fn small_motions<'py>(&self, py: Python<'py>, start: Option<&str>) -> PyResult<Bound<'py, PyDict>> {
        let mechanism = &self.mechanism;
        let start = start.map(Restart::from_json).transpose().map_err(|error| input_error(py, error))?;
        let found = match &start {
            None => {
                let dynamics = Dynamics::new(mechanism);
                let phases = (&dynamics.phases[..], dynamics.joint_phases(), &dynamics.turns[..]);
                small_motions(mechanism, 0.0, &mechanism.start, phases)
            }
            Some(end) => check_restart(mechanism, end).and_then(|()| {
                let state = State { q: end.q.clone(), v: end.v.clone() };
                small_motions(
                    mechanism,
                    end.time,
                    &state,
                    (&end.memory.phases, &end.memory.joint_phases, &end.memory.turns),
                )
            }),
        };
        let found = found.map_err(|error| input_error(py, error))?;
        let d = mechanism.degrees_of_freedom();
        let result = PyDict::new(py);
        result.set_item("accelerations", found.linear.a.into_pyarray(py))?;
        for (name, matrix) in [
            ("by_position", found.linear.a_q),
            ("by_velocity", found.linear.a_v),
            ("closures", found.closures),
            ("bodies", found.bodies),
        ] {
            let rows = matrix.len().checked_div(d).unwrap_or(0);
            result.set_item(name, matrix.into_pyarray(py).reshape([rows, d])?)?;
        }
        result.set_item("poses", found.poses)?;
        result.set_item("levers", mechanism.scales.levers.clone())?;
        let scales = &mechanism.scales;
        let of_freedoms = || scales.of_freedoms.iter().map(|&component| scales.components[component]);
        result.set_item("speeds", of_freedoms().map(|of| of.speed).collect::<Vec<f64>>())?;
        result.set_item("lengths", of_freedoms().map(|of| of.length).collect::<Vec<f64>>())?;
        result.set_item("length", mechanism.components.largest())?;
        Ok(result)
    }

    /// Simulates with settings (JSON), from the end of another run (JSON) if one is given.
    #[pyo3(signature = (settings, progress=None, start=None))]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        settings: &str,
        progress: Option<Py<PyAny>>,
        start: Option<&str>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let settings = read_settings(settings).map_err(|error| input_error(py, error))?;
        let mechanism = &self.mechanism;
        let start = start.map(Restart::from_json).transpose().map_err(|error| input_error(py, error))?;
        let begin = start.as_ref().map_or(0.0, |start| start.time);
        let from = start.as_ref().map_or(Begin::State(&mechanism.start), Begin::Restart);
        let span = settings.skip + settings.duration;
        let cancel = AtomicBool::new(false);
        let reached = AtomicU64::new(0);
        let monitor = |t: f64| {
            reached.store(t.to_bits(), Ordering::Relaxed);
            !cancel.load(Ordering::Relaxed)
        };
        let shape = [settings.samples, columns(mechanism, &settings).len()];
        let values = new_array(py, shape[0].saturating_mul(shape[1]))?;
        let mut memory = values.readwrite();
        let samples = memory.as_slice_mut()?;
        let run = wait_for(
            py,
            &cancel,
            || record(mechanism, from, &settings, &monitor, samples),
            |py| match &progress {
                Some(callback) => {
                    let fraction = (f64::from_bits(reached.load(Ordering::Relaxed)) - begin) / span;
                    callback.call1(py, (fraction.clamp(0.0, 1.0),)).map(|_| ())
                }
                None => Ok(()),
            },
        )?
        .map_err(|error| input_error(py, error))?;
        let result = PyDict::new(py);
        result.set_item("stats", stats(&run).into_iter().collect::<HashMap<_, _>>())?;
        result.set_item("status", run.status.word())?;
        result.set_item("message", run.message())?;
        result.set_item("time", run.time)?;
        result.set_item("joint", &run.joint)?;
        result.set_item("load", &run.load)?;
        result.set_item("notices", notices(&run.warnings))?;
        result.set_item("columns", &run.columns)?;
        result.set_item("events", events_dict(py, mechanism, &run.events)?)?;
        result.set_item("skipped_events", events_dict(py, mechanism, &run.skipped_events)?)?;
        result.set_item("contacts", contacts_dict(py, mechanism, &run.contacts)?)?;
        result.set_item("skipped_contacts", contacts_dict(py, mechanism, &run.skipped_contacts)?)?;
        let by_cycle = [settings.cycles, settings.features.len()];
        result.set_item("features", run.features.into_pyarray(py).reshape(by_cycle)?)?;
        result.set_item("end", run.restart.as_ref().map(Restart::to_json))?;
        drop(memory);
        result.set_item("values", values.reshape(shape)?)?;
        result.set_item("t", sample_times(py, &settings, begin)?)?;
        Ok(result)
    }
}

fn events_dict<'py>(
    py: Python<'py>,
    mechanism: &Mechanism,
    events: &[Event],
) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    let column = |of: fn(&Event) -> f64| events.iter().map(of).collect::<Vec<f64>>().into_pyarray(py);
    let joints: Vec<&str> = events.iter().map(|event| event_joint(mechanism, event.place)).collect();
    table.set_item("time", column(|event| event.time))?;
    table.set_item("joint", joints)?;
    table.set_item("kind", events.iter().map(|event| event.kind.word()).collect::<Vec<_>>())?;
    table.set_item("normal_velocity", column(|event| event.normal_velocity))?;
    Ok(table)
}

fn contacts_dict<'py>(
    py: Python<'py>,
    mechanism: &Mechanism,
    contacts: &[Contact],
) -> PyResult<Bound<'py, PyDict>> {
    let table = PyDict::new(py);
    let column = |of: fn(&Contact) -> f64| contacts.iter().map(of).collect::<Vec<f64>>().into_pyarray(py);
    let joints: Vec<&String> = contacts.iter().map(|contact| &mechanism.slots[contact.joint].name).collect();
    table.set_item("joint", joints)?;
    table.set_item("onset", column(|contact| contact.onset))?;
    table.set_item("separation", column(|contact| contact.separation))?;
    table.set_item("impact_velocity", column(|contact| contact.impact_velocity))?;
    table.set_item("peak_force", column(|contact| contact.peak_force))?;
    table.set_item("peak_time", column(|contact| contact.peak_time))?;
    Ok(table)
}

/// A notice as Python makes its record of it: code, what it is about, numbers, text.
pub(super) type PlainNotice<'a> = (&'a str, &'a [String], BTreeMap<&'a str, f64>, &'a str);

/// Notices for Python.
pub(super) fn notices(notices: &[Notice]) -> Vec<PlainNotice<'_>> {
    notices
        .iter()
        .map(|Notice { code, about, numbers, text }| {
            (*code, about.as_slice(), numbers.iter().copied().collect(), text.as_str())
        })
        .collect()
}
