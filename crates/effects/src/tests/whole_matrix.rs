//! Whole matrices of added mass and drag: the six numbers in their special case, Fossen's C_A, energy, derivatives.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use proptest::prelude::*;

use super::fixture::{any_motion, still, vector};
use crate::{BodyPart, Id, MATRIX_AT_POINT_LEN, MATRIX_LEN, MatrixPart, Motion, Part, effect};

const WHOLE: [Id; 3] = [Id::AddedMass, Id::LinearDrag, Id::QuadraticDrag];

fn whole(id: Id) -> &'static dyn MatrixPart {
    effect(id).matrix_part().expect("it takes a matrix")
}

/// Row by row.
pub(super) fn values(matrix: &Matrix6<f64>, point: Option<[f64; 3]>) -> Vec<f64> {
    let rows = matrix.transpose();
    rows.iter()
        .copied()
        .chain(point.into_iter().flatten())
        .collect()
}

/// A matrix with the sizes of a hull's masses and moments of inertia.
pub(super) fn any_matrix() -> impl Strategy<Value = Matrix6<f64>> {
    prop::collection::vec(-1.0..1.0, MATRIX_LEN).prop_map(|elements| {
        let sizes = Matrix6::from_diagonal(&Vector6::new(3.0, 4.0, 5.0, 0.3, 0.5, 0.4));
        sizes * Matrix6::from_row_slice(&elements) * sizes
    })
}

/// A symmetric positive definite matrix.
pub(super) fn any_definite() -> impl Strategy<Value = Matrix6<f64>> {
    any_matrix().prop_map(|matrix| {
        let sizes = Matrix6::from_diagonal(&Vector6::new(3.0, 4.0, 5.0, 0.3, 0.5, 0.4));
        let root = matrix * sizes.try_inverse().expect("none is zero");
        root * root.transpose() + sizes * sizes * 0.05
    })
}

fn velocity(motion: &Motion) -> Vector6<f64> {
    Vector6::from_iterator(motion.linear.into_iter().chain(motion.angular))
}

fn force(part: &dyn BodyPart, p: &[f64], motion: &Motion) -> Vector6<f64> {
    Vector6::from(part.wrench(p, motion, &[]))
}

/// Velocities and accelerations of a point from those of the origin.
fn moved(point: [f64; 3]) -> Matrix6<f64> {
    let mut moved = Matrix6::identity();
    let lever = -Vector3::from(point).cross_matrix();
    moved.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
    moved
}

fn cross(a: Vector3<f64>) -> Matrix3<f64> {
    a.cross_matrix()
}

#[test]
fn three_effects_take_a_matrix_and_know_it_by_its_length() {
    for id in Id::ALL {
        let takes = WHOLE.contains(id);
        assert_eq!(effect(*id).matrix_part().is_some(), takes, "{id}");
        for len in [6, MATRIX_LEN, MATRIX_AT_POINT_LEN] {
            let part = effect(*id).body_part(&vec![0.0; len]);
            let is_body = matches!(effect(*id).part(), Part::Body(_));
            assert_eq!(part.is_some(), is_body, "{id}");
        }
        let inertia = |len: usize| {
            let part = effect(*id).body_part(&vec![0.0; len]);
            part.is_some_and(BodyPart::has_inertia)
        };
        assert_eq!(inertia(6), inertia(MATRIX_LEN), "{id}");
    }
}

/// Surge by the speed of yaw: the row is the force, the column the motion.
#[test]
fn rows_are_forces_and_columns_motions() {
    let mut matrix = Matrix6::zeros();
    matrix[(0, 5)] = 2.0;
    let mut motion = still();
    motion.angular = [0.0, 0.0, -3.0];
    let p = values(&matrix, None);
    assert_eq!(p[5], 2.0);
    assert_eq!(force(whole(Id::LinearDrag), &p, &motion)[0], 6.0);
    assert_eq!(force(whole(Id::QuadraticDrag), &p, &motion)[0], 18.0);
    assert_eq!(force(whole(Id::QuadraticDrag), &p, &motion).amax(), 18.0);
}

#[test]
fn absurd_values_give_finite_wrenches() {
    for id in WHOLE {
        for value in [1e300, -1e300, f64::MAX] {
            let mut motion = still();
            (motion.linear, motion.angular) = ([value; 3], [-value, value, value]);
            (motion.water_acceleration, motion.middle) = ([value; 3], [value; 3]);
            for len in [MATRIX_LEN, MATRIX_AT_POINT_LEN] {
                let p = vec![value; len];
                assert!(force(whole(id), &p, &motion).iter().all(|f| f.is_finite()));
                let inertia = whole(id).inertia(&p, &motion).unwrap_or_default();
                assert!(inertia.iter().all(|f| f.is_finite()));
                let damping = whole(id).damping(&p, &motion, &[]).expect("a damping");
                assert!(damping.iter().all(|f| f.is_finite()));
            }
        }
    }
}

/// A neutral body at rest in accelerating water, with any added mass: it is carried as the water is, and does not turn.
#[test]
fn a_neutral_body_is_carried_by_accelerating_water() {
    let mut motion = still();
    motion.gravity = [0.0; 3];
    motion.world_from_base = nalgebra::UnitQuaternion::from_euler_angles(0.3, -0.5, 1.0);
    motion.water_acceleration = [0.4, -0.2, 0.7];
    let root = Matrix6::from_fn(|row, column| ((3 * row + 5 * column) % 7) as f64 - 2.5);
    let added = root * root.transpose();
    let p = values(&added, Some([0.0; 3]));
    let pushed = Vector6::from(motion.froude_krylov()) + force(whole(Id::AddedMass), &p, &motion);
    let mut total = whole(Id::AddedMass).inertia(&p, &motion).expect("inertia");
    for axis in 0..6 {
        total[(axis, axis)] += if axis < 3 {
            motion.density * motion.volume
        } else {
            0.5
        };
    }
    let solved = total.lu().solve(&pushed).expect("a body with mass");
    let carried = motion.world_from_base * solved.fixed_rows::<3>(0).into_owned();
    assert!((carried - Vector3::from(motion.water_acceleration)).norm() < 1e-12);
    assert!(solved.fixed_rows::<3>(3).norm() < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_diagonal_matrix_is_the_six_numbers(
        motion in any_motion(),
        diagonal in prop::array::uniform6(0.0..20.0),
    ) {
        let p = values(&Matrix6::from_diagonal(&Vector6::from(diagonal)), None);
        for id in WHOLE {
            let Part::Body(six) = effect(id).part() else { unreachable!() };
            let scale = 1.0 + force(six, &diagonal, &motion).amax();
            let difference = force(whole(id), &p, &motion) - force(six, &diagonal, &motion);
            prop_assert!(difference.amax() < 1e-12 * scale, "{id}");
            let difference = whole(id).inertia(&p, &motion).unwrap_or_default()
                - six.inertia(&diagonal, &motion).unwrap_or_default();
            prop_assert!(difference.amax() < 1e-12, "{id}");
            let difference = whole(id).damping(&p, &motion, &[]).unwrap_or_default()
                - six.damping(&diagonal, &motion, &[]).unwrap_or_default();
            prop_assert!(difference.amax() < 1e-11 * scale, "{id}");
        }
    }

    /// Fossen 2021, theorem 3.2: C = [0, -S(p); -S(p), -S(h)] with (p, h) = M nu, and C is skew-symmetric. Where the
    /// components in the body's frame do not change the force is -C_A nu, and the origin accelerates by omega x v.
    #[test]
    fn the_force_in_steady_motion_is_fossens(motion in any_motion(), matrix in any_definite()) {
        let mut motion = motion;
        motion.water_acceleration = [0.0; 3];
        let p = values(&matrix, Some([0.0; 3]));
        let nu = velocity(&motion);
        let momentum = matrix * nu;
        let (linear, angular) = (momentum.fixed_rows::<3>(0), momentum.fixed_rows::<3>(3));
        let mut c = Matrix6::zeros();
        c.fixed_view_mut::<3, 3>(0, 3).copy_from(&-cross(linear.into_owned()));
        c.fixed_view_mut::<3, 3>(3, 0).copy_from(&-cross(linear.into_owned()));
        c.fixed_view_mut::<3, 3>(3, 3).copy_from(&-cross(angular.into_owned()));
        prop_assert!((c + c.transpose()).amax() == 0.0);

        let carried = Vector3::from(motion.angular).cross(&Vector3::from(motion.linear));
        let acceleration = Vector6::new(carried.x, carried.y, carried.z, 0.0, 0.0, 0.0);
        let inertia = whole(Id::AddedMass).inertia(&p, &motion).expect("inertia");
        let found = force(whole(Id::AddedMass), &p, &motion) - inertia * acceleration;
        let scale = 1.0 + (c * nu).amax();
        prop_assert!((found + c * nu).amax() < 1e-11 * scale);
        prop_assert!(found.dot(&nu).abs() < 1e-11 * scale, "it does work");
    }

    /// Forces by velocity are linear in it: about another point the matrix is H^T M H. The square is not.
    #[test]
    fn a_point_is_a_change_of_the_matrix(
        motion in any_motion(),
        matrix in any_definite(),
        point in vector(0.4),
    ) {
        let there = values(&matrix, Some(point));
        let change = moved(point);
        let here = values(&(change.transpose() * matrix * change), Some([0.0; 3]));
        for id in [Id::AddedMass, Id::LinearDrag] {
            let (there, here) = (force(whole(id), &there, &motion), force(whole(id), &here, &motion));
            prop_assert!((there - here).amax() < 1e-10 * (1.0 + there.amax()), "{id}");
        }
        let inertia = whole(Id::AddedMass).inertia(&there, &motion).expect("inertia");
        prop_assert!((inertia - whole(Id::AddedMass).inertia(&here, &motion).expect("inertia")).amax() < 1e-10);
        // Quadratic drag: force and torque at the point, by the velocity there.
        let at_point = change * velocity(&motion);
        let expected = -change.transpose() * (matrix * at_point.map(|speed| speed.abs() * speed));
        let found = force(whole(Id::QuadraticDrag), &there, &motion);
        prop_assert!((found - expected).amax() < 1e-10 * (1.0 + expected.amax()));
    }

    #[test]
    fn damping_is_the_slope_of_the_wrench(
        motion in any_motion(),
        matrix in any_matrix(),
        point in vector(0.4),
    ) {
        for (id, point) in WHOLE.into_iter().flat_map(|id| [(id, None), (id, Some(point))]) {
            let p = values(&matrix, point);
            let damping = whole(id).damping(&p, &motion, &[]).expect("a damping");
            let step = 1e-5;
            for axis in 0..6 {
                let moved = |by: f64| {
                    let mut motion = motion.clone();
                    match axis {
                        0..3 => motion.linear[axis] += by,
                        _ => motion.angular[axis - 3] += by,
                    }
                    force(whole(id), &p, &motion)
                };
                let slope = (moved(step) - moved(-step)) / (2.0 * step);
                let fault = (slope + damping.column(axis)).amax();
                // The kink of a square that changes sign within the step.
                prop_assert!(fault < 1e-4 * (damping.amax() + slope.amax() + 1e-3), "{id} {axis}: {fault}");
            }
        }
    }

    #[test]
    fn sensitivities_are_the_slopes_of_the_wrench(
        motion in any_motion(),
        matrix in any_matrix(),
        point in vector(0.4),
    ) {
        for (id, point) in WHOLE.into_iter().flat_map(|id| [(id, None), (id, Some(point))]) {
            let p = values(&matrix, point);
            let columns = whole(id).by_parameters(&p, &motion, &[]);
            prop_assert_eq!(columns.len(), p.len());
            for (index, column) in columns.into_iter().enumerate() {
                let step = 1e-5;
                let moved = |by: f64| {
                    let mut p = p.clone();
                    p[index] += by;
                    force(whole(id), &p, &motion)
                };
                let slope = (moved(step) - moved(-step)) / (2.0 * step);
                let fault = (slope - Vector6::from(column)).amax();
                prop_assert!(fault < 1e-4 * (slope.amax() + 0.1), "{id} {index}: {fault}");
            }
        }
    }

    #[test]
    fn inertia_is_symmetric_and_positive(
        motion in any_motion(),
        matrix in any_definite(),
        point in vector(0.4),
    ) {
        prop_assert_eq!(whole(Id::AddedMass).check(&matrix), Ok(()));
        let p = values(&matrix, Some(point));
        let inertia = whole(Id::AddedMass).inertia(&p, &motion).expect("inertia");
        prop_assert!((inertia - inertia.transpose()).amax() < 1e-12 * inertia.amax());
        prop_assert!(inertia.symmetric_eigenvalues().min() > 0.0);
        // The kinetic energy of the water.
        let (nu, there) = (velocity(&motion), moved(point) * velocity(&motion));
        prop_assert!((nu.dot(&(inertia * nu)) - there.dot(&(matrix * there))).abs() < 1e-10 * (1.0 + inertia.amax()));
        prop_assert!(whole(Id::LinearDrag).inertia(&p, &motion).is_none());
    }

    /// What the check of linear drag lets through takes energy in every motion; what it refuses gives some in one.
    #[test]
    fn linear_drag_that_is_let_through_takes_energy(
        motion in any_motion(),
        matrix in any_matrix(),
        definite in any_definite(),
        point in vector(0.4),
    ) {
        let skew = (matrix - matrix.transpose()) * 0.5;
        let drag = definite + skew;
        prop_assert_eq!(whole(Id::LinearDrag).check(&drag), Ok(()));
        let power = force(whole(Id::LinearDrag), &values(&drag, Some(point)), &motion).dot(&velocity(&motion));
        prop_assert!(power <= 1e-12);
        if whole(Id::LinearDrag).check(&matrix).is_err() {
            let parts = ((matrix + matrix.transpose()) * 0.5).symmetric_eigen();
            let worst = parts.eigenvalues.imin();
            prop_assert!(parts.eigenvalues[worst] < 0.0);
            let nu = parts.eigenvectors.column(worst);
            let mut motion = still();
            motion.linear = [nu[0], nu[1], nu[2]];
            motion.angular = [nu[3], nu[4], nu[5]];
            let p = values(&matrix, Some([0.0; 3]));
            prop_assert!(force(whole(Id::LinearDrag), &p, &motion).dot(&velocity(&motion)) > 0.0);
        }
    }

    /// Along or about one axis a quadratic drag that is let through resists.
    #[test]
    fn quadratic_drag_resists_along_each_axis(matrix in any_matrix(), axis in 0_usize..6, speed in -2.0..2.0) {
        let mut motion = still();
        match axis {
            0..3 => motion.linear[axis] = speed,
            _ => motion.angular[axis - 3] = speed,
        }
        let p = values(&matrix, Some([0.0; 3]));
        let power = force(whole(Id::QuadraticDrag), &p, &motion).dot(&velocity(&motion));
        if whole(Id::QuadraticDrag).check(&matrix).is_ok() {
            prop_assert!(power <= 0.0);
        } else {
            prop_assert!(matrix.diagonal().min() < 0.0);
        }
    }
}
