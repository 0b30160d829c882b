//! The motion of a trial, estimated with a nominal that lacks much.

use super::{fake::RigidBody, pushed, settings, under};

/// Root mean square of the estimated position's error [noises], where a drag [N s/m] that the nominal lacks holds the body; from
/// windows that are halved from a misfit of `far_off` noises.
fn error(drag: f64, far_off: f64) -> f64 {
    let held = move |_: &[f64], qvel: &[f64]| -> [f64; 6] {
        let force = |axis: usize| -drag * qvel[axis];
        [force(0), force(1), force(2), 0.0, 0.0, 0.0]
    };
    let trial = pushed("held", &[], &[0.0, 0.0], 3, 0.1, &held);
    let mut settings = settings();
    settings.options.states.far_off = far_off;
    let mut found = f64::NAN;
    under(settings, &RigidBody::new(), vec![trial], |problem, _| {
        let (trial, motion) = (&problem.trials[0], &problem.motions[0]);
        let errors = (0..trial.times.len()).flat_map(|row| {
            let position = motion.state(row).0;
            (0..3).map(move |axis| (position[axis] - trial.row(row)[axis]) / 0.01)
        });
        let squares: Vec<f64> = errors.map(|error| error * error).collect();
        found = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    });
    found
}

#[test]
fn windows_shorten_where_the_nominal_lacks_much() {
    let whole = error(60.0, f64::INFINITY);
    let shorter = error(60.0, 3.0);
    assert!(shorter < 0.6 * whole, "{shorter} {whole}");
    // Where nothing is missing they stay as they are.
    let free = || error(0.0, 3.0);
    assert_eq!(free(), error(0.0, f64::INFINITY));
}
