"""Fan-out of jobs on this machine: every job once, few at a time, clear failures. Ray: test_ray.py."""

import sys
import tempfile
import time
import unittest
from contextlib import closing
from pathlib import Path
from unittest import mock

import example_jobs as jobs
from hydro_mujoco.jobs import JobError
from hydro_mujoco.jobs.here import Here
from hydro_mujoco.jobs.processes import AHEAD, Processes
from hydro_mujoco.recording.proof import Proof
from hydro_tools.datasets import DataError
from hydro_tools.jobs.cluster import Cluster


def begun_by_a_slow_receiver(executor, count, patience):
    """Number of the `count` jobs that have begun when one result was taken and time went by."""
    with tempfile.TemporaryDirectory() as folder:
        with closing(executor.run(jobs.begins, {str(i): f"{folder}/{i}" for i in range(count)})) as results:
            next(results)
            time.sleep(patience)
            return len(list(Path(folder).iterdir()))


class OnThisMachine(unittest.TestCase):
    def executors(self):
        return Here(), Processes(2)

    def test_every_job_once_and_any_job(self):
        lines = {str(i): [sys.executable, "-c", f"print({i})"] for i in range(7)}
        for executor in self.executors():
            results = list(executor.run(jobs.command, lines))
            self.assertEqual(sorted(results), [(str(i), f"{i}\n".encode()) for i in range(7)])

    def test_no_jobs(self):
        for executor in self.executors():
            self.assertEqual(list(executor.run(jobs.fails, {})), [])

    def test_a_failure_names_job_and_reason(self):
        for executor in self.executors():
            with self.assertRaisesRegex(JobError, "^third: ValueError: what was found"):
                list(executor.run(jobs.fails, {"first": "a", "second": "b", "third": "bad", "fourth": "c"}))

    def test_a_killed_worker_is_told(self):
        with self.assertRaisesRegex(
            JobError, "^only: a worker process was killed, at this job or at one beside it.*`dmesg`.*fewer workers"
        ):
            list(Processes(2).run(jobs.kills_its_worker, {"only": 0}))

    def test_a_slow_receiver_stops_the_flow(self):
        self.assertEqual(begun_by_a_slow_receiver(Here(), 50, 0), 1)
        begun = begun_by_a_slow_receiver(Processes(2), 50, 1)
        self.assertGreater(begun, 1)
        self.assertLessEqual(begun, AHEAD * 2 + 1)


class Elsewhere(unittest.TestCase):
    def test_ray_not_installed(self):
        with mock.patch.dict(sys.modules, {"ray": None}), self.assertRaisesRegex(JobError, "setup_venv.sh ray"):
            Cluster("auto", packages=[jobs])

    def test_a_machine_with_other_bits_is_refused(self):
        proof = Proof.from_bytes(b"known")
        with self.assertRaisesRegex(DataError, "rounds otherwise.*MuJoCo .*expected as on .*MuJoCo"):
            proof.check(lambda: b"knowm")
        proof.check(lambda: b"known")
        proof.check(lambda: self.fail("once a process is enough"))


if __name__ == "__main__":
    unittest.main()
