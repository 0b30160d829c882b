"""Closed loop in Python: replay recorded controls in a scene, print how far it strays from the truth.

    python scripts/simulate.py --rollouts out/rollouts                       # the plugin's water
    python scripts/simulate.py --rollouts out/rollouts --scene mjcf/b1_box_fluid.xml
    python scripts/simulate.py --rollouts out/rollouts --scene mjcf/b1_truth.xml   # no error
    python scripts/simulate.py --rollouts out/strip --water strip   # no error but for the first wakes

Start, joint targets and pushes are those of the recording; only the water differs. Position error:
distance of the base origins [m]. Attitude error: angle of the rotation between the base frames
[degrees]. Joint error: root mean square over the joints [degrees]. A checkpoint of another water than
that of the rollouts is said. Needs mujoco and numpy (pip install -e . -e scripts), and the plugin
library for a scene that names it.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from hydro_mujoco import plugin
from hydro_tools.datasets import DataError, replay, rollouts, scene
from hydro_tools.datasets.closed_loop import INSTANTS, errors
from hydro_tools.datasets.waters import STRIP
from hydro_tools.repository import ROOT


def parse() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rollouts", type=Path, required=True, help="folder of scripts/record_rollouts.py")
    parser.add_argument("--scene", default="mjcf/b1_swim.xml", help="default: %(default)s")
    parser.add_argument(
        "--plugin",
        type=Path,
        default=ROOT / "target/release" / plugin.library_name(),
        help="plugin library (default: target/release/...)",
    )
    parser.add_argument("--checkpoint", type=Path, help="checkpoint folder, instead of the scene's")
    parser.add_argument(
        "--water",
        choices=[STRIP.name],
        help="the truth of that water in place of a scene's; its wakes begin as in steady motion",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser.parse_args()


def run(args: argparse.Namespace) -> list[dict]:
    """One entry a rollout: file, density, errors by instant."""
    index, runs = rollouts.read(args.rollouts)
    loaded = scene.load(STRIP.model) if args.water else None
    trained = replay.water_of(args.scene, args.checkpoint) if loaded is None else {"name": args.water}
    told = index.get("water")
    if trained != told and (loaded is None or (told or {}).get("name") != args.water):
        print(
            f"simulate.py: WARNING: ANOTHER WATER. Simulated in: {_words(trained)}; {args.rollouts} was recorded in: "
            f"{_words(told)}",
            file=sys.stderr,
        )
    if loaded is None and plugin.WRENCH in scene.find(args.scene).read_text(encoding="utf-8"):
        plugin.load_plugin(args.plugin)
    results = []
    for entry, recorded in zip(index["rollouts"], runs):
        if loaded is not None:
            states = replay.replay_in_strips(loaded, recorded)
        else:
            model = replay.compile_scene(args.scene, density=entry["density"], checkpoint=args.checkpoint)
            states = replay.replay(model, recorded, index["sample_period"])
        found = errors(states, recorded, index["sample_period"])
        results.append(
            {
                "file": entry["file"],
                "density": entry["density"],
                "errors": [
                    {"t": t, "position_m": e.position, "attitude_deg": e.attitude, "joints_deg": e.joints}
                    for t, e in found.items()
                ],
            }
        )
    if not any(result["errors"] for result in results):
        raise DataError(f"{args.rollouts}: no run lasts {INSTANTS[0]:g} s; record longer ones with --duration")
    return results


def _words(water: dict | None) -> str:
    """A water's name and where its added mass is."""
    if water is None:
        return "MuJoCo's own, or one that is not named"
    inertia = water.get("added_mass")
    return water["name"] + (f" (added mass in the {inertia})" if inertia else "")


def main() -> int:
    """Run the command line; returns the exit status."""
    args = parse()
    try:
        results = run(args)
    except (DataError, OSError) as error:
        print(f"simulate.py: {error}", file=sys.stderr)
        return 1
    if args.json:
        print(json.dumps({"scene": args.water or args.scene, "rollouts": results}))
        return 0
    print(
        f"{args.water or args.scene}, {len(results)} rollouts\n"
        f"{'t [s]':>6} {'runs':>5} {'position [m]: mean':>19} {'median':>8} {'worst':>8}"
        f" {'attitude [deg]: mean':>21} {'median':>8} {'worst':>8} {'joints [deg]: median':>21}"
    )
    for t in INSTANTS:
        found = [
            (e["position_m"], e["attitude_deg"], e["joints_deg"]) for r in results for e in r["errors"] if e["t"] == t
        ]
        if found:
            p, a, j = np.array(found).T
            print(
                f"{t:6g} {len(p):5d} {p.mean():19.4f} {np.median(p):8.4f} {p.max():8.4f}"
                f" {a.mean():21.3f} {np.median(a):8.3f} {a.max():8.3f} {np.median(j):21.3f}"
            )
    return 0
