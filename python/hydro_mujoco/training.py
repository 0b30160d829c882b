"""`hydro train` and `hydro evaluate`: a data set -> a checkpoint -> its errors."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from .program import existing, flags, folder, run_json


@dataclass(frozen=True)
class Trained:
    """A checkpoint and its errors.

    Attributes:
        checkpoint: its folder, for `add_water(checkpoint=...)`, `with_checkpoint` and the attribute of `hydro.wrench`.
        test: errors on the test split as in card.json; None where the data have none.
    """

    checkpoint: Path
    test: dict[str, Any] | None = field(repr=False)

    @property
    def nrmse(self) -> float | None:
        """RMSE over the label's standard deviation, all outputs together, on the test split."""
        return None if self.test is None else float(self.test["pooled"])


def train(
    data: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    model: Literal["attention-ode", "mlp-ode", "relaxation-ode", "cnode", "lstm", "mlp"] = "attention-ode",
    preset: Literal["full", "release", "demo"] = "full",
    epochs: int | None = None,
    seed: int = 0,
    hidden: Sequence[int] | None = None,
    outputs: Literal["wrench", "generalised"] = "wrench",
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = True,
    **options: str | int | float | bool | None,
) -> Trained:
    """Train a force model on a data set and write a checkpoint; the program `hydro train` does the work.

    Stopped by Ctrl-C it goes on with `resume=True`.

    Args:
        data: folder that `hydro_mujoco.record` wrote: features `x` [M, T, n] (joint positions and velocities,
            quaternion, angular and linear velocity of the base; SI, radians, base frame), labels `wrench` [M, T, 6]
            (force N, torque N m about the base origin, base frame).
        out: folder of the checkpoint; the state of the training stands beside it in `out.run`.
        model: kind of model (docs/train.md). preset: sizes and length: `demo` takes minutes, `release` a quarter of
            an hour, `full` hours.
        epochs: passes over the data; the preset's by default. seed: of the first weights and the order of the data.
        hidden: widths of the field's hidden layers, or of an LSTM's layers.
        outputs: `wrench` on the base, or `generalised`, with the torque of the water on every joint, where the data
            have it (shard `generalised`).
        resume: go on with the training in `out`. overwrite: replace it.
        progress: show a bar.
        options: further flags of `hydro train --help`, by their names with underscores: `learning_rate=2e-3`,
            `encoding="links"`, `batch=32`, `device="cuda"`.

    Returns:
        The checkpoint's folder (weights.safetensors, card.json), and its errors on the test split.

    Raises:
        DataError: data, folder or an option are at fault, or the loss is no longer a number; the message is the
            program's.
        KeyboardInterrupt: after the program has stopped; `resume=True` goes on.

    Source: `attention-ode` and what it is compared with: C. Wang, A. Liang, F. Han, X. Zeng, Z. Li, D. Fan, J. Kober,
    "Learning Adaptive Hydrodynamic Models Using Neural ODEs in Complex Conditions"; the others: docs/train.md.

    >>> import hydro_mujoco
    >>> _ = hydro_mujoco.record(hydro_mujoco.scene("fish"), "data", trials=12, samples=40)
    >>> trained = hydro_mujoco.train("data", "mine", model="mlp", preset="demo", epochs=1, hidden=[8], progress=False)
    >>> sorted(path.name for path in trained.checkpoint.iterdir()), trained.nrmse > 0
    (['card.json', 'weights.safetensors'], True)
    """
    chosen = {
        "model": model,
        "preset": preset,
        "epochs": epochs,
        "seed": seed,
        "hidden": None if hidden is None else list(hidden),
        "outputs": outputs,
        "resume": resume,
        "overwrite": overwrite,
        **options,
    }
    target = folder("out", out)
    words = ["train", "--data", str(existing("data", data)), "--out", str(target), *flags(chosen)]
    return Trained(target, run_json(words, progress=progress)["test"])


def evaluate(
    checkpoint: str | os.PathLike[str],
    data: str | os.PathLike[str],
    *,
    split: Literal["train", "val", "test"] = "test",
    start: Literal["clean", "recorded", "estimate", "zero"] = "clean",
    solver: Literal["euler", "rk4", "dopri5"] | None = None,
) -> dict[str, Any]:
    """Errors of a checkpoint on a data set, in open loop: the force follows from the motion and its own past alone.

    Args:
        checkpoint: its folder. data: a data set of the same robot, features and sample period. split: of the data.
        start: force at the first sample: the true one, the perturbed one, the model's own estimate, or zero.
        solver: another than the checkpoint's.

    Returns:
        What `hydro evaluate --json` prints: `trajectories`, `outputs` (names [f]; torques of joints too where the
        checkpoint has them), `other_water` (None, or what to say where the data were made in another water than the
        checkpoint's), and `errors`: `mae` and `rmse` [f] in N and N m, base frame; `nrmse` [f] and `pooled` over the
        label's standard deviation; `nrmse_hydrodynamic` [f] and `pooled_hydrodynamic` without buoyancy.

    Raises:
        DataError: they do not fit each other, or the split is empty; the message is the program's.
    """
    chosen = {"split": split, "start": start, "solver": solver}
    places = {"checkpoint": existing("checkpoint", checkpoint), "data": existing("data", data)}
    found: dict[str, Any] = run_json(["evaluate", *flags(places), *flags(chosen)])
    return found
