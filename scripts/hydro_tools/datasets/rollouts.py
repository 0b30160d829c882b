"""A folder of recorded rollouts (`hydro-rollouts/1`): truth runs for tests and closed-loop comparison.

`rollouts.json` and one npz (f64, no pickles) a run of N sample periods:
time [N+1] s; qpos [N+1,19]; qvel [N+1,18]; ctrl [N,12] rad and push [N,6] (world force [N] and
torque [N m] on the base body, as xfrc_applied), both held over a sample period; x [N+1,35];
wrench_clean, hydrostatic [N+1,6]; density [] kg/m^3. Features and wrench belong to the qpos and qvel
of their own row. Those of strip water (`water` in the index) also have generalised [N+1,18], as in a data
set; gyroscopic [N+1,6], the force of the added mass at qacc = 0 as a wrench on the base; and step_force
[N, steps 18], the whole generalised force in each physics step of a period.
"""

from pathlib import Path

import mujoco
import numpy as np

from hydro_mujoco.reading import check, read_json
from hydro_mujoco.recording.files import npz_bytes, sha256, write_beside, write_json

from . import DataError, plan, scene
from .waters import ELLIPSOID, Water

SCHEMA = "hydro-rollouts/1"
INDEX = "rollouts.json"
#: Largest file of a run [byte] (crates/training/src/rollouts/read.rs).
LARGEST = 1 << 30
#: Arrays of runs in strip water alone.
STRIPS_ALONE = ("generalised", "gyroscopic", "step_force")


def record(
    loaded: scene.Scene,
    seed: int,
    index: int,
    *,
    duration: float,
    density_range: tuple[float, float],
    water: Water = ELLIPSOID,
) -> dict[str, np.ndarray]:
    """Run number `index` of `seed` in a water, `duration` seconds long."""
    periods = round(duration / scene.SAMPLE_PERIOD)
    drawn = plan.rollout(seed, index, samples=periods + 1, density_range=density_range, joint_range=loaded.joint_range)
    run = water.simulate(loaded, [drawn], every_step=True)
    if run.fault[0]:
        raise DataError(f"run {index} diverged ({run.fault[0]})")
    return {
        "time": np.arange(periods + 1) * scene.SAMPLE_PERIOD,
        "qpos": run.qpos[0],
        "qvel": run.qvel[0],
        "ctrl": drawn.ctrl[drawn.warm_up : drawn.warm_up + periods],
        "push": drawn.push[drawn.warm_up : drawn.warm_up + periods],
        "x": run.x[0],
        "wrench_clean": run.wrench[0],
        "hydrostatic": run.hydrostatic[0],
        "density": np.float64(drawn.density[-1]),
    } | {name: run.extra[name][0] for name in STRIPS_ALONE if name in run.extra}


def write_run(out: Path, index: int, arrays: dict[str, np.ndarray]) -> dict:
    """Write one run; returns its entry of the index."""
    path = out / f"rollout-{index:03d}.npz"
    write_beside(path, npz_bytes(arrays))
    return {
        "file": path.name,
        "sha256": sha256(path),
        "density": float(arrays["density"]),
        "duration": float(arrays["time"][-1]),
    }


def write_index(
    out: Path, loaded: scene.Scene, seed: int, command: str, entries: list[dict], water: Water = ELLIPSOID
) -> None:
    """Write `rollouts.json`, last: a folder without it is unfinished."""
    write_json(
        out / INDEX,
        {
            "schema": SCHEMA,
            "model": loaded.path,
            "model_sha256": loaded.sha256,
            "timestep": loaded.model.opt.timestep,
            "sample_period": scene.SAMPLE_PERIOD,
            "seed": seed,
            "command": command,
            "mujoco": mujoco.__version__,
            "features": loaded.layout.names(),
            "joints": list(loaded.joints),
            "rollouts": entries,
        }
        | water.recorded(),
    )


def read(folder: Path) -> tuple[dict, list[dict[str, np.ndarray]]]:
    """The index and the runs of a folder, checked against their sha256."""
    path = folder / INDEX
    index = read_json(path)
    if index.get("schema") != SCHEMA:
        raise DataError(f"{path}: schema {index.get('schema')!r}, expected {SCHEMA!r}")
    runs = []
    for entry in index["rollouts"]:
        file = folder / entry["file"]
        check(file, f"{file}, which {INDEX} lists", LARGEST)
        if sha256(file) != entry["sha256"]:
            raise DataError(f"{file}: its sha256 is not that of {INDEX}; record the folder again")
        with np.load(file, allow_pickle=False) as arrays:
            runs.append(dict(arrays))
    return index, runs
