"""How the vehicle is driven: what a field team does in a basin to identify it, with a pilot that holds the depth."""

import numpy as np

from ..hidden_cases import excitation
from ..hidden_cases.frames import exponential, product, rotation, turned_back
from . import fossen, numbers

#: Largest wrench that is asked for [N, N m].
REACH = np.array([45.0, 45.0, 40.0, 0.9, 0.9, 3.0])
#: Trials go through these in turn.
MODES = ("multisine", "ladder", "tilt", "zigzag", "dive", "steps", "sideways", "spin", "pulses", "drift")
#: Noise of what the pilot sees: position [m], velocity [m/s].
_SEEN = (0.008, 0.01)


class Pilot:
    """Wrenches from a table, the depth held where a trial says so. Called as `policy` of fossen.run."""

    def __init__(self, wrench, direct, depth, holds, noise, period, configuration):
        self.wrench, self.direct, self.depth, self.holds = wrench, direct, depth, holds
        self.noise, self.period = noise, period
        self.inverse = np.linalg.pinv(numbers.allocation(configuration))
        self.sum = np.zeros(len(wrench))

    def __call__(self, row, position, quaternion, nu):
        turn = rotation(quaternion)
        rise = (turn[:, 2] * nu[:, :3]).sum(1) + self.noise[:, row, 1]
        error = np.clip(self.depth[:, row] - position[:, 2] - self.noise[:, row, 0], -0.5, 0.5)
        self.sum = np.clip(self.sum + error * self.period, -1.0, 1.0)
        push = np.zeros((len(position), 3))
        push[:, 2] = self.holds * (45 * error + 12 * self.sum - 35 * rise)
        wrench = self.wrench[:, row].copy()
        wrench[:, :3] += turned_back(turn, push)
        return np.clip(self.direct[:, row] + wrench @ self.inverse.T, -1.0, 1.0)


def drive(
    rng: np.random.Generator, trials: int, rows: int, period: float, configuration: str
) -> tuple[np.ndarray, Pilot, list[str]]:
    """Start states [M, 13] at rest, the pilot, and what each trial does."""
    thrusters = len(numbers.PLACES[configuration])
    wrench, direct = np.zeros((trials, rows + 1, 6)), np.zeros((trials, rows + 1, thrusters))
    start = rng.uniform(1.5, 3.0, trials)
    depth = np.tile(-start[:, None], (1, rows + 1))
    holds = np.ones(trials)
    modes = [MODES[i % len(MODES)] for i in range(trials)]
    t = np.arange(rows + 1) * period
    for i, mode in enumerate(modes):
        size = rng.uniform(0.6, 1.0)
        if mode == "multisine":
            wrench[i] = excitation.multisine(rng, rows + 1, period, 6) * REACH * size
        elif mode == "ladder":
            wrench[i, :, 0] = _ladder(rng, t) * REACH[0]
            wrench[i, :, 5] = 0.3 * excitation.multisine(rng, rows + 1, period, 1)[:, 0] * REACH[5]
        elif mode == "tilt":
            # Roll and pitch are pushed and let go, so that they swing back by themselves.
            wrench[i, :, 3:5] = excitation.steps(rng, rows + 1, period, 2, hold=1.2) * REACH[3:5] * size
            wrench[i, :, 0] = 0.3 * excitation.multisine(rng, rows + 1, period, 1)[:, 0] * REACH[0]
        elif mode == "zigzag":
            wrench[i, :, 0] = 0.7 * size * REACH[0] * excitation.ramp(rows + 1, period)
            side = np.sign(np.sin(2 * np.pi * t / rng.uniform(4, 7) + rng.uniform(0, 6)))
            wrench[i, :, 5] = _soft(side, period) * REACH[5] * 0.8 * size
        elif mode == "dive":
            wrench[i, :, 2] = excitation.steps(rng, rows + 1, period, 1, hold=1.6)[:, 0] * REACH[2]
            wrench[i, :, 1] = 0.4 * excitation.multisine(rng, rows + 1, period, 1)[:, 0] * REACH[1]
            holds[i] = 0.2
        elif mode == "steps":
            wrench[i] = excitation.steps(rng, rows + 1, period, 6) * REACH * size
        elif mode == "sideways":
            wrench[i, :, 1] = _ladder(rng, t) * REACH[1]
            wrench[i, :, 2] = 0.4 * excitation.multisine(rng, rows + 1, period, 1)[:, 0] * REACH[2]
        elif mode == "spin":
            wrench[i, :, 5] = excitation.chirp(rng, rows + 1, period, highest=0.8) * REACH[5]
            wrench[i, :, :2] = 0.5 * excitation.multisine(rng, rows + 1, period, 2) * REACH[:2]
        elif mode == "pulses":
            direct[i] = 0.4 * excitation.pulses(rng, rows + 1, period, thrusters)
        else:
            # Nearly still: what the water does by itself.
            wrench[i] = 0.12 * excitation.multisine(rng, rows + 1, period, 6, highest=0.3) * REACH
            holds[i] = 0.0
        if mode not in ("dive", "drift"):
            depth[i] += 0.25 * np.sin(2 * np.pi * t / rng.uniform(8, 15) + rng.choice([0, np.pi]))
    noise = rng.normal(0, _SEEN, (trials, rows + 1, 2))
    if configuration == "standard":
        wrench[:, :, 4] = 0.0
    states = fossen.resting(trials, depth=start, heading=rng.uniform(-np.pi, np.pi, trials))
    lean = np.zeros((trials, 3))
    lean[:, :2] = rng.normal(0, 0.03, (trials, 2))
    states[:, 3:7] = product(states[:, 3:7], exponential(lean))
    return states, Pilot(wrench, direct, depth, holds, noise, period, configuration), modes


def _ladder(rng: np.random.Generator, t: np.ndarray) -> np.ndarray:
    """Ahead and astern at rising pushes [rows], each held long enough to settle."""
    hold = max(t[-1] / 8, 1.0)
    level = np.floor(t / hold).astype(int)
    sizes = np.linspace(0.25, 1.0, level.max() + 1) * rng.uniform(0.85, 1.0)
    return _soft(sizes[level] * np.where(level % 2, -1.0, 1.0), t[1] - t[0]) * excitation.ramp(len(t), t[1] - t[0])


def _soft(signal: np.ndarray, period: float) -> np.ndarray:
    """Edges of about a fifth of a second."""
    kernel = np.hanning(max(round(0.24 / period), 3) + 2)
    padded = np.concatenate([np.full(len(kernel), signal[0]), signal])
    return np.convolve(padded, kernel / kernel.sum())[len(kernel) : len(kernel) + len(signal)]
