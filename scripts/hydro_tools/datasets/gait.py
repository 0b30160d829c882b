"""Joint targets: sinusoids with the phase pattern of a gait."""

from dataclasses import dataclass

import numpy as np

from .regime import Ranges

#: Phases of the legs FR, FL, RR, RL as a share of the cycle.
PATTERNS = {
    "trot": (0.0, 0.5, 0.5, 0.0),
    "pace": (0.0, 0.5, 0.0, 0.5),
    "bound": (0.0, 0.0, 0.5, 0.5),
    "paddle": (0.0, 0.5, 0.25, 0.75),
    "pronk": (0.0, 0.0, 0.0, 0.0),
}
#: Chance that a gait follows no pattern: every joint has a phase of its own.
RANDOM_SHARE = 0.25
#: Centre of the postures about which a leg swings, hip, thigh, calf [rad].
CENTRE = (0.0, 0.75, -1.5)
#: Distance that targets keep from the joint limits [rad].
LIMIT_MARGIN = 0.05


@dataclass(frozen=True)
class Gait:
    """target(t) = centre + amplitude (sin(wt + phase) + skew sin(2 (wt + phase))), w = 2 pi frequency.

    Arrays of [12] joints, FR FL RR RL x hip thigh calf; rad, Hz. The second harmonic makes power
    and recovery strokes unlike.
    """

    centre: np.ndarray
    amplitude: np.ndarray
    frequency: float
    phase: np.ndarray
    skew: float

    def targets(self, t: np.ndarray) -> np.ndarray:
        """Targets [N, 12] at times t [N] s."""
        angle = 2 * np.pi * self.frequency * t[:, None] + self.phase
        return self.centre + self.amplitude * (np.sin(angle) + self.skew * np.sin(2 * angle))


def hold(posture: np.ndarray) -> Gait:
    """The gait that stays in `posture` [12] rad."""
    return Gait(posture, np.zeros(12), 0.0, np.zeros(12), 0.0)


def draw(rng: np.random.Generator, ranges: Ranges) -> Gait:
    """A random gait."""
    joint_phase = rng.uniform(0, 2 * np.pi, 3)
    pattern = list(PATTERNS.values())[rng.integers(len(PATTERNS))]
    phase = (2 * np.pi * np.array(pattern)[:, None] + joint_phase).ravel()
    scattered = rng.uniform(0, 2 * np.pi, 12)
    if rng.random() < RANDOM_SHARE:
        phase = scattered
    # One amplitude and centre a kind of joint, with small differences between the legs.
    amplitude = np.tile(rng.uniform(*ranges.amplitude), 4) * rng.uniform(0.8, 1.0, 12)
    if rng.random() < ranges.glide_share:
        amplitude = np.zeros(12)
    least, most = np.array(ranges.lean)
    lean = rng.uniform(-most, most)
    lean = np.copysign(least + (1 - least / most) * np.abs(lean), lean)
    # Hips open outwards together: the right side's sign is opposite to the left's.
    mirrored = np.array([[-lean[0], lean[1], lean[2]], [lean[0], lean[1], lean[2]]] * 2).ravel()
    centre = np.tile(CENTRE, 4) + mirrored + np.tile(ranges.scatter, 4) * rng.uniform(-1, 1, 12)
    return Gait(centre, amplitude, rng.uniform(*ranges.frequency), phase, rng.uniform(0.0, 0.3))


def within(targets: np.ndarray, joint_range: np.ndarray) -> np.ndarray:
    """Targets clipped to the limits [12, 2], less a margin."""
    return np.clip(targets, joint_range[:, 0] + LIMIT_MARGIN, joint_range[:, 1] - LIMIT_MARGIN)
