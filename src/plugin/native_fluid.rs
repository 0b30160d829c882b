//! MuJoCo's own two fluid models, a body at a time.
//!
//! MuJoCo gives the force of its fluid in joint space only (`qfrc_fluid`), where nothing is left of the
//! force on a body that is welded to its parent. A load cell needs it body by body, so the formulas
//! stand here again, from the "Fluid forces" chapter of MuJoCo's documentation; a test holds them
//! against `qfrc_fluid` on free bodies.
//!
//! Every vector here is in the frame of the box or ellipsoid; velocities are relative to the fluid.

use std::f64::consts::PI;

use nalgebra::Vector3;

/// MuJoCo's guard against division by zero.
const TINY: f64 = 1e-15;

/// Density [kg/m^3] and viscosity [Pa s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    /// Density [kg/m^3].
    pub density: f64,
    /// Dynamic viscosity [Pa s].
    pub viscosity: f64,
}

/// Velocity of a point relative to the fluid.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Angular velocity [rad/s].
    pub angular: Vector3<f64>,
    /// Linear velocity [m/s].
    pub linear: Vector3<f64>,
}

/// Force [N] and torque [N m] at the same point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Force [N].
    pub force: Vector3<f64>,
    /// Torque [N m].
    pub torque: Vector3<f64>,
}

/// The inertia-box model: the body as the box of the same mass and principal inertia [kg m^2].
pub fn inertia_box(mass: f64, inertia: [f64; 3], fluid: Fluid, motion: Motion) -> Load {
    let [ix, iy, iz] = inertia;
    let side = |sum: f64| (sum.max(TINY) / mass * 6.0).sqrt();
    let [x, y, z] = [side(iy + iz - ix), side(ix + iz - iy), side(ix + iy - iz)];
    let (v, w) = (motion.linear, motion.angular);
    // Stokes drag of the sphere whose diameter is the mean side.
    let diameter = (x + y + z) / 3.0;
    let mut force = -3.0 * PI * diameter * fluid.viscosity * v;
    let mut torque = -PI * diameter.powi(3) * fluid.viscosity * w;
    // Quadratic drag of each face.
    let quadratic = |value: f64| value.abs() * value;
    let areas = Vector3::new(y * z, x * z, x * y);
    let moments = Vector3::new(
        x * (y.powi(4) + z.powi(4)),
        y * (x.powi(4) + z.powi(4)),
        z * (x.powi(4) + y.powi(4)),
    );
    force -= 0.5 * fluid.density * areas.component_mul(&v.map(quadratic));
    torque -= fluid.density / 64.0 * moments.component_mul(&w.map(quadratic));
    Load { force, torque }
}

/// Coefficients of one geom under the ellipsoid model, in the order of MuJoCo's `geom_fluid`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipsoidCoefficients {
    /// Scales all forces; 0 switches the geom off.
    pub interaction: f64,
    /// Drag of the projected area.
    pub blunt_drag: f64,
    /// Drag of the rest of the surface.
    pub slender_drag: f64,
    /// Angular drag.
    pub angular_drag: f64,
    /// Kutta lift.
    pub kutta_lift: f64,
    /// Magnus lift.
    pub magnus_lift: f64,
    /// Virtual mass over density [m^3].
    pub virtual_mass: Vector3<f64>,
    /// Virtual inertia over density [m^5].
    pub virtual_inertia: Vector3<f64>,
}

impl EllipsoidCoefficients {
    /// Numbers of a geom.
    pub const LEN: usize = 12;

    /// The coefficients in a geom's row.
    pub fn from_row(row: &[f64; Self::LEN]) -> Self {
        Self {
            interaction: row[0],
            blunt_drag: row[1],
            slender_drag: row[2],
            angular_drag: row[3],
            kutta_lift: row[4],
            magnus_lift: row[5],
            virtual_mass: Vector3::new(row[6], row[7], row[8]),
            virtual_inertia: Vector3::new(row[9], row[10], row[11]),
        }
    }
}

/// The ellipsoid model for one geom of the given semi-axes [m].
pub fn ellipsoid(
    semi_axes: [f64; 3],
    coefficients: &EllipsoidCoefficients,
    fluid: Fluid,
    motion: Motion,
) -> Load {
    let (v, w) = (motion.linear, motion.angular);
    let Fluid { density, viscosity } = fluid;
    let [a, b, c] = semi_axes;

    // The part of the added mass that needs no acceleration.
    let linear_momentum = density * coefficients.virtual_mass.component_mul(&v);
    let angular_momentum = density * coefficients.virtual_inertia.component_mul(&w);
    let mut force = linear_momentum.cross(&w);
    let mut torque = linear_momentum.cross(&v) + angular_momentum.cross(&w);

    // Magnus lift.
    let volume = 4.0 / 3.0 * PI * a * b * c;
    force += coefficients.magnus_lift * density * volume * w.cross(&v);

    // Kutta lift, about the normal of the section that the motion projects.
    let squares = Vector3::new((b * c).powi(2), (c * a).powi(2), (a * b).powi(2));
    let normal = squares.component_mul(&v);
    let denominator = normal.norm_squared();
    let numerator = normal.dot(&v);
    let speed = v.norm();
    let projected_area = PI * (denominator / numerator.max(TINY)).sqrt();
    let cosine = numerator / (speed * denominator).max(TINY);
    let circulation =
        coefficients.kutta_lift * density * cosine * projected_area * normal.cross(&v);
    force += circulation.cross(&v);

    // Drag: Stokes' for the mean sphere, and quadratic of projected and remaining area.
    let longest = a.max(b).max(c);
    let shortest = a.min(b).min(c);
    let middle = a + b + c - longest - shortest;
    let largest_area = PI * longest * middle;
    let diameter = 2.0 / 3.0 * (a + b + c);
    let linear_drag = viscosity * 3.0 * PI * diameter
        + density
            * speed
            * (projected_area * coefficients.blunt_drag
                + coefficients.slender_drag * (largest_area - projected_area));
    force -= linear_drag * v;

    let moment =
        |along: f64, one: f64, other: f64| 8.0 / 15.0 * PI * along * one.max(other).powi(4);
    let moments = Vector3::new(moment(a, b, c), moment(b, c, a), moment(c, a, b));
    let largest_moment = 8.0 / 15.0 * PI * middle * longest.powi(4);
    let viscous = Vector3::from_fn(|axis, _| {
        w[axis]
            * (coefficients.angular_drag * moments[axis]
                + coefficients.slender_drag * (largest_moment - moments[axis]))
    });
    let angular_drag = viscosity * PI * diameter.powi(3) + density * viscous.norm();
    torque -= angular_drag * w;

    Load {
        force: coefficients.interaction * force,
        torque: coefficients.interaction * torque,
    }
}
