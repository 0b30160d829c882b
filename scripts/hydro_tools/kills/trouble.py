"""A command started, watched, and disturbed."""

import os
import random
import re
import resource
import signal
import subprocess
import time
from dataclasses import dataclass, replace
from pathlib import Path

from .jobs import environment

#: Seconds that a command may take, and that its workers may outlive it.
PATIENCE, WORKERS = 600.0, 10.0
_ABORT = re.compile(r"panicked at|Traceback \(most|memory allocation of")

#: What the one says that is refused: the other one is at work, or was.
_OTHER = re.compile(r"process \d+ .*at work there|is there already")


@dataclass(frozen=True)
class End:
    """How a command ended. status: negative for a signal, `None` where it had no end in time."""

    status: int | None
    text: str
    #: Something that must not be, or "".
    broken: str = ""
    #: Seconds from the start until something stood in the folder, and until the end; changes seen in the folder.
    first: float = 0.0
    seconds: float = 0.0
    changes: int = 0
    #: Size of the largest file [byte].
    largest: int = 0


@dataclass(frozen=True)
class Moment:
    """When to strike: seconds after the start, or at the so-manieth change of the folder."""

    seconds: float = PATIENCE
    change: int = 1 << 30

    @staticmethod
    def draw(undisturbed: End, chance: random.Random) -> "Moment":
        """One moment of such a run: half of them at a change of a file, where half-written ones would be."""
        if chance.random() < 0.5:
            return Moment(change=chance.randint(1, undisturbed.changes))
        return Moment(seconds=chance.uniform(undisturbed.first, undisturbed.seconds))


class Process:
    """A command in a folder of its own, with the workers that it starts."""

    def __init__(self, command: tuple[str, ...], folder: Path, largest: int | None = None):
        """largest: size [byte] that no file may pass."""

        def limit() -> None:
            # A campaign in the background of a shell ignores SIGINT, and its children would inherit that.
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            if largest is not None:
                # A write then fails as on a full disk; the signal would kill.
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))

        self.folder, self.started = folder, time.monotonic()
        # A pipe, since a limit of size would hold for a file.
        self.reader, writer = os.pipe()
        os.set_blocking(self.reader, False)
        self.process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=writer,
            stderr=writer,
            env=os.environ | environment(),
            preexec_fn=limit,
            start_new_session=True,
        )
        os.close(writer)
        self._said = b""

    def end(self, strike: Moment | None = None) -> End:
        """Wait for the end, or kill at the moment; then wait for the workers."""
        seen, changes, first = _stamps(self.folder), 0, 0.0
        while self.process.poll() is None:
            now = _stamps(self.folder)
            seconds = time.monotonic() - self.started
            if now != seen:
                seen, changes, first = now, changes + 1, first or seconds
            if seconds > PATIENCE or (strike and (changes >= strike.change or seconds >= strike.seconds)):
                self.process.kill()
                break
            self._read()
            time.sleep(0.0005)
        self.process.wait()
        seconds = time.monotonic() - self.started
        broken = self._workers()
        self._read()
        os.close(self.reader)
        text = self._said.decode("utf-8", "replace")
        if seconds > PATIENCE:
            return End(None, text, f"no end within {PATIENCE:g} s", first, seconds, changes)
        # Workers of a command that is killed while it starts them complain of their pipe.
        if not broken and self.process.returncode != -signal.SIGKILL and (found := _ABORT.search(text)):
            broken = "aborts: " + " ".join(text[found.start() :].split())[-300:]
        return End(self.process.returncode, text, broken, first, seconds, changes)

    def _workers(self) -> str:
        """Wait for what the command started; kill and name it where it stays."""
        end = time.monotonic() + WORKERS
        while workers := _alive(self.process.pid):
            if time.monotonic() > end:
                for worker in workers:
                    os.kill(worker, signal.SIGKILL)
                return f"workers live {WORKERS:g} s after it"
            self._read()
            time.sleep(0.01)
        return ""

    def _read(self) -> None:
        try:
            while part := os.read(self.reader, 1 << 16):
                self._said += part
        except BlockingIOError:
            pass


def alone(command: tuple[str, ...], folder: Path) -> End:
    """Run a command undisturbed."""
    end = Process(command, folder).end()
    return replace(end, largest=max((size for _, size, _ in _stamps(folder)), default=0))


def killed(command: tuple[str, ...], folder: Path, undisturbed: End, chance: random.Random) -> End:
    """Kill the command, not its workers, at a random moment of its work."""
    return Process(command, folder).end(Moment.draw(undisturbed, chance))


def full(command: tuple[str, ...], folder: Path, undisturbed: End, chance: random.Random) -> End:
    """No file grows beyond a random size. Nothing may be left in the folder that has no name of its own."""
    largest = round(undisturbed.largest ** chance.random())
    end = Process(command, folder, largest).end()
    if end.status and not end.broken:
        parts = [
            path.name for path in folder.rglob("*") if re.search(r"\.(tmp|part)$|\.partial|\.[0-9a-f]{12}$", path.name)
        ]
        if parts:
            return End(end.status, end.text, f"leaves {', '.join(parts[:3])} on a full disk")
        if not end.text.strip():
            return End(end.status, end.text, f"status {end.status} without a message")
    return end


def twice(
    command: tuple[str, ...], folder: Path, undisturbed: End, chance: random.Random, again: tuple[str, ...]
) -> End:
    """A second one beside the first. One of them at least ends well, and the other one says why it does not."""
    first = Process(command, folder)
    time.sleep(chance.uniform(0, 0.8 * undisturbed.seconds))
    second = Process((*command, *again), folder)
    ends = second.end(), first.end()
    for end in ends:
        if end.broken:
            return end
    if all(end.status for end in ends):
        said = " / ".join(end.text.strip()[-150:] for end in ends)
        return End(1, said, f"both fail: {said}")
    refused = next((end for end in ends if end.status), None)
    if refused and not _OTHER.search(refused.text):
        return replace(refused, broken=f"refused without the other's name: {refused.text.strip()[-200:]}")
    return refused or ends[0]


def _stamps(folder: Path) -> list[tuple[str, int, int]]:
    """Names, sizes and times of what is in a folder and in those in it."""
    found, todo = [], [folder]
    while todo:
        try:
            for entry in os.scandir(todo.pop()):
                about = entry.stat(follow_symlinks=False)
                found.append((entry.path, about.st_size, about.st_mtime_ns))
                if entry.is_dir(follow_symlinks=False):
                    todo.append(Path(entry.path))
        except FileNotFoundError:
            continue
    return sorted(found)


def _alive(session: int) -> list[int]:
    """Processes of a session that run; one that ended and that nobody waits for does not count."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, of = path.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(of) == session and state not in "ZX":
            found.append(int(path.parent.name))
    return found
