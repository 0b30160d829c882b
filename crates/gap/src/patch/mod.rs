//! Writes effects into an MJCF: the least special form that MuJoCo has for each, else an entry of the plugin
//! `hydro.wrench`.
//!
//! | effect | form |
//! |---|---|
//! | `actuator_gain` | gain and bias; a `motor` becomes `general` |
//! | `actuator_lag` | `dyntype="filterexact" actearly="true"` |
//! | `actuator_delay` | `delay`, `nsample`, `interp="linear"` |
//! | `joint_damping` | `damping` |
//! | `joint_armature` | `armature` |
//! | `joint_stiffness` | `stiffness`, `springref` |
//! | `joint_friction` | `frictionloss`, where the excess at low speed is small |
//! | `joint_backlash` | an extra limited joint |
//! | `payload` | a body |
//! | `net_buoyancy` | `gravcomp`, where it acts at the centre of mass of a body without children and without a force sensor above it |
//! | `current` | `option wind` where MuJoCo's own fluid acts, else `current` of every `hydro.wrench` |
//! | all others | `effects` of `hydro.wrench` on the target's body; force sensors above become load cells |
//!
//! The text is changed in place, byte by byte: comments stay, and the difference to the nominal model is only what was
//! added. Included files are inlined and relative paths made absolute, so that the result loads from any folder. Effects
//! on sensors have no form in an MJCF and are skipped. Fitted values of the nominal model are written too: see
//! `nominal_values.rs`.

mod actuator;
mod body;
mod checkpoint_wrench;
mod diff;
mod error;
mod flatten;
mod fluid_coefficients;
mod force_sensors;
mod inertia;
mod instance_values;
mod joint;
mod keyframe;
mod mjcf;
mod nominal_values;
mod patched;
mod request;
mod save;
#[cfg(test)]
mod tests;
mod wrench_plugin;
mod writer;
mod xml_edit;

pub use checkpoint_wrench::{CheckpointWrench, add_checkpoint_wrench};
pub use diff::{DiffKind, DiffLine, diff, unified};
pub use error::PatchError;
pub use patched::{Patched, Renumbered, Written};
pub use request::{Names, Request};
pub use save::save;

use mjcf::Mjcf;
use writer::Writer;

/// Writes effects and values of the nominal model into its text. Nothing is written to disk.
///
/// # Errors
/// A file that cannot be read, an effect on something that the model does not name, a wrong number of
/// values.
pub fn patch(request: &Request<'_>) -> Result<Patched, PatchError> {
    let flat = flatten::flatten(request.nominal)?;
    let path = request.nominal;
    let text = flatten::absolute_paths(&flat, path)?;
    let text =
        wrench_plugin::absolute_paths(&Mjcf::parse(&text, path)?, request.search, &flat.folder);
    let mut writer = Writer::new(request, text);
    writer.check()?;
    nominal_values::write(&mut writer)?;
    for index in writer::order(request) {
        writer.native(index)?;
    }
    writer.plugin()?;
    // The result must be well-formed XML.
    Mjcf::parse(&writer.text, path)?;
    let written = request
        .entries
        .iter()
        .zip(writer.forms)
        .filter_map(|(entry, form)| {
            Some(Written {
                effect: entry.effect,
                target: entry.target.clone(),
                form: form?,
            })
        })
        .collect();
    Ok(Patched {
        xml: writer.text,
        written,
        numbers: writer.renumbered,
        remarks: writer.remarks,
    })
}
