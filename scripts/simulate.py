#!/usr/bin/env python3
"""Closed loop in Python: replay recorded controls in a scene, print how far it strays from the truth.

    python scripts/simulate.py --rollouts out/rollouts                       # the plugin's water
    python scripts/simulate.py --rollouts out/rollouts --scene mjcf/b1_box_fluid.xml
    python scripts/simulate.py --rollouts out/rollouts --scene mjcf/b1_truth.xml   # no error

Start, joint targets and pushes are those of the recording; only the water differs. Position error:
distance of the base origins [m]. Attitude error: angle of the rotation between the base frames
[degrees]. Needs mujoco and numpy (scripts/requirements.txt), and the plugin library for a scene that
names it.
"""

import argparse
import json
import sys
from pathlib import Path

import mujoco
import numpy as np

from hydro_tools.datasets import DataError, replay, rollouts, scene

#: When the error is read [s].
INSTANTS = (1.0, 2.0, 4.0)


def attitude_error(a: np.ndarray, b: np.ndarray) -> float:
    """Angle between two attitudes (unit quaternions [4]), degrees."""
    difference = np.zeros(3)
    mujoco.mju_subQuat(difference, a, b)
    return float(np.degrees(np.linalg.norm(difference)))


def errors(model: mujoco.MjModel, run: dict[str, np.ndarray], sample_period: float) -> dict[float, tuple[float, float]]:
    """Position [m] and attitude [degrees] error at each of INSTANTS that the run reaches."""
    rows = {round(t / sample_period): t for t in INSTANTS if round(t / sample_period) < len(run["qpos"])}
    out = {}
    for k, data in enumerate(replay.replay(model, run, sample_period)):
        if k in rows:
            truth = run["qpos"][k]
            distance = float(np.linalg.norm(data.qpos[:3] - truth[:3]))
            out[rows[k]] = (distance, attitude_error(data.qpos[3:7], truth[3:7]))
    return out


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rollouts", type=Path, required=True, help="folder of scripts/record_rollouts.py")
    parser.add_argument("--scene", default="mjcf/b1_swim.xml", help="default: %(default)s")
    parser.add_argument("--plugin", type=Path, default=scene.ROOT / "target/release" / replay.library_name(),
                        help="plugin library (default: target/release/...)")
    parser.add_argument("--checkpoint", type=Path, help="checkpoint folder, instead of the scene's")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser.parse_args()


def run(args: argparse.Namespace) -> list[dict]:
    """One entry a rollout: file, density, errors by instant."""
    index, runs = rollouts.read(args.rollouts)
    if replay.PLUGIN in scene.find(args.scene).read_text(encoding="utf-8"):
        replay.load_plugin(args.plugin)
    results = []
    for entry, recorded in zip(index["rollouts"], runs):
        model = replay.compile_scene(args.scene, density=entry["density"], checkpoint=args.checkpoint)
        found = errors(model, recorded, index["sample_period"])
        results.append({"file": entry["file"], "density": entry["density"],
                        "errors": [{"t": t, "position_m": p, "attitude_deg": a} for t, (p, a) in found.items()]})
    if not any(result["errors"] for result in results):
        raise DataError(f"{args.rollouts}: no run lasts {INSTANTS[0]:g} s; record longer ones with --duration")
    return results


def main() -> int:
    args = parse()
    try:
        results = run(args)
    except (DataError, OSError) as error:
        print(f"simulate.py: {error}", file=sys.stderr)
        return 1
    if args.json:
        print(json.dumps({"scene": args.scene, "rollouts": results}))
        return 0
    print(f"{args.scene}, {len(results)} rollouts\n{'t [s]':>6} {'runs':>5} {'position [m]: mean':>19} {'median':>8} {'worst':>8}"
          f" {'attitude [deg]: mean':>21} {'median':>8} {'worst':>8}")
    for t in INSTANTS:
        found = [(e["position_m"], e["attitude_deg"]) for r in results for e in r["errors"] if e["t"] == t]
        if found:
            p, a = np.array(found).T
            print(f"{t:6g} {len(p):5d} {p.mean():19.4f} {np.median(p):8.4f} {p.max():8.4f}"
                  f" {a.mean():21.3f} {np.median(a):8.3f} {a.max():8.3f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
