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

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use hydro_effects::card::JointScale;

    use super::*;
    use crate::{
        plant::{Plant, PlantJoint},
        problem::channels::MeasuredTrial,
        tests::fake::RigidBody,
        trial::Steady,
    };

    /// A model of two slides, the second beginning at 0.7 m.
    fn model() -> PlantDescription {
        let mut model = RigidBody::new().description().clone();
        for (at, start) in [0.0, 0.7].into_iter().enumerate() {
            model.joints.push(PlantJoint {
                name: format!("slide_{at}"),
                qpos: at,
                dof: at,
                start,
                scale: JointScale {
                    inertia: 1.0,
                    armature: 0.0,
                    damping: 0.0,
                    torque: 1.0,
                    speed: 0.0,
                    travel: 0.0,
                    middle: 0.0,
                    slides: true,
                    driven: false,
                },
                pushes: Vec::new(),
                stiffness: 0.0,
                damping: 0.0,
                is_coordinate: false,
                is_level: false,
            });
        }
        model
    }

    fn series(columns: &[&str], times: Vec<f64>, data: Vec<f64>) -> Series {
        Series {
            columns: columns.iter().map(|name| (*name).to_owned()).collect(),
            times,
            data,
        }
    }

    /// A row labelled t holds the position of t less a step, as it holds the sensors'.
    #[test]
    fn samples_are_a_step_older_than_their_label() {
        let times: Vec<f64> = (0..6).map(f64::from).collect();
        let data = vec![0.0, 1.0, 4.0, f64::NAN, 16.0, 25.0];
        let trial = Trial {
            prescribed: Some(series(&["slide_1"], times, data)),
            ..Trial::default()
        };
        let model = model();
        let motion = motion(&trial, &model).unwrap();
        assert!(motion.imposes(1) && !motion.imposes(0));
        let [position, velocity, acceleration] = motion.joints[0].course.at(3.0 - model.timestep);
        assert!((position - 9.0).abs() < 1e-9 && (velocity - 6.0).abs() < 1e-9);
        assert!((acceleration - 2.0).abs() < 1e-9);
        assert!(super::motion(&Trial::default(), &model).is_none());
    }

    /// Every row of a table is a state of its own: what is not given is at rest where the model has it, commands are held.
    #[test]
    fn rows_of_a_table_are_states_of_their_own() {
        let rows = vec![3.0, 13.0];
        let table = Steady {
            motion: series(
                &["slide_0_vel", "slide_1_vel"],
                rows.clone(),
                vec![1.0, 0.0, 2.0, -1.0],
            ),
            deviations: series(&["gyro[1]"], rows.clone(), vec![0.2, f64::NAN]),
        };
        let trial = Trial {
            control: series(&["ahead"], rows.clone(), vec![5.0, 6.0]),
            sensors: series(&["gyro[1]"], rows, vec![0.1, 0.3]),
            steady: Some(table),
            ..Trial::default()
        };
        let model = model();
        let measured = MeasuredTrial::new(trial, &model);
        assert_eq!(measured.times, [3.0, 13.0]);
        assert!(measured.steady && (0..6).all(|dof| measured.imposes(dof)));
        let motion = measured.prescribed.as_ref().unwrap();
        let (mut qpos, mut qvel) = (vec![9.0; 7], vec![9.0; 6]);
        motion.impose(13.0 - model.timestep, &mut qpos, &mut qvel);
        assert_eq!(qpos[..3], [0.0, 0.7, 9.0]);
        assert_eq!(qvel[..3], [2.0, -1.0, 0.0]);
        let mut control = [0.0];
        for (label, expected) in [(3.0, 5.0), (13.0, 6.0)] {
            for shift in [-0.2, 0.0, 0.2] {
                measured.control.interpolate(label + shift, &mut control);
                assert_eq!(control, [expected]);
            }
        }
        assert_eq!(measured.row(1)[11], 0.3);
        assert_eq!(measured.deviations[11], 0.2);
    }
}
