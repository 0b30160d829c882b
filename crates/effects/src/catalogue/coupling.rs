//! Off-diagonal elements of an effect's 6 x 6 matrix, which its diagonal form neglects.

/// Symmetric elements, a pair of axes each, of the size that the diagonal allows: the root of the product of the two
/// diagonal elements (a positive semidefinite matrix has none larger). Each as the matrix's product with `x` [6].
pub(super) fn symmetric(p: &[f64], x: &[f64; 6]) -> Vec<[f64; 6]> {
    let pairs = (0..6).flat_map(|i| (i + 1..6).map(move |j| (i, j)));
    pairs
        .map(|(i, j)| {
            let size = (p[i] * p[j]).max(0.0).sqrt();
            let mut product = [0.0; 6];
            product[i] = size * x[j];
            product[j] = size * x[i];
            product
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use crate::{Id, effect};

    const VALUES: [f64; 6] = [6.0, 12.0, 18.0, 0.2, 0.3, 0.15];
    const NU: [f64; 6] = [0.4, -0.3, 0.2, 0.5, -0.6, 0.7];

    fn power(wrench: &[f64; 6]) -> f64 {
        wrench
            .iter()
            .zip(NU)
            .map(|(force, speed)| force * speed)
            .sum()
    }

    /// At constant velocity added mass does no work, whatever its off-diagonal elements.
    #[test]
    fn coupled_added_mass_does_no_work_at_constant_velocity() {
        let terms = effect(Id::AddedMass).neglected_terms(&VALUES, &NU, &[0.0; 6]);
        assert_eq!(terms.len(), 15);
        for wrench in &terms {
            assert!(wrench.iter().any(|value| value.abs() > 1e-6));
            assert!(power(wrench).abs() < 1e-12, "{wrench:?}");
        }
    }

    /// Surge and heave, from rest: the force along each is the root of both masses times the other's acceleration.
    #[test]
    fn coupled_added_mass_from_rest_is_the_matrix_times_acceleration() {
        let push = [1.5, 0.0, 0.0, 0.0, 0.0, 0.0];
        let terms = effect(Id::AddedMass).neglected_terms(&VALUES, &[0.0; 6], &push);
        let size = (VALUES[0] * VALUES[2]).sqrt();
        assert!((terms[1][2] + size * 1.5).abs() < 1e-12);
        assert_eq!(terms[1][0], 0.0);
    }

    /// The whole speed drags along an axis no less than the axis's own does.
    #[test]
    fn drag_by_the_whole_speed_takes_energy() {
        let terms = effect(Id::QuadraticDrag).neglected_terms(&VALUES, &NU, &[0.0; 6]);
        assert_eq!(terms.len(), 27);
        for wrench in &terms[15..21] {
            assert!(power(wrench) < 0.0, "{wrench:?}");
        }
        let linear = effect(Id::LinearDrag).neglected_terms(&VALUES, &NU, &[0.0; 6]);
        assert!((linear[0][0] + (VALUES[0] * VALUES[1]).sqrt() * NU[1]).abs() < 1e-12);
    }

    /// A ship in drift: the force ahead grows with the square of the drift, to port as to starboard.
    #[test]
    fn the_square_of_one_speed_pushes_along_another_axis() {
        let drift = |sway: f64| {
            let nu = [1.0, sway, 0.0, 0.0, 0.0, 0.0];
            effect(Id::QuadraticDrag).neglected_terms(&VALUES, &nu, &[0.0; 6])
        };
        let (to_port, to_starboard) = (drift(0.2), drift(-0.2));
        let ahead = |of: &[[f64; 6]]| of[21][0];
        assert!((ahead(&to_port) - VALUES[1] * 0.04).abs() < 1e-12);
        assert_eq!(ahead(&to_port), ahead(&to_starboard));
    }
}
