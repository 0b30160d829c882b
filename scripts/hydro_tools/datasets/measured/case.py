"""A measured case as `hydro gap` takes it: nominal.xml and trials."""

import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from ...repository import ROOT
from . import ball_drops, captive, crazyflie, glider, roll_decay, trial

CASES = (roll_decay.CASE, *ball_drops.BALLS, captive.CASE, glider.CASE, *crazyflie.FLIGHTS)


def make_case(case: str, data: Path, out: Path, with_speed: bool) -> list[trial.Trial | captive.Table | glider.Dive]:
    """Write OUT/<case>/nominal.xml, nominal.toml where the scene has one, and the trials; returns them."""
    scene = crazyflie.SCENE if case in crazyflie.FLIGHTS else case
    source = ROOT / "mjcf" / "gap" / f"{scene}.xml"
    folder = out / case
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, folder / "nominal.xml")
    if source.with_suffix(".toml").is_file():
        shutil.copyfile(source.with_suffix(".toml"), folder / "nominal.toml")
    timestep = float(ElementTree.parse(source).find("option").get("timestep"))
    into = folder / "trials"
    if case == captive.CASE:
        made = captive.trials(data)
        for table in made:
            captive.write(table, into)
    elif case == glider.CASE:
        made = glider.trials(data)
        for dive in made:
            glider.write(dive, into, timestep)
    else:
        made = _runs(case, data, with_speed)
        for one in made:
            trial.write(one, into, timestep)
    return made


def _runs(case: str, data: Path, with_speed: bool) -> list[trial.Trial]:
    if case == roll_decay.CASE:
        return roll_decay.trials(data)
    if case in crazyflie.FLIGHTS:
        return crazyflie.trials(data, case)
    return ball_drops.trials(data, case, with_speed)
