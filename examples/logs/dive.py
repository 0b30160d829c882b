"""A dive of an ROV, recorded as its logs: a ROS 2 bag, an MCAP file and an ArduPilot DataFlash log.

    python examples/logs/dive.py --out out/logs

Writes nominal.xml, whose water lacks quadratic drag, the logs of a vehicle that has it, and truth.json. Needs
`pip install 'hydro-mujoco[logs]'`.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

import hydro_mujoco as hydro
import writers

HERE = Path(__file__).resolve().parent
#: What the nominal knows of the water (M. von Benzon et al., J. Mar. Sci. Eng. 10(12), 1898, 2022), and what it lacks.
KNOWN = {
    "added_mass": {"surge": 6.36, "sway": 7.12, "heave": 18.68, "roll": 0.189, "pitch": 0.135, "yaw": 0.222},
    "linear_drag": {"surge": 13.7, "sway": 11, "heave": 33, "roll": 0.5, "pitch": 0.8, "yaw": 0.5},
    "net_buoyancy": {"force": 133.0},
    "buoyancy_offset": {"x": 0, "y": 0, "z": 0.02},
}
LACKING = {"quadratic_drag": {"surge": 141, "sway": 217, "heave": 190, "roll": 1.19, "pitch": 0.47, "yaw": 1.5}}
#: Standard deviations of readings, by sensor; of an attitude [rad].
NOISE = {"imu_gyro": 0.003, "attitude": 0.004, "position": 0.01, "dvl": 0.01, "velocity": 0.02}
EPOCH = 1_790_000_000 * 10**9


@dataclass(frozen=True)
class Dive:
    """A run, a row a step. times: [s]; commands: (n, 8), held for 20 ms; readings: of each sensor, without noise."""

    times: np.ndarray
    commands: np.ndarray
    readings: dict[str, np.ndarray]


def vehicle(effects: dict) -> mujoco.MjSpec:
    """The ROV in water with these effects."""
    spec = mujoco.MjSpec.from_file(str(HERE / "rov.xml"))
    return hydro.add_water(spec, body="rov", effects=effects)


def swim(seconds: float = 60.0, seed: int = 1) -> Dive:
    """The truth, driven about by slow waves of all six wrenches, its depth held."""
    model = vehicle(KNOWN | LACKING).compile()
    data = mujoco.MjData(model)
    random = np.random.default_rng(seed)
    steps = round(seconds / model.opt.timestep)
    rates, phases = random.uniform(0.4, 2.5, (6, 4)), random.uniform(0, 2 * np.pi, (6, 4))
    sizes = np.array([0.35, 0.35, 0.25, 0.02, 0.02, 0.06])
    mix = np.array(
        [
            [1, 1, 1, 1, 0, 0, 0, 0],
            [1, -1, -1, 1, 0, 0, 0, 0],
            [0, 0, 0, 0, 1, 1, 1, 1],
            [0, 0, 0, 0, -1, 1, -1, 1],
            [0, 0, 0, 0, -1, -1, 1, 1],
            [1, -1, 1, -1, 0, 0, 0, 0],
        ]
    )
    times, commands, readings = [], [], []
    for step in range(steps):
        time = data.time
        if step % round(0.02 / model.opt.timestep) == 0:
            wrench = sizes * np.sin(rates * time + phases).mean(1) * 2
            wrench[2] += 0.3 * np.clip(-2.0 - data.qpos[2], -1, 1)
            data.ctrl[:] = np.clip(wrench @ mix, -1, 1)
        times.append(time)
        commands.append(data.ctrl.copy())
        mujoco.mj_step(model, data)
        # mj_step has read the sensors at its start.
        readings.append(data.sensordata.copy())
    table = np.array(readings)
    sensors = [model.sensor(name) for name in NOISE]
    found = {s.name: table[:, s.adr[0] : s.adr[0] + s.dim[0]] for s in sensors}
    return Dive(np.round(times, 6), np.array(commands), found)


def noisy(dive: Dive, seed: int = 2) -> dict[str, np.ndarray]:
    """Readings as instruments give them."""
    random = np.random.default_rng(seed)
    found = {}
    for name, values in dive.readings.items():
        noise = NOISE[name] * random.standard_normal((len(values), 3))
        if name != "attitude":
            found[name] = values + noise
            continue
        turned = np.zeros_like(values)
        for row, (quaternion, turn) in enumerate(zip(values, noise)):
            small = np.array([1.0, *(turn / 2)])
            mujoco.mju_mulQuat(turned[row], quaternion, small / np.linalg.norm(small))
        found[name] = turned
    return found


def main() -> None:
    """Write the logs of a dive."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    flags = parser.parse_args()
    flags.out.mkdir(parents=True, exist_ok=True)
    nominal = vehicle(KNOWN)
    nominal.compile()
    (flags.out / "nominal.xml").write_text(nominal.to_xml())
    (flags.out / "truth.json").write_text(json.dumps(LACKING, indent=1) + "\n")
    dive = swim(flags.seconds, flags.seed)
    readings = noisy(dive, flags.seed + 1)
    writers.rosbag(flags.out / "dive_ros2", dive.times, dive.commands, readings, EPOCH)
    writers.mcap(flags.out / "dive.mcap", dive.times, dive.commands, readings, EPOCH)
    writers.dataflash(flags.out / "dive.bin", dive.times, dive.commands, readings)
    speed = np.linalg.norm(dive.readings["dvl"], axis=1)
    deepest = -dive.readings["position"][:, 2].min()
    print(f"{flags.out}: {flags.seconds:g} s, up to {speed.max():.2f} m/s, {deepest:.2f} m deep")


if __name__ == "__main__":
    main()
