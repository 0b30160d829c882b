//! Runs that blow up, and bounds.

use super::*;
use crate::{comparison::point_mass::PointMass, rollouts::Table};

#[test]
fn a_simulator_that_blew_up_and_calmed_down_is_out_of_bounds() {
    let still = |samples: usize, columns| Table::new(vec![0.0; samples * columns], columns);
    let pose = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
    let run = Rollout {
        name: "still".into(),
        density: 1000.0,
        time: vec![0.0, 0.01, 0.02],
        qpos: Table::new(pose.repeat(3), 7).expect("whole rows"),
        qvel: still(3, 6).expect("whole rows"),
        ctrl: still(2, 1).expect("whole rows"),
        push: still(2, 6).expect("whole rows"),
        x: still(3, 1).expect("whole rows"),
        wrench: still(3, 6).expect("whole rows"),
        hydrostatic: still(3, 6).expect("whole rows"),
        generalised: None,
        step_force: None,
    };
    let calm = long_run_peaks(&mut PointMass::new(1.0, 0.002), &Water::Scene, &run);
    assert_eq!(calm.speed.reached, 0.0);
    let mut broken = PointMass::new(1.0, 0.002);
    broken.break_at(0.011);
    let broken = long_run_peaks(&mut broken, &Water::Scene, &run);
    assert_eq!(broken.speed.reached, f64::INFINITY);
    // The wrench that a law gives counts as the scene's own does.
    let law = |_: &hydro_frames::Twist, density: f64| Wrench {
        force: [0.0, 0.003 * density, 0.0],
        torque: [0.0, 0.0, 0.5],
    };
    let pulled = long_run_peaks(
        &mut PointMass::new(1.0, 0.002),
        &Water::Law(Box::new(law)),
        &run,
    );
    assert!((pulled.force.reached - 3.0).abs() < 1e-12);
    assert!((pulled.torque.reached - 0.5).abs() < 1e-12);
    assert!(
        (pulled.speed.reached - 3.0 * 0.02).abs() < 1e-12,
        "{pulled:?}"
    );
}

#[test]
fn a_run_that_diverged_is_out_of_bounds_however_calm_it_was_later() {
    let mut peaks = [0.0; 4];
    keep_peaks(
        &mut peaks,
        &[f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0],
        Wrench::default(),
    );
    keep_peaks(
        &mut peaks,
        &[1.0, 0.0, 0.0, 0.0, 2.0, 0.0],
        Wrench::default(),
    );
    assert_eq!(peaks[..2], [f64::INFINITY, 2.0]);
    let fine = Peak {
        reached: 1.4,
        truth: 1.0,
    };
    let gone = Peak {
        reached: f64::INFINITY,
        truth: 1.0,
    };
    let bounds = LongRunPeaks {
        duration: 600.0,
        speed: fine,
        rate: fine,
        force: fine,
        torque: fine,
    };
    assert!(bounds.within(1.5) && !bounds.within(1.3));
    assert!(
        !LongRunPeaks {
            speed: gone,
            ..bounds
        }
        .within(1e300)
    );
}

#[test]
fn bounds_are_the_others_or_the_truths_whichever_are_wider() {
    let of = |torque: Option<f64>| [Some(1.0), Some(1.4), Some(0.5), torque];
    let oracle = of(Some(1.6));
    assert!(within(&of(Some(2.3)), &oracle, 1.5));
    assert!(!within(&of(Some(2.5)), &oracle, 1.5));
    assert!(!within(&of(None), &oracle, 1.5), "it blew up");
    // An oracle that is calmer than the truth narrows nothing, and one that blew up widens nothing.
    for other in [Some(0.1), None] {
        assert!(within(&of(Some(1.4)), &of(other), 1.5));
        assert!(!within(&of(Some(1.6)), &of(other), 1.5));
    }
}
