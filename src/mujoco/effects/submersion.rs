//! How much of a body is under water, and the pressure of the water on its hull.

use hydro_effects::hydrostatics::{Hull, Part};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{source::Source, surroundings::Surroundings, water::Water, wet_bodies::wet_body};
use crate::{
    mujoco::{
        bodies::joint_space::{rotation, vector},
        ffi::DataView,
    },
    plugin::{
        bound::WetBody,
        sea::{Sea, WaterMotion},
    },
};

/// The part of a body's hull that is under water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SubmergedPart {
    /// Volume [m^3].
    pub(crate) volume: f64,
    /// Part of the whole volume, 0 to 1.
    pub(crate) share: f64,
    /// Its centre, body frame [m]; the attribute `centre_of_buoyancy` where that is given.
    pub(crate) centre: [f64; 3],
}

/// A body's hull against the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Submersion {
    /// Part of the hull's volume that is under water, 0 to 1.
    pub(super) fraction: f64,
    /// Centre of that part, or of buoyancy where it is given, body frame [m].
    pub(super) centre: Vector3<f64>,
    /// Pressure of the water per density and per volume of the hull: [`hydro_effects::Motion::upthrust`].
    pub(super) upthrust: [f64; 6],
    /// Motion of the water of the instance's own sea at the centre of that part.
    pub(super) water: WaterMotion,
}

/// The submersion of a body at a pose: `frame` has the body's axes in the world as its columns.
pub(super) fn submersion(
    source: &Source<'_>,
    wet: &WetBody,
    frame: &Matrix3<f64>,
    origin: Vector3<f64>,
    gravity: Vector3<f64>,
    water: &Water<'_>,
) -> Submersion {
    let time = water.time;
    // Where waves push by their excitation, the rest is what it is at the still level.
    let calm = wet.is_excited().then(|| source.bound.sea.calm());
    let sea = calm.as_ref().unwrap_or(&source.bound.sea);
    let pushed = wet.panels.as_ref().map(|panels| {
        let place = Isometry3::from_parts(
            origin.into(),
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*frame)),
        );
        let still = sea.waterline.unwrap_or(0.0);
        panels.push(
            &place,
            |at| sea.level(at.x, at.y, time).unwrap_or(f64::INFINITY),
            |at| gravity.norm() * (still - at.z) + sea.wave_pressure(at, time),
        )
    });
    let (fraction, middle) = match &pushed {
        Some((_, part)) => of_whole(&wet.hull, part),
        None => wet_part(&wet.hull, sea, frame, &origin, time),
    };
    let centre = wet.centre_of_buoyancy.map_or(middle, Vector3::from);
    let water = water.own(source, origin + frame * centre);
    let upthrust = match pushed {
        Some((push, _)) => {
            let push = push.map(|part| part / wet.hull.volume());
            match wet.centre_of_buoyancy {
                Some(_) => with_torque(Vector3::new(push[0], push[1], push[2]), centre),
                None => push,
            }
        }
        None => {
            // The pressure that accelerates the water (Froude-Krylov) has its share in the undisturbed wave.
            let swell = match wet.in_waves {
                true => water.acceleration,
                false => Vector3::zeros(),
            };
            with_torque(frame.tr_mul(&(swell - gravity)) * fraction, centre)
        }
    };
    Submersion {
        fraction,
        centre,
        upthrust,
        water,
    }
}

/// The submerged part of a body at the pose of `data`, in the water of one of the sources: of the hull that its effects act on,
/// or, where none does, of the one that they would.
pub(crate) fn submerged_part(
    data: &DataView<'_>,
    sources: &[Source<'_>],
    which: usize,
    body: usize,
    around: &Surroundings,
) -> SubmergedPart {
    let source = &sources[which];
    let bound = source.bound;
    let made;
    let wet = match bound.bodies.iter().find(|wet| wet.body == body) {
        Some(wet) => wet,
        None => {
            made = wet_body(data.model(), body, around, bound.density);
            &made
        }
    };
    let found = submersion(
        source,
        wet,
        &rotation(data.xmat(), body),
        vector(data.xpos(), body),
        Vector3::zeros(),
        &Water::new(data, sources),
    );
    let whole = wet
        .displaced()
        .or(around.given_volume(body))
        .unwrap_or_else(|| wet.hull.volume());
    SubmergedPart {
        volume: whole * found.fraction,
        share: found.fraction,
        centre: found.centre.into(),
    }
}

fn with_torque(force: Vector3<f64>, at: Vector3<f64>) -> [f64; 6] {
    let torque = at.cross(&force);
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

/// Submerged part of a hull, and its centre [m, body frame]; the surface is a plane over it.
pub(super) fn wet_part(
    hull: &Hull,
    sea: &Sea,
    frame: &Matrix3<f64>,
    origin: &Vector3<f64>,
    time: f64,
) -> (f64, Vector3<f64>) {
    let whole = hull.centre();
    let Some(surface) = sea.surface(origin + frame * whole, time) else {
        return (1.0, whole);
    };
    let (up, level) = surface.in_frame(frame, origin);
    of_whole(hull, &hull.below(&up, level))
}

/// A wet part as a share of its hull, 0 to 1, and its centre.
fn of_whole(hull: &Hull, part: &Part) -> (f64, Vector3<f64>) {
    if part.volume <= 0.0 || hull.volume() <= 0.0 {
        return (0.0, hull.centre());
    }
    let fraction = (part.volume / hull.volume()).min(1.0);
    (fraction, part.moment / part.volume)
}
