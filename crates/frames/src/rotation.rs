//! Rotations between the base frame and the world, from MuJoCo's quaternions `w x y z`.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Rotation `world_from_base` from MuJoCo's `w x y z`. A zero quaternion is the identity, as in MuJoCo.
pub fn world_from_base(wxyz: [f64; 4]) -> UnitQuaternion<f64> {
    let [w, x, y, z] = wxyz;
    let quaternion = Quaternion::new(w, x, y, z);
    UnitQuaternion::try_new(quaternion, f64::MIN_POSITIVE).unwrap_or_else(UnitQuaternion::identity)
}

/// A world vector, expressed in the base frame.
pub fn base_from_world(wxyz: [f64; 4], in_world: [f64; 3]) -> [f64; 3] {
    let rotated = world_from_base(wxyz).inverse_transform_vector(&Vector3::from(in_world));
    rotated.into()
}

/// A base vector, expressed in the world frame.
pub fn to_world(wxyz: [f64; 4], in_base: [f64; 3]) -> [f64; 3] {
    let rotated = world_from_base(wxyz).transform_vector(&Vector3::from(in_base));
    rotated.into()
}

/// The quaternion with the sign that continues `previous`, or with `w >= 0` for the first one.
///
/// `q` and `-q` are the same attitude; a network must not see the jump between them.
pub fn continuous_quaternion(wxyz: [f64; 4], previous: Option<[f64; 4]>) -> [f64; 4] {
    let agreement = match previous {
        Some(before) => wxyz.iter().zip(before).map(|(a, b)| a * b).sum(),
        None => wxyz[0],
    };
    if agreement < 0.0 {
        wxyz.map(|component| -component)
    } else {
        wxyz
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_quarter_turn_about_z_takes_base_x_to_world_y() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let in_world = to_world([half, 0.0, 0.0, half], [1.0, 0.0, 0.0]);
        for (got, want) in in_world.iter().zip([0.0, 1.0, 0.0]) {
            assert!((got - want).abs() < 1e-12, "{in_world:?}");
        }
    }

    #[test]
    fn the_sign_is_canonical_first_and_continuous_after() {
        let q = [-0.1, 0.2, 0.3, 0.4];
        let first = continuous_quaternion(q, None);
        assert!(first[0] > 0.0);
        assert_eq!(continuous_quaternion([0.1, -0.2, -0.3, -0.4], Some(q)), q);
    }

    proptest! {
        #[test]
        fn there_and_back(q in prop::array::uniform4(-1.0f64..1.0), v in prop::array::uniform3(-10.0f64..10.0)) {
            prop_assume!(q.iter().map(|c| c * c).sum::<f64>() > 1e-3);
            let back = base_from_world(q, to_world(q, v));
            for (a, b) in back.iter().zip(v) {
                prop_assert!((a - b).abs() < 1e-9);
            }
        }
    }
}
