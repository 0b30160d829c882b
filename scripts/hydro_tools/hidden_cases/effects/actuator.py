"""Actuator effects: changes between the logged command and the force."""

import numpy as np

from ..frames import cross
from .base import Effect


class ActuatorGain(Effect):
    """A force off by a factor: both gain and bias of the actuator. `gain` is the factor."""

    kind = "actuator_gain"
    most = 8.0

    def __init__(self, target: str, actuators: list[int], change: float):
        super().__init__(target, {"gain": (1.0 + change, "1")})
        self.actuators, self.change = actuators, change
        self.most = 0.7 / abs(change)

    def scaled_parameters(self, factor):
        return {"gain": (1.0 + self.change * factor, "1")}

    def begin(self, plant):
        gain = plant.batch.expand("actuator_gainprm")
        bias = plant.batch.expand("actuator_biasprm")
        factor = 1 + np.broadcast_to(self.scale, (plant.members, 1)) * self.change
        for actuator in self.actuators:
            gain[:, actuator] *= factor
            bias[:, actuator] *= factor


class ActuatorDeadband(Effect):
    """Small commands do nothing; the corners are rounded over a tenth of the width."""

    kind = "actuator_deadband"

    def __init__(self, target: str, actuators: list[int], width: float):
        super().__init__(target, {"width": (width, "ctrl")})
        self.actuators, self.width = actuators, width
        self.most = 0.45 / width

    def command(self, plant, asked):
        out = asked.copy()
        u = asked[:, self.actuators]
        width = self.scale * self.width
        soft = 0.1 * width + 1e-9
        beyond = soft * np.logaddexp(0.0, (np.abs(u) - width) / soft)
        start = soft * np.logaddexp(0.0, -width / soft)
        out[:, self.actuators] = np.sign(u) * np.maximum(beyond - start, 0.0)
        return out


class ActuatorLag(Effect):
    """Two equal poles whose delays add up to the time constant of a first-order lag."""

    kind = "actuator_lag"

    def __init__(self, target: str, actuators: list[int], time_constant: float):
        super().__init__(target, {"time_constant": (time_constant, "s")})
        self.actuators, self.time_constant = actuators, time_constant
        self.most = 0.8 / time_constant

    def begin(self, plant):
        self.first = self.second = None

    def command(self, plant, asked):
        u = asked[:, self.actuators]
        if self.first is None:
            self.first, self.second = u.copy(), u.copy()
        tau = np.maximum(0.5 * self.scale * self.time_constant, 1e-9)
        rise = -np.expm1(-plant.step_length / tau)
        self.first = self.first + rise * (u - self.first)
        self.second = self.second + rise * (self.first - self.second)
        out = asked.copy()
        out[:, self.actuators] = self.second
        return out


class ActuatorDelay(Effect):
    """A pure delay of the command."""

    kind = "actuator_delay"

    def __init__(self, target: str, actuators: list[int], delay: float):
        super().__init__(target, {"delay": (delay, "s")})
        self.actuators, self.delay = actuators, delay
        self.most = 0.4 / delay

    def begin(self, plant):
        longest = float(np.max(self.scale)) * self.delay
        self.length = int(np.ceil(longest / plant.step_length)) + 3
        self.ring, self.at = None, 0
        steps = np.broadcast_to(self.scale[:, 0], (plant.members,)) * self.delay / plant.step_length
        self.whole, self.part = np.floor(steps).astype(int), (steps - np.floor(steps))[:, None]

    def command(self, plant, asked):
        u = asked[:, self.actuators]
        if self.ring is None:
            self.ring = np.repeat(u[None], self.length, 0)
        self.at = (self.at + 1) % self.length
        self.ring[self.at] = u
        members = np.arange(plant.members)
        near = self.ring[(self.at - self.whole) % self.length, members]
        far = self.ring[(self.at - self.whole - 1) % self.length, members]
        out = asked.copy()
        out[:, self.actuators] = near * (1 - self.part) + far * self.part
        return out


class InflowThrustLoss(Effect):
    """Thrust times 1 - slope v_in (v_in the inflow speed along the thrust), saturating between 0.2 and 1.3."""

    kind = "inflow_thrust_loss"

    def __init__(
        self, target: str, actuators: list[int], slope: float, *, body: int, directions: np.ndarray, places: np.ndarray
    ):
        super().__init__(target, {"slope": (slope, "s/m")})
        self.actuators, self.slope, self.body = actuators, slope, body
        self.directions, self.places = directions, places
        self.most = 1.5 / slope

    def command(self, plant, asked):
        motion = plant.body(self.body)
        out = asked.copy()
        for actuator, direction, place in zip(self.actuators, self.directions, self.places):
            inflow = (motion.nu + cross(motion.omega, place)) @ direction
            # Water that comes against the push's own direction adds, water that runs with it takes away.
            relative = inflow * np.tanh(asked[:, actuator] / 0.05)
            factor = 1 - self.scale[:, 0] * self.slope * relative
            out[:, actuator] *= 1.3 - np.logaddexp(0, (1.3 - np.maximum(factor, 0.2)) / 0.02) * 0.02
        return out


__all__ = ["ActuatorDeadband", "ActuatorDelay", "ActuatorGain", "ActuatorLag", "InflowThrustLoss"]
