"""The program `hydro`, run for a function of the package: its progress as a bar, its result, its error, Ctrl-C."""

import itertools
import json
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from tqdm.auto import tqdm

from hydro_mujoco_entry import environment, find_program

from .errors import DataError
from .recording.progress import has_bars

#: A line of progress: `likelihoods: 12/40 in 3 s, 7 s left  epoch 2`.
PROGRESS = re.compile(r"(?P<what>[^:]+): (?P<done>\d+)/(?P<total>\d+) in \d+ s(?:, \d+ s left)?\s*(?P<words>.*)")
#: Environment of a program whose lines of progress become a bar: seconds between them.
OFTEN = {"HYDRO_LOG_SECONDS": "0.2"}
#: What the error of the program begins with.
ERROR = "hydro: "
#: Seconds that the program has to stop after Ctrl-C; it takes one.
PATIENCE = 10.0


def run_json(words: Iterable[str | os.PathLike[str]], *, progress: bool = True) -> Any:
    """Run `hydro WORDS --json` and return what it prints.

    progress: show a bar (on a terminal or in a notebook; lines in a log) and what else the program says, on standard
        error.

    Raises:
        DataError: with the program's own message.
        KeyboardInterrupt: after the program has stopped; it leaves what it leaves on the command line.
    """
    try:
        path = find_program()
    except FileNotFoundError as error:
        raise DataError(str(error)) from error
    command = [str(path), *(os.fspath(word) for word in words), "--json"]
    # A process group of its own: Ctrl-C reaches the program once, from here.
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        process_group=0,
        env=environment() | (OFTEN if has_bars(sys.stderr) else {}),
    ) as child:
        printed: list[str] = []
        reader = threading.Thread(target=lambda: printed.extend(child.stdout or ()), daemon=True)
        reader.start()
        try:
            said = _follow(child.stderr or (), progress)
            status = child.wait()
        except BaseException:
            _stop(child)
            raise
        finally:
            reader.join()
    if status:
        raise DataError(_error(said) or f"{path} ended with status {status} and no message")
    try:
        return json.loads("".join(printed))
    except ValueError as error:
        raise DataError(f"{path}: standard output is no JSON ({error}); is it another version's program?") from error


def flags(options: Mapping[str, Any]) -> list[str]:
    """Command-line flags of options: underscores as hyphens, `True` alone, lists by commas; `None`, `False` out."""
    words: list[str] = []
    for name, value in options.items():
        flag = f"--{name.replace('_', '-')}"
        if value is None or value is False:
            continue
        if value is True:
            words.append(flag)
        elif isinstance(value, list | tuple):
            words += [flag, ",".join(map(str, value))]
        else:
            words += [flag, os.fspath(value) if isinstance(value, os.PathLike) else str(value)]
    return words


def folder(name: str, path: str | os.PathLike[str]) -> Path:
    """The path of a folder that is to be written, whose name does not begin like a flag."""
    return _path(name, path)


def existing(name: str, path: str | os.PathLike[str]) -> Path:
    """The path of a file or folder that is there."""
    found = _path(name, path)
    if not found.exists():
        raise DataError(f"{name} is {found}: no such file or folder")
    return found


def _path(name: str, path: str | os.PathLike[str]) -> Path:
    if not isinstance(path, str | os.PathLike):
        raise DataError(f"{name} is a {type(path).__name__}; expected a path")
    # An absolute path cannot be taken for a flag.
    return Path(path).absolute() if os.fspath(path).startswith("-") else Path(path)


def _follow(lines: Iterable[str], progress: bool) -> list[str]:
    """Show progress and remarks until the program closes its standard error; returns its lines without the progress."""
    said: list[str] = []
    bar = _Bar() if has_bars(sys.stderr) else None
    try:
        for line in lines:
            line = line.rstrip("\n")
            found = PROGRESS.fullmatch(line)
            if found is None:
                said.append(line)
            if not progress or _error(said) is not None:
                continue
            if found is not None and bar is not None:
                bar.show(found["what"], int(found["done"]), int(found["total"]), found["words"])
            elif line.strip():
                tqdm.write(line, file=sys.stderr)
    finally:
        if bar is not None:
            bar.close()
    return said


class _Bar:
    """One bar at a time, for the work that the program is at."""

    def __init__(self) -> None:
        self._now: tqdm[Any] | None = None
        self._work: tuple[str, int] | None = None

    def show(self, what: str, done: int, total: int, words: str) -> None:
        """Show that `done` of `total` parts of a work are done."""
        if self._now is None or self._work != (what, total) or done < self._now.n:
            self.close()
            self._now, self._work = tqdm(total=total, desc=what, leave=False), (what, total)
        if words:
            self._now.set_postfix_str(words, refresh=False)
        self._now.update(done - self._now.n)

    def close(self) -> None:
        """Take the bar away."""
        if self._now is not None:
            self._now.close()
            self._now = None


def _error(said: list[str]) -> str | None:
    """The program's error, which is the last that it says."""
    for at, line in enumerate(said):
        if line.startswith(ERROR):
            return "\n".join([line.removeprefix(ERROR), *said[at + 1 :]]).strip()
        if line.startswith("error: "):
            # A flag that was refused; advice on usage follows after an empty line.
            about = itertools.takewhile(str.strip, said[at:])
            return " ".join(part.strip() for part in about).removeprefix("error: ")
    return None


def _stop(child: subprocess.Popen[str]) -> None:
    """Pass Ctrl-C on and wait for the end."""
    if child.poll() is None:
        child.send_signal(signal.SIGINT)
        try:
            child.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
