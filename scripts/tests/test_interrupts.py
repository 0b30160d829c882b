"""Ctrl-C stops the generator and the program's long commands within a second; the package's: python/tests."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from hydro_tools.commands.make_reference import built_program
from hydro_tools.kills import campaign, jobs

#: Seconds from a Ctrl-C to the end, of the quickest of some attempts: others may have the cores meanwhile.
MOST, ATTEMPTS = 1.0, 3
#: Seconds until a command has begun, and until it has ended at all.
PATIENCE = 60.0
#: Sizes of the campaign's jobs at which they last.
LASTING = {"--trials=20": "--trials=4000", "--epochs=600": "--epochs=100000", "--epochs=30": "--epochs=100000"}
SAYS = {
    "gen_task2.py": (130, "gen_task2.py: stopped; finished shards are kept in out: go on with --resume"),
    "hydro train": (1, "hydro: interrupted; the same command"),
    "hydro compare": (1, "hydro: interrupted; the same command"),
    "hydro gap run": (1, "the same command goes on"),
}


def interrupted(job: jobs.Job, place: Path) -> tuple[int, str, float]:
    """Status and words of a job that Ctrl-C stops once it has left something; how long it took to end [s]."""
    with subprocess.Popen(
        [LASTING.get(word, word) for word in job.command],
        cwd=campaign.begun(job, place),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | jobs.environment(),
        # As on a terminal; a background job of a shell would ignore it.
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as child:
        try:
            end = time.monotonic() + PATIENCE
            while not job.left(place):
                assert child.poll() is None and time.monotonic() < end, child.communicate()
                time.sleep(0.01)
            os.killpg(child.pid, signal.SIGINT)
            start = time.monotonic()
            # Its workers have ended too where nobody writes any more.
            said, _ = child.communicate(timeout=PATIENCE)
            return child.returncode, said, time.monotonic() - start
        except BaseException:
            os.killpg(child.pid, signal.SIGKILL)
            raise


@pytest.mark.skipif(not built_program().is_file(), reason="no `hydro` is built: cargo build")
@pytest.mark.parametrize("name", SAYS)
def test_one_interrupt_is_enough(tmp_path: Path, name: str):
    job = jobs.make(tmp_path / "given", built_program())[name]
    status, words = SAYS[name]
    times = []
    while len(times) < ATTEMPTS and min(times, default=MOST) >= MOST:
        found, said, took = interrupted(job, tmp_path / f"attempt-{len(times)}")
        times.append(took)
        assert words in said and "Traceback" not in said, said
        # Where the orderly end takes longer the program ends all the same, and says so by its status.
        assert found in (status, 130), said
    assert min(times) < MOST, times
