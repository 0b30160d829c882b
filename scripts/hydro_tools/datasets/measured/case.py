"""A measured case as `hydro gap` takes it: nominal.xml and trials."""

import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from ...repository import ROOT
from . import ball_drops, crazyflie, roll_decay
from .trial import Trial, write

CASES = (roll_decay.CASE, *ball_drops.BALLS, *crazyflie.FLIGHTS)


def _trials(case: str, data: Path, with_speed: bool) -> tuple[str, list[Trial]]:
    """Name of the scene in mjcf/gap, and the trials."""
    if case == roll_decay.CASE:
        return case, roll_decay.trials(data)
    if case in crazyflie.FLIGHTS:
        return crazyflie.SCENE, crazyflie.trials(data, case)
    return case, ball_drops.trials(data, case, with_speed)


def make_case(case: str, data: Path, out: Path, with_speed: bool) -> list[Trial]:
    """Write OUT/<case>/nominal.xml, nominal.toml where the scene has one, and the trials; returns them."""
    scene, trials = _trials(case, data, with_speed)
    source = ROOT / "mjcf" / "gap" / f"{scene}.xml"
    folder = out / case
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, folder / "nominal.xml")
    if source.with_suffix(".toml").is_file():
        shutil.copyfile(source.with_suffix(".toml"), folder / "nominal.toml")
    timestep = float(ElementTree.parse(source).find("option").get("timestep"))
    for trial in trials:
        write(trial, folder / "trials", timestep)
    return trials
