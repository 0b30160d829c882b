"""Costs of water without a network: microseconds a step of each effect, hull and sea, beside MuJoCo alone.

    python scripts/bench_water.py [--rounds 15]

One free body, implicitfast, 5 ms. Every row is timed in turn with the bare scene, rounds times; printed are
medians and what the water adds to a step. 64 boats in `mujoco.batch`, on one thread and on
two.
"""

import argparse
import json
import time

import mujoco
import numpy as np
from mujoco.batch import Batch

from ..benchmarks import LIBRARY

STEPS = 2000
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
GEOMS = {
    "sphere": '<geom name="hull" type="sphere" size="0.5" mass="250"/>',
    "ellipsoid": '<geom name="hull" type="ellipsoid" size="1 0.5 0.25" mass="250"/>',
    "box": '<geom name="hull" type="box" size="1 0.5 0.25" mass="400"/>',
    "cylinder": '<geom name="hull" type="cylinder" size="0.3 1" mass="250"/>',
    "capsule": '<geom name="hull" type="capsule" size="0.3 1" mass="300"/>',
    "mesh of 320 triangles": '<geom name="hull" type="mesh" mesh="small" mass="250"/>',
    "mesh of 1,280 triangles": '<geom name="hull" type="mesh" mesh="large" mass="250"/>',
}
EFFECTS = {
    "added_mass": [5, 8, 10, 0.5, 0.5, 0.5],
    "linear_drag": [20, 40, 60, 3, 3, 3],
    "quadratic_drag": [20, 40, 60, 3, 3, 3],
}


def sphere_mesh(name: str, level: int) -> str:
    """An icosphere of radius 0.5 m as an MJCF asset."""
    t = (1 + 5**0.5) / 2
    points = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t)]
    points += [(0, -1, -t), (0, 1, -t), (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    points = [np.array(p) / np.linalg.norm(p) for p in points]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6)]
    faces += [(7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10)]
    faces += [(8, 6, 7), (9, 8, 1)]
    for _ in range(level):
        known, finer = {}, []

        def middle(a, b, known=known):
            key = (min(a, b), max(a, b))
            if key not in known:
                centre = points[a] + points[b]
                points.append(centre / np.linalg.norm(centre))
                known[key] = len(points) - 1
            return known[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    vertices = " ".join(f"{0.5 * x:.6f}" for point in points for x in point)
    return f'<mesh name="{name}" vertex="{vertices}" face="{" ".join(str(i) for face in faces for i in face)}"/>'


def scene(geoms: str, effects: list | None, **attributes: str) -> mujoco.MjModel:
    """A free body with these effects; None: without the plugin."""
    extension = plugin = ""
    if effects is not None:
        listed = {"schema": "hydro-effects/1", "effects": effects}
        given = {"effects": json.dumps(listed), **attributes}
        config = "".join(f"<config key=\"{key}\" value='{value}'/>" for key, value in given.items())
        extension = (
            f'<extension><plugin plugin="hydro.wrench"><instance name="w">{config}</instance></plugin></extension>'
        )
        plugin = '<plugin plugin="hydro.wrench" instance="w"/>'
    return mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="0.005" integrator="implicitfast"/>{extension}
  <asset>{sphere_mesh("small", 2)}{sphere_mesh("large", 3)}</asset>
  <worldbody><body name="hull" pos="0 0 0.02"><freejoint/>{plugin}{geoms}<body name="room"/></body></worldbody>
</mujoco>""")


def effect(name: str, values=None) -> dict:
    """One effect on the hull."""
    parameters = dict(zip(AXES, values)) if values else {}
    return {"effect": name, "target": "hull", "parameters": parameters}


def step_time(model: mujoco.MjModel, steps: int) -> float:
    """Microseconds of a step."""
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    data.qvel[:] = 0.1
    start = time.perf_counter()
    mujoco.mj_step(model, data, steps)
    return 1e6 * (time.perf_counter() - start) / steps


def scenes() -> dict:
    """Scenes by name: each with its bare one."""
    box, afloat = GEOMS["box"], {"waterline": "0"}
    rows = {f"`{name}`": (box, [effect(name, values)], {}) for name, values in EFFECTS.items()}
    rows |= {f"hydrostatics, {name}": (geom, [effect("hydrostatics")], afloat) for name, geom in GEOMS.items()}
    boat = [effect("hydrostatics"), *(effect(name, values) for name, values in EFFECTS.items())]
    rows["all four, box afloat"] = (box, boat, afloat)
    one = json.dumps({"schema": "hydro-waves/1", "components": [{"height": 0.2, "period": 6}]})
    short = json.dumps({"schema": "hydro-waves/1", "components": [{"height": 0.1, "period": 2}]})
    sea = {"schema": "hydro-waves/1", "spectrum": "jonswap", "significant_height": 0.3, "peak_period": 10}
    gusts = {"schema": "hydro-current/1", "velocity": [0.2, 0, 0]}
    gusts["random"] = {"deviation": [0.1, 0.1, 0], "time_constant": 20}
    rows["the same in a regular wave"] = (box, boat, {**afloat, "waves": one})
    rows["the same in a short wave, by panels"] = (box, boat, {**afloat, "waves": short})
    rows["the same in a sea of 60 waves"] = (box, boat, {**afloat, "waves": json.dumps(sea | {"peak_period": 14})})
    rows["the same in a random current"] = (box, boat, {**afloat, "current": json.dumps(gusts)})
    return {name: (scene(geom, None), scene(geom, effects, **more)) for name, (geom, effects, more) in rows.items()}


def batch(rounds: int) -> str:
    """64 boats on one thread and on two: seconds, and whether the bits are the same."""
    boat = [effect("hydrostatics"), *(effect(name, values) for name, values in EFFECTS.items())]
    wave = json.dumps({"schema": "hydro-waves/1", "components": [{"height": 0.2, "period": 6}]})
    model = scene(GEOMS["box"], boat, waterline="0", waves=wave)
    times, found = {1: [], 2: []}, {}
    batches = {threads: Batch(model, 64, threads) for threads in times}
    for _ in range(rounds):
        for threads, boats in batches.items():
            boats.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
            boats.bind("qpos")[:, 2] += np.linspace(-0.1, 0.1, 64)
            start = time.perf_counter()
            boats.step(nstep=200)
            times[threads].append(time.perf_counter() - start)
            found[threads] = np.array(boats.bind("qpos"))
    one, two = (np.median(times[threads]) for threads in (1, 2))
    same = "the same bits" if np.array_equal(found[1], found[2]) else "OTHER BITS"
    return f"64 boats, 200 steps: {one:.3f} s on one thread, {two:.3f} s on two ({one / two:.2f} times as fast), {same}"


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15, help="default: %(default)s")
    args = parser.parse_args()
    mujoco.mj_loadPluginLibrary(str(LIBRARY))
    rows = scenes()
    times = {name: ([], []) for name in rows}
    for _ in range(args.rounds):
        for name, pair in rows.items():
            for model, kept in zip(pair, times[name]):
                kept.append(step_time(model, STEPS))
    print("| water | us a step | bare | adds |\n|---|---|---|---|")
    for name, (bare, wet) in times.items():
        added = np.median(np.array(wet) - np.array(bare))
        print(f"| {name} | {np.median(wet):.2f} | {np.median(bare):.2f} | {added:.2f} |")
    print(batch(args.rounds))
    return 0
