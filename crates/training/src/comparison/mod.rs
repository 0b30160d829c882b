//! The learned wrench beside its rivals: in open loop on recorded inputs, and in closed loop, where
//! the wrench changes the motion that it sees.

pub mod bounded;
pub mod closed_loop;
pub mod open_loop;
pub mod step_time;
pub mod summary;

pub use bounded::{BOUND, Bounds, Peak, Ratios, bounds, within};
pub use closed_loop::{ClosedLoop, Contender, ORACLE, Spread, Water, closed_loop};
pub use open_loop::{OpenLoop, OpenLoopRow, open_loop};
pub use step_time::step_times;
pub use summary::{LongRun, StepTime, Summary};
