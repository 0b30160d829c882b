"""`python -m hydro_mujoco` and `hydro doctor`: what they find, and what they advise."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest

import hydro_mujoco
import hydro_mujoco_entry
from hydro_mujoco import DataError, doctor, plugin, requirement

PACKAGE = Path(hydro_mujoco.__file__).parent
LIBRARY = plugin.built_library()
#: A wheel of MuJoCo 3.17, unpacked by scripts/test.sh.
OLD = os.environ.get("HYDRO_TEST_OTHER_WHEEL")
pytestmark = pytest.mark.skipif(not LIBRARY.is_file(), reason="no plugin library: cargo build --release")


def python(code, **environment):
    """The words and the status of a new Python."""
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env={**os.environ, **environment}, cwd="/"
    )
    return run.returncode, run.stdout + run.stderr


DOCTOR = "import hydro_mujoco.doctor as d; raise SystemExit(d.main())"


def test_it_says_what_acts_and_where_all_is_from():
    status, text = python(DOCTOR)
    assert status == 0, text
    assert f"MuJoCo       {mujoco.__version__}  {Path(mujoco.__file__).parent}" in text
    assert f"plugin       {LIBRARY.resolve()}  loaded by hydro_mujoco: `import mujoco` alone does not" in text
    assert f"program      {hydro_mujoco_entry.find_program()}" in text
    assert "-40.0 N of drag on a test body, -40.0 N expected: it acts" in text
    assert text.splitlines()[-1].startswith("to do        install the wheel")


def test_a_wrong_force_is_told(monkeypatch):
    monkeypatch.setattr(doctor, "_force", lambda: -39.0)
    acts, text = doctor.examine()
    assert not acts and "-39.0 N of drag on a test body, -40.0 N expected: WRONG\nto do        1." in text


def test_no_mujoco():
    status, text = python(f"import sys; sys.modules['mujoco'] = None; {DOCTOR}")
    assert (
        status == 1 and "MuJoCo       hydro_mujoco needs MuJoCo, and there is none: pip install 'mujoco==4.0.0'" in text
    )
    status, text = python("import sys; sys.modules['mujoco'] = None; import hydro_mujoco; hydro_mujoco.add_water")
    assert status == 1
    assert (
        text.splitlines()[-1]
        == "ImportError: hydro_mujoco needs MuJoCo, and there is none: pip install 'mujoco==4.0.0'"
    )


def test_a_mujoco_that_is_broken(tmp_path):
    tmp_path.joinpath("mujoco.py").write_text("import nothing_of_this_name")
    status, text = python(DOCTOR, PYTHONPATH=f"{tmp_path}:{PACKAGE.parent}")
    assert (
        status == 1
        and "MuJoCo       mujoco cannot be imported (No module named 'nothing_of_this_name'): pip install" in text
    )


def test_a_folder_that_uninstalling_left(tmp_path):
    tmp_path.joinpath("mujoco", "plugin").mkdir(parents=True)
    code = f"import sys; sys.path[:] = [{str(tmp_path)!r}] + [p for p in sys.path if not p.endswith('site-packages')]; {DOCTOR}"
    status, text = python(code, PYTHONPATH=str(PACKAGE.parent))
    assert status == 1 and f"and {tmp_path / 'mujoco'} is a folder without it: pip install" in text


def test_a_mujoco_that_is_too_old(monkeypatch):
    monkeypatch.setattr(mujoco, "__version__", "3.17.0")
    acts, text = doctor.examine()
    assert not acts
    assert "does not act: hydro_mujoco needs MuJoCo 4.0.0, and mujoco 3.17.0 is installed: pip install" in text
    with pytest.raises(ImportError, match="needs MuJoCo 4.0.0, and mujoco 3.17.0 is installed"):
        requirement.check_installed()


@pytest.mark.skipif(OLD is None, reason="HYDRO_TEST_OTHER_WHEEL names no other wheel")
def test_the_real_one_that_is_too_old():
    status, text = python(DOCTOR, PYTHONPATH=f"{OLD}:{PACKAGE.parent}")
    assert status == 1 and "MuJoCo       3.17.0" in text and "pip install 'mujoco==4.0.0'" in text
    code = f"import mujoco; mujoco.mj_loadPluginLibrary({str(LIBRARY.resolve())!r})"
    status, text = python(code, PYTHONPATH=OLD)
    assert (
        "for MuJoCo 4.0.0 and 4.0.1, and the running MuJoCo is 3.17.0: nothing is registered. Take the wheel mujoco=="
        in text
    )


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize(("version", "readable"), [(4_000_002, "4.0.2"), (4_001_000, "4.1.0"), (5_000_000, "5.0.0")])
def test_a_mujoco_that_is_too_new_is_declined_by_one_sentence(version, readable, tmp_path):
    """A library that only says which version it is: nothing else of it may be called."""
    source, library = tmp_path / "new.c", tmp_path / "libnew.so"
    source.write_text(
        "#include <stdarg.h>\n#include <stdio.h>\n"
        f"int mj_version(void) {{ return {version}; }}\n"
        'void mju_warning(const char* form, ...) { va_list of; va_start(of, form); vprintf(form, of); va_end(of); puts(""); }\n'
    )
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    status, text = python(f"import ctypes; ctypes.CDLL({str(LIBRARY.resolve())!r})", LD_PRELOAD=str(library))
    assert (status, text.splitlines()) == (
        0,
        [
            f"hydro: this build of hydro is for MuJoCo 4.0.0 and 4.0.1, and the running MuJoCo is {readable}: nothing is "
            f"registered. Take the wheel mujoco==4.0.0, or build hydro with MUJOCO_DIR naming MuJoCo {readable}"
        ],
    )


@pytest.fixture(scope="module")
def newer(tmp_path_factory):
    """A folder of packages: a MuJoCo that says it is 4.1.0 and is 4.0.0 otherwise, and this package as a wheel puts it."""
    folder = tmp_path_factory.mktemp("newer")
    unneeded = shutil.ignore_patterns("*test*", "sysid", "studio", "usd", "include", "__pycache__")
    shutil.copytree(Path(mujoco.__file__).parent, folder / "mujoco", ignore=unneeded)
    (library,) = folder.joinpath("mujoco").glob("libmujoco.so*")
    content = library.read_bytes()
    # `mov eax, VERSION; ret` of mj_version, and the text of mj_versionString.
    call, text = (
        ([b"\xb8" + number.to_bytes(4, "little") + b"\xc3" for number in (mujoco.mj_version(), 4_001_000)]),
        ([f"\0{version}\0".encode() for version in (mujoco.__version__, "4.1.0")]),
    )
    assert content.count(call[0]) == content.count(text[0]) == 1
    library.write_bytes(content.replace(*call).replace(*text))
    shutil.copytree(PACKAGE, folder / "hydro_mujoco", ignore=unneeded)
    shutil.copy(LIBRARY, folder / "hydro_mujoco" / "libhydro_plugin.so")
    shutil.copy(hydro_mujoco_entry.__file__, folder)
    info = folder / "hydro_mujoco-0.dist-info"
    info.mkdir()
    info.joinpath("METADATA").write_text("Metadata-Version: 2.1\nName: hydro-mujoco\nVersion: 0\n")
    info.joinpath("entry_points.txt").write_text("[mujoco.plugins]\nhydro = hydro_mujoco_entry:plugin\n")
    return folder


TOO_NEW = (
    "this build of hydro is for MuJoCo 4.0.0 and 4.0.1, and the running MuJoCo is 4.1.0: nothing is registered. "
    "Take the wheel mujoco==4.0.0, or build hydro with MUJOCO_DIR naming MuJoCo 4.1.0"
)


@pytest.mark.skipif(sys.platform != "linux", reason="a patch of the library for Linux")
def test_a_mujoco_that_is_too_new_is_declined_wherever_it_is_met(newer, tmp_path):
    """One sentence each: at `import mujoco`, by `python -m hydro_mujoco`, `hydro doctor`, `add_water`."""

    def run(*words, **environment):
        environment = {**os.environ, "PYTHONPATH": str(newer), **environment}
        found = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment)
        assert (found.stdout + found.stderr).count(TOO_NEW) == 1, found.stdout + found.stderr
        return found

    code = "import mujoco; print(mujoco.__version__, mujoco.__file__)"
    found = run(sys.executable, "-c", code)
    assert (found.returncode, found.stdout) == (0, f"4.1.0 {newer / 'mujoco' / '__init__.py'}\n")
    assert f"RuntimeWarning: Failed to load mujoco plugin entry point hydro: {TOO_NEW}" in found.stderr

    quiet = {"PYTHONWARNINGS": "ignore"}
    found = run(sys.executable, "-m", "hydro_mujoco", **quiet)
    assert found.returncode == 1 and found.stderr == ""
    assert "\nMuJoCo       4.1.0  " in found.stdout and "\nto do        1. a MuJoCo" in found.stdout
    assert (
        f"\nplugin       does not act: plugin library {newer / 'hydro_mujoco' / 'libhydro_plugin.so'} did"
        in found.stdout
    )

    code = f"""
import mujoco, hydro_mujoco
spec = mujoco.MjSpec.from_string({doctor.PROBE!r})
try: hydro_mujoco.add_water(spec, body="hull", effects={{"linear_drag": {{"surge": 1}}}})
except hydro_mujoco.DataError as error: print("DataError:", error)
"""
    found = run(sys.executable, "-c", code, **quiet)
    assert found.stdout.startswith("DataError: ") and found.stdout.count("\n") == 1 and found.stderr == ""

    (library,) = newer.joinpath("mujoco").glob("libmujoco.so*")
    found = run(hydro_mujoco_entry.find_program(), "doctor", HYDRO_MUJOCO_LIBRARY=str(library))
    assert found.returncode == 1 and found.stderr == f"hydro: the plugin does not work here: {TOO_NEW}\n"
    # Neither MUJOCO_LOG.TXT nor anything else.
    assert list(tmp_path.iterdir()) == []


def test_a_library_that_is_none():
    status, text = python(DOCTOR, HYDRO_PLUGIN=__file__)
    assert status == 1 and f"plugin       does not act: plugin library {__file__}: " in text
    assert "to do        1. a MuJoCo that this package goes with" in text


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_a_library_that_registers_nothing_is_refused_with_what_it_said(tmp_path):
    source, library = tmp_path / "idle.c", tmp_path / "libidle.so"
    source.write_text("int idle;")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    code = f"""
from pathlib import Path
from hydro_mujoco import plugin
try: plugin.load_plugin(Path({str(library)!r}))
except plugin.DataError as error: print(error)
"""
    status, text = python(code)
    assert text.strip() == f"plugin library {library} did not register hydro.wrench: and says nothing of it", text


def test_a_folder_copy_beside_the_installed_package(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "hydro_mujoco")
    shutil.copyfile(hydro_mujoco_entry.__file__, tmp_path / "hydro_mujoco_entry.py")
    shutil.copyfile(LIBRARY, tmp_path / "hydro_mujoco" / LIBRARY.name)
    status, text = python(DOCTOR, PYTHONPATH=str(tmp_path))
    assert status == 0, text
    assert f"{tmp_path / 'hydro_mujoco'}  a folder before the installed {hydro_mujoco.__version__} in " in text
    assert f"plugin       {tmp_path / 'hydro_mujoco' / LIBRARY.name}  loaded by " in text


def program(*words, path=None, **environment):
    """Status and words of the program."""
    run = subprocess.run(
        [path or hydro_mujoco_entry.find_program(), *words],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    )
    return run.returncode, run.stdout + run.stderr


def test_the_program_says_what_acts_and_where_all_is_from():
    status, text = program("doctor", **hydro_mujoco_entry.environment())
    assert status == 0
    for line in (
        "hydro ",
        "program   ",
        "plugin    ",
        "for       MuJoCo 4.0.0 and 4.0.1",
        "MuJoCo    ",
        "water     acts: -40.0 N",
    ):
        assert f"\n{line}" in f"\n{text}", text


def test_the_program_without_mujoco(tmp_path):
    status, text = program("doctor", HYDRO_MUJOCO_LIBRARY="/none/libmujoco.so")
    assert status == 1
    assert (
        "does not work here: no MuJoCo at /none/libmujoco.so: pip install 'mujoco==4.0.0' beside this program" in text
    )
    # In a package it does not fall back on the machine where it was built.
    copy = tmp_path / "hydro_mujoco" / "bin" / "hydro"
    copy.parent.mkdir(parents=True)
    shutil.copy(hydro_mujoco_entry.find_program(), copy)
    status, text = program("doctor", path=copy)
    assert status == 1 and f"package   {copy.parents[1]}" in text
    assert f"no MuJoCo at {tmp_path / 'mujoco' / 'libmujoco.so'}: pip install" in text


@pytest.mark.skipif(OLD is None, reason="HYDRO_TEST_OTHER_WHEEL names no other wheel")
def test_the_program_with_a_mujoco_that_is_too_old():
    (library,) = Path(OLD, "mujoco").glob("libmujoco.so*")
    status, text = program("doctor", HYDRO_MUJOCO_LIBRARY=str(library))
    assert status == 1 and "the running MuJoCo is 3.17.0: nothing is registered. Take the wheel mujoco==4.0.0" in text


def test_functions_refuse_without_a_library(monkeypatch, tmp_path):
    monkeypatch.setattr(plugin, "is_loaded", lambda: False)
    with pytest.raises(DataError, match="no such file; install the wheel, or build it with `cargo build --release`"):
        plugin.load_plugin(tmp_path / "none.so")
