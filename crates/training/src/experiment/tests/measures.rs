//! Measures against closed forms.

use hydro_model::features::{Feature, FeatureLayout};

use super::{detail::detail, energy::energy, fluctuation::fluctuation, noise::noisy};
use crate::dataset::{Dataset, Manifest, SCHEMA, Split, Trajectory, write};

/// Samples of a trajectory, at 10 ms.
const T: usize = 200;

fn layout() -> FeatureLayout {
    let quaternion = (0..4).map(Feature::Quaternion);
    let motion = [
        Feature::LinearVelocity(0),
        Feature::AngularVelocity(2),
        Feature::Density,
    ];
    FeatureLayout::new(quaternion.chain(motion).collect()).expect("a layout")
}

/// v = cos(wt), r = sin(wt), force.x = -2 v, torque.z = -3 r; two trajectories of other frequencies.
fn split() -> Split {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest: Manifest = serde_json::from_value(serde_json::json!({
        "schema": SCHEMA, "name": "waves", "features": layout(),
        "feature_units": layout().features().iter().map(Feature::unit).collect::<Vec<_>>(),
        "outputs": ["force.x", "torque.z"], "output_units": ["N", "N m"], "frames": {"wrench": "base"},
        "sample_period": 0.01, "samples": T, "splits": {},
    }))
    .expect("a manifest");
    let trajectory = |turns: f64| {
        let (mut x, mut wrench) = (Vec::new(), Vec::new());
        for k in 0..T {
            let angle = std::f64::consts::TAU * turns * k as f64 / T as f64;
            let (v, r) = (angle.cos() as f32, angle.sin() as f32);
            x.extend([1.0, 0.0, 0.0, 0.0, v, r, 1000.0 + 10.0 * v]);
            wrench.extend([-2.0 * v, -3.0 * r]);
        }
        Trajectory { x, wrench }
    };
    let splits = [("test", vec![trajectory(2.0), trajectory(3.0)])];
    let data: Dataset = write(folder.path(), &manifest, &splits).expect("written");
    data.split("test", None).expect("read")
}

/// Forces of the truth, changed by `change(trajectory, sample, axis, force)`.
fn forces(split: &Split, change: impl Fn(usize, usize, usize, f64) -> f64) -> Vec<Vec<f64>> {
    (0..split.len())
        .map(|m| {
            let clean = split.clean(m).iter().enumerate();
            clean
                .map(|(i, force)| change(m, i / 2, i % 2, f64::from(*force)))
                .collect()
        })
        .collect()
}

fn outputs() -> Vec<String> {
    ["force.x", "torque.z"].map(str::to_owned).to_vec()
}

#[test]
fn a_drag_too_strong_by_a_tenth_does_a_tenth_more_work() {
    let split = split();
    let strong = forces(&split, |_, _, _, force| 1.1 * force);
    let found = energy(&layout(), &outputs(), &split, &strong).expect("velocities are known");
    assert!((found.work_error - 0.1).abs() < 1e-6, "{found:?}");
    assert!(found.gives.abs() < 1e-12 && found.gives_truth.abs() < 1e-12);
    // Power -2 cos^2 - 3 sin^2 has mean -2.5 and deviation 1 / (2 sqrt 2); its error is a tenth of its root mean square.
    let expected = 0.1 * (2.5f64.powi(2) + 0.125).sqrt() / 0.125f64.sqrt();
    assert!(
        (found.power_error - expected).abs() < 0.02 * expected,
        "{found:?} {expected}"
    );
    let helps = forces(&split, |_, _, _, force| -force);
    let found = energy(&layout(), &outputs(), &split, &helps).expect("velocities are known");
    assert!((found.gives - 1.0).abs() < 1e-12 && (found.work_error - 2.0).abs() < 1e-6);
    let unnamed = ["lift".to_owned(), "x".to_owned()];
    assert_eq!(energy(&layout(), &unnamed, &split, &helps), None);
}

#[test]
fn errors_are_found_in_the_trajectory_and_at_the_time_where_they_are() {
    let split = split();
    // Half a newton off in the second trajectory's second half.
    let wrong = forces(&split, |m, k, axis, force| {
        force
            + if m == 1 && k >= T / 2 && axis == 0 {
                0.5
            } else {
                0.0
            }
    });
    let found = detail(&split, &wrong);
    assert!(
        found.by_trajectory[0].abs() < 1e-12,
        "{:?}",
        found.by_trajectory
    );
    // Deviation of 2 cos over whole turns: sqrt 2. Half of the samples, one axis of two.
    let share = 0.25 / 2.0 / 2.0 * (T / 2) as f64 / (T - 1) as f64;
    assert!(
        (found.by_trajectory[1] - share).abs() < 1e-3 * share,
        "{:?}",
        found.by_trajectory
    );
    for (time, nrmse) in &found.by_horizon {
        let expected = if *time < 0.99 {
            0.0
        } else {
            (0.125f64 / 4.0).sqrt()
        };
        // The point whose samples stand on both sides lies between.
        if !(0.99..1.05).contains(time) {
            assert!(
                (nrmse - expected).abs() < 1e-3,
                "{time}: {nrmse} {expected}"
            );
        }
    }
    let (mae, rmse) = found.pooled_si;
    let part = (T / 2) as f64 / (T - 1) as f64 / 4.0;
    assert!((mae - 0.5 * part).abs() < 1e-9 && (rmse - 0.5 * part.sqrt()).abs() < 1e-9);
}

#[test]
fn trembling_is_power_where_the_truth_has_none() {
    let split = split();
    let calm = fluctuation(&split, &forces(&split, |_, _, _, force| force)).expect("power");
    assert!((calm - 1.0).abs() < 1e-12, "{calm}");
    let shaking = forces(&split, |_, k, _, force| {
        force + 0.1 * (std::f64::consts::TAU * 40.0 * k as f64 / T as f64).cos()
    });
    assert!(fluctuation(&split, &shaking).expect("power") > 10.0);
    // A slow error is no trembling.
    let slow = forces(&split, |_, _, _, force| 1.02 * force);
    let slow = fluctuation(&split, &slow).expect("power");
    assert!((slow - 1.02f64.powi(2)).abs() < 1e-9);
}

#[test]
fn noise_has_the_level_asked_for_and_leaves_density_and_quaternions_whole() {
    let split = split();
    let shaken = noisy(&split, &layout(), 0.1);
    let (mut square, mut count) = (0.0, 0.0);
    for m in 0..split.len() {
        for (a, b) in split.x(m).chunks_exact(7).zip(shaken.x(m).chunks_exact(7)) {
            square += f64::from(a[4] - b[4]).powi(2);
            count += 1.0;
            assert_eq!(a[6], b[6]);
            let norm = b[..4].iter().map(|q| q * q).sum::<f32>();
            assert!((norm - 1.0).abs() < 1e-5);
        }
    }
    // Deviation of cos: 1 / sqrt 2; 400 draws leave 3.5 % of doubt.
    let (found, expected) = (f64::sqrt(square / count), 0.1 / 2f64.sqrt());
    assert!((found / expected - 1.0).abs() < 0.12, "{found} {expected}");
    let none = noisy(&split, &layout(), 0.0);
    assert_eq!(none.x(1)[4..6], split.x(1)[4..6]);
}
