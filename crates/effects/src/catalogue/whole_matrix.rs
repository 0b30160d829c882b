//! Whole 6 x 6 matrices of added mass and drag, about the middle of the body or about a given point of it.
//!
//! With nu = (v, omega) the velocity of the point relative to the water and the angular velocity, body frame, and M, D the
//! matrices (rows and columns surge, sway, heave, roll, pitch, yaw):
//!
//! ```text
//! added mass       -(M nu' + C(nu) nu),  C(nu) nu = (omega x p, omega x h + v x p),  (p, h) = M nu
//! linear drag      -D nu
//! quadratic drag   -D (|nu_1| nu_1, ..., |nu_6| nu_6)
//! ```
//!
//! as force and torque about the point. T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd ed.,
//! Wiley 2021, theorem 3.2 and section 6.3 (C_A of a full M_A; equation 6.43 of the first edition, 2011); H. Lamb,
//! Hydrodynamics, 6th ed. 1932, article 124 (Kirchhoff's equations); sections 6.4 and 8.1 of Fossen (damping). Elements of
//! the quadratic matrix are Fossen's `-Y_|r|r`: row by force, column by the velocity that is squared.

use nalgebra::{Matrix6, Vector3};
use num_dual::DualSVec64;

use super::axes::NAMES;
use crate::{
    BodyPart, MATRIX_LEN, MatrixFault, MatrixPart, Motion,
    dual::{Scalar, constant, cross, scaled, signed_square, sum},
    flow::{Flow, within_reach},
    wrench_law::{about_origin, bounded},
};

/// A difference of two mirrored elements below this share of the greater, and an eigenvalue above minus this of a matrix with
/// ones on its diagonal, are rounding.
const ROUNDING: f64 = 1e-9;

const ENERGY: &str = "the water would have kinetic energy below zero in some motion";
const PUSHES: &str = "it would push along some motion, and add energy";
/// Index of the negative element of the diagonal.
const SIGNS: &str = "; the derivatives in vehicles' tables (X_udot, X_u, X_u|u|) are the negatives of the elements, and \
                     `hydro effects from-fossen` converts them";

/// A number with six derivatives.
type Dual6 = DualSVec64<6>;

/// Motion that the matrix multiplies.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    AddedMass,
    LinearDrag,
    QuadraticDrag,
}

/// A whole matrix in one of the laws.
#[derive(Debug)]
pub(super) struct WholeMatrix {
    law: Law,
    /// Units of the blocks, by row and column: translations, rotations.
    units: [[&'static str; 2]; 2],
}

/// Added mass.
pub(super) static ADDED_MASS: WholeMatrix = WholeMatrix {
    law: Law::AddedMass,
    units: [["kg", "kg m"], ["kg m", "kg m^2"]],
};

/// Linear drag.
pub(super) static LINEAR_DRAG: WholeMatrix = WholeMatrix {
    law: Law::LinearDrag,
    units: [["N s/m", "N s/rad"], ["N s", "N m s/rad"]],
};

/// Quadratic drag.
pub(super) static QUADRATIC_DRAG: WholeMatrix = WholeMatrix {
    law: Law::QuadraticDrag,
    units: [["N s^2/m^2", "N s^2/rad^2"], ["N s^2/m", "N m s^2/rad^2"]],
};

/// `m x`.
fn product<D: Scalar>(m: &Matrix6<f64>, x: [D; 6]) -> [D; 6] {
    std::array::from_fn(|row| {
        (0..6).fold(D::from(0.0), |sum, column| {
            sum + x[column] * D::from(m[(row, column)])
        })
    })
}

/// The six numbers as two vectors.
fn halves<D: Scalar>([a, b, c, d, e, f]: [D; 6]) -> [[D; 3]; 2] {
    [[a, b, c], [d, e, f]]
}

/// Force and torque about the point, without the part in proportion to the body's acceleration.
fn at_point<D: Scalar>(law: Law, m: &Matrix6<f64>, flow: &Flow<D>, point: [D; 3]) -> [[D; 3]; 2] {
    let omega = flow.angular;
    let v = sum(flow.linear, cross(omega, point));
    let nu = [v[0], v[1], v[2], omega[0], omega[1], omega[2]];
    let negative = |x: [D; 6]| halves(product(m, x).map(|value| -value));
    match law {
        Law::LinearDrag => negative(nu),
        Law::QuadraticDrag => negative(nu.map(signed_square)),
        Law::AddedMass => {
            let [p, h] = halves(product(m, nu));
            // `nu'` of the equation is the rate of the components in the body's frame: acceleration of the point as the
            // world sees it, a + omega' x r + omega x (omega x r), less the water's and less omega x v. All but the part in
            // a and omega', which is the inertia's.
            let minus = D::from(-1.0);
            let turning = scaled(minus, cross(omega, cross(omega, point)));
            let left = sum(
                constant(flow.water_acceleration()),
                sum(cross(omega, v), turning),
            );
            let zero = D::from(0.0);
            let [force, torque] = halves(product(m, [left[0], left[1], left[2], zero, zero, zero]));
            [
                sum(force, cross(p, omega)),
                sum(torque, sum(cross(h, omega), cross(p, v))),
            ]
        }
    }
}

/// Wrench about the origin.
fn wrench_of<D: Scalar>(law: Law, m: &Matrix6<f64>, flow: &Flow<D>, point: [D; 3]) -> [D; 6] {
    let [force, torque] = at_point(law, m, flow, point);
    about_origin(force, torque, point)
}

/// The matrix for velocities and forces at the origin in place of the point r: H^T M H, H = [1, -r x; 0, 1].
fn about(m: &Matrix6<f64>, point: [f64; 3]) -> Matrix6<f64> {
    let mut moved = Matrix6::identity();
    moved
        .fixed_view_mut::<3, 3>(0, 3)
        .copy_from(&-Vector3::from(point).cross_matrix());
    moved.transpose() * m * moved
}

impl WholeMatrix {
    /// The matrix among the values; an added mass is made symmetric to the last bit.
    fn matrix(&self, p: &[f64]) -> Matrix6<f64> {
        let element = |row: usize, column: usize| p.get(6 * row + column).copied().unwrap_or(0.0);
        let m = Matrix6::from_fn(|row, column| bounded(element(row, column)));
        match self.law {
            Law::AddedMass => (m + m.transpose()) * 0.5,
            Law::LinearDrag | Law::QuadraticDrag => m,
        }
    }

    fn check_symmetric(&self, m: &Matrix6<f64>) -> Result<(), MatrixFault> {
        let pairs = (0..6).flat_map(|row| (row + 1..6).map(move |column| (row, column)));
        for (row, column) in pairs {
            let (value, mirrored) = (m[(row, column)], m[(column, row)]);
            if (value - mirrored).abs() > ROUNDING * value.abs().max(mirrored.abs()) {
                return Err(MatrixFault::NotSymmetric {
                    row: NAMES[row],
                    column: NAMES[column],
                    value,
                    mirrored,
                    unit: self.unit(row, column),
                });
            }
        }
        Ok(())
    }
}

/// Checks that the symmetric part of a matrix has no negative eigenvalue.
///
/// Scaled to ones on the diagonal, so that rounding of large masses hides no small moment of inertia: whether an eigenvalue
/// is negative does not depend on the scale. The eigenvalue that is told is the matrix's own.
fn check_semidefinite(
    m: &Matrix6<f64>,
    what: &'static str,
    why: &'static str,
) -> Result<(), MatrixFault> {
    let symmetric = (m + m.transpose()) * 0.5;
    let scale = Matrix6::from_diagonal(&symmetric.diagonal().map(|value| match value.abs() {
        size if size > 0.0 => size.sqrt().recip(),
        _ => 1.0,
    }));
    let scaled = scale * symmetric * scale;
    let least = scaled.symmetric_eigenvalues().min();
    if least >= -ROUNDING * scaled.amax().max(1.0) {
        return Ok(());
    }
    let is_negative = symmetric.diagonal().iter().any(|value| *value < 0.0);
    Err(MatrixFault::Indefinite {
        what,
        eigenvalue: symmetric.symmetric_eigenvalues().min(),
        why,
        hint: if is_negative { SIGNS } else { "" },
    })
}

impl MatrixPart for WholeMatrix {
    fn unit(&self, row: usize, column: usize) -> &'static str {
        self.units[row / 3][column / 3]
    }

    /// An added mass is symmetric and positive semidefinite. A linear drag takes energy in every motion where its symmetric
    /// part is positive semidefinite. Of a quadratic drag only motions along or about one axis are checked, by the diagonal:
    /// the power -nu^T D |nu| nu of all six is a cubic form, whose sign has no closed test, and tables with couplings
    /// (REMUS) are used at low angles of attack, where they resist.
    fn check(&self, matrix: &Matrix6<f64>) -> Result<(), MatrixFault> {
        match self.law {
            Law::AddedMass => {
                self.check_symmetric(matrix)?;
                check_semidefinite(matrix, "the matrix", ENERGY)
            }
            Law::LinearDrag => {
                check_semidefinite(matrix, "the symmetric part of the matrix", PUSHES)
            }
            Law::QuadraticDrag => {
                let negative = (0..6).find(|axis| matrix[(*axis, *axis)] < 0.0);
                negative.map_or(Ok(()), |axis| {
                    Err(MatrixFault::NegativeDiagonal {
                        axis: NAMES[axis],
                        value: matrix[(axis, axis)],
                        unit: self.unit(axis, axis),
                        hint: SIGNS,
                    })
                })
            }
        }
    }
}

/// The point that the matrix acts at: given after its elements, or the middle of the body.
fn point<D>(p: &[f64], flow: &Flow<D>) -> [f64; 3]
where
    D: Scalar,
{
    match p.get(MATRIX_LEN..) {
        Some([x, y, z]) => within_reach([*x, *y, *z]),
        _ => flow.middle(),
    }
}

impl BodyPart for WholeMatrix {
    fn has_inertia(&self) -> bool {
        self.law == Law::AddedMass
    }

    fn wrench(&self, p: &[f64], motion: &Motion, _memory: &[f64]) -> [f64; 6] {
        let flow = Flow::<f64>::bounded(motion);
        wrench_of(self.law, &self.matrix(p), &flow, point(p, &flow))
    }

    fn inertia(&self, p: &[f64], motion: &Motion) -> Option<Matrix6<f64>> {
        let at = point(p, &Flow::<f64>::bounded(motion));
        self.has_inertia().then(|| about(&self.matrix(p), at))
    }

    fn damping(&self, p: &[f64], motion: &Motion, _memory: &[f64]) -> Option<Matrix6<f64>> {
        let mut flow = Flow::<Dual6>::bounded(motion);
        for axis in 0..3 {
            flow.linear[axis] = flow.linear[axis].derivative(axis);
            flow.angular[axis] = flow.angular[axis].derivative(axis + 3);
        }
        let at = constant(point(p, &flow));
        let wrench = wrench_of(self.law, &self.matrix(p), &flow, at);
        let mut damping = Matrix6::zeros();
        for (row, component) in wrench.iter().enumerate() {
            if let Some(gradient) = &component.eps.0 {
                damping.set_row(row, &-gradient.transpose());
            }
        }
        Some(damping)
    }

    /// The wrench is linear in the elements.
    fn by_parameters(&self, p: &[f64], motion: &Motion, _memory: &[f64]) -> Vec<[f64; 6]> {
        let flow = Flow::<f64>::bounded(motion);
        let at = point(p, &flow);
        let elements = (0..p.len().min(MATRIX_LEN)).map(|index| {
            let mut one = [0.0; MATRIX_LEN];
            one[index] = 1.0;
            wrench_of(self.law, &self.matrix(&one), &flow, at)
        });
        let mut columns: Vec<[f64; 6]> = elements.collect();
        if let Some(coordinates) = p.get(MATRIX_LEN..) {
            let flow = Flow::<Dual6>::bounded(motion);
            let mut at: [Dual6; 3] = constant(at);
            for (axis, coordinate) in at.iter_mut().enumerate() {
                *coordinate = coordinate.derivative(axis);
            }
            let wrench = wrench_of(self.law, &self.matrix(p), &flow, at);
            columns.extend((0..coordinates.len()).map(|axis| {
                wrench.map(|component| component.eps.0.map_or(0.0, |gradient| gradient[axis]))
            }));
        }
        columns
    }
}
