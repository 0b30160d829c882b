//! Bodies that effects act on, and their hulls.

use hydro_effects::{Id, hydrostatics::Panels};
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
    let named = around.hull.as_deref();
    let (middle, extent) = sizes::bounding_box(model, body, named);
    let hull = sizes::body_hull(model, body, named);
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
        panels: None,
        in_waves: false,
        centre_of_buoyancy: around.given_centre(body),
        acting: Vec::new(),
        potential_flow: None,
    }
}

/// The surface of a floating hull in triangles, where the instance has waves that are too short to be planes over it.
pub(super) fn panels(around: &Surroundings, wet: &WetBody) -> Option<Panels> {
    let waves = around.sea.waves.as_ref().filter(|_| wet.in_waves)?;
    let is_short = wet.length() > LONG_WAVE * waves.shortest_length();
    is_short.then(|| Panels::new(&wet.hull, PANELS))
}

/// Refusal of a body that is to float and has no hull for it.
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
    if closed == 0 && named.is_some() {
        return Err(format!(
            "attribute `hull` names no geom of body `{name}` that encloses a volume; add one, or give the body an instance of \
             its own"
        ));
    }
    if closed == 0 {
        return Err(format!(
            "body `{name}` has no geom that encloses a volume; add one (it may be invisible and collide with nothing), or give \
             the attributes `volume` and `centre_of_buoyancy`"
        ));
    }
    Ok(())
}

/// Part of the smaller of two hulls that they may share before it is said.
const MOST_SHARED: f64 = 0.1;

/// Notes for the user on hulls that a floating body shares with the nearest floating one above it: what is in both is lifted twice.
pub(crate) fn shared_hulls(model: ModelView<'_>, bound: &Bound) -> Vec<String> {
    let by_hull = |wet: &&WetBody| {
        wet.displaced()
            .is_some_and(|volume| volume == wet.hull.volume())
    };
    let floating: Vec<&WetBody> = bound.bodies.iter().filter(by_hull).collect();
    let name = |body: usize| model.label(mjOBJ_BODY as i32, "body", body);
    let welded = |wet: &WetBody| model.body_weldid()[wet.body];
    let above = |of: &WetBody| {
        let mut body = of.body;
        while body != 0 {
            body = model.body_parentid()[body] as usize;
            if let Some(found) = floating.iter().find(|wet| wet.body == body) {
                return Some(*found);
            }
        }
        None
    };
    let pairs = floating
        .iter()
        .filter_map(|below| Some((above(below)?, *below)));
    // Two buoyancies of what is welded together are told as such.
    pairs
        .filter(|(above, below)| welded(above) != welded(below))
        .filter_map(|(above, below)| {
            let place = sizes::relative(model, below.body, above.body);
            let shared = above.hull.shares(&below.hull, &place);
            let part = shared / above.hull.volume().min(below.hull.volume());
            (part > MOST_SHARED).then(|| {
                format!(
                    "hulls of bodies `{}` and `{}` share {} L in the initial position, {:.0} % of the smaller, and both are lifted \
                     for it; name geoms that do not overlap in attribute `hull`, or give hydrostatics the `volume` of each",
                    name(above.body),
                    name(below.body),
                    hydro_files::rounded(1e3 * shared),
                    100.0 * part
                )
            })
        })
        .collect()
}

/// All bodies that displace water.
pub(super) fn displacing(model: ModelView<'_>, density: f64) -> Vec<Displacing> {
    (1..model.bodies())
        .filter(|body| sizes::weighs_in(model, *body))
        .map(|body| Displacing {
            body,
            mass: density * sizes::own_volume(model, body, density),
            middle: sizes::bounding_box(model, body, None).0,
            centre: None,
            hull: sizes::body_hull(model, body, None),
        })
        .collect()
}

/// Bodies that displace water in the waves of an instance, that are its own, and that no hydrostatics floats.
pub(super) fn in_waves(
    model: ModelView<'_>,
    around: &Surroundings,
    bound: &Bound,
) -> Vec<Displacing> {
    if !around.moves_in_waves() {
        return Vec::new();
    }
    let named = around.hull.as_deref();
    let floats = |body: usize| {
        let pushed = |wet: &&WetBody| wet.floats() || wet.is_excited();
        let floating = bound.bodies.iter().filter(pushed);
        floating
            .map(|wet| model.body_weldid()[wet.body])
            .any(|welded| welded == model.body_weldid()[body])
    };
    (1..model.bodies())
        .filter(|body| is_own(model, around, *body) && sizes::weighs_in(model, *body))
        .filter(|body| !floats(*body))
        .filter(|body| !hull::geoms(model, std::iter::once(*body), named).is_empty())
        .map(|body| {
            let given = around.given_volume(body);
            let volume = given.unwrap_or_else(|| sizes::own_volume(model, body, bound.density));
            Displacing {
                body,
                mass: bound.density * volume,
                middle: sizes::bounding_box(model, body, named).0,
                centre: around.given_centre(body),
                hull: sizes::body_hull(model, body, named),
            }
        })
        .collect()
}

/// True where the water of an instance is that of a body: the nearest body at or above it that carries one carries this one;
/// above all of them it is the first one's of the tree.
fn is_own(model: ModelView<'_>, around: &Surroundings, body: usize) -> bool {
    let Some(carrier) = around.carrier.map(|given| given.body) else {
        return false;
    };
    let root = model.body_rootid()[carrier];
    let slot = |body: usize| {
        let instance = usize::try_from(model.body_plugin()[body]).ok()?;
        model.plugin().get(instance).copied()
    };
    let carries = |body: usize| slot(body).is_some() && slot(body) == slot(carrier);
    let mut at = body;
    while at != 0 {
        if carries(at) {
            return at == carrier;
        }
        at = model.body_parentid()[at] as usize;
    }
    let first = (1..model.bodies()).find(|of| model.body_rootid()[*of] == root && carries(*of));
    model.body_rootid()[body] == root && first == Some(carrier)
}

/// Notes for the user on hulls and waves.
pub(super) fn notes(model: ModelView<'_>, around: &Surroundings, bound: &Bound) -> Vec<String> {
    let mut notes = around.notes.clone();
    for wet in bound.bodies.iter().filter(|wet| wet.floats()) {
        let name = model.label(mjOBJ_BODY as i32, "body", wet.body);
        if wet.panels.is_some() && wet.hull.overlaps() {
            notes.push(format!(
                "geoms of body `{name}` overlap, and in waves as short as these the pressure on what they share counts twice; \
                 name geoms that do not in attribute `hull`"
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
        if model.body_gravcomp()[wet.body] != 0.0 {
            notes.push(format!(
                "body `{name}` has `gravcomp` and the effect `hydrostatics`: two buoyancies; take one away"
            ));
        }
        if let Some(other) = second_buoyancy(model, bound, wet) {
            notes.push(format!(
                "body `{name}` floats by the effect `hydrostatics` and has `{other}` too, on it or on what is welded to it: two \
                 buoyancies; take one away"
            ));
        }
        let waves = around.sea.waves.as_ref().filter(|_| !wet.is_excited());
        if let Some(note) = waves.and_then(|waves| waves.large_hull(wet.length())) {
            notes.push(format!("body `{name}`: {note}"));
        }
    }
    let carrier = around.carrier.filter(|given| {
        given.is_something()
            && !bound
                .bodies
                .iter()
                .any(|wet| wet.body == given.body && wet.floats())
    });
    if let Some(given) = carrier {
        notes.push(format!(
            "attributes `volume` and `centre_of_buoyancy` act by the effect `hydrostatics`, which body `{}` has not",
            model.label(mjOBJ_BODY as i32, "body", given.body)
        ));
    }
    notes
}

/// Effect that lifts a floating body a second time: a net buoyancy on it, or the hydrostatics of what is welded to it.
fn second_buoyancy(model: ModelView<'_>, bound: &Bound, wet: &WetBody) -> Option<Id> {
    if wet.has(Id::NetBuoyancy) {
        return Some(Id::NetBuoyancy);
    }
    let welded = |other: &WetBody| model.body_weldid()[other.body] == model.body_weldid()[wet.body];
    let mut others = bound.bodies.iter().filter(|other| other.body != wet.body);
    others
        .any(|other| welded(other) && other.floats())
        .then_some(Id::Hydrostatics)
}
