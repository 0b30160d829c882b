//! The identification problem: channels, sensor noise, segments, candidate effects, uncertainty of the nominal.

pub(crate) mod candidates;
pub(crate) mod channels;
pub(crate) mod command_noise;
pub(crate) mod outliers;
pub(crate) mod point;
pub(crate) mod prescribed;
#[expect(clippy::module_inception)]
pub(crate) mod problem;
pub(crate) mod segments;
pub(crate) mod sensor_noise;
pub(crate) mod typical;
pub(crate) mod uncertainty;
