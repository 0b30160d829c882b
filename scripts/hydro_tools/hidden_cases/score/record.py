"""Answers and verdicts in one file, from which the table can be made again without the cases.

JSON lines. The first is `{"schema": ..., "methods": [...]}`. Every other line is a case: its id, its answer, and by
method the part of the verdict that the table needs: the likeliest effect, the effects that were named or marked as a
surrogate, any above 5 %, and the errors before and after on the trials kept back. Numbers have five digits.
"""

import json
from pathlib import Path

from hydro_mujoco import DataError
from hydro_mujoco.reading import read_text

from .read import Scored, ScoreError

SCHEMA = "hydro-hidden-record/1"
#: Digits of a number.
DIGITS = 5
#: Effects less probable than this are left out.
NEGLIGIBLE = 0.05
#: What the table needs of an answer and of a verdict.
ANSWER = ("kind", "system", "effects", "identifiable", "lookalikes", "twin", "strength")
VERDICT = ("verdict", "named", "confusion_set", "names")
CALIBRATION = ("alarm", "alarm_level")


def save(path: Path, methods: dict[str, list[Scored]]) -> None:
    """Write the record of some methods on the same cases."""
    lines: dict[str, dict] = {}
    for name, cases in methods.items():
        for case in cases:
            line = lines.setdefault(case.id, {"case": case.id, "methods": {}})
            line["answer"] = {key: case.answer[key] for key in ANSWER if key in case.answer}
            line["methods"][name] = {"verdict": _figures(case.verdict), "seconds": case.seconds}
    head = {"schema": SCHEMA, "methods": list(methods)}
    text = [json.dumps(head)] + [json.dumps(_short(line), sort_keys=True) for _, line in sorted(lines.items())]
    beside = path.with_name(path.name + ".part")
    try:
        beside.write_text("\n".join(text) + "\n")
        beside.replace(path)
    except OSError as error:
        raise ScoreError(f"{path}: {error.strerror}") from error


def load(paths: list[Path], only: str | None = None) -> dict[str, list[Scored]]:
    """Cases by method from the records of different cases; `only`: of this method, whatever others a record has."""
    methods: dict[str, list[Scored]] = {}
    seen: dict[tuple[str, str], Path] = {}  # by id and system: generators of one seed may give one id
    for path in paths:
        names, lines = _read(path)
        if only and only not in names:
            raise ScoreError(f"{path}: no method {only!r} (there is {', '.join(names)})")
        names = [only] if only else names
        if seen and names != list(methods):
            raise ScoreError(
                f"{path}: methods {', '.join(names)}, expected {', '.join(methods)} as in the files before"
            )
        methods |= {name: methods.get(name, []) for name in names}
        for number, line in lines:
            place = f"{path}, line {number}"
            case, answer, said = (_part(line, key, place) for key in ("case", "answer", "methods"))
            for key in ("kind", "system", "effects", "strength"):
                _part(answer, key, place)
            known = case, answer["system"]
            if known in seen:
                raise ScoreError(f"{place}: case {case} stands in {seen[known]} already")
            seen[known] = path
            for name in names:
                of = _part(said, name, place)
                methods[name].append(Scored(case, answer, _part(of, "verdict", place), _part(of, "seconds", place)))
    if not seen:
        raise ScoreError(f"{', '.join(map(str, paths))}: no case in it")
    return {name: sorted(cases, key=lambda case: case.id) for name, cases in methods.items()}


def _read(path: Path) -> tuple[list[str], list[tuple[int, dict]]]:
    """Names of the methods, and number and content of every line of a case."""
    try:
        text = read_text(path).splitlines()
    except DataError as error:
        raise ScoreError(str(error)) from error
    lines = []
    for number, line in enumerate(text, 1):
        try:
            content = json.loads(line)
        except json.JSONDecodeError as error:
            raise ScoreError(f"{path}, line {number}: not JSON: {error}") from error
        if not isinstance(content, dict):
            raise ScoreError(f"{path}, line {number}: expected an object, found {line[:40]!r}")
        lines.append((number, content))
    head = lines[0][1] if lines else {}
    if head.get("schema") != SCHEMA:
        raise ScoreError(f"{path}: schema is {head.get('schema')!r}, expected {SCHEMA!r}")
    return _part(head, "methods", f"{path}, line 1"), lines[1:]


def _part(of: dict, key: str, place: str):
    if not isinstance(of, dict):
        raise ScoreError(f"{place}: expected an object with `{key}`, found {of!r:.40}")
    if key not in of:
        raise ScoreError(f"{place}: without `{key}` (there is {', '.join(map(repr, of)) or 'nothing'})")
    return of[key]


def _figures(verdict: dict | None) -> dict | None:
    if verdict is None:
        return None
    likeliest = max((effect["probability"] for effect in verdict["effects"]), default=0.0)
    effects = [
        effect
        for effect in verdict["effects"]
        if effect["probability"] >= min(NEGLIGIBLE, likeliest)
        or effect["effect"] in verdict["named"]
        or effect.get("surrogate")
    ]
    gap = {"reduction": (verdict.get("gap") or {}).get("reduction")}
    elsewhere = {
        regime: {side: gap[side] for side in ("before", "after")}
        for regime, gap in (verdict.get("elsewhere") or {}).items()
    }
    alarm = {key: value for key, value in (verdict.get("calibration") or {}).items() if key in CALIBRATION}
    return {key: verdict[key] for key in VERDICT if key in verdict} | {
        **({"calibration": alarm} if alarm else {}),
        "effects": effects,
        "gap": gap,
        **({"elsewhere": elsewhere} if elsewhere else {}),
    }


def _short(value):
    """Numbers with a few digits."""
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {key: _short(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_short(item) for item in value]
    return value
