"""Trials of a tethered vehicle, as a rig would log them.

    python examples/tether/make_trials.py --out out/tether

The truth is this file, not the effect that is fitted to it: its masses, inertias, drags and thrusters are a few per
cent off the nominal's, it steps four times as fine, its line is a chain of eight cylinders that are dragged each at
its own speed, and its spring sets in gradually and stiffens. Needs `mujoco` and `numpy`.
"""

import argparse
import csv
import json
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).parent
#: The line: stiffness [N/m], length [m], diameter [m], drag coefficient, place on the hull and anchor [m].
LINE = {
    "stiffness": 25.0,
    "length": 2.6,
    "diameter": 0.012,
    "coefficient": 1.2,
    "at": (-0.30, 0.0, 0.05),
    "anchor": (0.0, 0.0, -4.0),
}
#: The spring sets in over this way [m], and pulls 1 + this part of its extension [1/m] as hard.
SOFT, STIFFENING = 0.03, 0.05
SECONDS, PERIOD, STEP = 10.0, 0.02, 0.001


def line_force(place: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Force of the line on the hull [N], world, from the place [m] and the velocity [m/s] of its end."""
    away = place - np.array(LINE["anchor"])
    distance = np.linalg.norm(away)
    along = away / distance
    extension = SOFT * np.logaddexp(0.0, (distance - LINE["length"]) / SOFT)
    force = -LINE["stiffness"] * extension * (1.0 + STIFFENING * extension) * along
    across = velocity - along * (along @ velocity)
    pieces = 8
    for piece in range(pieces):
        share = (piece + 0.5) / pieces
        area = LINE["diameter"] * distance / pieces
        moved = share * across
        # The hull bears its share of the force on a piece.
        force -= share * 0.5 * 1000.0 * LINE["coefficient"] * area * np.linalg.norm(moved) * moved
    return force


def true_model(random: np.random.Generator) -> mujoco.MjModel:
    """The nominal with every uncertain number a little off."""
    model = mujoco.MjModel.from_xml_path(str(HERE / "nominal.xml"))
    model.opt.timestep = STEP
    hull = model.body("hull").id
    model.body_mass[hull] *= 1.015
    model.body_inertia[hull] *= 1.0 + 0.02 * random.standard_normal(3)
    model.geom_fluid[model.geom("hull").id, 1:4] *= 1.0 + 0.02 * random.standard_normal(3)
    gains = 1.0 + 0.02 * random.standard_normal(model.nu)
    model.actuator_gainprm[:, 0] *= gains
    # Ballasted to be neutral all the same.
    foam = model.body("foam").id
    model.body_gravcomp[foam] *= model.body_mass[hull] / 25.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def commands(random: np.random.Generator, times: np.ndarray) -> np.ndarray:
    """Commands of the thrusters [len(times), 6]: out along a heading, with slow turns, slides and dives."""

    def wave(size: float) -> np.ndarray:
        rates, phases = random.uniform(0.3, 1.6, 3), random.uniform(0, 2 * np.pi, 3)
        return size / 3 * np.sin(np.outer(times, rates) + phases).sum(1)

    ahead, aside, turn, up = 0.35 + wave(0.8), wave(0.6), wave(0.12), wave(0.8)
    horizontal = [
        ahead - aside - turn,
        ahead + aside + turn,
        ahead + aside - turn,
        ahead - aside + turn,
    ]
    return np.clip(np.stack([*horizontal, up, up], 1), -1, 1)


def motion(
    model: mujoco.MjModel, random: np.random.Generator, look=lambda step, data: None
) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray, np.ndarray]:
    """Start (positions, velocities), commands and places of the hull [m], each step; `look` sees every state."""
    data = mujoco.MjData(model)
    heading = random.uniform(0, 2 * np.pi)
    data.qpos[:3] = (1.5 * np.cos(heading), 1.5 * np.sin(heading), random.uniform(-3.0, -1.8))
    data.qpos[3:7] = (np.cos(heading / 2), 0, 0, np.sin(heading / 2))
    start = data.qpos.copy(), data.qvel.copy()
    fine = np.arange(round(SECONDS / STEP) + 1) * STEP
    commanded = commands(random, fine)
    hull = model.body("hull").id
    places = []
    for step in range(len(fine)):
        data.ctrl[:] = commanded[step]
        mujoco.mj_forward(model, data)
        places.append(data.qpos[:3].copy())
        look(step, data)
        rotation = data.xmat[hull].reshape(3, 3)
        arm = rotation @ np.array(LINE["at"])
        place, velocity = data.xpos[hull] + arm, data.qvel[:3] + np.cross(rotation @ data.qvel[3:6], arm)
        force = line_force(place, velocity)
        # MuJoCo takes the force at the centre of mass.
        data.xfrc_applied[hull, :3] = force
        data.xfrc_applied[hull, 3:] = np.cross(place - data.xipos[hull], force)
        mujoco.mj_step(model, data)
    return start, commanded, np.array(places)


def trial(model: mujoco.MjModel, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Labels [s], commands and readings of one trial, and the greatest distance from the anchor [m]."""
    nominal_step = mujoco.MjModel.from_xml_path(str(HERE / "nominal.xml")).opt.timestep
    shown, readings = [], []

    def look(step: int, data: mujoco.MjData) -> None:
        if step % round(PERIOD / STEP) == 0:
            shown.append(step)
            readings.append(data.sensordata.copy())

    _, commanded, places = motion(model, random, look)
    # A row shows the state one step of the nominal before its label, as mj_step leaves it.
    labels = np.array(shown) * STEP + nominal_step
    rows = commanded[np.minimum(np.array(shown) + round(nominal_step / STEP), len(commanded) - 1)]
    readings = np.array(readings)
    for sensor in range(model.nsensor):
        start, size = model.sensor_adr[sensor], model.sensor_dim[sensor]
        noise = model.sensor_noise[sensor] * random.standard_normal((len(readings), 4))
        if size == 4:
            for row, turn in zip(readings, noise):
                small = np.array([1.0, *(turn[:3] / 2)])
                mujoco.mju_mulQuat(row[start : start + 4], row[start : start + 4].copy(), small / np.linalg.norm(small))
        else:
            readings[:, start : start + size] += noise[:, :size]
    farthest = np.linalg.norm(places - np.array(LINE["anchor"]), axis=1).max()
    return labels, rows, readings, farthest


def main() -> None:
    """Writes trials/*.csv and truth.json."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--trials", type=int, default=6)
    parser.add_argument("--seed", type=int, default=7)
    flags = parser.parse_args()
    random = np.random.default_rng(flags.seed)
    model = true_model(random)
    folder = flags.out / "trials"
    folder.mkdir(parents=True, exist_ok=True)
    names = ["time"] + [model.actuator(i).name for i in range(model.nu)]
    for i in range(model.nsensor):
        names += [f"{model.sensor(i).name}[{k}]" for k in range(model.sensor_dim[i])]
    for number in range(flags.trials):
        labels, controls, readings, farthest = trial(model, random)
        with open(folder / f"trial_{number:02}.csv", "w", newline="") as file:
            out = csv.writer(file, lineterminator="\n")
            out.writerow(names)
            for row in np.column_stack([labels, controls, readings]):
                out.writerow([f"{value:.9g}" for value in row])
        print(f"trial_{number:02}: up to {farthest:.2f} m from the anchor")
    # Force of the whole line on the hull, for one metre of it and one metre a second across.
    drag = 0.25 * 0.5 * 1000.0 * LINE["coefficient"] * LINE["diameter"]
    truth = {"stiffness": LINE["stiffness"], "length": LINE["length"], "drag_across": drag}
    (flags.out / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")


if __name__ == "__main__":
    main()
