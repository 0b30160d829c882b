//! The prescribed motion of a trial, from its columns.

use crate::{
    plant::{
        PlantDescription,
        prescribed::{Course, PrescribedJoint, PrescribedMotion, Spline},
    },
    trial::{Series, Trial},
};

/// Time between the rows of a table of steady states, in steps of the model at least; one second otherwise. Rows stand apart
/// so that what a step of one reaches is not the next.
const STEPS_APART: f64 = 20.0;

/// Labels of the rows of a table [s]: their numbers, as a rule.
pub(crate) fn row_times(rows: &Series, model: &PlantDescription) -> Vec<f64> {
    let apart = (STEPS_APART * model.timestep).max(1.0);
    rows.times.iter().map(|number| apart * number).collect()
}

/// The commands of a table, each held about its row.
pub(crate) fn held(control: &Series, model: &PlantDescription) -> Series {
    let apart = (STEPS_APART * model.timestep).max(1.0);
    let mut held = Series {
        columns: control.columns.clone(),
        ..Series::default()
    };
    for (row, label) in row_times(control, model).into_iter().enumerate() {
        for side in [-0.3, 0.3] {
            held.times.push(label - model.timestep + side * apart);
            held.data.extend_from_slice(control.row(row));
        }
    }
    held
}

/// The imposed motion of a trial; `None` where there is none. A row labelled t is of the state at t less a step.
pub(crate) fn motion(trial: &Trial, model: &PlantDescription) -> Option<PrescribedMotion> {
    if let Some(table) = &trial.steady {
        let rows = &table.motion;
        let labels = row_times(rows, model);
        let times: Vec<f64> = labels.iter().map(|label| label - model.timestep).collect();
        let joints = model.joints.iter().filter_map(|joint| {
            let position = rows.column(&joint.name);
            let velocity = rows.column(&format!("{}_vel", joint.name));
            if position.is_none() && velocity.is_none() {
                return None;
            }
            let at = |column: Option<usize>, row: usize, without: f64| {
                column.map_or(without, |column| rows.at(row, column))
            };
            let states =
                (0..rows.len()).map(|row| [at(position, row, joint.start), at(velocity, row, 0.0)]);
            Some(PrescribedJoint {
                name: joint.name.clone(),
                qpos: joint.qpos,
                dof: joint.dof,
                course: Course::Steady {
                    times: times.clone(),
                    states: states.collect(),
                },
            })
        });
        return Some(PrescribedMotion {
            joints: joints.collect(),
            holds_the_rest: true,
        });
    }
    let rows = trial.prescribed.as_ref()?;
    let joints = rows
        .columns
        .iter()
        .enumerate()
        .filter_map(|(column, name)| {
            let joint = model.joints.iter().find(|joint| joint.name == *name)?;
            let samples = rows.times.iter().zip(rows.column_values(column));
            let (times, values): (Vec<f64>, Vec<f64>) = samples
                .filter(|(_, value)| value.is_finite())
                .map(|(label, value)| (label - model.timestep, value))
                .unzip();
            Some(PrescribedJoint {
                name: name.clone(),
                qpos: joint.qpos,
                dof: joint.dof,
                course: Course::Spline(Spline::through(&times, &values)?),
            })
        });
    let joints: Vec<PrescribedJoint> = joints.collect();
    (!joints.is_empty()).then_some(PrescribedMotion {
        joints,
        holds_the_rest: false,
    })
}
