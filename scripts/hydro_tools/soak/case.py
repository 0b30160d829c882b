"""One run: a model, a motion, resets in mid-run; what is broken about it."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from . import SoakError, energy, motion
from .catalogue import Effect
from .scenes import robot, vehicle

#: Steps between two looks.
CHUNK = 25
#: Said once: of a checkpoint outside its training range, of `hydrostatics` beside `net_buoyancy`.
EXPECTED = ("the force is a guess", "two buoyancies")


@dataclass(frozen=True)
class Case:
    """What acts, on what, how it moves. calm: energy is compared; there are no contacts."""

    checkpoint: str
    effects: tuple[Effect, ...]
    integrator: str
    motion: str
    calm: bool
    seed: int

    def model(self) -> mujoco.MjModel:
        """Compile it."""
        if self.checkpoint:
            return robot(self.checkpoint, list(self.effects), self.integrator)
        return vehicle(list(self.effects), self.integrator, self.calm)

    def name(self) -> str:
        """For a message."""
        what = [*([self.checkpoint] if self.checkpoint else ()), *(effect.effect for effect in self.effects)]
        return f"{' + '.join(what)}, {self.integrator}, {self.motion}{', calm' if self.calm else ''}, seed {self.seed}"


@dataclass(frozen=True)
class Outcome:
    """Steps done, greatest energy over its bound (0 where none is compared), and what is broken, in words."""

    steps: int
    energy: float
    asleep: bool
    broken: str


def run(case: Case, steps: int, warnings: Counter) -> Outcome:
    """Run a case three times over from the same start, the second and third after a reset in mid-run.

    All three must be bit for bit alike, as far as they go: what the plugin remembers is forgotten by a reset.

    Args:
        case: the case.
        steps: of the longest of the three.
        warnings: texts of MuJoCo's warnings, counted by the caller's hook; emptied here.
    """
    warnings.clear()
    try:
        model = case.model()
    except SoakError as error:
        return Outcome(0, 0.0, False, f"refused: {error}")
    data = mujoco.MjData(model)
    first: list[bytes] = []
    worst, done, asleep, why = 0.0, 0, False, ""
    for length in (steps // 3, steps, steps // 2):
        seen, found = [], Counter()
        motion.start(model, data, case.motion, case.seed)
        bound = _bound(case, model, data, steps) if case.calm and length == steps // 3 else None
        if bound is not None:
            limit = bound
        rng = np.random.default_rng(case.seed + 1)
        for _ in range(0, length, CHUNK):
            if case.motion == "violent" and not case.calm:
                motion.drive(model, data, rng)
            mujoco.mj_step(model, data, CHUNK)
            done += CHUNK
            why = why or _fault(model, data, found)
            seen.append(data.qpos.tobytes() + data.qvel.tobytes() + data.plugin_state.tobytes())
            asleep = asleep or bool(data.ntree_awake < model.ntree)
            if case.calm:
                mujoco.mj_energyPos(model, data)
                mujoco.mj_energyVel(model, data)
                worst = max(worst, energy.of(data) / limit)
            if why:
                return Outcome(done, worst, asleep, why)
        if first and any(one != other for one, other in zip(first, seen)):
            return Outcome(done, worst, asleep, "a reset does not give the same run")
        first = first if len(first) > len(seen) else seen
    if worst > 1 + energy.TOLERANCE:
        why = f"energy {worst:.4f} times what there can be"
    else:
        strange = [text for text in warnings if not any(known in text for known in EXPECTED)]
        why = f"a warning: {strange[0][:200]}" if strange else ""
    return Outcome(done, worst, asleep, why)


def _bound(case: Case, model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> float:
    """The most energy that there can be [J]: the start's, and what the integrator adds to the dry model's."""
    mujoco.mj_forward(model, data)
    most = energy.of(data) + energy.stored(case.effects, model, data)
    dry = vehicle([], case.integrator, calm=True)
    alone = mujoco.MjData(dry)
    motion.start(dry, alone, case.motion, case.seed)
    mujoco.mj_forward(dry, alone)
    begin = highest = energy.of(alone)
    for _ in range(0, steps, CHUNK):
        mujoco.mj_step(dry, alone, CHUNK)
        highest = max(highest, energy.of(alone))
    added = highest / begin if begin > 0 else 1.0
    return max(most, 1e-9) * added


def _fault(model: mujoco.MjModel, data: mujoco.MjData, found: Counter) -> str:
    numbers: dict[str, Callable[[], np.ndarray]] = {
        "qpos": lambda: data.qpos,
        "qvel": lambda: data.qvel,
        "qfrc_passive": lambda: data.qfrc_passive,
        "sensordata": lambda: data.sensordata,
        "plugin_state": lambda: data.plugin_state,
    }
    for name, read in numbers.items():
        if not np.isfinite(read()).all():
            return f"{name} is not finite at {data.time:.3f} s"
    for kind in (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC):
        if data.warning[kind].number > found[kind]:
            return f"MuJoCo resets a simulation that diverged ({kind.name[7:]}) at {data.time:.3f} s"
    return ""
