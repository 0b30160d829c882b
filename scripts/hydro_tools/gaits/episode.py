"""Robots that swim, each by a gait of its own, and what is made of it."""

from dataclasses import dataclass

import mujoco
import numpy as np

from hydro_mujoco.envs.attitude import about_axis, rotation
from hydro_mujoco.envs.b1_tasks import DEEPEST, DRIFT, SPIN, TILT

from .generator import PERIOD, Generator, Senses
from .waters import Pool

#: Prices of an error, in m/s of speed: a metre of depth, a right angle of tilt, one of heading.
DEPTH_PRICE, TILT_PRICE, HEADING_PRICE = 0.5, 0.2, 0.4
#: Mass of the robot times gravity [N]: what a cost of transport refers to.
WEIGHT = 62.58 * 9.81


@dataclass(frozen=True)
class Starts:
    """States [n, ...] that robots start in: heading along x, at the origin."""

    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: np.ndarray


def starts(model: mujoco.MjModel, random: np.random.Generator, number: int) -> Starts:
    """The pose `home`, tilted by up to 0.15 rad, moving by up to 0.05 m/s and 0.1 rad/s on each axis."""
    qpos, qvel = np.tile(model.key_qpos[0], (number, 1)), np.zeros((number, model.nv))
    for row in range(number):
        qpos[row, 3:7] = about_axis(random.normal(size=3), random.uniform(0, TILT))
        qvel[row, :3], qvel[row, 3:6] = random.uniform(-DRIFT, DRIFT, 3), random.uniform(-SPIN, SPIN, 3)
    return Starts(qpos, qvel, np.tile(model.key_ctrl[0], (number, 1)))


@dataclass(frozen=True)
class Track:
    """T moments, `PERIOD` apart, of n robots: qpos [T, n, nq], ctrl [T, n, nu], power of the servos [T, n] W.

    swims [T, n]: until its end, which is too far from its depth, the trunk's z axis below the horizon, or a simulation
    that blew up.
    """

    qpos: np.ndarray
    ctrl: np.ndarray
    power: np.ndarray
    swims: np.ndarray

    @property
    def seconds(self) -> float:
        """Length [s]."""
        return len(self.qpos) * PERIOD

    @property
    def place(self) -> np.ndarray:
        """Of the trunk [T, n, 3] m."""
        return self.qpos[..., :3]

    @property
    def axes(self) -> np.ndarray:
        """Of the trunk, as columns in the world [T, n, 3, 3]."""
        moments, robots = self.power.shape
        return rotation(self.qpos[..., 3:7].reshape(-1, 4)).reshape(moments, robots, 3, 3)


def swim(pool: Pool, values: np.ndarray, begin: Starts, seconds: float, deepest: float = DEEPEST) -> Track:
    """Swim gaits `values` [n, P] from as many starts; `deepest` [m] from its depth a way comes to its end."""
    generator, count = Generator(values), round(seconds / PERIOD)
    pool.start(begin.qpos, begin.qvel, begin.ctrl)
    ctrl, swims = begin.ctrl.copy(), np.ones(len(values), bool)
    record: dict[str, list] = {"qpos": [], "ctrl": [], "power": [], "swims": []}
    for step in range(count):
        axes = rotation(pool.qpos[:, 3:7])
        senses = Senses(
            nose=axes[:, 2, 0],
            left=axes[:, 2, 1],
            heading=axes[:, 1, 0],
            pitch_rate=pool.qvel[:, 4],
            yaw_rate=pool.qvel[:, 5],
            below=begin.qpos[:, 2] - pool.qpos[:, 2],
            rising=pool.qvel[:, 2],
        )
        ctrl = np.where(swims[:, None], generator.targets(step * PERIOD, ctrl, senses), ctrl)
        pool.step(ctrl)
        # MuJoCo starts a simulation that blew up anew: its clock is then behind.
        whole = np.abs(pool.time - (step + 1) * PERIOD) < PERIOD / 2
        upright = rotation(pool.qpos[:, 3:7])[:, 2, 2] > 0
        swims = swims & whole & upright & (np.abs(pool.qpos[:, 2] - begin.qpos[:, 2]) < deepest)
        record["qpos"].append(pool.qpos.copy())
        record["ctrl"].append(ctrl)
        record["power"].append(np.abs(pool.force * pool.qvel[:, 6:]).sum(axis=1))
        record["swims"].append(swims)
    return Track(**{name: np.stack(rows) for name, rows in record.items()})


def score(track: Track) -> np.ndarray:
    """What learning maximises [n], m/s: the speed ahead, less the prices of errors of depth, tilt and heading, averaged
    over time. After its end a robot stands still with all errors at their greatest.
    """
    place, axes = track.place, track.axes
    ahead = np.diff(place[..., 0], axis=0, prepend=place[:1, :, 0]) / PERIOD
    errors = DEPTH_PRICE * np.minimum(np.abs(place[..., 2] - place[0, :, 2]), DEEPEST)
    errors += TILT_PRICE * np.minimum(1 - axes[..., 2, 2], 1.0) + HEADING_PRICE * (1 - axes[..., 0, 0])
    worst = DEPTH_PRICE * DEEPEST + TILT_PRICE + 2 * HEADING_PRICE
    return np.where(track.swims, ahead - errors, -worst).mean(axis=0)


@dataclass(frozen=True)
class Judgement:
    """Of one robot's way.

    ahead, speed: distance along the first heading [m], and that over the time [m/s].
    depth_drift, depth_worst: last and greatest distance from the first depth [m].
    tilt_worst, heading_drift: greatest tilt, last turn from the first heading [degrees].
    cost: of transport, mean sum of |torque x rate| over weight times speed; None where it does not go ahead.
    swam: seconds until its end.
    """

    ahead: float
    speed: float
    depth_drift: float
    depth_worst: float
    tilt_worst: float
    heading_drift: float
    cost: float | None
    swam: float


def judge(track: Track) -> list[Judgement]:
    """Each robot; what it does after its end does not count, the time does."""
    found = []
    for row in range(track.power.shape[1]):
        last = max(int(track.swims[:, row].sum()), 1)
        place, axes, power = (part[:last, row] for part in (track.place, track.axes, track.power))
        ahead = float(place[-1, 0])
        speed = ahead / track.seconds
        depth = np.abs(place[:, 2])
        tilt = np.degrees(np.arccos(np.clip(axes[:, 2, 2], -1, 1)))
        heading = np.degrees(np.arctan2(axes[-1, 1, 0], axes[-1, 0, 0]))
        cost = float(power.mean() * last * PERIOD / (WEIGHT * ahead)) if ahead > 0 else None
        found.append(
            Judgement(
                ahead,
                speed,
                float(depth[-1]),
                float(depth.max()),
                float(tilt.max()),
                float(abs(heading)),
                cost,
                last * PERIOD,
            )
        )
    return found
