//! What a model's sensors, bodies, joints and actuators are to `hydro gap`.

use hydro_gap::plant::{Inertial, PlantActuator, PlantBody, PlantJoint, PlantSensor, SensorKind};

use super::{
    apply,
    bindings::{
        mjOBJ_ACTUATOR, mjOBJ_BODY, mjOBJ_JOINT, mjOBJ_SENSOR, mjOBJ_SITE, mjOBJ_XBODY,
        mjSENS_ACCELEROMETER, mjSENS_FORCE, mjSENS_FRAMEANGVEL, mjSENS_FRAMELINACC,
        mjSENS_FRAMELINVEL, mjSENS_FRAMEPOS, mjSENS_FRAMEQUAT, mjSENS_GYRO, mjSENS_JOINTPOS,
        mjSENS_JOINTVEL, mjSENS_PLUGIN, mjSENS_TORQUE, mjSENS_VELOCIMETER,
    },
    scale,
    views::{DataView, ModelView, NBIAS},
};

/// A body weighs in its tree from this part of the tree's mass on.
pub(super) const WEIGHTY: f64 = 0.02;

/// A body's inertia is uncertain from this part of the tree's mass on: three per cent of a light shank bend a
/// stiff servo by more than its encoder's noise. Whether data see it is theirs to say.
const LIGHT: f64 = 0.001;

/// True where a body has more than [`WEIGHTY`] of its tree's mass.
pub(super) fn weighs_in(model: ModelView<'_>, body: usize) -> bool {
    has_part(model, body, WEIGHTY)
}

/// True where a moving body's inertia is worth doubting.
pub(super) fn has_inertia(model: ModelView<'_>, body: usize) -> bool {
    has_part(model, body, LIGHT)
}

fn has_part(model: ModelView<'_>, body: usize, part: f64) -> bool {
    let root = model.body_rootid()[body] as usize;
    body != 0
        && apply::last_dof(model, body) >= 0
        && model.body_mass()[body] > part * model.body_subtreemass()[root]
}

/// True where a body that stands still hangs on a force or torque sensor with more than [`WEIGHTY`] of what
/// hangs there: its weight is in the readings.
pub(super) fn is_weighed(model: ModelView<'_>, body: usize) -> bool {
    if apply::last_dof(model, body) >= 0 {
        return false;
    }
    let sensors = 0..model.sensor_type().len();
    sensors
        .filter(|sensor| {
            let kind = model.sensor_type()[*sensor] as u32;
            (kind == mjSENS_FORCE || kind == mjSENS_TORQUE)
                && model.sensor_objtype()[*sensor] as u32 == mjOBJ_SITE
        })
        .map(|sensor| model.site_bodyid()[model.sensor_objid()[sensor] as usize] as usize)
        .any(|cell| {
            cell != 0
                && model.hangs_below(body, cell)
                && model.body_mass()[body] > WEIGHTY * model.body_subtreemass()[cell]
        })
}

/// Bodies that move and have mass, or degrees of freedom of their own; bodies that a sensor weighs.
pub(super) fn bodies(data: &DataView<'_>, density: f64, waterline: Option<f64>) -> Vec<PlantBody> {
    let model = data.model();
    // Without hulls at all, masses tell which body is the bulky one.
    let has_hulls = (1..model.bodies()).any(|body| scale::own_volume(model, body, density) > 0.0);
    (1..model.bodies())
        .filter(|body| {
            is_weighed(model, *body)
                || apply::last_dof(model, *body) >= 0
                    && (model.body_mass()[*body] > 0.0 || model.body_dofnum()[*body] > 0)
        })
        .map(|body| {
            let scale = scale::body(model, body, density);
            let low = data.xpos()[3 * body + 2] - 0.5 * scale.extent[2];
            let under = waterline.is_none_or(|surface| low < surface);
            let bulk = match scale::own_volume(model, body, density) {
                volume if volume > 0.0 => volume,
                _ if has_hulls => 0.0,
                _ => model.body_mass()[body] / density,
            };
            let size = scale.extent.iter().any(|extent| *extent > 0.0);
            PlantBody {
                name: model.label(mjOBJ_BODY as i32, "body", body),
                root: scale::is_root(model, body),
                moves: apply::last_dof(model, body) >= 0,
                wet: weighs_in(model, body) && size && under,
                bulk,
                scale,
                inertial: Inertial {
                    mass: model.body_mass()[body],
                    position: ModelView::triple(model.body_ipos(), body),
                    attitude: ModelView::quadruple(model.body_iquat(), body),
                    moments: ModelView::triple(model.body_inertia(), body),
                    compensation: model.body_gravcomp()[body],
                },
            }
        })
        .collect()
}

/// Hinges and slides.
pub(super) fn joints(model: ModelView<'_>) -> Vec<PlantJoint> {
    (0..model.jnt_type().len())
        .filter(|joint| scale::is_scalar(model, *joint))
        .map(|joint| PlantJoint {
            name: model.label(mjOBJ_JOINT as i32, "joint", joint),
            qpos: model.jnt_qposadr()[joint] as usize,
            dof: model.jnt_dofadr()[joint] as usize,
            scale: scale::joint(model, joint),
            stiffness: model.jnt_stiffness()[joint],
            damping: model.dof_damping()[model.jnt_dofadr()[joint] as usize],
        })
        .collect()
}

/// One entry a control; an actuator with several controls has its name with an index.
pub(super) fn actuators(model: ModelView<'_>) -> Vec<PlantActuator> {
    let raw = model.raw();
    (0..raw.nu as usize)
        .map(|control| {
            // SAFETY: one flag a control.
            let limited = unsafe { ModelView::flag(raw.actuator_ctrllimited, control) };
            let row = &model.actuator_ctrlrange()[2 * control..2 * control + 2];
            let (id, index) = owner(model, control);
            let name = model.label(mjOBJ_ACTUATOR as i32, "actuator", id);
            PlantActuator {
                name: index.map_or(name.clone(), |index| format!("{name}[{index}]")),
                range: limited.then(|| [row[0], row[1]]),
                thrusts: scale::thrust(model, id).is_some(),
                speed_bias: model.actuator_biasprm()[NBIAS * id + 2],
            }
        })
        .collect()
}

/// The actuator of a control, and which of its several controls that is.
fn owner(model: ModelView<'_>, control: usize) -> (usize, Option<usize>) {
    #[cfg(mujoco_outputs)]
    {
        let raw = model.raw();
        for id in 0..model.actuator_trntype().len() {
            // SAFETY: one number an actuator in each array.
            let (first, count) = unsafe {
                (
                    *raw.actuator_ctrladr.add(id) as usize,
                    *raw.actuator_ctrlnum.add(id) as usize,
                )
            };
            if (first..first + count).contains(&control) {
                return (id, (count > 1).then(|| control - first));
            }
        }
        (0, None)
    }
    #[cfg(not(mujoco_outputs))]
    {
        let _ = model;
        (control, None)
    }
}

/// All sensors.
pub(super) fn sensors(model: ModelView<'_>) -> Vec<PlantSensor> {
    (0..model.sensor_type().len())
        .map(|id| sensor(model, id))
        .collect()
}

fn sensor(model: ModelView<'_>, id: usize) -> PlantSensor {
    let object = model.sensor_objid()[id];
    let joint_slides = || {
        usize::try_from(object)
            .is_ok_and(|joint| model.jnt_type()[joint] as u32 == super::bindings::mjJNT_SLIDE)
    };
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
            .then(|| body_of(model, id))
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
    match super::load_cell::measures_force(model, instance) {
        Some(true) => (SensorKind::Force, "N"),
        Some(false) => (SensorKind::Torque, "N m"),
        None => (SensorKind::Other, "1"),
    }
}

/// The body whose motion a sensor of a frame gives in the world, be it through a site on it.
fn body_of(model: ModelView<'_>, id: usize) -> Option<usize> {
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
