//! A trial as comma-separated text, read and written. The columns are described in [the parent module](super).

mod header;
mod rows;
pub(super) mod steady;
mod write;

pub(super) use rows::read;
pub use write::write_csv;

const TIME: &str = "time";
/// Blocks of a state in the order of a full-physics vector after its time; the whole vector has its own name.
const BLOCKS: [&str; 3] = ["qpos", "qvel", "act"];
const WHOLE_STATE: &str = "state";

/// The block and the index of a state column: `qpos[3]`.
fn state_column(name: &str) -> Option<(&'static str, usize)> {
    let (block, index) = name.strip_suffix(']')?.split_once('[')?;
    let known = BLOCKS
        .iter()
        .copied()
        .chain([WHOLE_STATE])
        .find(|known| *known == block)?;
    Some((known, index.parse().ok()?))
}
