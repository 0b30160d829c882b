//! A URDF with odd numbers and names: refused, or a robot of finite masses and poses.

use proptest::prelude::*;

use super::{ARM, read};

/// Values of the attributes of [`ARM`].
fn values() -> Vec<&'static str> {
    ARM.split('"').skip(1).step_by(2).collect()
}

fn odd_word() -> impl Strategy<Value = String> {
    let words = prop::sample::select(vec![
        "",
        "nan",
        "inf",
        "-inf",
        "1e308",
        "-1e308",
        "1e-320",
        "0",
        "-0",
        "0 0 0",
        "1e200 1e200 1e200",
        "1 2",
        "base",
        "root",
        "tip",
        "fixed",
        "prismatic",
        "\u{1F30A}",
    ]);
    prop_oneof![
        words.prop_map(str::to_owned),
        any::<f64>().prop_map(|number| number.to_string())
    ]
}

proptest! {
    #[test]
    fn an_odd_file_is_refused_or_finite(changes in prop::collection::vec((any::<prop::sample::Index>(), odd_word()), 1..4)) {
        let mut parts: Vec<String> = ARM.split('"').map(str::to_owned).collect();
        for (index, word) in &changes {
            parts[1 + 2 * index.index(values().len())].clone_from(word);
        }
        match read(&parts.join("\"")) {
            Err(error) => prop_assert!(!error.to_string().is_empty()),
            Ok(robot) => {
                prop_assert!(robot.mass().is_finite() && robot.displaced_volume().is_finite());
                for joint in &robot.joints {
                    prop_assert!((joint.axis.norm() - 1.0).abs() < 1e-9, "{:?}", joint.axis);
                    prop_assert!(joint.parent_from_child.translation.vector.iter().all(|x| x.is_finite()));
                }
                for body in &robot.bodies {
                    prop_assert!(body.inertia.mass >= 0.0 && body.inertia.centre.iter().all(|x| x.is_finite()), "{body:?}");
                }
            }
        }
    }
}
