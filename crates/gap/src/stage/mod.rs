//! The stages: locate (find), name, add, verify, conclude.

pub(crate) mod acceptance;
pub(crate) mod add;
pub(crate) mod bootstrap;
pub(crate) mod calibration;
pub(crate) mod conclude;
pub(crate) mod cross_fit;
pub(crate) mod decision;
pub(crate) mod doubts;
pub(crate) mod experiment_design;
pub(crate) mod locate;
pub(crate) mod name;
pub(crate) mod own_values;
pub(crate) mod regime_tree;
pub(crate) mod timing;
pub(crate) mod verify;
