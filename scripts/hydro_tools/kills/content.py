"""What a folder holds, without what two undisturbed runs do not share: times, memory, the words of the last command."""

import hashlib
import json
import re
from pathlib import Path

#: Files whose content is times and memory.
FREE = {"timing.json"}
#: Members of JSON objects that name the last command, and digests over them.
COMMANDS = ("command", "card_sha256")
#: Files of `hydro compare`, and their members, at any depth, of what a training cost: fewer jobs have more threads.
COMPARISON = {"compare.json", "result.json", "training.json"}
COSTS = {"seconds", "train_seconds", "threads", "peak_memory", "peak_memory_mib"}
_TIMES = re.compile(rb'<p class="note">Time: [^<]*</p>')
#: The last two columns of the table of what a training costs [s], [MiB].
_COLUMNS = re.compile(rb"\| \d+ \| \d+ \|$", re.MULTILINE)


def content(folder: Path) -> dict[str, str]:
    """Digest by path of every file and link below; of a folder and a link the kind."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_symlink() or path.is_dir():
            found[name] = "link" if path.is_symlink() else "folder"
        elif path.name in FREE:
            found[name] = "free"
        else:
            found[name] = hashlib.sha256(plain(path.name, path.read_bytes())).hexdigest()
    return found


def plain(name: str, found: bytes) -> bytes:
    """The bytes of a file without what may differ."""
    if name == "report.html":
        return _TIMES.sub(b"", found)
    if name == "README.md":
        return _COLUMNS.sub(b"", found)
    if not name.endswith(".json"):
        return found
    try:
        value = json.loads(found)
    except ValueError:
        return found
    if not isinstance(value, dict):
        return found
    value = {key: part for key, part in value.items() if key not in COMMANDS}
    if isinstance(value.get("written"), dict):
        # The report's digest counts its times.
        value["written"] = value["written"] | {"report.html": None}
    if name in COMPARISON:
        value = _without_costs(value)
    return json.dumps(value).encode()


def _without_costs(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_costs(part) for key, part in value.items() if key not in COSTS}
    return [_without_costs(part) for part in value] if isinstance(value, list) else value


def differences(expected: dict[str, str], found: dict[str, str]) -> str:
    """Names of what is missing, too much or other; empty where the two are the same."""
    kinds = {
        "missing": expected.keys() - found.keys(),
        "left over": found.keys() - expected.keys(),
        "other bytes": {name for name in expected.keys() & found.keys() if expected[name] != found[name]},
    }
    return "; ".join(f"{kind}: {', '.join(sorted(names)[:4])}" for kind, names in kinds.items() if names)
