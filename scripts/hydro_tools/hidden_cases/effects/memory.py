"""Memory of the fluid: wakes and Basset history."""

import numpy as np

from .base import AXES, Effect, one_by_one


class WakeMemory(Effect):
    """Two first-order wakes per axis, at a rate and at 2.6 times that rate, driven by the velocity.

    F = -sum_i w_i a z_i, z_i' = r_i (nu - z_i): a force that lags behind linear drag of strength a.
    """

    kind = "wake_memory"
    PARTS = ((1.0, 0.75), (2.6, 0.25))

    def __init__(self, target: str, body: int, amplitudes: np.ndarray, rate: float):
        names = {
            f"amplitude_{axis}": (float(v), ("N s/m", "N m s/rad")[i // 3])
            for i, (axis, v) in enumerate(zip(AXES, amplitudes))
            if v != 0.0
        }
        super().__init__(target, names | {"rate": (rate, "1/s")}, comparable=False)
        self.body, self.amplitudes, self.rate = body, np.asarray(amplitudes, float), rate

    def fixed(self):
        return {"rate"}

    def parts(self):
        return [WakeMemory(self.target, self.body, part, self.rate) for part in one_by_one(self.amplitudes)]

    def begin(self, plant):
        self.z = np.zeros((len(self.PARTS), plant.members, 6))

    def force(self, plant):
        motion = plant.hull(self.body)
        nu = np.concatenate([motion.nu, motion.omega], 1)
        wrench = np.zeros_like(nu)
        for i, (speed, weight) in enumerate(self.PARTS):
            wrench -= weight * self.z[i]
            self.z[i] += (1 - np.exp(-plant.step_length * self.rate * speed)) * (nu - self.z[i])
        wrench *= self.scale * self.amplitudes
        plant.add_hull_wrench(self.body, wrench[:, :3], wrench[:, 3:])


class BassetHistory(Effect):
    """-c integral of nu_dot(s) / sqrt(t - s), as nine exponentials from 5 ms to 20 s fitted in L2.

    The window kernel of F. van Hinsberg et al., J. Comput. Phys. 230 (2011) 1465, without its direct part.
    """

    kind = "basset_history"
    RATES = np.geomspace(1 / 20.0, 1 / 0.005, 9)

    def __init__(self, target: str, body: int, coefficient: float, *, axes: np.ndarray):
        super().__init__(target, {"coefficient": (coefficient, "N s^0.5/(m/s)")}, comparable=False)
        self.body, self.axes = body, coefficient * np.asarray(axes, float)
        t = np.geomspace(0.004, 15.0, 240)
        basis = np.exp(-np.outer(t, self.RATES)) * np.sqrt(t)[:, None]
        self.weights = np.linalg.lstsq(basis, np.ones(len(t)), rcond=None)[0]

    def begin(self, plant):
        self.z = np.zeros((len(self.RATES), plant.members, 3))
        self.before = None

    def force(self, plant):
        nu = plant.hull(self.body).nu
        change = np.zeros_like(nu) if self.before is None else nu - self.before
        self.before = nu.copy()
        decay = np.exp(-self.RATES * plant.step_length)[:, None, None]
        self.z = self.z * decay + change * np.sqrt(decay)
        force = -self.scale * self.axes * np.tensordot(self.weights, self.z, 1)
        plant.add_hull_wrench(self.body, force)
