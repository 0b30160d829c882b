"""Record a data set (`hydro-dataset/1`) from any MJCF with a free body.

scene.py       the model: read, its base body, its joints
water.py       MuJoCo's fluid, effects of hydro.wrench, or both; what of it is the label
drives.py      the actuators: which are driven, and how far
excitation.py  what happens in one trajectory
recorder.py    how far a robot is driven, by its length, inertia and drag; a pilot
set_up.py      all of these together

The command is `python -m hydro_mujoco.record`.
"""

import os
import sys
import types
import warnings
from pathlib import Path
from typing import Any

import mujoco

from ..errors import DataError, Notice
from ..jobs.here import Here
from ..jobs.processes import Processes
from ..recording.dataset import Size, empty_splits, generate
from ..recording.interrupts import saying
from .set_up import Options, set_up

__all__ = ["record"]


def record(
    model: str | os.PathLike | mujoco.MjSpec,
    out: str | os.PathLike,
    *,
    trials: int = 500,
    samples: int = 400,
    seed: int = 0,
    body: str | None = None,
    water: str | None = None,
    buoyancy: bool = False,
    density: tuple[float, float] | None = None,
    sample_period: float | None = None,
    noise: float = 0.0,
    effort: float = 1.0,
    frequency: tuple[float, float] | None = None,
    contacts: bool = False,
    splits: tuple[float, float, float] = (0.8, 0.1, 0.1),
    shard_size: int = 50,
    workers: int = 1,
    resume: bool = False,
    overwrite: bool = False,
    plugin: str | os.PathLike | None = None,
) -> dict:
    """Record a data set that `hydro train` reads; returns its manifest.

    The robot is driven, pushed and started anyhow; a row has features `x` [n] (joint positions [rad, m] and velocities,
    quaternion w x y z, angular [rad/s] and linear [m/s] velocity of the base in its own frame, the density [kg/m^3]
    where it varies) and the label `wrench` [6] (force N, torque N m about the base origin, base frame) of the same
    state.

    Args:
        model: an MJCF, or a spec.
        out: folder of the data set: shards with `x` [M, T, n], `wrench` and `wrench_clean` [M, T, 6], `time` [T] s, and
            manifest.json.
        trials: trajectories in all. samples: of each; seed: the same gives the same bytes, whatever `workers`.
        body: the body whose motion is recorded; the first with a free joint by default.
        water: `fluid` (MuJoCo's own), `effects` (of hydro.wrench) or `both`; all that the model has by default.
        buoyancy: `gravcomp` counts as the water's too.
        density: lowest and highest [kg/m^3], of MuJoCo's fluid; the model's alone by default, and then no feature.
        sample_period: a multiple of the timestep; by default the one nearest to 0.01 s.
        noise: on the label, as a share of each component's standard deviation.
        effort: share of the actuators' ranges, and of the usual pushes. frequency: of gaits, lowest and highest [Hz].
        contacts: whether bodies touch.
        splits: shares of train, val, test. shard_size: trajectories a file. workers: processes.
        resume: finish what a former run left. overwrite: replace the data set.
        plugin: the plugin library, for models with effects; found by itself where it was built.

    Raises:
        DataError: with one message, naming what was found and the repair.
        KeyboardInterrupt: finished shards are kept; the same call with resume=True goes on to the same bytes.

    Warns:
        Notice: of what a recording leaves out or assumes; also in the manifest's `notes`.

    Source: the label and its frames: docs/any-robot.md; the format `hydro-dataset/1`: docs/train.md.

    >>> import hydro_mujoco
    >>> manifest = hydro_mujoco.record(hydro_mujoco.scene("fish"), "data", trials=12, samples=40)
    >>> manifest["outputs"]
    ['force.x', 'force.y', 'force.z', 'torque.x', 'torque.y', 'torque.z']
    >>> {split: part["trajectories"] for split, part in manifest["splits"].items()}
    {'train': 10, 'val': 1, 'test': 1}
    """
    out = Path(out)
    options = Options(
        seed=seed,
        samples=samples,
        body=body,
        water=water,
        buoyancy=buoyancy,
        density=density,
        sample_period=sample_period,
        noise=noise,
        effort=effort,
        frequency=frequency,
        contacts=contacts,
        plugin=Path(plugin) if plugin is not None else None,
    )
    options.check()
    size = Size(_count("trials", trials), _shares(splits), _count("shard_size", shard_size))
    if empty := empty_splits(size):
        raise DataError(f"{empty}; record at least {_enough(size)} trajectories, or ask for other splits")
    workers = _count("workers", workers)
    ready = set_up(model, options)
    if ready.lacks_library and workers > 1:
        raise DataError(
            "other processes cannot load the plugin, for its file is not known: name it by plugin, or workers=1"
        )
    for note in ready.notes:
        warnings.warn(note, Notice, stacklevel=2)
    head = {"schema": "hydro-dataset/1", "name": out.resolve().name} | ready.head
    kept = saying(f"hydro record: stopped; finished shards are kept in {out}: go on with resume=True")
    with kept, Processes(workers) if workers > 1 else Here() as executor:
        manifest = generate(
            ready.recorder,
            size,
            lambda: head,
            out,
            noise_std=lambda: ready.noise_std,
            executor=executor,
            resume=resume,
            overwrite=overwrite,
        )
    if again := manifest.get("drawn_again"):
        text = f"{again} of {trials + again} trajectories were unstable and drawn again"
        warnings.warn(text, Notice, stacklevel=2)
    return manifest


def _count(name: str, value: int) -> int:
    if int(value) != value or value < 1:
        raise DataError(f"{name} is {value}; expected a whole number above 0")
    return int(value)


def _shares(splits: tuple[float, float, float]) -> tuple[float, float, float]:
    shares = tuple(float(part) for part in splits)
    if len(shares) != 3 or not all(0 <= part <= 1 for part in shares) or not abs(sum(shares) - 1) < 1e-9:
        raise DataError(f"splits are {splits}; expected three shares train, val, test that sum to 1")
    return shares


def _enough(size: Size) -> int:
    """The fewest trajectories of which every split gets one."""
    trials = size.trials
    while Size(trials, size.splits, size.shard_size).missing():
        trials += 1
    return trials


class _Function(types.ModuleType):
    """This module, called as the function that it is named after: `hydro_mujoco.record(model, out)`."""

    def __call__(self, *arguments: Any, **options: Any) -> dict:
        return record(*arguments, **options)


sys.modules[__name__].__class__ = _Function
