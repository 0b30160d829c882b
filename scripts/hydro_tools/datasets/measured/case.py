"""A measured case as `hydro gap` takes it: nominal.xml and trials."""

import shutil
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from ...repository import ROOT
from . import ball_drops, roll_decay
from .trial import Trial, write

CASES = (roll_decay.CASE, *ball_drops.BALLS)


def make_case(case: str, data: Path, out: Path, with_speed: bool) -> list[Trial]:
    """Write OUT/<case>/nominal.xml and its trials; returns them."""
    source = ROOT / "mjcf" / "gap" / f"{case}.xml"
    trials = roll_decay.trials(data) if case == roll_decay.CASE else ball_drops.trials(data, case, with_speed)
    folder = out / case
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, folder / "nominal.xml")
    timestep = float(ElementTree.parse(source).find("option").get("timestep"))
    for trial in trials:
        write(trial, folder / "trials", timestep)
    return trials
