"""Sound inputs, small and made once, that the campaign damages copies of."""

import hashlib
import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..repository import ROOT
from . import HostileError

#: Samples of a trajectory.
SAMPLES = 40
MODELS = ("attention-ode", "mlp-ode", "relaxation-ode", "cnode", "lstm", "mlp")
#: Sizes of the checkpoints, so that they train in a moment.
SIZES = {
    "attention-ode": ("--hidden=8", "--window=3", "--heads=2", "--embedding=8", "--latent=4"),
    "mlp-ode": ("--hidden=8", "--embedding=8", "--latent=4"),
    "relaxation-ode": ("--hidden=8", "--encoding=raw", "--window=2"),
    "cnode": ("--hidden=8", "--latent=4"),
    "lstm": ("--hidden=8",),
    "mlp": ("--hidden=8",),
}
#: A checkpoint acts on the hull; one attribute a `{name}`.
SCENE = """<mujoco>
  <option timestep="0.002" gravity="0 0 0"/>
  <size memory="4M"/>
  <extension><plugin plugin="hydro.wrench"><instance name="water">{config}</instance></plugin></extension>
  <worldbody>
    <body name="hull"><freejoint/>
      <plugin plugin="hydro.wrench" instance="water"/>
      <geom type="ellipsoid" size="0.3 0.1 0.12" mass="12"/>
      <body name="fin" pos="-0.3 0 0"><joint name="thigh" axis="0 0 1" damping="0.1"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 -0.2 0 0" mass="1"/></body>
    </body>
  </worldbody>
  <actuator><motor name="fin" joint="thigh"/></actuator>
  <sensor><plugin name="water" plugin="hydro.wrench" instance="water"/></sensor>
</mujoco>
"""
EFFECTS = {
    "schema": "hydro-effects/1",
    "effects": [
        {
            "effect": "linear_drag",
            "target": "hull",
            "parameters": {"surge": 10, "sway": 20, "heave": 20, "roll": 1, "pitch": 2, "yaw": 2},
        },
        {"effect": "actuator_delay", "target": "fin", "parameters": {"delay": 0.02}},
    ],
}
#: The nominal of the gap cases: a cart on a spring.
NOMINAL = """<mujoco model="cart">
  <compiler autolimits="true"/>
  <option timestep="0.005" integrator="implicitfast"/>
  <worldbody>
    <body name="cart"><joint name="rail" type="slide" axis="1 0 0" stiffness="20" damping="1"/>
      <geom type="box" size="0.1 0.1 0.1" mass="2"/></body>
  </worldbody>
  <actuator><motor name="pull" joint="rail" gear="5" ctrlrange="-1 1"/></actuator>
  <sensor><jointpos name="at" joint="rail" noise="0.001"/><jointvel name="speed" joint="rail" noise="0.005"/></sensor>
</mujoco>
"""
UNCERTAINTY = (
    "mass = 0.03\ninertia = 0.03\ncom_m = 0.005\nfluid = 0.03\ngain = 0.03\ndamping = 0.03\n\n[elements]\ncart = 0.01\n"
)


@dataclass(frozen=True)
class Bases:
    """Folders of sound inputs, and the two things under test."""

    program: Path
    library: Path
    data: Path
    #: A folder of one checkpoint a kind of model.
    checkpoints: Path
    #: nominal.xml, trials/ (csv), archives/ (npz), uncertainty.toml.
    gap: Path
    #: A finished run of the stages.
    results: Path
    rollouts: Path
    urdf: Path
    own_effects: Path


def make(folder: Path, program: Path, library: Path) -> Bases:
    """Make what `folder` does not hold yet."""
    bases = Bases(
        program,
        library,
        folder / "data",
        folder / "checkpoints",
        folder / "gap",
        folder / "results",
        ROOT / "tests/data/rollouts",
        ROOT / "models/robots/b1.urdf",
        ROOT / "examples/tether/effects.d",
    )
    if (folder / "made").is_file():
        return bases
    write_dataset(bases.data)
    for model in MODELS:
        out = bases.checkpoints / model
        if not out.exists():
            flags = ["--model", model, *SIZES[model], "--epochs=1", "--batch=4", "--horizon=20", "--overwrite"]
            _run(program, "train", "--data", bases.data, "--out", out, *flags)
    write_gap(bases.gap)
    _run(program, "gap", "run", *gap_flags(bases.gap, "trials", bases.results), "--overwrite")
    (folder / "made").touch()
    return bases


def gap_flags(case: Path, trials: str, out: Path) -> list:
    """Flags of `hydro gap` on the case."""
    return ["--model", case / "nominal.xml", "--trials", case / trials, "--out", out, "--threads", "1", "--no-residual"]


def write_dataset(folder: Path, counts: dict[str, int] | None = None) -> None:
    """A data set of two outputs and three features, as `hydro train` reads it."""
    from safetensors.numpy import save

    folder.mkdir(parents=True, exist_ok=True)
    splits = {}
    for salt, (split, count) in enumerate((counts or {"train": 8, "val": 2, "test": 2}).items()):
        x, wrench = np.zeros((count, SAMPLES, 3), "f4"), np.zeros((count, SAMPLES, 2), "f4")
        for trajectory in range(count):
            wave = np.sin(0.2 * (np.arange(SAMPLES) + 7 * trajectory + 31 * salt))
            x[trajectory] = np.stack([wave, 0.5 * wave**2, np.full(SAMPLES, 1000.0 + trajectory)], axis=1)
            wrench[trajectory] = np.stack([20 * wave, -10 * wave**2], axis=1)
        arrays = {
            "x": x,
            "wrench": wrench,
            "wrench_clean": wrench,
            "time": (0.01 * np.arange(SAMPLES)).astype("f4"),
            "condition": np.zeros((count, SAMPLES), "i4"),
        }
        content, file = save(arrays), f"{split}-00000-of-00001.safetensors"
        (folder / file).write_bytes(content)
        shard = {"file": file, "trajectories": count, "sha256": hashlib.sha256(content).hexdigest()}
        splits[split] = {"trajectories": count, "shards": [shard]}
    manifest = {
        "schema": "hydro-dataset/1",
        "name": "hostile",
        "features": ["position.thigh", "linear_velocity.x", "density"],
        "feature_units": ["rad", "m/s", "kg/m^3"],
        "outputs": ["force.x", "force.y"],
        "output_units": ["N", "N"],
        "frames": {"wrench": "base"},
        "sample_period": 0.01,
        "samples": SAMPLES,
        "splits": splits,
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))


def trial_arrays(seed: int) -> dict[str, np.ndarray]:
    """A trial of the cart, whose truth has more damping than the nominal."""
    import mujoco

    rng = np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_string(NOMINAL.replace('damping="1"', 'damping="3"'))
    data = mujoco.MjData(model)
    times, controls, sensors = [], [], []
    phase = rng.uniform(0, 6)
    for step in range(200):
        data.ctrl[0] = 0.8 * np.sin(4 * data.time + phase)
        if step % 2 == 0:
            times.append(data.time)
            controls.append(data.ctrl[0])
        mujoco.mj_step(model, data)
        if step % 2 == 0:
            sensors.append(data.sensordata + rng.normal(size=2) * (0.001, 0.005))
    # A row of sensors labelled t holds those of the state a step before.
    return {
        "control_times": np.array(times),
        "control_data": np.array(controls)[:, None],
        "sensordata_times": np.array(times) + model.opt.timestep,
        "sensordata_data": np.array(sensors),
        "initial_state": np.array([0.0, 0.0, 0.0]),
    }


def csv_text(arrays: dict[str, np.ndarray]) -> str:
    """The same trial as a table."""
    rows = [(t, f"{u!r}", "", "") for t, (u,) in zip(arrays["control_times"].tolist(), arrays["control_data"].tolist())]
    sensors = zip(arrays["sensordata_times"].tolist(), arrays["sensordata_data"].tolist())
    rows += [(t, "", f"{at!r}", f"{speed!r}") for t, (at, speed) in sensors]
    lines = [f"{time!r},{','.join(cells)}" for time, *cells in sorted(rows)]
    return "\n".join(["time,pull,at,speed", *lines]) + "\n"


def write_gap(folder: Path) -> None:
    """A nominal, and three trials of it as csv and as npz."""
    for name in ("trials", "archives"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / "nominal.xml").write_text(NOMINAL)
    (folder / "uncertainty.toml").write_text(UNCERTAINTY)
    for seed in range(3):
        arrays = trial_arrays(seed)
        (folder / f"trials/t{seed}.csv").write_text(csv_text(arrays))
        np.savez(folder / f"archives/t{seed}.npz", **arrays)


def _run(*command) -> None:
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode:
        raise HostileError(f"{' '.join(map(str, command[:3]))}: {done.stderr.strip()[-400:]}")
