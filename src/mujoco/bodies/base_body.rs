//! The base body of a compiled model, how it is held, and the joints: all that a card is tied to.

use hydro_frames as frames;
use nalgebra::{UnitQuaternion, Vector3};

use crate::mujoco::ffi::{
    ModelView,
    bindings::{mjJNT_BALL, mjJNT_FREE, mjJNT_SLIDE, mjOBJ_BODY, mjOBJ_JOINT},
};
use crate::plugin::{Base, Body, Joint, JointKind};

/// All joints of the model, in order.
pub(crate) fn joints(model: ModelView<'_>) -> Vec<Joint> {
    (0..model.jnt_type().len())
        .map(|id| Joint {
            name: model.name(mjOBJ_JOINT as i32, id),
            kind: kind(model.jnt_type()[id]),
            qpos: model.jnt_qposadr()[id] as usize,
            dof: model.jnt_dofadr()[id] as usize,
        })
        .collect()
}

fn kind(code: i32) -> JointKind {
    match code as u32 {
        code if code == mjJNT_FREE => JointKind::Free,
        code if code == mjJNT_BALL => JointKind::Ball,
        code if code == mjJNT_SLIDE => JointKind::Slide,
        _ => JointKind::Hinge,
    }
}

/// A body by its number, as a card sees it.
pub(crate) fn body(model: ModelView<'_>, id: usize) -> Body {
    let joints = joints(model);
    Body {
        name: model.name(mjOBJ_BODY as i32, id),
        base: base(model, id, &joints),
        joints,
    }
}

fn base(model: ModelView<'_>, body: usize, joints: &[Joint]) -> Base {
    // The chain of bodies from the world (left out) to the base.
    let mut chain = vec![body];
    while let Some(parent) = chain
        .last()
        .map(|last| model.body_parentid()[*last] as usize)
        && parent != 0
    {
        chain.push(parent);
    }
    chain.reverse();
    let mut attitude = UnitQuaternion::identity();
    let mut slides = Vec::new();
    for &link in &chain {
        let name = model.name(mjOBJ_BODY as i32, link);
        if model.body_mocapid()[link] >= 0 {
            return Base::Other {
                reason: format!("body `{name}` is a mocap body"),
            };
        }
        attitude *= frames::world_from_base(ModelView::quadruple(model.body_quat(), link));
        let first = model.body_jntadr()[link].max(0) as usize;
        let count = model.body_jntnum()[link] as usize;
        for (id, joint) in joints.iter().enumerate().skip(first).take(count) {
            match joint.kind {
                JointKind::Free if link == body => {
                    return Base::Free {
                        qpos: joint.qpos,
                        dof: joint.dof,
                    };
                }
                JointKind::Slide => {
                    let axis = attitude * Vector3::from(ModelView::triple(model.jnt_axis(), id));
                    slides.push((joint.dof, axis.into()));
                }
                kind => {
                    let reason = format!(
                        "joint `{}` ({kind:?}) on body `{name}` lies between it and the world",
                        joint.name
                    );
                    return Base::Other { reason };
                }
            }
        }
    }
    Base::Gantry {
        world_from_base: [attitude.w, attitude.i, attitude.j, attitude.k],
        slides,
    }
}
