//! The sensor plugin `hydro.load_cell`: a force or torque sensor that feels the water.
//!
//! | attribute | meaning | default |
//! |---|---|---|
//! | `site` | the site, as of MuJoCo's force sensor: it sits on the child body | required |
//! | `quantity` | `force` [N] or `torque` [N m] | `force` |
//! | `include` | `plugin`: what `hydro.wrench` applies; `all`: MuJoCo's own fluid and gravcomp too | `plugin` |
//!
//! MuJoCo's reading is the interaction force between the site's body and its parent, by Newton's law
//! over the subtree: inertia and gravity less the external forces. Passive forces are missing among the
//! external ones, so the wrenches w_i that the water puts on the subtree still have to come off:
//!
//! ```text
//! reading = MuJoCo's reading - sum of w_i            in the site's frame, about the site
//! ```
//!
//! which is what MuJoCo's own sensor reads where the same w_i are `xfrc_applied`.

use std::{
    ffi::{CStr, c_char, c_int, c_void},
    sync::atomic::{AtomicUsize, Ordering},
};

use nalgebra::Vector3;

use super::{
    api::Api,
    apply::{rotation, vector},
    bindings::{
        mjDSBL_GRAVITY, mjData, mjModel, mjOBJ_SENSOR, mjOBJ_SITE, mjPLUGIN_SENSOR, mjSTAGE_ACC,
        mjpPlugin, mjtNum,
    },
    boundary::guard,
    effect_forces, native,
    views::{DataView, ModelView},
    warn::warn,
    wrench,
};
use crate::plugin::native_fluid::Load;

const NAME: &CStr = c"hydro.load_cell";

const ATTRIBUTES: [&CStr; 3] = [c"site", c"quantity", c"include"];

/// Numbers of one reading.
const READING_LEN: usize = 3;

/// Which instance warned last (plus one), so that a fault is told once.
static WARNED: AtomicUsize = AtomicUsize::new(0);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    Force,
    Torque,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Include {
    Plugin,
    All,
}

/// One load cell; small enough to be `plugin_data` itself, so a copied `mjData` carries it whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct LoadCell {
    site: usize,
    quantity: Quantity,
    include: Include,
}

impl LoadCell {
    fn to_bits(self) -> usize {
        self.site << 3
            | usize::from(self.include == Include::All) << 2
            | usize::from(self.quantity == Quantity::Torque) << 1
            | 1
    }

    /// `None` for 0, a cell that was never made.
    fn from_bits(bits: usize) -> Option<Self> {
        (bits & 1 == 1).then_some(Self {
            site: bits >> 3,
            include: if bits & 4 == 0 {
                Include::Plugin
            } else {
                Include::All
            },
            quantity: if bits & 2 == 0 {
                Quantity::Force
            } else {
                Quantity::Torque
            },
        })
    }

    fn from_attributes(model: ModelView<'_>, id: usize) -> Result<Self, String> {
        let value = |name| {
            model
                .attribute(id, name)
                .map(|text| text.trim().to_owned())
                .filter(|text| !text.is_empty())
        };
        let sites = || -> String {
            let names: Vec<String> = (0..model.site_bodyid().len())
                .map(|site| model.name(mjOBJ_SITE as i32, site))
                .filter(|name| !name.is_empty())
                .collect();
            if names.is_empty() {
                "none".to_owned()
            } else {
                names.join(", ")
            }
        };
        let site = value("site").ok_or_else(|| {
            format!(
                "attribute `site` is missing; name the site of the cell. The model's sites are: {}",
                sites()
            )
        })?;
        let found = model.id(mjOBJ_SITE as i32, &site).ok_or_else(|| {
            format!(
                "attribute `site` is `{site}`; the model's sites are: {}",
                sites()
            )
        })?;
        if model.site_bodyid()[found] == 0 {
            return Err(format!(
                "attribute `site` is `{site}`, which sits on the world; a load cell measures between a body \
                 and its parent, so put the site on the body below the cell"
            ));
        }
        let quantity = match value("quantity").as_deref() {
            None | Some("force") => Quantity::Force,
            Some("torque") => Quantity::Torque,
            Some(other) => {
                return Err(format!(
                    "attribute `quantity` is `{other}`; expected `force` or `torque`"
                ));
            }
        };
        let include = match value("include").as_deref() {
            None | Some("plugin") => Include::Plugin,
            Some("all") => Include::All,
            Some(other) => {
                return Err(format!(
                    "attribute `include` is `{other}`; expected `plugin` or `all`"
                ));
            }
        };
        Ok(Self {
            site: found,
            quantity,
            include,
        })
    }
}

/// What the load cell of this instance measures: force or torque; `None` where it is no load cell.
pub(super) fn measures_force(model: ModelView<'_>, instance: usize) -> Option<bool> {
    model.attribute(instance, "include")?;
    let cell = LoadCell::from_attributes(model, instance).ok()?;
    Some(cell.quantity == Quantity::Force)
}

/// Registers the plugin, unless one of this name is there already.
pub(super) fn register(api: &'static Api) {
    // SAFETY: a static C string; null asks for no slot.
    if !unsafe { (api.functions.mjp_getPlugin)(NAME.as_ptr(), std::ptr::null_mut()) }.is_null() {
        return;
    }
    let mut names: Vec<*const c_char> = ATTRIBUTES.iter().map(|name| name.as_ptr()).collect();
    // SAFETY: all zero is a valid table (null pointers, no flags); MuJoCo fills its defaults.
    let mut table: mjpPlugin = unsafe { std::mem::zeroed() };
    // SAFETY: a table to write to.
    unsafe { (api.functions.mjp_defaultPlugin)(&mut table) };
    table.name = NAME.as_ptr();
    table.nattribute = names.len() as c_int;
    table.attributes = names.as_mut_ptr().cast();
    table.capabilityflags = mjPLUGIN_SENSOR as c_int;
    table.needstage = mjSTAGE_ACC as c_int;
    table.nstate = Some(nstate);
    table.nsensordata = Some(nsensordata);
    table.init = Some(init);
    table.reset = Some(reset);
    table.compute = Some(compute);
    // SAFETY: MuJoCo copies the table and its strings before it returns.
    unsafe { (api.functions.mjp_registerPlugin)(&table) };
}

unsafe extern "C" fn nstate(_: *const mjModel, _: c_int) -> c_int {
    0
}

unsafe extern "C" fn nsensordata(_: *const mjModel, _: c_int, _: c_int) -> c_int {
    READING_LEN as c_int
}

unsafe extern "C" fn reset(_: *const mjModel, _: *mut mjtNum, _: *mut c_void, _: c_int) {}

unsafe extern "C" fn init(m: *const mjModel, d: *mut mjData, id: c_int) -> c_int {
    guard("load cell init", -1, || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { wrench::both(m, d) }) else {
            return -1;
        };
        match LoadCell::from_attributes(data.model(), id as usize) {
            Ok(cell) => {
                data.plugin_data_mut()[id as usize] = cell.to_bits();
                0
            }
            Err(reason) => {
                let of = data.model().sensor_plugin().iter().position(|of| *of == id);
                let sensor = of
                    .map(|sensor| data.model().name(mjOBJ_SENSOR as i32, sensor))
                    .unwrap_or_default();
                let refusal = format!("plugin hydro.load_cell, sensor `{sensor}`: {reason}");
                wrench::remember_refusal(&refusal);
                warn(data.model().api(), &refusal);
                -1
            }
        }
    })
}

unsafe extern "C" fn compute(m: *const mjModel, d: *mut mjData, id: c_int, _: c_int) {
    guard("load cell compute", (), || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { wrench::both(m, d) }) else {
            return;
        };
        let cell = match LoadCell::from_bits(data.plugin_data()[id as usize]) {
            Some(cell) => cell,
            None => match LoadCell::from_attributes(data.model(), id as usize) {
                Ok(cell) => cell,
                Err(reason) => {
                    if WARNED.swap(id as usize + 1, Ordering::Relaxed) != id as usize + 1 {
                        warn(
                            data.model().api(),
                            &format!("plugin hydro.load_cell: {reason}"),
                        );
                    }
                    return;
                }
            },
        };
        let reading = cell.reading(&mut data);
        let model = data.model();
        for (sensor, of) in model.sensor_plugin().iter().enumerate() {
            if *of == id {
                let at = model.sensor_adr()[sensor] as usize;
                data.sensordata_mut()[at..at + READING_LEN].copy_from_slice(reading.as_slice());
            }
        }
    });
}

/// Force and torque in the world about a fixed point.
struct About {
    point: Vector3<f64>,
    sum: Load,
}

impl About {
    fn add(&mut self, at: Vector3<f64>, force: Vector3<f64>, torque: Vector3<f64>) {
        self.sum.force += force;
        self.sum.torque += torque + (at - self.point).cross(&force);
    }
}

impl LoadCell {
    fn reading(self, data: &mut DataView<'_>) -> Vector3<f64> {
        let model = data.model();
        let body = model.site_bodyid()[self.site] as usize;
        let root = model.body_rootid()[body] as usize;
        let point = vector(data.site_xpos(), self.site);
        let mut water = About {
            point,
            sum: Load::default(),
        };
        if !model.passive_is_off() {
            let instances: Vec<usize> = wrench::instances(model).collect();
            for instance in instances {
                let Some(now) = wrench::applied(data, instance) else {
                    continue;
                };
                if model.hangs_below(now.body, body) {
                    let world_from_base = rotation(data.xmat(), now.body);
                    let force = world_from_base * Vector3::from(now.wrench.force);
                    let torque = world_from_base * Vector3::from(now.wrench.torque);
                    water.add(vector(data.xpos(), now.body), force, torque);
                }
            }
            let carriers = wrench::with_effects(data);
            wrench::with_sources(data, &carriers, |data, sources| {
                effect_forces::on_subtree(data, sources, body, 0, |at, force, torque| {
                    water.add(at, force, torque);
                });
            });
            if self.include == Include::All {
                for link in (body..model.bodies()).filter(|link| model.hangs_below(*link, body)) {
                    add_native(data, link, &mut water);
                }
            }
        }
        // MuJoCo's own: (torque, force) about the centre of mass of the tree, in the world.
        let internal = &data.cfrc_int()[6 * body..6 * body + 6];
        let centre = vector(data.subtree_com(), root);
        let mut reading = About {
            point,
            sum: Load::default(),
        };
        reading.add(
            centre,
            Vector3::new(internal[3], internal[4], internal[5]),
            Vector3::new(internal[0], internal[1], internal[2]),
        );
        let world_from_site = rotation(data.site_xmat(), self.site);
        match self.quantity {
            Quantity::Force => world_from_site.tr_mul(&(reading.sum.force - water.sum.force)),
            Quantity::Torque => world_from_site.tr_mul(&(reading.sum.torque - water.sum.torque)),
        }
    }
}

/// What MuJoCo's fluid and gravity compensation put on one body.
fn add_native(data: &DataView<'_>, body: usize, water: &mut About) {
    let model = data.model();
    let option = &model.raw().opt;
    let mass = model.body_mass()[body];
    let compensation = model.body_gravcomp()[body];
    let gravity_is_on = option.disableflags & mjDSBL_GRAVITY as i32 == 0;
    if gravity_is_on {
        let force = -compensation * mass * Vector3::from(option.gravity);
        water.add(vector(data.xipos(), body), force, Vector3::zeros());
    }
    let wind = Vector3::from(option.wind);
    native::loads(
        data,
        body,
        |_| wind,
        |at, force, torque| {
            water.add(at, force, torque);
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_fits_into_plugin_data() {
        for site in [0, 1, 77] {
            for quantity in [Quantity::Force, Quantity::Torque] {
                for include in [Include::Plugin, Include::All] {
                    let cell = LoadCell {
                        site,
                        quantity,
                        include,
                    };
                    assert_eq!(LoadCell::from_bits(cell.to_bits()), Some(cell));
                }
            }
        }
        assert_eq!(LoadCell::from_bits(0), None);
    }
}
