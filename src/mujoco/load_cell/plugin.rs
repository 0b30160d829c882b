//! The sensor plugin `hydro.load_cell`: a force or torque sensor that feels the water.
//!
//! Its attributes: [`crate::plugin::attribute_table::LOAD_CELL`].
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

use super::cell::LoadCell;
use crate::{
    mujoco::ffi::{
        Api, DataView,
        bindings::{
            mjData, mjModel, mjOBJ_SENSOR, mjPLUGIN_SENSOR, mjSTAGE_ACC, mjpPlugin, mjtNum,
        },
        guard, last_refusal, warn,
    },
    plugin::attribute_table::LOAD_CELL,
};

const NAME: &CStr = c"hydro.load_cell";

/// Numbers of one reading.
const READING_LEN: usize = 3;

/// Which instance warned last (plus one), so that a fault is told once.
static WARNED: AtomicUsize = AtomicUsize::new(0);

/// Registers the plugin, unless one of this name is there already.
pub(crate) fn register(api: &'static Api) {
    // SAFETY: a static C string; null asks for no slot.
    if !unsafe { (api.functions.mjp_getPlugin)(NAME.as_ptr(), std::ptr::null_mut()) }.is_null() {
        return;
    }
    let mut names: Vec<*const c_char> = LOAD_CELL
        .iter()
        .map(|attribute| attribute.name.as_ptr())
        .collect();
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
        let Some(mut data) = (unsafe { DataView::from_callback(m, d) }) else {
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
                last_refusal::remember(&refusal);
                warn(data.model().api(), &refusal);
                -1
            }
        }
    })
}

unsafe extern "C" fn compute(m: *const mjModel, d: *mut mjData, id: c_int, _: c_int) {
    guard("load cell compute", (), || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { DataView::from_callback(m, d) }) else {
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
