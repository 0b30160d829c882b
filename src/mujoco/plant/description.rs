//! Bodies, joints and actuators of a model, as `hydro gap` sees them.

use hydro_effects::{Medium, card::JointScale};
use hydro_frames::world_from_base;
use hydro_gap::plant::{Inertial, PlantActuator, PlantBody, PlantJoint};
use nalgebra::Vector3;

use crate::mujoco::{
    bodies::joint_space::last_dof,
    effects::sizes::{self, WEIGHTY, weighs_in},
    ffi::{
        DataView, ModelView,
        bindings::{
            mjJNT_HINGE, mjJNT_SLIDE, mjOBJ_ACTUATOR, mjOBJ_BODY, mjOBJ_JOINT, mjOBJ_SITE,
            mjSENS_FORCE, mjSENS_TORQUE,
        },
        views::NBIAS,
    },
};

/// Cosine of the angle between axes that are across one another.
const ACROSS: f64 = 1e-6;

/// True where a body that stands still hangs on a force or torque sensor with more than [`WEIGHTY`] of what
/// hangs there: its weight is in the readings.
pub(crate) fn is_weighed(model: ModelView<'_>, body: usize) -> bool {
    if last_dof(model, body) >= 0 {
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

/// Bodies that move and have mass, or degrees of freedom of their own; bodies that a sensor weighs. `floating`: the names of those
/// with hydrostatics; `has_buoyancy`: true for one whose buoyancy the model has, gravity compensation apart.
pub(crate) fn bodies(
    data: &DataView<'_>,
    density: f64,
    waterline: Option<f64>,
    floating: &[String],
    has_buoyancy: impl Fn(&str) -> bool,
) -> Vec<PlantBody> {
    let model = data.model();
    // Without hulls at all, masses tell which body is the bulky one.
    let has_hulls = (1..model.bodies()).any(|body| sizes::own_volume(model, body, density) > 0.0);
    (1..model.bodies())
        .filter(|body| {
            is_weighed(model, *body)
                || last_dof(model, *body) >= 0
                    && (model.body_mass()[*body] > 0.0 || model.body_dofnum()[*body] > 0)
        })
        .map(|body| {
            let mut scale = sizes::body(model, body, density, None);
            let low = data.xpos()[3 * body + 2] - 0.5 * scale.extent[2];
            let under = waterline.is_none_or(|surface| low < surface);
            let bulk = match sizes::own_volume(model, body, density) {
                volume if volume > 0.0 => volume,
                _ if has_hulls => 0.0,
                _ => model.body_mass()[body] / density,
            };
            let size = scale.extent.iter().any(|extent| *extent > 0.0);
            let name = model.label(mjOBJ_BODY as i32, "body", body);
            let is_carried = sizes::with_tree(model, body).any(|link| {
                has_buoyancy(&model.label(mjOBJ_BODY as i32, "body", link))
                    || model.body_gravcomp()[link] > 0.0
            });
            if !is_carried {
                scale.buoyancy_left_out = density * scale.gravity * scale.volume;
            }
            PlantBody {
                floats: floating.contains(&name),
                name,
                root: sizes::is_root(model, body),
                moves: last_dof(model, body) >= 0,
                only_dof: only_dof(model, body),
                end: is_end(model, body),
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

/// The degree of freedom that alone moves a body, a hinge's or a slide's, where it is one.
fn only_dof(model: ModelView<'_>, body: usize) -> Option<usize> {
    let above = (1..=body).filter(|of| model.hangs_below(body, *of));
    let dofs: i32 = above.map(|of| model.body_dofnum()[of]).sum();
    usize::try_from(last_dof(model, body))
        .ok()
        .filter(|_| dofs == 1)
}

/// True where a body has a degree of freedom of its own and none hangs below it.
fn is_end(model: ModelView<'_>, body: usize) -> bool {
    let has_own = |of: usize| model.body_dofnum()[of] > 0;
    let mut below = (body + 1..model.bodies()).filter(|of| model.hangs_below(*of, body));
    has_own(body) && !below.any(has_own)
}

/// Density from which a fluid is no gas [kg/m^3].
const LIQUID: f64 = 100.0;

/// The medium that a model tells of: by the density of its fluid, by an instance of `hydro.wrench` that is `wet`, or by a
/// tree that floats, one of six degrees of freedom whose weight gravity compensation carries.
pub(crate) fn medium(model: ModelView<'_>, wet: bool) -> Medium {
    let density = model.raw().opt.density;
    let floats = (1..model.bodies()).any(|body| {
        let root = (1..model.bodies())
            .find(|root| sizes::is_root(model, *root) && model.hangs_below(body, *root));
        model.body_gravcomp()[body] > 0.0 && root.is_some_and(|root| model.body_dofnum()[root] == 6)
    });
    if density >= LIQUID || wet {
        Medium::Water
    } else if density > 0.0 {
        Medium::Air
    } else if floats {
        Medium::Water
    } else {
        Medium::None
    }
}

/// Hinges and slides.
pub(crate) fn joints(model: ModelView<'_>) -> Vec<PlantJoint> {
    (0..model.jnt_type().len())
        .filter(|joint| sizes::is_scalar(model, *joint))
        .map(|joint| {
            let scale = sizes::joint(model, joint);
            PlantJoint {
                name: model.label(mjOBJ_JOINT as i32, "joint", joint),
                qpos: model.jnt_qposadr()[joint] as usize,
                dof: model.jnt_dofadr()[joint] as usize,
                start: model.qpos0()[model.jnt_qposadr()[joint] as usize],
                is_coordinate: is_coordinate(model, joint, &scale),
                is_level: is_level(model, joint),
                scale,
                pushes: sizes::pushes(model, joint),
                stiffness: model.jnt_stiffness()[joint],
                damping: model.dof_damping()[model.jnt_dofadr()[joint] as usize],
            }
        })
        .collect()
}

/// True for a slide or hinge that only says where a body is: on a body that hangs at the world, among slides and hinges about
/// axes across them, without limits, spring, damping (of its own or a servo's), friction or armature. Models describe robots that
/// move in a plane by such joints.
fn is_coordinate(model: ModelView<'_>, joint: usize, scale: &JointScale) -> bool {
    let body = model.jnt_bodyid()[joint] as usize;
    let friction = model.dof_frictionloss()[model.jnt_dofadr()[joint] as usize];
    let mut passive = sizes::stiffness(model, joint);
    passive.extend([scale.damping, scale.armature, friction]);
    // SAFETY: one flag a joint.
    let is_limited = unsafe { ModelView::flag(model.raw().jnt_limited, joint) };
    let first = model.body_jntadr()[body] as usize;
    let of_body = || first..first + model.body_jntnum()[body] as usize;
    let axes = |kind: u32| -> Vec<Vector3<f64>> {
        of_body()
            .filter(|other| model.jnt_type()[*other] as u32 == kind)
            .map(|other| Vector3::from(ModelView::triple(model.jnt_axis(), other)))
            .collect()
    };
    let (slides, hinges) = (axes(mjJNT_SLIDE), axes(mjJNT_HINGE));
    let is_across = |slide: &Vector3<f64>| hinges.iter().all(|of| slide.dot(of).abs() < ACROSS);
    model.body_parentid()[body] == 0
        && !slides.is_empty()
        && !hinges.is_empty()
        && slides.iter().all(is_across)
        && !is_limited
        && passive.iter().all(|value| *value == 0.0)
}

/// True for a slide across the vertical, where nothing above it turns.
fn is_level(model: ModelView<'_>, joint: usize) -> bool {
    let slides = |joint: usize| model.jnt_type()[joint] as u32 == mjJNT_SLIDE;
    let mut axis = Vector3::from(ModelView::triple(model.jnt_axis(), joint));
    let mut body = model.jnt_bodyid()[joint] as usize;
    let mut above = model.body_jntadr()[body] as usize..joint;
    while body != 0 {
        if !above.all(slides) {
            return false;
        }
        axis = world_from_base(ModelView::quadruple(model.body_quat(), body)) * axis;
        body = model.body_parentid()[body] as usize;
        let first = usize::try_from(model.body_jntadr()[body]).unwrap_or(0);
        above = first..first + model.body_jntnum()[body] as usize;
    }
    slides(joint) && axis.z.abs() < ACROSS
}

/// One entry a control; an actuator with several controls has its name with an index.
pub(crate) fn actuators(model: ModelView<'_>) -> Vec<PlantActuator> {
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
                thrusts: sizes::thrust(model, id).is_some(),
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
