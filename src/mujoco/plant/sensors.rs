//! The sensors of a model, as `hydro gap` sees them.

use hydro_gap::plant::{PlantSensor, SensorKind};

use crate::mujoco::{
    ffi::{
        ModelView,
        bindings::{
            mjJNT_SLIDE, mjOBJ_BODY, mjOBJ_JOINT, mjOBJ_SENSOR, mjOBJ_SITE, mjOBJ_XBODY,
            mjSENS_ACCELEROMETER, mjSENS_FORCE, mjSENS_FRAMEANGVEL, mjSENS_FRAMELINACC,
            mjSENS_FRAMELINVEL, mjSENS_FRAMEPOS, mjSENS_FRAMEQUAT, mjSENS_GYRO, mjSENS_JOINTPOS,
            mjSENS_JOINTVEL, mjSENS_PLUGIN, mjSENS_TORQUE, mjSENS_VELOCIMETER,
        },
    },
    load_cell::cell::measures_force,
};

/// All sensors.
pub(crate) fn sensors(model: ModelView<'_>) -> Vec<PlantSensor> {
    (0..model.sensor_type().len())
        .map(|id| sensor(model, id))
        .collect()
}

fn sensor(model: ModelView<'_>, id: usize) -> PlantSensor {
    let object = model.sensor_objid()[id];
    let joint_slides =
        || usize::try_from(object).is_ok_and(|joint| model.jnt_type()[joint] as u32 == mjJNT_SLIDE);
    let turn_or_way = |turn, way| if joint_slides() { way } else { turn };
    let code = model.sensor_type()[id] as u32;
    let (kind, unit) = match code {
        code if code == mjSENS_FRAMEPOS => (SensorKind::Position, "m"),
        code if code == mjSENS_FRAMEQUAT => (SensorKind::Quaternion, "1"),
        code if code == mjSENS_JOINTPOS => (SensorKind::JointPosition, turn_or_way("rad", "m")),
        code if code == mjSENS_JOINTVEL => (SensorKind::JointVelocity, turn_or_way("rad/s", "m/s")),
        code if code == mjSENS_GYRO || code == mjSENS_FRAMEANGVEL => {
            (SensorKind::AngularVelocity, "rad/s")
        }
        code if code == mjSENS_VELOCIMETER || code == mjSENS_FRAMELINVEL => {
            (SensorKind::LinearVelocity, "m/s")
        }
        code if code == mjSENS_ACCELEROMETER || code == mjSENS_FRAMELINACC => {
            (SensorKind::Acceleration, "m/s^2")
        }
        code if code == mjSENS_FORCE => (SensorKind::Force, "N"),
        code if code == mjSENS_TORQUE => (SensorKind::Torque, "N m"),
        code if code == mjSENS_PLUGIN => load_cell(model, id),
        _ => (SensorKind::Other, "1"),
    };
    let of_frame = matches!(
        kind,
        SensorKind::Position
            | SensorKind::Quaternion
            | SensorKind::AngularVelocity
            | SensorKind::LinearVelocity
    );
    let of_joint = matches!(kind, SensorKind::JointPosition | SensorKind::JointVelocity);
    PlantSensor {
        name: model.label(mjOBJ_SENSOR as i32, "sensor", id),
        kind,
        start: model.sensor_adr()[id] as usize,
        len: model.sensor_dim()[id] as usize,
        noise: model.sensor_noise()[id],
        unit,
        frame_of: of_frame
            .then(|| framed_body(model, id))
            .flatten()
            .map(|body| model.label(mjOBJ_BODY as i32, "body", body)),
        joint: of_joint
            .then(|| usize::try_from(object).ok())
            .flatten()
            .map(|joint| model.label(mjOBJ_JOINT as i32, "joint", joint)),
    }
}

/// A load cell by its attribute `quantity`; any other plugin says nothing.
fn load_cell(model: ModelView<'_>, id: usize) -> (SensorKind, &'static str) {
    let Ok(instance) = usize::try_from(model.sensor_plugin()[id]) else {
        return (SensorKind::Other, "1");
    };
    match measures_force(model, instance) {
        Some(true) => (SensorKind::Force, "N"),
        Some(false) => (SensorKind::Torque, "N m"),
        None => (SensorKind::Other, "1"),
    }
}

/// The body whose motion a sensor of a frame gives in the world, be it through a site on it.
fn framed_body(model: ModelView<'_>, id: usize) -> Option<usize> {
    if model.sensor_refid()[id] >= 0 {
        return None;
    }
    let object = usize::try_from(model.sensor_objid()[id]).ok()?;
    let kind = model.sensor_objtype()[id] as u32;
    if kind == mjOBJ_BODY || kind == mjOBJ_XBODY {
        Some(object)
    } else if kind == mjOBJ_SITE {
        Some(model.site_bodyid()[object] as usize)
    } else {
        None
    }
}
