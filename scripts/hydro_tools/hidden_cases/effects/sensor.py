"""Sensor effects: measured(t) = scale sensor(t - delay) + bias."""

import numpy as np

from ..frames import exponential, product
from .base import Effect, Readings, one_by_one


class SensorBias(Effect):
    """A bias that creeps by 2 % over a trial."""

    kind = "sensor_bias"

    def __init__(self, target: str, bias: np.ndarray, unit: str):
        names = (
            {"bias": (float(bias[0]), unit)}
            if len(bias) == 1
            else {f"bias_{axis}": (float(b), unit) for axis, b in zip("xyz", bias)}
        )
        super().__init__(target, names)
        self.bias, self.unit = np.asarray(bias, float), unit

    def parts(self):
        return [SensorBias(self.target, part, self.unit) for part in one_by_one(self.bias)]

    def sense(self, readings: Readings):
        columns = readings.columns[self.target]
        span = max(readings.times[-1], 1.0)
        creep = 1 + 0.02 * (readings.times / span - 0.5)[:, None]
        offset = self.scale.item() * self.bias * creep
        if self.target in readings.quaternions:
            readings.values[:, columns] = product(readings.values[:, columns], exponential(offset))
        else:
            readings.values[:, columns] += offset


class SensorScale(Effect):
    """A reading off by a factor, with a trace of saturation (0.2 % at three standard deviations)."""

    kind = "sensor_scale"

    def __init__(self, target: str, change: float):
        super().__init__(target, {"scale": (1 + change, "1")})
        self.change = change
        self.most = 0.6 / abs(change)

    def scaled_parameters(self, factor):
        return {"scale": (1 + self.change * factor, "1")}

    def sense(self, readings: Readings):
        columns = readings.columns[self.target]
        x = readings.values[:, columns]
        swing = x - x.mean(0, keepdims=True)
        spread = 3 * x.std(0, keepdims=True) + 1e-9
        bent = x - 0.002 * swing * (swing / spread) ** 2
        readings.values[:, columns] = (1 + self.scale.item() * self.change) * bent


class SensorDelay(Effect):
    """A reading that comes late."""

    kind = "sensor_delay"

    def __init__(self, target: str, delay: float):
        super().__init__(target, {"delay": (delay, "s")})
        self.delay = delay
        self.most = 0.3 / delay

    def sense(self, readings: Readings):
        late = readings.times - self.scale.item() * self.delay
        start = readings.columns[self.target].start
        for column in range(start, readings.columns[self.target].stop):
            readings.values[:, column] = np.interp(late, readings.times, readings.values[:, column])
