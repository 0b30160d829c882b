//! Matrices recovered, and motions that do not determine them.
#![allow(clippy::unwrap_used)]

use super::*;

/// Velocities that no two columns of the regression share.
fn twist(i: usize) -> Twist {
    let wave = |k: usize| ((i * (k + 2)) as f64 * 0.7 + k as f64).sin() * (1.0 + k as f64 * 0.3);
    Twist {
        linear: [wave(0), wave(1), wave(2)],
        angular: [wave(3), wave(4), wave(5)],
    }
}

#[test]
fn known_matrices_are_recovered() {
    let linear = SMatrix::from_fn(|r, c| {
        if r == c {
            10.0
        } else {
            0.3 * (r as f64 - c as f64)
        }
    });
    let quadratic = SMatrix::from_fn(|r, c| if r == c { 40.0 } else { 0.1 * (r + c) as f64 });
    let truth = Drag { linear, quadratic };
    let mut fit = DragFit::default();
    for i in 0..200 {
        let density = 990.0 + (i % 40) as f64;
        fit.add(&twist(i), density, &truth.wrench(&twist(i), density));
    }
    let found = fit.solve().unwrap();
    assert!((found.linear - linear).abs().max() < 1e-6);
    assert!((found.quadratic - quadratic).abs().max() < 1e-6);
}

#[test]
fn the_diagonal_fit_recovers_a_diagonal_and_never_drives_a_motion() {
    let linear = SMatrix::from_diagonal(&SVector::from([1.0, 2.0, 3.0, 0.4, 0.5, 0.6]));
    let truth = Drag {
        linear,
        quadratic: linear * 7.0,
    };
    let (mut fit, mut driving) = (DragFit::default(), DragFit::default());
    for i in 0..200 {
        let wrench = truth.wrench(&twist(i), 1000.0);
        fit.add(&twist(i), 1000.0, &wrench);
        driving.add(
            &twist(i),
            1000.0,
            &Wrench::from_array(wrench.to_array().map(|v| -v)),
        );
    }
    let found = fit.solve_diagonal();
    assert!((found.linear - linear).abs().max() < 1e-8);
    assert!((found.quadratic - linear * 7.0).abs().max() < 1e-8);
    let none = driving.solve_diagonal();
    assert_eq!((none.linear.max(), none.quadratic.max()), (0.0, 0.0));
}

#[test]
fn drag_opposes_motion_and_grows_with_density() {
    let drag = Drag {
        linear: SMatrix::identity(),
        quadratic: SMatrix::identity() * 2.0,
    };
    let towed = Twist {
        linear: [-3.0, 0.0, 0.0],
        angular: [0.0; 3],
    };
    assert_eq!(
        drag.wrench(&towed, 1000.0).force,
        [3.0 + 2.0 * 9.0, 0.0, 0.0]
    );
    assert_eq!(drag.wrench(&towed, 500.0).force[0], 10.5);
}

#[test]
fn motion_along_one_axis_is_refused() {
    let mut fit = DragFit::default();
    for i in 0..50 {
        let along_x = Twist {
            linear: [i as f64, 0.0, 0.0],
            angular: [0.0; 3],
        };
        fit.add(&along_x, 1000.0, &Wrench::default());
    }
    let message = fit.solve().unwrap_err().to_string();
    assert!(message.contains("50 samples"), "{message}");
}
