"""What was hidden and what was said, in one file: a table can be made again without the cases.

JSON lines. The first is `{"schema": ...}`, every other a case: its id, what the answer says of it, and by method the
verdict's figures (effects less probable than 5 % that were not named are left out, numbers have five digits).
"""

import json
from pathlib import Path

from .read import Scored, ScoreError

SCHEMA = "hydro-hidden-record/1"
#: Digits of a number.
DIGITS = 5
#: Effects less probable than this are left out.
NEGLIGIBLE = 0.05
#: What the table needs of an answer and of a verdict.
ANSWER = ("kind", "system", "effects", "identifiable", "lookalikes", "twin", "strength")
VERDICT = ("verdict", "named", "effects", "confusion_set", "gap")


def save(path: Path, methods: dict[str, list[Scored]]) -> None:
    """Write the record of some methods on the same cases."""
    lines: dict[str, dict] = {}
    for name, cases in methods.items():
        for case in cases:
            line = lines.setdefault(case.id, {"case": case.id, "methods": {}})
            line["answer"] = {key: case.answer[key] for key in ANSWER if key in case.answer}
            line["methods"][name] = {"verdict": _figures(case.verdict), "seconds": case.seconds}
    text = [json.dumps({"schema": SCHEMA})] + [json.dumps(_short(line), sort_keys=True) for _, line in sorted(lines.items())]
    beside = path.with_name(path.name + ".part")
    beside.write_text("\n".join(text) + "\n")
    beside.replace(path)


def load(paths: list[Path]) -> dict[str, list[Scored]]:
    """Cases by method from the records of different cases."""
    methods: dict[str, list[Scored]] = {}
    seen: dict[str, Path] = {}
    for path in paths:
        for number, line in _lines(path):
            case = line["case"]
            if case in seen:
                raise ScoreError(f"{path}, line {number}: case {case} stands in {seen[case]} already")
            seen[case] = path
            for name, said in line["methods"].items():
                methods.setdefault(name, []).append(Scored(case, line["answer"], said["verdict"], said["seconds"]))
    return {name: sorted(cases, key=lambda case: case.id) for name, cases in methods.items()}


def _lines(path: Path):
    """Number and content of every line but the first."""
    try:
        text = path.read_text().splitlines()
    except OSError as error:
        raise ScoreError(f"{path}: {error.strerror}") from error
    for number, line in enumerate(text, 1):
        try:
            content = json.loads(line)
        except json.JSONDecodeError as error:
            raise ScoreError(f"{path}, line {number}: not JSON: {error}") from error
        if number == 1:
            if content.get("schema") != SCHEMA:
                raise ScoreError(f"{path}: schema is {content.get('schema')!r}, expected {SCHEMA!r}")
            continue
        missing = [key for key in ("case", "answer", "methods") if key not in content]
        if missing:
            raise ScoreError(f"{path}, line {number}: without `{'`, `'.join(missing)}`")
        yield number, content


def _figures(verdict: dict | None) -> dict | None:
    if verdict is None:
        return None
    kept = {key: verdict[key] for key in VERDICT if key in verdict}
    kept["effects"] = [effect for effect in verdict["effects"]
                       if effect["probability"] >= NEGLIGIBLE or effect["effect"] in verdict["named"]]
    return kept


def _short(value):
    """Numbers with a few digits."""
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {key: _short(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_short(item) for item in value]
    return value
