"""Jobs that are command lines: files come back, failures are told, nothing is written outside; compare_ray.py."""

import io
import json
import os
import stat
import subprocess
import sys
import tarfile
import tempfile
import unittest
from pathlib import Path

from hydro_mujoco.jobs import JobError
from hydro_mujoco.jobs.here import Here
from hydro_mujoco.jobs.processes import Processes
from hydro_tools.jobs.program import HERE, Job, Program, packed, unpack
from hydro_tools.repository import SCRIPTS

#: Writes its environment and first word below the folder that it is given.
WRITES = (
    "import os, pathlib, sys; out = pathlib.Path(sys.argv[1]) / 'a' / 'b'; out.mkdir(parents=True); "
    "(out / 'word').write_text(sys.argv[2] + os.environ['COLOUR'])"
)
#: Stands in for `hydro`: two jobs, one done; what it is asked to do alone it does into its --out.
HYDRO = """#!{python}
import json, pathlib, sys
words = sys.argv[1:]
out = pathlib.Path(words[words.index("--out") + 1])
if "--list" in words:
    print(json.dumps([{{"job": "2/a/seed-0", "done": True}}, {{"job": "2/b/seed-0", "done": False}}]))
elif "--tables" in words:
    print("tables of", sorted(str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()))
else:
    job = words[words.index("--only") + 1]
    assert words[words.index("--data") + 1].startswith("/"), words
    (out / "jobs" / job).mkdir(parents=True, exist_ok=True)
    if (out / "jobs" / job / "weights").is_file():
        words.append("trained before")
    (out / "jobs" / job / "result.json").write_text(json.dumps(words))
"""


class Programs(unittest.TestCase):
    def test_files_come_back_from_here_and_from_processes(self):
        jobs = {word: Job([sys.executable, "-c", WRITES, HERE, word]) for word in ("sea", "lake")}
        for executor in (Here(), Processes(2)):
            with tempfile.TemporaryDirectory() as folder:
                for _, content in executor.run(Program((("COLOUR", " blue"),)), jobs):
                    (path,) = unpack(content, Path(folder))
                    self.assertEqual(path.relative_to(Path(folder).resolve()), Path("a/b/word"))
                self.assertIn(path.read_text(), ("sea blue", "lake blue"))

    def test_the_same_files_are_packed_alike(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("b", "a"):
                (Path(folder) / name).write_text(name)
            with tarfile.open(fileobj=io.BytesIO(packed(Path(folder)))) as archive:
                names = archive.getnames()
        self.assertEqual(names, ["a", "b"])

    def test_a_failure_tells_the_last_words(self):
        job = {"job": Job([sys.executable, "-c", "import sys; sys.exit('no water')"])}
        with self.assertRaisesRegex(JobError, "^job: exit status 1: no water"):
            list(Here().run(Program(), job))

    def test_a_program_that_is_not_there_is_named(self):
        with self.assertRaisesRegex(JobError, "/nowhere/hydro: No such file or directory on this node"):
            list(Here().run(Program(), {"job": Job(["/nowhere/hydro"])}))

    def test_files_outside_the_folder_are_refused(self):
        out = io.BytesIO()
        with tarfile.open(fileobj=out, mode="w") as archive:
            archive.addfile(tarfile.TarInfo("../escaped"), io.BytesIO(b""))
        with tempfile.TemporaryDirectory() as folder, self.assertRaisesRegex(JobError, "escaped"):
            unpack(out.getvalue(), Path(folder))


class Compare(unittest.TestCase):
    def run_it(self, folder: Path, *words: str) -> subprocess.CompletedProcess:
        hydro = folder / "hydro"
        hydro.write_text(HYDRO.format(python=sys.executable))
        hydro.chmod(hydro.stat().st_mode | stat.S_IXUSR)
        return subprocess.run(
            [sys.executable, SCRIPTS / "compare_ray.py", "--ray", "here", "--hydro", hydro, "--", *words],
            capture_output=True,
            text=True,
            cwd=folder,
            env=os.environ,
            check=False,
        )

    def test_what_is_not_done_is_done_and_the_tables_are_written(self):
        with tempfile.TemporaryDirectory() as folder:
            done = self.run_it(Path(folder), "task2", "--data", "data", "--out", "out")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(done.stdout.strip(), "tables of ['jobs/2/b/seed-0/result.json']")
            words = json.loads((Path(folder) / "out/jobs/2/b/seed-0/result.json").read_text())
            self.assertEqual(words[:2], ["compare", "task2"])

    def test_what_a_job_has_already_goes_along(self):
        with tempfile.TemporaryDirectory() as folder:
            before = Path(folder) / "out/jobs/2/b/seed-0"
            before.mkdir(parents=True)
            (before / "weights").write_text("1 2 3")
            done = self.run_it(Path(folder), "task2", "--data", "data", "--out", "out")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(json.loads((before / "result.json").read_text())[-1], "trained before")

    def test_words_without_out_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            done = self.run_it(Path(folder), "task2", "--data", "data")
            self.assertEqual(done.returncode, 2)
            self.assertIn("expected --out", done.stderr)


if __name__ == "__main__":
    unittest.main()
