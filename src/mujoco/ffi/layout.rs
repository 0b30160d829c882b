//! Whether the running MuJoCo lays out its structs as the headers of this build say.
//!
//! Versions whose headers are equal share a build ([`super::api`]). This probe guards that table: a small model is compiled from
//! a text, and what the text says, or what MuJoCo's functions answer, must be what the bound structs hold. Counts and options
//! are read first; an array is read only where its pointer lies in the struct's buffer.

use std::{
    ffi::{CStr, c_char},
    fmt,
    ops::Range,
    ptr,
};

use super::bindings::{Functions, mjData, mjModel, mjSTATE_QVEL, mjSTATE_TIME, mjtNum};

/// All numbers have few binary digits, so that they are equal to the last bit.
const SCENE: &CStr = c"<mujoco>
  <option timestep='0.00390625' gravity='0 0 -3.5' density='0.125' viscosity='0.0625' wind='0.25 0 0'/>
  <worldbody>
    <body name='hull' pos='1 2 4'>
      <freejoint/>
      <inertial mass='1.5' pos='0 0 0' diaginertia='1 1 1'/>
      <geom size='0.5'/>
      <site name='eye' pos='0 0.5 0'/>
      <body name='fin' pos='0.5 0 0'>
        <joint name='fin' axis='0 0 1' damping='0.25'/>
        <inertial mass='0.75' pos='0.25 0 0' diaginertia='1 1 1'/>
        <geom size='0.125' pos='0.25 0 0'/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint='fin'/></actuator>
  <sensor><jointvel joint='fin'/></sensor>
</mujoco>";

/// Degree of freedom of the fin's joint, and its velocity [rad/s].
const FIN: (usize, f64) = (6, 0.5);

/// A field that does not hold what it should.
#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
    field: &'static str,
    found: f64,
    expected: f64,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            field,
            found,
            expected,
        } = self;
        write!(f, "`{field}` reads {found}, expected {expected}")
    }
}

/// Compiles the scene and compares; `Err` names the first field that is elsewhere.
pub(super) fn probe(mujoco: &Functions) -> Result<(), Mismatch> {
    let mut error: [c_char; 256] = [0; 256];
    // SAFETY: C strings; null stands for no file system; what was made is deleted once, whatever was found.
    unsafe {
        let (text, room) = (SCENE.as_ptr(), error.len() as i32);
        let spec = (mujoco.mj_parseXMLString)(text, ptr::null(), error.as_mut_ptr(), room);
        expect("mjSpec", f64::from(u8::from(!spec.is_null())), 1.0)?;
        let model = (mujoco.mj_compile)(spec, ptr::null());
        (mujoco.mj_deleteSpec)(spec);
        let Some(of) = model.as_ref() else {
            return expect("mjModel", 0.0, 1.0);
        };
        let mut found = counts_and_options(of).and_then(|()| arrays_of_model(of));
        if found.is_ok() {
            let data = (mujoco.mj_makeData)(model);
            found = match data.is_null() {
                true => expect("mjData", 0.0, 1.0),
                false => simulation(mujoco, model, data),
            };
            (mujoco.mj_deleteData)(data);
        }
        (mujoco.mj_deleteModel)(model);
        found
    }
}

fn expect(field: &'static str, found: f64, expected: f64) -> Result<(), Mismatch> {
    if found.to_bits() == expected.to_bits() {
        return Ok(());
    }
    Err(Mismatch {
        field,
        found,
        expected,
    })
}

#[allow(
    clippy::unnecessary_cast,
    reason = "counts are 32 or 64 bits by release"
)]
fn counts_and_options(of: &mjModel) -> Result<(), Mismatch> {
    expect("nq", of.nq as f64, 8.0)?;
    expect("nv", of.nv as f64, 7.0)?;
    expect("nu", of.nu as f64, 1.0)?;
    expect("nbody", of.nbody as f64, 3.0)?;
    expect("njnt", of.njnt as f64, 2.0)?;
    expect("ngeom", of.ngeom as f64, 2.0)?;
    expect("nsite", of.nsite as f64, 1.0)?;
    expect("nsensor", of.nsensor as f64, 1.0)?;
    expect("nsensordata", of.nsensordata as f64, 1.0)?;
    expect("nplugin", of.nplugin as f64, 0.0)?;
    expect("opt.timestep", of.opt.timestep, 0.003_906_25)?;
    expect("opt.gravity", of.opt.gravity[2], -3.5)?;
    expect("opt.wind", of.opt.wind[0], 0.25)?;
    expect("opt.density", of.opt.density, 0.125)?;
    expect("opt.viscosity", of.opt.viscosity, 0.0625)
}

/// # Safety
/// The counts of the model are right.
unsafe fn arrays_of_model(of: &mjModel) -> Result<(), Mismatch> {
    let inside = buffer(of.buffer.cast(), i128::from(of.nbuffer));
    // SAFETY: `entry` reads inside the model's buffer alone, and the counts of the text are larger than the indices.
    unsafe {
        expect("body_mass", entry(&inside, of.body_mass, 2), 0.75)?;
        expect(
            "body_parentid",
            f64::from(entry(&inside, of.body_parentid, 2)),
            1.0,
        )?;
        expect(
            "body_rootid",
            f64::from(entry(&inside, of.body_rootid, 2)),
            1.0,
        )?;
        expect("body_pos", entry(&inside, of.body_pos, 3 * 2), 0.5)?;
        expect(
            "body_plugin",
            f64::from(entry(&inside, of.body_plugin, 1)),
            -1.0,
        )?;
        expect(
            "jnt_qposadr",
            f64::from(entry(&inside, of.jnt_qposadr, 1)),
            7.0,
        )?;
        expect(
            "dof_parentid",
            f64::from(entry(&inside, of.dof_parentid, 6)),
            5.0,
        )?;
        expect("geom_size", entry(&inside, of.geom_size, 3), 0.125)?;
        expect("site_pos", entry(&inside, of.site_pos, 1), 0.5)?;
        expect(
            "sensor_adr",
            f64::from(entry(&inside, of.sensor_adr, 0)),
            0.0,
        )
    }
}

/// # Safety
/// Both are live, and the model's layout is right.
unsafe fn simulation(
    mujoco: &Functions,
    model: *mut mjModel,
    data: *mut mjData,
) -> Result<(), Mismatch> {
    // SAFETY: the data is live; `entry` reads inside its buffer alone, and `state` has room for what is asked for.
    unsafe {
        let inside = |of: &mjData| buffer(of.buffer.cast(), i128::from(of.nbuffer));
        let (dof, velocity) = FIN;
        let mut state: [mjtNum; 7] = [0.0; 7];
        state[dof] = velocity;
        (mujoco.mj_setState)(model, data, state.as_ptr(), mjSTATE_QVEL as _);
        (mujoco.mj_forward)(model, data);
        let of = &*data;
        let at = inside(of);
        expect("qvel", entry(&at, of.qvel, dof), velocity)?;
        expect("qpos", entry(&at, of.qpos, 2), 4.0)?;
        expect("xpos", entry(&at, of.xpos, 3 * 2), 1.5)?;
        expect("xmat", entry(&at, of.xmat, 9 * 2), 1.0)?;
        expect("xipos", entry(&at, of.xipos, 3 * 2), 1.75)?;
        expect("site_xpos", entry(&at, of.site_xpos, 1), 2.5)?;
        expect("geom_xpos", entry(&at, of.geom_xpos, 3), 1.75)?;
        expect("sensordata", entry(&at, of.sensordata, 0), velocity)?;
        let damper = entry(&at, of.qfrc_damper, dof);
        let fluid = entry(&at, of.qfrc_fluid, dof);
        expect("qfrc_damper", damper, -0.25 * velocity)?;
        expect(
            "qfrc_passive",
            entry(&at, of.qfrc_passive, dof),
            damper + fluid,
        )?;
        (mujoco.mj_step)(model, data);
        let mut time: mjtNum = 0.0;
        (mujoco.mj_getState)(model, data, &mut time, mjSTATE_TIME as _);
        let of = &*data;
        expect("time", of.time, time)?;
        expect("time", of.time, (*model).opt.timestep)
    }
}

/// Addresses of a buffer; empty where its size makes no sense.
fn buffer(start: *const u8, bytes: i128) -> Range<usize> {
    let start = start as usize;
    let bytes = usize::try_from(bytes).unwrap_or(0);
    start..start.saturating_add(bytes)
}

/// A number of an array; the type's zero, which no field here may hold by chance, where it is not inside the buffer.
///
/// # Safety
/// The buffer is readable.
unsafe fn entry<T: Copy + Default>(inside: &Range<usize>, array: *const T, index: usize) -> T {
    let at = (array as usize).saturating_add(index * size_of::<T>());
    let aligned = (array as usize).is_multiple_of(align_of::<T>());
    if !aligned || at < inside.start || at.saturating_add(size_of::<T>()) > inside.end {
        return T::default();
    }
    // SAFETY: inside the buffer, and aligned.
    unsafe { *array.add(index) }
}

#[cfg(test)]
mod tests {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};

    use super::*;
    use crate::mujoco::ffi::Api;

    #[test]
    fn the_mujoco_of_the_headers_passes() {
        let api = Api::running_or_opened().expect("a MuJoCo");
        assert_eq!(probe(&api.functions), Ok(()));
    }

    /// The release that scripts/test.sh fetches, whose layout is another.
    #[test]
    fn another_layout_is_told_and_not_read_wildly() {
        let Some(wheel) = std::env::var_os("HYDRO_TEST_OTHER_WHEEL") else {
            return;
        };
        let folder = std::path::Path::new(&wheel).join("mujoco");
        let mut files = std::fs::read_dir(folder)
            .expect("the other wheel")
            .flatten();
        let file = files.find(|file| {
            let name = file.file_name();
            name.to_string_lossy().starts_with("libmujoco.so")
        });
        let path = file.expect("its libmujoco").path();
        // SAFETY: MuJoCo's initialisers have no preconditions.
        let functions = unsafe {
            let library = Library::open(Some(&path), RTLD_NOW | RTLD_LOCAL);
            Functions::from_library(library.expect("it opens"))
        };
        let functions = functions.expect("the functions of the table");
        let told = probe(&functions).expect_err("a mismatch").to_string();
        assert!(
            told.contains(" reads ") && told.contains(", expected "),
            "{told}"
        );
    }

    #[test]
    fn what_lies_outside_the_buffer_is_not_read() {
        let numbers = [3.0, 5.0];
        let whole = buffer(numbers.as_ptr().cast(), 16);
        // SAFETY: the buffer is that of the numbers.
        unsafe {
            assert_eq!(expect("x", entry(&whole, numbers.as_ptr(), 1), 5.0), Ok(()));
            assert_eq!(entry(&whole, numbers.as_ptr(), 2).to_bits(), 0);
            assert_eq!(entry(&whole, ptr::null::<f64>(), 1).to_bits(), 0);
            assert_eq!(
                entry(&buffer(numbers.as_ptr().cast(), -1), numbers.as_ptr(), 0).to_bits(),
                0
            );
        }
        let told = expect("nq", 9.0, 8.0).map_err(|mismatch| mismatch.to_string());
        assert_eq!(told, Err("`nq` reads 9, expected 8".to_owned()));
    }
}
