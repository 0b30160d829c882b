"""The commands, small enough to be run some hundred times, and what they are given."""

import json
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..hostile import bases
from ..repository import ROOT, SCRIPTS

#: A swimmer of two links in MuJoCo's own fluid.
SWIMMER = """<mujoco model="swimmer">
  <option timestep="0.005" density="1000" viscosity="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="hull" gravcomp="1"><freejoint/>
      <geom type="ellipsoid" size="0.3 0.1 0.12" mass="12" fluidshape="ellipsoid"/>
      <body name="fin" pos="-0.3 0 0" gravcomp="1"><joint name="tail" axis="0 0 1" range="-1 1" damping="0.1"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 -0.2 0 0" mass="1" fluidshape="ellipsoid"/></body>
    </body>
  </worldbody>
  <actuator><motor name="fin" joint="tail" ctrlrange="-1 1"/></actuator>
</mujoco>
"""
MAPPING = """schema = "hydro-mapping/1"

[time]
clock = "time"

[trials]
length = 0.1

[sensors.at]
field = "at"
unit = "m"

[sensors.speed]
field = "speed"
unit = "m/s"

[actuators.pull]
field = "pull"
"""


@dataclass(frozen=True)
class Job:
    """A command that writes into the folder in which it is started."""

    command: tuple[str, ...]
    #: Words that it takes to go on.
    again: tuple[str, ...]
    #: What it says when it goes on.
    says: re.Pattern[str]
    #: True where a run left something in its folder for the next one to go on from.
    left: Callable[[Path], bool]
    #: What stands in its folder before the first run, if anything does.
    given: Path | None = None


#: Times of the row of `hydro compare`, in its folder beforehand, so that none are taken.
COST = {"entry": "relaxation-ode", "machine": "none"} | {
    name: {"median": 1.0, "quartiles": [1.0, 1.0]} for name in ("stepped", "one", "many")
}


def make(folder: Path, program: Path) -> dict[str, Job]:
    """Write what the commands read, and list them."""
    folder.mkdir(parents=True, exist_ok=True)
    model, log, mapping = folder / "swimmer.xml", folder / "log.csv", folder / "map.toml"
    model.write_text(SWIMMER)
    mapping.write_text(MAPPING)
    log.write_text(_log())
    data, gap = folder / "data", folder / "gap"
    bases.write_dataset(data)
    bases.write_gap(gap)
    timed = folder / "timed"
    (timed / "out").mkdir(parents=True, exist_ok=True)
    (timed / "out/cost.json").write_text(json.dumps({"2": [COST]}))

    def python(*words: object) -> tuple[str, ...]:
        return (sys.executable, *map(str, words))

    sizes = ("--trials=20", "--samples=60", "--shard-size=2", "--workers=2")
    train = ("--model=mlp-ode", "--hidden=32", "--embedding=16", "--latent=8", "--batch=4", "--horizon=40")
    length = ("--epochs=600", "--patience=1000")
    resume = ("--resume",)
    going_on = re.compile(r"going on after [1-9]\d*")
    return {
        "gen_task2.py": Job(
            python(SCRIPTS / "gen_task2.py", "--water=ellipsoid", "--out", "out", *sizes), resume, going_on, _has_shards
        ),
        "hydro_mujoco.record": Job(
            python("-m", "hydro_mujoco.record", "--model", model, "--out", "out", *sizes), resume, going_on, _has_shards
        ),
        "hydro train": Job(
            (str(program), "train", "--data", str(data), "--out", "out", *train, *length),
            resume,
            re.compile("going on after|trained already"),
            lambda place: Path(place, "out.run/state.safetensors").exists(),
        ),
        "hydro compare": Job(
            (
                str(program), "compare", "task2", "--data", str(data), "--out", "out", "--entries=relaxation-ode",
                "--seeds=0,1", "--epochs=30",
            ),
            (),
            re.compile(r"[1-9]\d* (done already|begun)"),
            _has_jobs,
            timed,
        ),
        "hydro gap run": Job(
            tuple(map(str, (program, "gap", "run", *bases.gap_flags(gap, "trials", Path("out"))))),
            (),
            re.compile("going on after"),
            lambda place: Path(place, "out/find.json").exists(),
        ),
        "hydro trials convert": Job(
            python(
                "-m", "hydro_mujoco.trials", "convert", log, "--model", gap / "nominal.xml", "--mapping", mapping,
                "--out", "out",
            ),
            (),
            re.compile("was cut short"),
            lambda place: Path(place, "out/.log.unfinished").exists() and any(place.glob("out/*.npz")),
        ),
    }  # fmt: skip


def environment() -> dict[str, str]:
    """Where the commands find the packages of this repository."""
    return {"PYTHONPATH": f"{ROOT / 'python'}:{SCRIPTS}", "RUST_BACKTRACE": "0", "HYDRO_LOG_SECONDS": "0.2"}


def _has_shards(place: Path) -> bool:
    """True where a growing data set lists a shard. One that was written and not yet listed is made again."""
    path = place / "out/generation.json"
    return path.exists() and bool(json.loads(path.read_text())["finished"])


def _has_jobs(place: Path) -> bool:
    """True where a comparison has a job with an epoch behind it."""
    return any(place.glob("out/jobs/*/*/*/run/state.safetensors")) or any(place.glob("out/jobs/*/*/*/result.json"))


def _log() -> str:
    """The cart's three trials, one after another, as a table of a logger."""
    rows, before = [], 0.0
    for seed in range(3):
        arrays = bases.trial_arrays(seed)
        times = arrays["sensordata_times"] - arrays["sensordata_times"][0] + before
        columns = (times, arrays["control_data"][:, 0], *arrays["sensordata_data"].T)
        rows += np.column_stack(columns).tolist()
        before = times[-1] + 0.01
    return "\n".join(["time,pull,at,speed", *(",".join(map(repr, row)) for row in rows)]) + "\n"
