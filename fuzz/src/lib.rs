//! What the fuzzer calls: one function a parser, each of which must refuse or accept any bytes.
//!
//! A panic, a signal, an assertion that fails, memory or time out of proportion are findings. `fuzz_targets/` hands them to
//! libFuzzer; `tests/cli/corpus.rs` of the main build compiles the same files and runs every input of `corpus/` through them.
//!
//! | module | reads |
//! |---|---|
//! | [`card`], [`weights`] | a checkpoint: `card.json`, `weights.safetensors` |
//! | [`manifest`], [`shard`] | a data set: `manifest.json`, a safetensors shard |
//! | [`csv`], [`npz`] | a trial |
//! | [`effects`], [`own_effects`] | `effects.json`, a definition in TOML |
//! | [`derivatives`] | a table of hydrodynamic derivatives |
//! | [`mjcf`], [`urdf`] | a robot: flattening and patching, links and joints |
//! | [`stages`], [`uncertainty`] | `hydro gap`: its results, `nominal.toml` |
//! | [`attributes`], [`current`], [`waves`], [`potential_flow`] | attributes of `hydro.wrench`, and the documents in them |
//! | `folder`, `robot` | a scratch folder; the model that effects and trials belong to |

#![allow(unreachable_pub, reason = "a library here, a module in tests/cli")]

pub mod attributes;
pub mod card;
pub mod csv;
pub mod current;
pub mod derivatives;
pub mod effects;
mod folder;
pub mod manifest;
pub mod mjcf;
pub mod npz;
pub mod own_effects;
pub mod potential_flow;
mod robot;
pub mod shard;
pub mod stages;
pub mod uncertainty;
pub mod urdf;
pub mod waves;
pub mod weights;

/// A target: its name, which is that of its corpus, and its function, true where the input is accepted.
pub type Target = (&'static str, fn(&[u8]) -> bool);

/// Every target.
pub const TARGETS: [Target; 17] = [
    ("attributes", attributes::read),
    ("card", card::read),
    ("csv", csv::read),
    ("current", current::read),
    ("derivatives", derivatives::read),
    ("effects", effects::read),
    ("manifest", manifest::read),
    ("mjcf", mjcf::read),
    ("npz", npz::read),
    ("own_effects", own_effects::read),
    ("potential_flow", potential_flow::read),
    ("shard", shard::read),
    ("stages", stages::read),
    ("uncertainty", uncertainty::read),
    ("urdf", urdf::read),
    ("waves", waves::read),
    ("weights", weights::read),
];

/// Checks that a refusal says something; false.
fn refused(error: &dyn std::fmt::Display) -> bool {
    assert!(
        !error.to_string().trim().is_empty(),
        "a refusal without words"
    );
    false
}
