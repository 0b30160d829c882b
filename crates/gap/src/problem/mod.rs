pub(crate) mod candidates;
pub(crate) mod channels;
pub(crate) mod problem;
pub(crate) mod segments;
pub(crate) mod sensor_noise;
pub(crate) mod typical;
pub(crate) mod uncertainty;
