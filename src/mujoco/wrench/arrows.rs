//! Arrows of force and torque in a viewer.

use std::{ffi::c_int, ptr};

use hydro_frames as frames;
use nalgebra::Vector3;

use super::applied::{applied, total_wrench};
use crate::mujoco::{
    bodies::joint_space,
    ffi::{
        Api, DataView, ModelView,
        bindings::{mjData, mjGEOM_ARROW, mjModel, mjVIS_PERTOBJ, mjvOption, mjvScene},
        guard,
        views::view_mut,
    },
};

/// Two arrows at the base origin, force and torque, as long as MuJoCo draws its own
/// (`<visual><map force torque/>`), while the viewer shows perturbations (`mjVIS_PERTOBJ`, on by default).
pub(crate) unsafe extern "C" fn visualize(
    m: *const mjModel,
    d: *mut mjData,
    option: *const mjvOption,
    scene: *mut mjvScene,
    id: c_int,
) {
    guard("visualize", (), || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { DataView::from_callback(m, d) }) else {
            return;
        };
        // SAFETY: as above.
        let (Some(option), Some(scene)) = (unsafe { option.as_ref() }, unsafe { scene.as_mut() })
        else {
            return;
        };
        if option.flags[mjVIS_PERTOBJ as usize] == 0 {
            return;
        }
        let Some(now) = applied(&mut data, id as usize) else {
            return;
        };
        let wrench = total_wrench(&data, &now);
        let visual = &data.model().raw().vis;
        let attitude = ModelView::quadruple(data.xquat(), now.body);
        let origin = joint_space::vector(data.xpos(), now.body);
        let width = f64::from(visual.scale.forcewidth) * data.model().raw().stat.meansize;
        for (in_base, scale, colour) in [
            (wrench.force, visual.map.force, FORCE_COLOUR),
            (wrench.torque, visual.map.torque, TORQUE_COLOUR),
        ] {
            let arrow = Vector3::from(frames::to_world(attitude, in_base)) * f64::from(scale);
            draw(
                data.model().api(),
                scene,
                origin,
                origin + arrow,
                width,
                colour,
            );
        }
    });
}

/// Sea green, and amber.
const FORCE_COLOUR: [f32; 4] = [0.1, 0.65, 0.75, 1.0];
const TORQUE_COLOUR: [f32; 4] = [0.95, 0.65, 0.1, 1.0];

fn draw(
    api: &Api,
    scene: &mut mjvScene,
    from: Vector3<f64>,
    to: Vector3<f64>,
    width: f64,
    colour: [f32; 4],
) {
    let len = scene.ngeom;
    // SAFETY: the scene has `maxgeom` geoms.
    let geoms = unsafe { view_mut(scene.geoms, scene.maxgeom) };
    let Some(geom) = usize::try_from(len).ok().and_then(|at| geoms.get_mut(at)) else {
        return;
    };
    // SAFETY: null asks for defaults; the arrays have the lengths that MuJoCo reads.
    unsafe {
        let (none, kind) = (ptr::null(), mjGEOM_ARROW as c_int);
        (api.functions.mjv_initGeom)(geom, kind, none, none, none, colour.as_ptr());
        (api.functions.mjv_connector)(geom, kind, width, from.as_ptr(), to.as_ptr());
    }
    scene.ngeom = len + 1;
}
