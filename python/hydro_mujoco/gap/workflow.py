"""`hydro gap run`: where simulation and measurement disagree, what is missing, and whether adding it helps."""

import os
from pathlib import Path
from typing import Literal

from ..errors import DataError
from ..program import existing, flags, folder, run_json
from .case import Case, case
from .trials import Trials, write


def run(
    nominal: str | os.PathLike[str],
    trials: Trials,
    *,
    out: str | os.PathLike[str],
    uncertainty: str | os.PathLike[str] | None = None,
    effects: str | os.PathLike[str] | None = None,
    medium: Literal["none", "air", "water"] | None = None,
    holdout: float = 0.25,
    seed: int = 0,
    threads: int | None = None,
    residual: bool = True,
    overwrite: bool = False,
    progress: bool = True,
) -> Case:
    """Find what a nominal model lacks beside measured trials; the program `hydro gap run` does the work.

    Called again with the same inputs it reuses the stages in `out`; stopped by Ctrl-C it goes on from them.

    Args:
        nominal: MJCF of the nominal model. Its sensors and actuators are those of the trials, by name; a sensor's
            `noise` is its standard deviation.
        trials: a folder of npz (as `mujoco.sysid` writes them) and csv files; or several trials, each a file, a
            `mujoco.sysid.SystemTrajectory`, or a dict of arrays: `control_times` [N] s, `control_data` [N, nu],
            `sensordata_times` [M] s, `sensordata_data` [M, nsensordata] in MuJoCo's units and frames, where known
            `initial_state` [nstate] (full physics). They are written into `out/trials`. A row of sensors labelled t
            is of the state at t - timestep, as `mj_step` gives it.
        out: folder of results: verdict.json, report.html, patched.xml, one JSON a stage.
        uncertainty: nominal.toml with standard deviations of the nominal's numbers; 3 % of each by default.
        effects: folder of effects of your own; by default `effects.d` beside the model, where it is.
        medium: that the robot moves in; by default what the model tells of.
        holdout: part of the trials that only the last stage sees, above 0 and below 1.
        seed: of every draw. threads: all cores by default; results do not depend on it.
        residual: offer a learned force where no effect explains the difference.
        overwrite: start anew though `out` holds results of other inputs.
        progress: show a bar.

    Raises:
        DataError: model, trials or an option are at fault; the message is the program's.
        KeyboardInterrupt: after the program has stopped; finished stages stay in `out`, and the same call goes on.

    Source: docs/gap.md has the method, the options and how sure an answer is.

    A cart whose nominal has no damping, and four runs of one that has 3 N s/m:

    >>> import mujoco, numpy as np
    >>> from pathlib import Path
    >>> from hydro_mujoco import gap
    >>> cart = '''<mujoco><worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0" damping="{}"/>
    ...   <geom size=".1" mass="2"/></body></worldbody>
    ...   <actuator><motor name="motor" joint="rail" ctrlrange="-10 10"/></actuator>
    ...   <sensor><jointpos name="x" joint="rail" noise="0.001"/><jointvel name="v" joint="rail" noise="0.002"/>
    ...   </sensor><option timestep="0.01"/></mujoco>'''
    >>> def measured(seed):
    ...     model, random = mujoco.MjModel.from_xml_string(cart.format(3)), np.random.default_rng(seed)
    ...     data, times = mujoco.MjData(model), 0.01 * np.arange(401)
    ...     rates, phases = random.uniform(1, 8, 3), random.uniform(0, 6, 3)
    ...     force = sum(a * np.sin(w * times + p) for a, w, p in zip((6, 3, 2), rates, phases))
    ...     rows = []
    ...     for push in force[:-1]:
    ...         data.ctrl[0] = push
    ...         mujoco.mj_step(model, data)
    ...         rows.append(data.sensordata + random.normal(size=2) * model.sensor_noise)
    ...     return {"control_times": times, "control_data": force[:, None],
    ...             "sensordata_times": times[1:], "sensordata_data": np.array(rows)}
    >>> _ = Path("nominal.xml").write_text(cart.format(0))
    >>> case = gap.run("nominal.xml", [measured(seed) for seed in range(4)], out="out", medium="none", progress=False)
    >>> case.verdict["verdict"], [(each.effect, each.target) for each in case.named]
    ('named', [('joint_damping', 'rail')])
    >>> (damping,) = case.named[0].parameters.values()
    >>> damping.unit, damping.ci95[0] < 3 < damping.ci95[1]
    ('N s/m', True)
    >>> bool(abs(mujoco.MjModel.from_xml_path(str(case.patched)).dof_damping[0] - damping.value) < 1e-6)
    True
    """
    model, results = existing("nominal", nominal), folder("out", out)
    if isinstance(trials, str | os.PathLike):
        trials_folder = existing("trials", trials)
        if not trials_folder.is_dir():
            raise DataError(f"trials is {trials_folder}; expected a folder, or a list of files")
    else:
        trials_folder = results / "trials"
        write(trials, trials_folder, overwrite=overwrite)
    options = {
        "uncertainty": None if uncertainty is None else existing("uncertainty", uncertainty),
        "effects": None if effects is None else existing("effects", effects),
        "medium": medium,
        "holdout": holdout,
        "seed": seed,
        "threads": threads,
        "no_residual": not residual,
        "overwrite": overwrite,
    }
    words = flags({"model": model, "trials": trials_folder, "out": results} | options)
    return case(Path(results), run_json(["gap", "run", *words], progress=progress))
