//! Trials: what is read, what is said of it, what is refused, and the exchange with `mujoco.sysid`.

mod csv;
mod exchange;
mod files;
mod fixture;
mod npz;
mod prescribed;
mod random;
