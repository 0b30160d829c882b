"""A pattern generator for a quadruped's twelve joints, with feedback of attitude, heading and depth.

Every joint follows a sine with a second harmonic about a middle; fore and hind legs have numbers of their own, left and
right ones are mirrored. Feedback moves the middles of the thighs and scales the strokes of a side. Joints in the order
FR, FL, RR, RL x hip, thigh, calf [rad]; a target stays where the released checkpoints have been trained and moves at
most `FASTEST`.
"""

from dataclasses import dataclass

import numpy as np

from hydro_mujoco.envs.b1_tasks import FASTEST, MIDDLE, REACH

#: Seconds between two commands.
PERIOD = 0.02
#: Steepest climb that feedback of depth asks for: height of the nose over the trunk's length.
STEEPEST = 0.5
#: +1 for a left leg, 0 for a hind leg; of each joint.
SIDE = np.repeat([-1.0, 1.0, -1.0, 1.0], 3)
HIND = np.repeat([0, 0, 1, 1], 3)


@dataclass(frozen=True)
class Parameter:
    """A number of the generator, between `least` and `most`; learning begins at `first`."""

    name: str
    unit: str
    least: float
    most: float
    first: float


def _parameters() -> tuple[Parameter, ...]:
    turn = (-np.pi, np.pi)
    found = [Parameter("frequency", "Hz", 0.4, 2.0, 1.2)]
    for end in ("fore", "hind"):
        strokes = {"hip": 0.1, "thigh": 0.35, "calf": 0.55}
        found += [Parameter(f"{end}_{joint}_amplitude", "1", 0.0, 1.0, first) for joint, first in strokes.items()]
        found += [Parameter(f"{end}_{joint}_middle", "1", -0.7, 0.7, 0.0) for joint in strokes]
        found += [
            Parameter(f"{end}_{joint}_lead", "rad", *turn, first) for joint, first in (("hip", 0.0), ("calf", 2.0))
        ]
    return (
        *found,
        Parameter("hind_lead", "rad", *turn, -1.5),
        Parameter("side_lead", "rad", 0.0, 2 * np.pi, np.pi),
        Parameter("skew", "1", -0.5, 0.5, 0.0),
        # Wanted height of the nose of an error of depth and of a vertical speed.
        Parameter("climb_of_depth", "1/m", -1.0, 1.0, 0.0),
        Parameter("climb_of_speed", "s/m", -1.0, 1.0, 0.0),
        # Lean of the thighs of what is missing in that height, and of the rate of pitch.
        Parameter("lean_of_pitch", "1", -2.0, 2.0, 0.0),
        Parameter("lean_of_pitch_rate", "s", -1.0, 1.0, 0.0),
        # Difference between left and right thighs of a roll.
        Parameter("split_of_roll", "1", -2.0, 2.0, 0.0),
        # Difference between the strokes of left and right of a heading and its rate.
        Parameter("turn_of_heading", "1", -2.0, 2.0, 0.0),
        Parameter("turn_of_yaw_rate", "s", -1.0, 1.0, 0.0),
    )


#: All numbers, in the order of a vector of them.
PARAMETERS = _parameters()
LEAST = np.array([parameter.least for parameter in PARAMETERS])
MOST = np.array([parameter.most for parameter in PARAMETERS])
#: Where learning begins, of 96 gaits without feedback the ways of the best four in the truth: calves 2 rad ahead.
FIRST = np.array([parameter.first for parameter in PARAMETERS])


@dataclass(frozen=True)
class Senses:
    """What feedback sees of n robots, each [n]: heights of the nose and of the left side over the trunk (sines of pitch
    and roll), sine of the heading left of the start's, pitch and yaw rate [rad/s], depth below the start [m], vertical
    speed [m/s].
    """

    nose: np.ndarray
    left: np.ndarray
    heading: np.ndarray
    pitch_rate: np.ndarray
    yaw_rate: np.ndarray
    below: np.ndarray
    rising: np.ndarray


def unit_to_values(unit: np.ndarray) -> np.ndarray:
    """Numbers of the generator from ones between 0 and 1, shape (..., P)."""
    return LEAST + (MOST - LEAST) * unit


def values_to_unit(values: np.ndarray) -> np.ndarray:
    """The inverse of `unit_to_values`."""
    return (values - LEAST) / (MOST - LEAST)


class Generator:
    """n generators, one for each row of `values` [n, P]."""

    def __init__(self, values: np.ndarray):
        named = dict(zip((parameter.name for parameter in PARAMETERS), np.atleast_2d(values).T))
        self._named = named

        def by_joint(kind: str, joints=("hip", "thigh", "calf")) -> np.ndarray:
            ends = [[named.get(f"{end}_{joint}_{kind}", 0.0 * named["skew"]) for joint in joints] for end in END]
            return np.stack([ends[hind][joint] for hind in (0, 0, 1, 1) for joint in range(3)], axis=1)

        self._amplitude, self._middle = by_joint("amplitude"), by_joint("middle")
        # Hips open outwards together: the right side's sign is opposite to the left's.
        mirrored = np.where(np.arange(12) % 3 == 0, SIDE, 1.0)
        self._middle = self._middle * mirrored
        self._amplitude = self._amplitude * mirrored
        self._lead = by_joint("lead") + np.outer(named["hind_lead"], HIND) + np.outer(named["side_lead"], SIDE > 0)

    def targets(self, time: float, before: np.ndarray, senses: Senses) -> np.ndarray:
        """Targets [n, 12] rad at a time [s], `PERIOD` after the targets `before` [n, 12]."""
        of = self._named
        angle = 2 * np.pi * of["frequency"][:, None] * time + self._lead
        turn = of["turn_of_heading"] * senses.heading + of["turn_of_yaw_rate"] * senses.yaw_rate
        stroke = self._amplitude * np.clip(1.0 + turn[:, None] * SIDE, 0.0, 2.0)
        climb = of["climb_of_depth"] * senses.below - of["climb_of_speed"] * senses.rising
        missing = np.clip(climb, -STEEPEST, STEEPEST) - senses.nose
        lean = of["lean_of_pitch"] * missing + of["lean_of_pitch_rate"] * senses.pitch_rate
        split = of["split_of_roll"] * senses.left
        thigh = np.arange(12) % 3 == 1
        middle = self._middle + thigh * (np.outer(lean, 1 - 2 * HIND) + np.outer(split, SIDE))
        action = middle + stroke * (np.sin(angle) + of["skew"][:, None] * np.sin(2 * angle))
        wanted = MIDDLE + REACH * np.clip(action, -1.0, 1.0)
        return before + np.clip(wanted - before, -FASTEST * PERIOD, FASTEST * PERIOD)


#: Prefixes of the names of fore and hind legs.
END = ("fore", "hind")
