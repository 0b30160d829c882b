"""Trainings by `hydro compare`: each made once, its validation error read."""

import json
import math
import os
import subprocess
import sys
import threading
from pathlib import Path

from . import TrainingError

#: Exit status of `hydro` where a training diverged.
DIVERGED = 3


class Trainings:
    """Trainings by `hydro compare`, each kept below `folder`."""

    def __init__(self, hydro: Path, task: str, data: Path, folder: Path):
        self.hydro, self.task, self.data, self.folder = hydro, task, data, folder
        self.found: dict[tuple[str, str, float, int], float] = {}
        self.lock = threading.Lock()

    def rows(self) -> list[str]:
        """All rows that the program knows."""
        words = [*self.command(self.folder / "none"), "--seeds", "0", "--list", "--json"]
        listed = subprocess.run(words, stdout=subprocess.PIPE, check=False)
        if listed.returncode:
            sys.exit(listed.returncode)
        return sorted({job["job"].split("/")[1] for job in json.loads(listed.stdout)})

    def command(self, out: Path) -> list[str]:
        return [str(self.hydro), "compare", self.task, "--data", str(self.data), "--out", str(out)]

    def error(self, data: str, row: str, rate: float, seed: int) -> float:
        """Least validation error of one training [nRMSE]."""
        key = (data, row, rate, seed)
        if key in self.found:
            return self.found[key]
        job, out = f"{data}/{row}/seed-{seed}", self.folder / f"{rate:g}"
        words = [*self.command(out), "--learning-rate", f"{rate:g}", "--seeds", str(seed), "--only", job]
        done = subprocess.run(
            words,
            env={**os.environ, "RAYON_NUM_THREADS": "1"},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
        if done.returncode == 0:
            note = json.loads((out / "jobs" / job / "result.json").read_text())["training"]
            error = note["validation"] if note["validation"] is not None else math.inf
        elif done.returncode == DIVERGED:
            error = math.inf
        else:
            raise TrainingError(f"{job} at {rate:g}: {done.stderr.strip().rpartition(chr(10))[2]}")
        with self.lock:
            self.found[key] = error
            print(f"{job} at {rate:g}: {error:.4f}", file=sys.stderr, flush=True)
        return error
