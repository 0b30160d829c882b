//! Sizes of bodies, joints and actuators, as priors and effects need them.

use hydro_effects::{
    Target,
    card::{ActuatorScale, BodyScale, JointScale},
    hydrostatics::{Hull, Shape, Solid},
};
use nalgebra::{Isometry3, Matrix3, Vector3};

#[cfg(mujoco_outputs)]
use crate::mujoco::ffi::views::NPOLY;
use crate::{
    mujoco::{
        bodies::{
            hull,
            joint_space::{last_dof, pose},
        },
        ffi::{
            ModelView,
            bindings::{
                mjBIAS_AFFINE, mjGAIN_FIXED, mjJNT_HINGE, mjJNT_SLIDE, mjTRN_JOINT,
                mjTRN_JOINTINPARENT, mjTRN_SITE,
            },
            views::{NBIAS, NGAIN},
        },
    },
    plugin::{attributes::FRESH_WATER, native_fluid::EllipsoidCoefficients},
};

/// Density of the water that a model speaks of [kg/m^3]: `given` by the attribute of `hydro.wrench`, else that of MuJoCo's own
/// fluid, else fresh water's.
pub(crate) fn density(model: ModelView<'_>, given: Option<f64>) -> f64 {
    given.unwrap_or_else(|| match model.raw().opt.density {
        density if density > 0.0 => density,
        _ => FRESH_WATER,
    })
}

/// Pose of a body in a body above it, in the model's initial position.
pub(super) fn relative(model: ModelView<'_>, mut body: usize, above: usize) -> Isometry3<f64> {
    let mut sum = Isometry3::identity();
    while body != above && body != 0 {
        let step = pose(
            ModelView::triple(model.body_pos(), body),
            ModelView::quadruple(model.body_quat(), body),
        );
        sum = step * sum;
        body = model.body_parentid()[body] as usize;
    }
    sum
}

/// True for the first moving body of a tree.
pub(crate) fn is_root(model: ModelView<'_>, body: usize) -> bool {
    body != 0 && model.body_rootid()[body] as usize == body
}

/// Bodies that count with a body: its tree where it is the root.
pub(crate) fn with_tree(model: ModelView<'_>, body: usize) -> impl Iterator<Item = usize> {
    let root = is_root(model, body);
    (body..model.bodies())
        .filter(move |link| *link == body || (root && model.hangs_below(*link, body)))
}

/// Displaced volume [m^3]: what gravity compensation says, else that of the hull's geoms.
pub(crate) fn volume(model: ModelView<'_>, body: usize, density: f64) -> f64 {
    displaced_volume(model, density, || with_tree(model, body))
}

/// Displaced volume of a body alone [m^3].
pub(crate) fn own_volume(model: ModelView<'_>, body: usize, density: f64) -> f64 {
    displaced_volume(model, density, || std::iter::once(body))
}

fn displaced_volume<I: Iterator<Item = usize>>(
    model: ModelView<'_>,
    density: f64,
    bodies: impl Fn() -> I,
) -> f64 {
    let compensated: f64 = bodies()
        .map(|link| model.body_gravcomp()[link] * model.body_mass()[link])
        .sum();
    if compensated > 0.0 {
        return compensated / density;
    }
    hull::geoms(model, bodies(), None)
        .into_iter()
        .filter_map(|(_, geom)| Some(hull::shape_or_ellipsoid(model, geom)?.whole().volume))
        .sum()
}

/// The bodies that move as one with a body, below it.
pub(crate) fn welded(model: ModelView<'_>, body: usize) -> impl Iterator<Item = usize> {
    (body..model.bodies()).filter(move |link| {
        model.hangs_below(*link, body) && model.body_weldid()[*link] == model.body_weldid()[body]
    })
}

/// The hull of a body and what is welded to it, in its frame; `named`: of these geoms alone. The ellipsoid of its extents
/// where it has no geoms.
pub(crate) fn body_hull(model: ModelView<'_>, body: usize, named: Option<&[String]>) -> Hull {
    let geoms = hull::geoms(model, welded(model, body), named);
    let found = hull::hull(model, &geoms, |link| relative(model, link, body));
    if found.volume() > 0.0 {
        return found;
    }
    let (middle, extent) = bounding_box(model, body, named);
    let shape = Shape::Ellipsoid {
        semi_axes: extent.map(|extent| 0.5 * extent),
    };
    let place = Isometry3::translation(middle[0], middle[1], middle[2]);
    Hull::new(vec![Solid { shape, place }])
}

/// Middle [m] and extents [m] of a body and what is welded to it along its axes; of the box of the same
/// inertia where it has no geoms.
pub(crate) fn bounding_box(
    model: ModelView<'_>,
    body: usize,
    named: Option<&[String]>,
) -> ([f64; 3], [f64; 3]) {
    let (mut low, mut high) = (
        Vector3::repeat(f64::INFINITY),
        Vector3::repeat(f64::NEG_INFINITY),
    );
    for (link, geom) in hull::geoms(model, welded(model, body), named) {
        let pose = relative(model, link, body) * hull::place(model, geom);
        let rotation = pose.rotation.to_rotation_matrix();
        let box_ = &model.geom_aabb()[6 * geom..6 * geom + 6];
        let half = Vector3::new(box_[3], box_[4], box_[5]);
        let centre = pose * nalgebra::Point3::new(box_[0], box_[1], box_[2]);
        let reach = rotation.matrix().abs() * half;
        low = low.inf(&(centre.coords - reach));
        high = high.sup(&(centre.coords + reach));
    }
    if low.x.is_finite() && high.x.is_finite() {
        return ((0.5 * (high + low)).into(), (high - low).into());
    }
    let mass = model.body_mass()[body].max(f64::MIN_POSITIVE);
    let [x, y, z] = ModelView::triple(model.body_inertia(), body);
    let extent = [y + z - x, x + z - y, x + y - z].map(|sum| (6.0 * sum.max(0.0) / mass).sqrt());
    (ModelView::triple(model.body_ipos(), body), extent)
}

/// Sizes of a body; of its whole tree where it is the root. `named`: its hull is of these geoms alone.
pub(crate) fn body(
    model: ModelView<'_>,
    body: usize,
    density: f64,
    named: Option<&[String]>,
) -> BodyScale {
    let mut inertia = [0.0; 3];
    let mut mass = 0.0;
    for link in with_tree(model, body) {
        let at = relative(model, link, body)
            * pose(
                ModelView::triple(model.body_ipos(), link),
                ModelView::quadruple(model.body_iquat(), link),
            );
        let of_link = model.body_mass()[link];
        mass += of_link;
        let rotation = *at.rotation.to_rotation_matrix().matrix();
        let moments = Vector3::from(ModelView::triple(model.body_inertia(), link));
        let turned: Matrix3<f64> =
            rotation * Matrix3::from_diagonal(&moments) * rotation.transpose();
        let arm = at.translation.vector;
        for axis in 0..3 {
            let square = arm.norm_squared() - arm[axis] * arm[axis];
            inertia[axis] += turned[(axis, axis)] + of_link * square;
        }
    }
    BodyScale {
        mass,
        inertia,
        extent: bounding_box(model, body, None).1,
        volume: volume(model, body, density),
        hull_volume: body_hull(model, body, named).volume(),
        buoyancy_left_out: 0.0,
        density,
        gravity: Vector3::from(model.raw().opt.gravity).norm(),
        speed: 0.0,
        rate: 0.0,
    }
}

/// Sizes of a hinge or slide.
pub(crate) fn joint(model: ModelView<'_>, joint: usize) -> JointScale {
    let dof = model.jnt_dofadr()[joint] as usize;
    let body = model.jnt_bodyid()[joint] as usize;
    let slides = model.jnt_type()[joint] as u32 == mjJNT_SLIDE;
    // Weight at the lever of everything below, along an axis that stands still in the world or may point anywhere.
    let anchor = Vector3::from(ModelView::triple(model.jnt_pos(), joint));
    let axis = Vector3::from(ModelView::triple(model.jnt_axis(), joint));
    let gravity = Vector3::from(model.raw().opt.gravity);
    let gravity = match has_fixed_axis(model, joint) {
        true => {
            let along = relative(model, body, 0).rotation * axis;
            match slides {
                true => gravity.dot(&along).abs(),
                false => gravity.cross(&along).norm(),
            }
        }
        false => gravity.norm(),
    };
    let mut moment = Vector3::zeros();
    for link in (body..model.bodies()).filter(|link| model.hangs_below(*link, body)) {
        let centre = relative(model, link, body)
            * nalgebra::Point3::from(Vector3::from(ModelView::triple(model.body_ipos(), link)));
        moment += model.body_mass()[link] * (centre.coords - anchor);
    }
    let weight = gravity
        * if slides {
            model.body_subtreemass()[body]
        } else {
            (moment - axis * axis.dot(&moment)).norm()
        };
    let drives: Vec<usize> = drives(model, joint).collect();
    let largest = drives.iter().filter_map(|id| largest_force(model, *id));
    let largest = largest.fold(0.0, f64::max);
    JointScale {
        inertia: model.dof_M0()[dof],
        armature: model.dof_armature()[dof],
        torque: if largest > 0.0 { largest } else { weight },
        damping: model.dof_damping()[dof]
            + drives
                .iter()
                .map(|id| servo_damping(model, *id))
                .sum::<f64>(),
        speed: 0.0,
        travel: 0.0,
        middle: 0.0,
        slides,
        driven: !drives.is_empty(),
    }
}

/// Actuators that drive a joint.
fn drives(model: ModelView<'_>, joint: usize) -> impl Iterator<Item = usize> {
    (0..model.actuator_trntype().len()).filter(move |id| {
        let kind = model.actuator_trntype()[*id] as u32;
        (kind == mjTRN_JOINT || kind == mjTRN_JOINTINPARENT)
            && model.actuator_trnid()[2 * id] as usize == joint
    })
}

/// The commands that push a joint in proportion: index in `ctrl` and force a unit of command [N m or N].
pub(crate) fn pushes(model: ModelView<'_>, joint: usize) -> Vec<(usize, f64)> {
    let pushes = drives(model, joint).filter_map(|id| {
        let control = address(model, id)?.control;
        Some((control, force_per_command(model, id)?))
    });
    pushes.collect()
}

/// An element of the model that an effect can act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    Body(usize),
    Joint(usize),
    Actuator(usize),
}

impl Found {
    /// Its sizes; `named`: a body's hull is of these geoms alone.
    pub(crate) fn sizes(
        self,
        model: ModelView<'_>,
        density: f64,
        named: Option<&[String]>,
    ) -> Target {
        match self {
            Self::Body(id) => Target::Body(body(model, id, density, named)),
            Self::Joint(id) => Target::Joint(joint(model, id)),
            Self::Actuator(id) => Target::Actuator(actuator(model, id)),
        }
    }
}

/// True for a joint of one degree of freedom.
pub(crate) fn is_scalar(model: ModelView<'_>, joint: usize) -> bool {
    let kind = model.jnt_type()[joint] as u32;
    kind == mjJNT_SLIDE || kind == mjJNT_HINGE
}

/// Terms of a joint's stiffness, the linear one first.
pub(crate) fn stiffness(model: ModelView<'_>, joint: usize) -> Vec<f64> {
    let mut terms = vec![model.jnt_stiffness()[joint]];
    #[cfg(mujoco_outputs)]
    terms.extend(&model.jnt_stiffnesspoly()[NPOLY * joint..NPOLY * (joint + 1)]);
    terms
}

/// True for a joint whose axis keeps its direction in the world: between it and the world there are slides alone.
fn has_fixed_axis(model: ModelView<'_>, joint: usize) -> bool {
    let body = model.jnt_bodyid()[joint] as usize;
    let parent = model.body_parentid()[body] as usize;
    let before = (0..joint).filter(|other| model.jnt_bodyid()[*other] as usize == body);
    let slides = |other: usize| model.jnt_type()[other] as u32 == mjJNT_SLIDE;
    model.body_weldid()[parent] == 0 && before.into_iter().all(slides)
}

/// Viscous damping that an actuator puts on its joint, as a servo does.
fn servo_damping(model: ModelView<'_>, id: usize) -> f64 {
    let is_affine = model.actuator_biastype()[id] as u32 == mjBIAS_AFFINE;
    let gear = model.actuator_gear()[6 * id];
    match is_affine {
        true => (-model.actuator_biasprm()[NBIAS * id + 2]).max(0.0) * gear * gear,
        false => 0.0,
    }
}

/// The largest force on a joint that an actuator's limits allow.
fn largest_force(model: ModelView<'_>, id: usize) -> Option<f64> {
    let address = address(model, id)?;
    let raw = model.raw();
    let gear = model.actuator_gear()[6 * address.output].abs();
    // SAFETY: one flag a control, and one an actuator.
    let (control_is_limited, force_is_limited) = unsafe {
        (
            ModelView::flag(raw.actuator_ctrllimited, address.control),
            ModelView::flag(raw.actuator_forcelimited, id),
        )
    };
    let largest = |range: &[f64]| range[0].abs().max(range[1].abs());
    if force_is_limited {
        return Some(gear * largest(&model.actuator_forcerange()[2 * id..2 * id + 2]));
    }
    let at = 2 * address.control;
    force_per_command(model, id)
        .filter(|_| control_is_limited)
        .map(|force| force * largest(&model.actuator_ctrlrange()[at..at + 2]))
}

/// Size of the force on a joint a unit of command, of an actuator whose force is in proportion to it.
fn force_per_command(model: ModelView<'_>, id: usize) -> Option<f64> {
    let gear = model.actuator_gear()[6 * address(model, id)?.output].abs();
    let fixed = model.actuator_gaintype()[id] as u32 == mjGAIN_FIXED
        && model.actuator_biastype()[id] as u32 != mjBIAS_AFFINE;
    fixed.then(|| gear * model.actuator_gainprm()[NGAIN * id].abs())
}

/// Sizes of an actuator. Its largest command is the limit of its control; where there is none, larger
/// than any.
fn actuator(model: ModelView<'_>, id: usize) -> ActuatorScale {
    const UNLIMITED: f64 = 1e6;
    let limit = address(model, id).and_then(|address| {
        // SAFETY: one flag a control.
        let limited = unsafe { ModelView::flag(model.raw().actuator_ctrllimited, address.control) };
        let range = &model.actuator_ctrlrange()[2 * address.control..][..2];
        limited.then(|| range[0].abs().max(range[1].abs()))
    });
    ActuatorScale {
        command: limit.unwrap_or(UNLIMITED),
        inflow: 0.0,
        step: model.raw().opt.timestep,
        thrusts: thrust(model, id).is_some(),
    }
}

/// Index of the single control and of the single output of an actuator.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Address {
    pub(crate) control: usize,
    pub(crate) output: usize,
}

/// `None` for an actuator with several controls or outputs.
pub(crate) fn address(model: ModelView<'_>, id: usize) -> Option<Address> {
    #[cfg(mujoco_outputs)]
    {
        let raw = model.raw();
        // SAFETY: one number an actuator in each array.
        let row = unsafe {
            [
                *raw.actuator_ctrlnum.add(id),
                *raw.actuator_outnum.add(id),
                *raw.actuator_ctrladr.add(id),
                *raw.actuator_outadr.add(id),
            ]
        };
        (row[0] == 1 && row[1] == 1).then_some(Address {
            control: row[2] as usize,
            output: row[3] as usize,
        })
    }
    #[cfg(not(mujoco_outputs))]
    {
        (id < model.actuator_trntype().len()).then_some(Address {
            control: id,
            output: id,
        })
    }
}

/// The site that an actuator pushes at, and the direction there, where it does.
pub(crate) fn thrust(model: ModelView<'_>, id: usize) -> Option<(usize, [f64; 3])> {
    let address = address(model, id)?;
    let gear = &model.actuator_gear()[6 * address.output..6 * address.output + 3];
    let direction = Vector3::new(gear[0], gear[1], gear[2]);
    let pushes = model.actuator_trntype()[id] as u32 == mjTRN_SITE && direction.norm() > 0.0;
    pushes.then(|| {
        let site = model.actuator_trnid()[2 * id] as usize;
        (site, direction.normalize().into())
    })
}

/// True where MuJoCo's ellipsoid fluid acts on a geom.
pub(crate) fn is_ellipsoid(model: ModelView<'_>, geom: usize) -> bool {
    model.geom_fluid()[EllipsoidCoefficients::LEN * geom] > 0.0
}

/// A body weighs in its tree from this part of the tree's mass on.
pub(crate) const WEIGHTY: f64 = 0.02;

/// A body's inertia is uncertain from this part of the tree's mass on: three per cent of a light shank bend a
/// stiff servo by more than its encoder's noise. Whether data see it is theirs to say.
const LIGHT: f64 = 0.001;

/// True where a body has more than [`WEIGHTY`] of its tree's mass.
pub(crate) fn weighs_in(model: ModelView<'_>, body: usize) -> bool {
    has_part(model, body, WEIGHTY)
}

/// True where a moving body's inertia is worth doubting.
pub(crate) fn has_inertia(model: ModelView<'_>, body: usize) -> bool {
    has_part(model, body, LIGHT)
}

fn has_part(model: ModelView<'_>, body: usize, part: f64) -> bool {
    let root = model.body_rootid()[body] as usize;
    body != 0
        && last_dof(model, body) >= 0
        && model.body_mass()[body] > part * model.body_subtreemass()[root]
}
