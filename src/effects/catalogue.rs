//! Which code stands behind which name.
use super::{Effect, Id};
/// The effect of that name.
pub fn effect(_id: Id) -> &'static dyn Effect {
    unimplemented!()
}
