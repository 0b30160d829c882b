"""A run that nobody fitted, replayed by the nominal and by the patched model in plain MuJoCo.

    python examples/tether/replay.py --patched out/tether/gap/patched.xml --library target/release/libhydro_plugin.so

It starts where the truth starts and gets the same commands. Needs `mujoco` and `numpy`.
"""

import argparse
from pathlib import Path

import make_trials
import mujoco
import numpy as np

#: Times at which the error is told [s].
TIMES = (1.0, 2.0, 5.0)


def replay(path: Path, start: tuple[np.ndarray, np.ndarray], commanded: np.ndarray) -> np.ndarray:
    """Positions [m] at the times asked for, from a start and commands every millisecond."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = start
    places, step = [], model.opt.timestep
    for time in TIMES:
        while data.time < time - step / 2:
            data.ctrl[:] = commanded[round(data.time / make_trials.STEP)]
            mujoco.mj_step(model, data)
        places.append(data.qpos[:3].copy())
    return np.array(places)


def main() -> None:
    """Prints the error of the position for several new runs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--patched", type=Path, required=True)
    parser.add_argument("--library", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=7, help="that of make_trials.py: the same vehicle")
    flags = parser.parse_args()
    mujoco.mj_loadPluginLibrary(str(flags.library.resolve()))
    truth = make_trials.true_model(np.random.default_rng(flags.seed))
    random = np.random.default_rng(1000 + flags.seed)
    errors = {"nominal": [], "patched": []}
    for _ in range(8):
        start, commanded, places = make_trials.motion(truth, random)
        true = np.array([places[round(time / make_trials.STEP)] for time in TIMES])
        for name, path in (("nominal", make_trials.HERE / "nominal.xml"), ("patched", flags.patched)):
            errors[name].append(np.linalg.norm(replay(path, start, commanded) - true, axis=1))
    print("error of the position [m], rms of 8 runs    " + "".join(f"{time:g} s".rjust(9) for time in TIMES))
    for name, found in errors.items():
        rms = np.sqrt(np.mean(np.square(found), axis=0))
        print(f"{name:<44}" + "".join(f"{value:9.3f}" for value in rms))


if __name__ == "__main__":
    main()
