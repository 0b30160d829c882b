//! Bodies that effects act on, and their hulls.

use hydro_effects::hydrostatics::Panels;
use nalgebra::Vector3;

use super::{sizes, surroundings::Surroundings};
use crate::{
    mujoco::{
        bodies::{hull, joint_space::last_dof},
        ffi::{
            ModelView,
            bindings::{mjOBJ_BODY, mjOBJ_GEOM},
        },
    },
    plugin::{
        Bound,
        bound::{Displacing, WetBody},
    },
};

/// Part of a wave's length from which on a hull is too long for the wave to be a plane over it.
const LONG_WAVE: f64 = 0.2;

/// Sides of a panel: this part of the hull's longest.
const PANELS: usize = 16;

/// A body with no effects yet.
pub(super) fn wet_body(
    model: ModelView<'_>,
    body: usize,
    around: &Surroundings,
    density: f64,
) -> WetBody {
    let mut dofs = Vec::new();
    let mut dof = last_dof(model, body);
    while let Ok(at) = usize::try_from(dof) {
        dofs.push(at);
        dof = model.dof_parentid()[at];
    }
    dofs.reverse();
    let full_rows = dofs
        .iter()
        .enumerate()
        .all(|(above, dof)| model.M_rownnz()[*dof] as usize == above + 1);
    let (middle, extent) = sizes::bounding_box(model, body);
    let hull = sizes::body_hull(model, body, around.hull.as_deref());
    let given = around.displacement.filter(|given| given.body == body);
    let length = extent.into_iter().fold(0.0, f64::max);
    let panels = around
        .sea
        .waves
        .as_ref()
        .filter(|waves| {
            length > LONG_WAVE * waves.shortest_length() && !around.commands_before_step
        })
        .map(|_| Panels::new(&hull, PANELS));
    WetBody {
        body,
        middle,
        root: sizes::is_root(model, body),
        dofs,
        full_rows,
        extent,
        volume: around
            .given_volume(body)
            .unwrap_or_else(|| sizes::volume(model, body, density)),
        hull,
        panels,
        centre_of_buoyancy: given.and_then(|given| given.centre),
        acting: Vec::new(),
    }
}

/// What is wrong with the hull of a body that is to float.
pub(super) fn check_hull(
    model: ModelView<'_>,
    body: usize,
    around: &Surroundings,
) -> Result<(), String> {
    let name = model.label(mjOBJ_BODY as i32, "body", body);
    let named = around.hull.as_deref();
    let geoms = hull::geoms(model, sizes::welded(model, body), named);
    let label = |geom: usize| model.label(mjOBJ_GEOM as i32, "geom", geom);
    if around.given_volume(body).is_some() {
        return Ok(());
    }
    let mut closed = 0;
    for (_, geom) in &geoms {
        match hull::shape(model, *geom) {
            Ok(Some(_)) => closed += 1,
            Ok(None) => {}
            Err(fault) => {
                return Err(format!(
                    "geom `{}` of body `{name}`: {fault}; or give `volume`, and its box stands for it",
                    label(*geom)
                ));
            }
        }
    }
    if closed == 0 {
        return Err(format!(
            "body `{name}` has no geom that encloses a volume; add one (it may be invisible and collide with nothing), or give \
             the attributes `volume` and `centre_of_buoyancy`"
        ));
    }
    Ok(())
}

/// All bodies that displace water.
pub(super) fn displacing(model: ModelView<'_>, density: f64) -> Vec<Displacing> {
    (1..model.bodies())
        .filter(|body| sizes::weighs_in(model, *body))
        .map(|body| Displacing {
            body,
            mass: density * sizes::own_volume(model, body, density),
            middle: sizes::bounding_box(model, body).0,
            hull: sizes::body_hull(model, body, None),
        })
        .collect()
}

/// Bodies of the carrier's tree that displace water, where the instance has waves. Panels have the pressure of the waves with
/// that of the still water.
pub(super) fn in_waves(
    model: ModelView<'_>,
    around: &Surroundings,
    bound: &Bound,
) -> Vec<Displacing> {
    let (Some(_), Some(carrier)) = (&around.sea.waves, around.displacement) else {
        return Vec::new();
    };
    let root = model.body_rootid()[carrier.body] as usize;
    let own = |body: &usize| model.hangs_below(*body, root) && sizes::weighs_in(model, *body);
    let floating = |body: usize| {
        bound
            .bodies
            .iter()
            .find(|wet| wet.body == body && wet.floats())
    };
    (1..model.bodies())
        .filter(own)
        .filter(|body| floating(*body).is_none_or(|wet| wet.panels.is_none()))
        .map(|body| {
            let given = around.given_volume(body);
            let floats = floating(body).and_then(WetBody::buoyant_volume).or(given);
            let volume = floats.unwrap_or_else(|| sizes::own_volume(model, body, bound.density));
            Displacing {
                body,
                mass: bound.density * volume,
                middle: sizes::bounding_box(model, body).0,
                hull: sizes::body_hull(model, body, around.hull.as_deref()),
            }
        })
        .collect()
}

/// What a user should know of hulls and waves.
pub(super) fn notes(model: ModelView<'_>, around: &Surroundings, bound: &Bound) -> Vec<String> {
    let mut notes = around.notes.clone();
    for wet in bound.bodies.iter().filter(|wet| wet.floats()) {
        let name = model.label(mjOBJ_BODY as i32, "body", wet.body);
        let named = around.hull.as_deref();
        if let Some(pair) = wet.hull.overlap() {
            let geoms = sizes::solid_geoms(model, wet.body, named);
            let [one, other] = [pair.0, pair.1].map(|at| {
                let geom = geoms.get(at).copied().unwrap_or_default();
                model.label(mjOBJ_GEOM as i32, "geom", geom)
            });
            notes.push(format!(
                "geoms `{one}` and `{other}` of body `{name}` overlap, and the water that both displace counts twice; name the \
                 geoms of the hull in attribute `hull`, or give `volume`"
            ));
        }
        if let Some(centre) = wet.centre_of_buoyancy {
            let centre = Vector3::from(centre);
            if !wet
                .hull
                .solids()
                .iter()
                .any(|solid| solid.contains(&centre))
            {
                notes.push(format!(
                    "attribute `centre_of_buoyancy` is {:?}, outside the hull of body `{name}`",
                    <[f64; 3]>::from(centre)
                ));
            }
        }
        let length = wet.extent.into_iter().fold(0.0, f64::max);
        let large = around.sea.waves.as_ref();
        if let Some(note) = large.and_then(|waves| waves.large_hull(length)) {
            notes.push(format!("body `{name}`: {note}"));
        }
    }
    notes
}
