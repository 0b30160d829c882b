"""Cases, answers and verdicts from disk."""

from dataclasses import dataclass
from pathlib import Path

from hydro_mujoco import DataError
from hydro_mujoco.reading import read_json

#: What a verdict may say.
VERDICTS = ("named", "confusable", "no_gap", "unknown")


#: Systems of our own generators, beside those whose name begins with RANDOM. Every other is others' robot.
OWN = {"vehicle", "leg", "tow", "swim", "bluerov"}
RANDOM = "random_"


class ScoreError(Exception):
    """A file that is not what the contract says."""


@dataclass(frozen=True)
class Scored:
    """One case with what a method said of it; `verdict` is None where there is none."""

    id: str
    answer: dict
    verdict: dict | None
    seconds: float | None

    @property
    def kind(self) -> str:
        """single, null, pair, several, outside or inseparable."""
        return self.answer["kind"]

    @property
    def system(self) -> str:
        """vehicle, leg, tow, swim, bluerov, a stranger's robot, random_tree and so on."""
        return self.answer["system"]

    @property
    def strangers(self) -> bool:
        """True of a robot that others wrote."""
        return self.system not in OWN and not self.system.startswith(RANDOM)

    @property
    def truth(self) -> list[str]:
        """Ids of the hidden effects."""
        return [effect["effect"] for effect in self.answer["effects"]]

    @property
    def strength(self) -> float:
        """Whitened, nuisances projected out."""
        return self.answer["strength"]["projected"]

    @property
    def names(self) -> bool:
        """True where the method names effects."""
        return bool(self.verdict) and self.verdict.get("names", True)

    @property
    def said(self) -> str:
        """The verdict's word; `none` where there is no verdict."""
        return self.verdict["verdict"] if self.verdict else "none"

    @property
    def named(self) -> list[str]:
        """Effects that were added, surrogates aside."""
        if not self.verdict:
            return []
        surrogate = {effect["effect"] for effect in self.verdict.get("effects", []) if effect.get("surrogate")}
        return [effect for effect in self.verdict["named"] if effect not in surrogate]

    @property
    def top(self) -> str | None:
        """The most probable effect of a verdict that claims one."""
        if self.said not in ("named", "confusable") or not self.verdict["effects"]:
            return None
        return max(self.verdict["effects"], key=lambda effect: effect["probability"])["effect"]

    @property
    def surrogate(self) -> bool:
        """A catalogue effect is marked as standing in for something else."""
        return bool(self.verdict) and any(effect.get("surrogate") for effect in self.verdict.get("effects", []))

    @property
    def called(self) -> set[str]:
        """Effects that a verdict puts forward: the named ones and the undecided ones."""
        if not self.verdict:
            return set()
        return set(self.verdict["named"]) | set(self.verdict.get("confusion_set") or [])


def load(cases: Path, sealed: Path, verdicts: Path) -> list[Scored]:
    """Every case that has a sealed answer, in order of its id."""
    ids = sorted(path.parent.name for path in cases.glob("*/case.json"))
    if not ids:
        raise ScoreError(f"{cases}: no case in it (expected folders with a case.json)")
    out = []
    for case in ids:
        answer = sealed / case / "answer.json"
        if not answer.is_file():
            raise ScoreError(f"{answer}: no sealed answer for this case")
        verdict = _verdict(verdicts / case / "verdict.json")
        out.append(Scored(case, _json(answer), verdict, _seconds(verdicts / case / "timing.json", verdict)))
    return out


def _verdict(path: Path) -> dict | None:
    if not path.is_file():
        return None
    verdict = _json(path)
    if verdict.get("verdict") not in VERDICTS:
        raise ScoreError(f"{path}: verdict is {verdict.get('verdict')!r}, expected one of {', '.join(VERDICTS)}")
    for key in ("named", "effects"):
        if not isinstance(verdict.get(key), list):
            raise ScoreError(f"{path}: `{key}` is missing or no list")
    elsewhere = path.with_name("elsewhere.json")
    if elsewhere.is_file():
        verdict["elsewhere"] = _json(elsewhere)
    return verdict


def _json(path: Path) -> dict:
    try:
        return read_json(path)
    except DataError as error:
        raise ScoreError(str(error)) from error


def _seconds(path: Path, verdict: dict | None) -> float | None:
    """`timing.json`: {"seconds": x}, or by stage as `hydro gap` has it, or {"wall_s": x}; else the verdict's own."""
    if not path.is_file():
        return (verdict or {}).get("seconds")
    timing = _json(path)
    seconds = timing.get("seconds", timing.get("wall_s"))
    return sum(seconds.values()) if isinstance(seconds, dict) else seconds
