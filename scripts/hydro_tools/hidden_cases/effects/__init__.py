"""The hidden effects: one family a file. Their forms differ from any catalogue's in detail, on purpose."""

from .base import AXES, Effect, Readings

#: The ids of the contract, in its order.
IDS = (
    "added_mass",
    "linear_drag",
    "quadratic_drag",
    "cross_flow_drag",
    "current",
    "munk_moment",
    "lift",
    "net_buoyancy",
    "buoyancy_offset",
    "payload",
    "wake_memory",
    "basset_history",
    "free_surface",
    "wall_proximity",
    "waves",
    "actuator_gain",
    "actuator_deadband",
    "actuator_lag",
    "actuator_delay",
    "inflow_thrust_loss",
    "joint_friction",
    "joint_damping",
    "joint_armature",
    "joint_stiffness",
    "joint_backlash",
    "sensor_bias",
    "sensor_delay",
    "sensor_scale",
    "constant_force",
)

__all__ = ["AXES", "IDS", "Effect", "Readings"]
