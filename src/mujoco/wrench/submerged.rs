//! How much of a body is under water, for callers outside MuJoCo: the library's function `hydro_submerged`.

use std::{
    ffi::{c_char, c_int},
    sync::atomic::{AtomicBool, Ordering},
};

use super::{
    instance_effects::{with_effects, with_sources},
    instances::{carrying_body, instances},
    memory_fit::held,
};
use crate::{
    mujoco::{
        effects::{
            source::Source,
            submersion::{SubmergedPart, submerged_part},
            surroundings::{Carrier, Surroundings},
        },
        ffi::{
            DataView,
            bindings::{mjData, mjModel, mjOBJ_BODY},
            guard,
            views::view_mut,
        },
    },
    plugin::{Bound, Settings},
};

/// True in the copy of this library that registered: the memory of instances is its own.
static ACTS: AtomicBool = AtomicBool::new(false);

/// Notes that this copy of the library registered the plugin.
pub(crate) fn set_acting() {
    ACTS.store(true, Ordering::Relaxed);
}

/// What the library's function says.
#[repr(i32)]
enum Status {
    Done = 0,
    Refused = 1,
    /// Another copy of the library acts in this process, or none does.
    Idle = 2,
    Panicked = 3,
}

/// Submerged part of a body at the pose that `d` holds (`xpos`, `xmat`): volume [m^3], part of the whole, and its centre x y z
/// [m] in the body's frame, into the five numbers at `out`.
///
/// The body carries an instance of `hydro.wrench`, or an effect of one acts on it. Returns 0; 1 where neither is so, with the
/// reason at `reason`, a C string of at most `size` bytes; 2 where this copy of the library did not register the plugin; 3 after
/// an internal fault.
///
/// # Safety
/// `m` is a model of the MuJoCo that this library registered in, and `d` a data of it that nothing else uses meanwhile; `out` has
/// room for five numbers, `reason` for `size` bytes; each may be null.
#[unsafe(no_mangle)]
#[expect(unreachable_pub, reason = "found by its name in the shared library")]
pub unsafe extern "C" fn hydro_submerged(
    m: *const mjModel,
    d: *mut mjData,
    body: c_int,
    out: *mut f64,
    reason: *mut c_char,
    size: c_int,
) -> c_int {
    guard("hydro_submerged", Status::Panicked as c_int, || {
        if !ACTS.load(Ordering::Relaxed) {
            return Status::Idle as c_int;
        }
        // SAFETY: the caller's promise.
        let found = match unsafe { DataView::from_callback(m, d) } {
            Some(mut data) => submerged(&mut data, body),
            None => Err("model or data is null".to_owned()),
        };
        match found {
            Ok(part) => {
                let [x, y, z] = part.centre;
                // SAFETY: the caller's promise.
                let out = unsafe { view_mut(out, 5) };
                for (place, value) in out.iter_mut().zip([part.volume, part.share, x, y, z]) {
                    *place = value;
                }
                Status::Done as c_int
            }
            Err(text) => {
                // SAFETY: the caller's promise; characters are bytes.
                write_text(unsafe { view_mut(reason.cast::<u8>(), size) }, &text);
                Status::Refused as c_int
            }
        }
    })
}

/// As much of a text as there is room for, and the zero that ends it.
fn write_text(room: &mut [u8], text: &str) {
    let Some(most) = room.len().checked_sub(1) else {
        return;
    };
    let end = (0..=most.min(text.len())).rfind(|at| text.is_char_boundary(*at));
    let text = &text[..end.unwrap_or(0)];
    room[..text.len()].copy_from_slice(text.as_bytes());
    room[text.len()] = 0;
}

fn submerged(data: &mut DataView<'_>, body: c_int) -> Result<SubmergedPart, String> {
    let model = data.model();
    let body = usize::try_from(body)
        .ok()
        .filter(|body| *body < model.bodies())
        .ok_or_else(|| {
            format!(
                "body {body} is not of the model, which has {}",
                model.bodies()
            )
        })?;
    let carried = instances(model).find(|id| carrying_body(model, *id) == Some(body));
    let effects = with_effects(data);
    let which = match carried {
        Some(id) => effects.iter().position(|of| of.id == id),
        None => effects.iter().position(|of| {
            let bound = of.instance.effects();
            bound.is_some_and(|bound| bound.bodies.iter().any(|wet| wet.body == body))
        }),
    };
    if let Some(which) = which {
        let around = around(effects[which].instance.settings(), carried.map(|_| body));
        return Ok(with_sources(data, &effects, |data, sources| {
            submerged_part(data, sources, which, body, &around)
        }));
    }
    let Some(id) = carried else {
        return Err(format!(
            "body `{}` carries no hydro.wrench, and no effect of one acts on it",
            model.label(mjOBJ_BODY as i32, "body", body)
        ));
    };
    // A checkpoint alone: still water with or without a surface.
    let instance = held(data, id).ok_or("the instance is broken; MuJoCo's warning says why")?;
    let bound = Bound {
        sea: instance.sea().clone(),
        ..Bound::default()
    };
    let source = Source {
        bound: &bound,
        memory: &[],
        commands_arrived: false,
    };
    let around = around(instance.settings(), Some(body));
    Ok(submerged_part(data, &[source], 0, body, &around))
}

/// What of an instance's attributes shapes the hull of a body.
fn around(settings: &Settings, carrier: Option<usize>) -> Surroundings {
    Surroundings {
        hull: settings.hull.clone(),
        carrier: carrier.map(|body| Carrier {
            body,
            volume: settings.volume,
            centre: settings.centre_of_buoyancy,
        }),
        ..Surroundings::default()
    }
}

#[cfg(test)]
mod tests {
    use super::write_text;

    #[test]
    fn a_text_ends_with_a_zero_and_whole_characters() {
        let mut room = [9; 6];
        write_text(&mut room, "m\u{b3} and more");
        assert_eq!(&room, b"m\xc2\xb3 a\0");
        let mut tight = [9; 3];
        write_text(&mut tight, "m\u{b3}");
        assert_eq!(&tight, b"m\0\x09");
        write_text(&mut [], "m");
    }
}
