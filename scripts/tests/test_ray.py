"""The fan-out over two Ray nodes on this machine: bytes, a node killed, failures, Ctrl-C. Skipped without Ray."""

import importlib.util
import io
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from unittest import mock

import example_jobs as jobs
from hydro_mujoco.jobs import JobError
from hydro_mujoco.jobs.here import Here
from hydro_mujoco.recording import proof
from hydro_tools.datasets import DataError, dataset, task2
from hydro_tools.jobs import cluster
from hydro_tools.jobs.two_nodes import TwoNodes
from hydro_tools.repository import SCRIPTS
from test_jobs import begun_by_a_slow_receiver

SETTINGS = dataset.Settings(
    name="t", trials=40, seed=5, samples=60, splits=(0.5, 0.25, 0.25), shard_size=5, model="mjcf/b1_truth.xml"
)
SHARDS = 8
RAY = importlib.util.find_spec("ray")


def contents(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


@unittest.skipUnless(RAY, "Ray is not installed (scripts/setup_venv.sh ray)")
class OnTwoNodes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(mock.patch.object(task2, "PILOT", 4))
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        dataset.generate(SETTINGS, cls.folder / "reference", executor=Here())
        cls.reference = contents(cls.folder / "reference")
        cls.nodes = cls.enterClassContext(TwoNodes())

    def connected(self, *packages):
        return cluster.Cluster(self.nodes.address, packages=packages or [jobs])

    def test_both_nodes_work_and_every_file_has_the_bytes_of_one_machine(self):
        out = self.folder / "two"
        with self.connected() as executor:
            dataset.generate(SETTINGS, out, executor=executor)
        self.assertEqual(contents(out), self.reference)
        self.assertEqual(len(executor.done_by), 2, executor.done_by)
        self.assertEqual(executor.done_by.total(), SHARDS)

    def test_resume_makes_what_is_missing(self):
        out = self.folder / "resumed"
        dataset.generate(SETTINGS, out, executor=Here())
        (out / "test-00001-of-00002.safetensors").unlink()
        with self.connected() as executor:
            dataset.generate(SETTINGS, out, executor=executor, resume=True)
        self.assertEqual(executor.done_by.total(), 1)
        self.assertEqual(contents(out), self.reference)

    def test_a_node_killed_in_the_middle_changes_no_byte(self):
        out = self.folder / "killed"
        with TwoNodes() as nodes, cluster.Cluster(nodes.address) as executor:
            take, left = executor.result, []

            def result(handle):
                if executor.done_by.total() == 2 and not left:
                    nodes.kill_second()
                    left.append(SHARDS - 2)
                return take(handle)

            with mock.patch.object(executor, "result", result):
                dataset.generate(SETTINGS, out, executor=executor)
            self.assertEqual(left, [SHARDS - 2], "no node was killed")
        self.assertEqual(executor.done_by.total(), SHARDS)
        self.assertEqual(contents(out), self.reference)

    def test_nodes_need_no_checkout(self):
        copy = self.folder / "checkout"
        for package in ("hydro_tools", "tests/example_jobs"):
            shutil.copytree(SCRIPTS / package, copy / Path(package).name)
        code = f"""
import shutil, example_jobs as jobs
from hydro_tools.jobs.cluster import Cluster
with Cluster({self.nodes.address!r}, packages=[jobs]) as executor:
    shutil.rmtree({str(copy)!r})
    print({{file.decode() for _, file in executor.run(jobs.where, dict.fromkeys("abcd"))}})
"""
        # A worker on this machine also looks where its driver's modules are, and in its working directory.
        run = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            cwd=self.folder,
            env=os.environ | {"PYTHONPATH": str(copy)},
        )
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("py_modules", run.stdout)
        self.assertNotIn(str(copy), run.stdout)

    def test_a_failure_names_job_and_reason(self):
        with self.connected() as executor:
            with self.assertRaisesRegex(JobError, "^third: ValueError: what was found"):
                list(executor.run(jobs.fails, {"first": "a", "second": "b", "third": "bad", "fourth": "c"}))

    def test_what_kills_its_worker_each_time_is_a_fault(self):
        with mock.patch.object(cluster, "RETRIES", 1), self.connected() as executor:
            with self.assertRaisesRegex(JobError, "^only: WorkerCrashedError .*tried 1 times more"):
                list(executor.run(jobs.kills_its_worker, {"only": 0}))

    def test_a_slow_receiver_stops_the_flow(self):
        with self.connected() as executor:
            begun = begun_by_a_slow_receiver(executor, 50, 3)
        self.assertGreater(begun, 1)
        self.assertLessEqual(begun, cluster.AHEAD * 2 + 1)

    def test_a_node_with_other_bits_is_refused(self):
        with mock.patch.object(proof.Proof, "from_bytes", lambda known: proof.Proof("0" * 64, "another machine")):
            with self.connected() as executor, self.assertRaisesRegex(DataError, "rounds otherwise.*--resume"):
                dataset.generate(SETTINGS, self.folder / "refused", executor=executor)

    def test_a_second_connection_is_refused(self):
        with self.connected(), self.assertRaisesRegex(JobError, "connected to a Ray cluster already"):
            self.connected()

    def test_no_cluster(self):
        for address, reason in (("127.0.0.1:1", "refused"), ("ray://127.0.0.1:1", "refused"), ("nowhere", "Invalid")):
            with self.assertRaisesRegex(JobError, f"`{address}`.*{reason}"):
                cluster.Cluster(address)

    def test_a_cluster_without_cores_is_told(self):
        with (
            self.connected() as executor,
            mock.patch.object(cluster, "PATIENCE", 0.2),
            mock.patch.object(executor._ray, "cluster_resources", return_value={}),
            mock.patch("sys.stderr", io.StringIO()) as said,
        ):
            list(executor.run(jobs.command, {"only": ["sleep", "1"]}))
        self.assertIn("has a core; waiting", said.getvalue())

    def test_auto_means_a_cluster_that_answers(self):
        with mock.patch.dict(os.environ, {"RAY_ADDRESS": "127.0.0.1:1"}):
            with self.assertRaisesRegex(JobError, "`auto`.*127.0.0.1:1.*refused"):
                cluster.Cluster("auto", packages=[])

    def test_an_interrupt_keeps_finished_shards(self):
        out = self.folder / "interrupted" / "t"
        command = [
            sys.executable,
            str(SCRIPTS / "gen_task2.py"),
            "--water",
            "ellipsoid",
            "--out",
            str(out),
            "--trials",
            "40",
            "--shard-size",
            "1",
            "--ray",
            self.nodes.address,
        ]
        run = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        until = time.monotonic() + 60
        while not list(out.glob("*.safetensors")) and time.monotonic() < until:
            time.sleep(0.02)
        run.send_signal(signal.SIGINT)
        _, said = run.communicate(timeout=60)
        self.assertEqual(run.returncode, 130, said)
        self.assertIn("go on with --resume", said)
        self.assertNotIn("Traceback", said)
        kept = {path.name: path.stat().st_mtime_ns for path in out.glob("*.safetensors")}
        self.assertTrue(0 < len(kept) < 40)
        done = subprocess.run([*command, "--resume"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        files = {path.name: path.stat().st_mtime_ns for path in out.glob("*.safetensors")}
        self.assertEqual(len(files), 40)
        # All but the one whose record may have been under way.
        self.assertGreaterEqual(sum(files[name] == at for name, at in kept.items()), len(kept) - 1)


class Shown(unittest.TestCase):
    def refused(self, *arguments):
        run = subprocess.run(
            [sys.executable, str(SCRIPTS / "ray_two_nodes.py"), *arguments], capture_output=True, text=True
        )
        self.assertEqual(run.returncode, 2, run.stderr)
        return run.stderr

    def test_bad_numbers(self):
        self.assertIn("at least 1", self.refused("--trials", "10", "0"))

    @unittest.skipIf(RAY, "Ray is installed")
    def test_no_ray(self):
        self.assertIn("setup_venv.sh ray", self.refused())

    @unittest.skipUnless(RAY, "Ray is not installed (scripts/setup_venv.sh ray)")
    def test_a_folder_that_holds_something(self):
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "20").mkdir()
            self.assertIn("20 exists", self.refused("--out", folder, "--trials", "20"))


if __name__ == "__main__":
    unittest.main()
