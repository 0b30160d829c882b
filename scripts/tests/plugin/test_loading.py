"""Loading the library into a process."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import mujoco
import numpy as np
from scene import LIBRARY, fish, fish_xml, start, steps

DEBIAN = pathlib.Path("/usr/lib/x86_64-linux-gnu/libmujoco.so.2.2.2")


class Loading(unittest.TestCase):
    def test_four_lines(self):
        code = f"""
import mujoco
mujoco.mj_loadPluginLibrary({LIBRARY!r})
model = mujoco.MjModel.from_xml_string({fish_xml()!r}); data = mujoco.MjData(model)
mujoco.mj_step(model, data)
print(*data.sensor('water').data)
"""
        out = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
        wrench = np.array(out.split(), float)
        self.assertEqual(wrench.shape, (6,))
        self.assertGreater(np.abs(wrench).max(), 0.1)

    def test_a_scene_of_the_project_loads_from_any_directory_and_starts_in_range(self):
        scene = pathlib.Path(__file__).resolve().parents[3] / "mjcf/b1_swim.xml"
        code = f"""
import mujoco
mujoco.mj_loadPluginLibrary({LIBRARY!r})
model = mujoco.MjModel.from_xml_path({str(scene)!r}); data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, 0)
for _ in range(500): mujoco.mj_step(model, data)
print('done')
"""
        with tempfile.TemporaryDirectory() as elsewhere:
            run = subprocess.run([sys.executable, "-c", code], cwd=elsewhere, capture_output=True, text=True)
        self.assertEqual((run.stdout, run.returncode), ("done\n", 0), run.stderr)
        self.assertNotIn("hydro", run.stderr)

    def test_plugin_folder_needs_an_mjcf_alone(self):
        package = pathlib.Path(mujoco.__file__).parent
        with tempfile.TemporaryDirectory() as folder:
            overlay = pathlib.Path(folder) / "mujoco"
            overlay.mkdir()
            for entry in package.iterdir():
                if entry.name != "plugin":
                    (overlay / entry.name).symlink_to(entry)
            shutil.copytree(package / "plugin", overlay / "plugin")
            shutil.copy(LIBRARY, overlay / "plugin" / "libhydro_plugin.so")
            # Nothing but `import mujoco` and a model.
            code = (
                "import mujoco; m = mujoco.MjModel.from_xml_string("
                f"{fish_xml()!r}); d = mujoco.MjData(m); mujoco.mj_step(m, d); print(mujoco.__file__, *d.sensordata)"
            )
            out = subprocess.run(
                [sys.executable, "-c", code],
                check=True,
                capture_output=True,
                text=True,
                env={**os.environ, "PYTHONPATH": folder},
            ).stdout.split()
            self.assertTrue(out[0].startswith(folder))
            self.assertGreater(np.abs(np.array(out[1:], float)).max(), 0.1)

    def test_a_second_copy_of_the_library_does_no_harm(self):
        with tempfile.TemporaryDirectory() as folder:
            other = pathlib.Path(folder) / "libhydro_plugin.so"
            shutil.copy(LIBRARY, other)
            mujoco.mj_loadPluginLibrary(str(other))
            self.assertTrue(np.isfinite(steps(fish(), start(fish()), 5)).all())

    def test_no_symbol_is_left_to_the_linker(self):
        undefined = subprocess.run(
            ["nm", "-D", "--undefined-only", LIBRARY], check=True, capture_output=True, text=True
        )
        names = [line.split()[-1] for line in undefined.stdout.splitlines()]
        self.assertGreater(len(names), 10)
        self.assertEqual([name for name in names if name.startswith("mj")], [])
        dynamic = subprocess.run(["readelf", "-d", LIBRARY], check=True, capture_output=True, text=True).stdout
        self.assertNotIn("mujoco", dynamic)
        defined = subprocess.run(
            ["nm", "-D", "--defined-only", LIBRARY], check=True, capture_output=True, text=True
        ).stdout
        self.assertIn(" hydro_plugin_load", defined)

    @unittest.skipUnless(DEBIAN.exists(), "Debian's libmujoco is not installed")
    def test_another_version_is_declined_with_both_named(self):
        code = f"""
import ctypes
ctypes.CDLL({str(DEBIAN)!r}, mode=ctypes.RTLD_GLOBAL)
ctypes.CDLL({LIBRARY!r})
print('alive')
"""
        done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
        self.assertIn("alive", done.stdout)
        text = done.stdout + done.stderr
        self.assertIn(f"for MuJoCo {mujoco.__version__}", text)
        self.assertIn("running MuJoCo is 2.2.2", text)
        self.assertEqual(text.count("nothing is registered"), 1)

    @unittest.skipUnless(os.environ.get("HYDRO_TEST_OTHER_WHEEL"), "HYDRO_TEST_OTHER_WHEEL names no other wheel")
    def test_a_wheel_of_another_version_declines(self):
        code = f"""
import mujoco
mujoco.mj_loadPluginLibrary({LIBRARY!r})
try:
  mujoco.MjModel.from_xml_string({fish_xml()!r})
except ValueError as fault:
  print(mujoco.__version__, 'refused', fault)
"""
        environment = {**os.environ, "PYTHONPATH": os.environ["HYDRO_TEST_OTHER_WHEEL"]}
        done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True, env=environment)
        self.assertNotIn(mujoco.__version__ + " refused", done.stdout)
        self.assertIn("refused", done.stdout)
        self.assertIn(f"this build of hydro is for MuJoCo {mujoco.__version__}", done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
