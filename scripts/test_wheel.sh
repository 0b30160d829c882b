#!/usr/bin/env bash
# Builds the wheel, installs it into an empty environment, uses it from another folder and removes it:
# `scripts/test_wheel.sh [--dev | --out FOLDER] [WHEELS]`.
#   --dev         of the development build, here, as scripts/test.sh does
#                 without it, of the release that users get: from a copy of the checkout that is gone afterwards, and from the sdist
#   --out FOLDER  keep wheel and sdist there
#   WHEELS        a folder of wheels to install from, instead of the package index
set -euo pipefail
cd "$(dirname "$0")/.."
checkout=$PWD
limit=25 # MB
dev=
keep=
case ${1:-} in
--dev)
  export HYDRO_WHEEL_PROFILE=dev
  dev=1 limit=150
  shift
  ;;
--out)
  mkdir -p "${2:?usage: scripts/test_wheel.sh --out FOLDER}"
  keep=$(cd "$2" && pwd)
  shift 2
  ;;
esac
if [ -n "${1:-}" ]; then
  export PIP_NO_INDEX=1 PIP_FIND_LINKS
  PIP_FIND_LINKS=$(cd "$1" && pwd)
fi
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore
python=${PYTHON:-$checkout/.venv/bin/python}
[ -x "$python" ] || python=python3
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
chmod 755 "$place"
say() { printf '%4d s  %s\n' $SECONDS "$*"; }
die() {
  echo "test_wheel.sh: $*" >&2
  exit 1
}

if [ -n "$dev" ]; then
  "$python" -m pip wheel --quiet --no-deps --wheel-dir "$place/dist" .
else
  # What cargo has compiled of others' crates serves again; those of the workspace are compiled in each place. Not target/ itself:
  # the program there would look for the MuJoCo of pip's build environment, which is gone afterwards.
  export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$checkout/target/wheel}
  "$python" -m venv "$place/build"
  "$place/build/bin/pip" install --quiet build
  mkdir "$place/checkout"
  git ls-files -z --cached --others --exclude-standard | tar --create --null --files-from - | tar --extract --directory "$place/checkout"
  "$place/build/bin/python" -m build --sdist --outdir "$place/dist" "$place/checkout" >"$place/sdist.log" || die "$(cat "$place/sdist.log")"
  sdist=$(echo "$place"/dist/hydro_mujoco-*.tar.gz)
  say "sdist $(basename "$sdist"), $(du -k "$sdist" | awk '{printf "%.1f", $1 / 1024}') MB"
  "$python" -m pip wheel --quiet --no-deps --wheel-dir "$place/dist" "$place/checkout"
  rm -rf "$place/checkout"
  say 'built from a copy of the checkout, which is gone'
  "$python" -m pip wheel --quiet --no-deps --wheel-dir "$place/from_sdist" "$sdist"
  same() { "$python" -m zipfile --list "$1" | awk '{print $1}' | sort; }
  diff <(same "$place"/dist/*.whl) <(same "$place"/from_sdist/*.whl) || die 'the sdist makes another wheel than the checkout'
  say 'built from the sdist: the same files'
  [ -z "$keep" ] || cp "$place"/dist/* "$keep"
fi
wheel=$(echo "$place"/dist/hydro_mujoco-*.whl)
say "built $(basename "$wheel"), $(du -k "$wheel" | awk '{printf "%.1f", $1 / 1024}') MB"
[ "$(du -m "$wheel" | cut -f1)" -le $limit ] || die "the wheel is larger than $limit MB"
"$python" - "$wheel" <<'CODE' || die 'its list of crates is not that of Cargo.lock'
import json
import sys
import tomllib
import zipfile
from pathlib import Path

with zipfile.ZipFile(sys.argv[1]) as wheel:
    [name] = [name for name in wheel.namelist() if name.endswith(".dist-info/sboms/crates.cdx.json")]
    components = json.loads(wheel.read(name))["components"]
listed = {(of["name"], of["version"]) for of in components}
locked = {(of["name"], of["version"]) for of in tomllib.loads(Path("Cargo.lock").read_text())["package"]}
assert listed <= locked, listed - locked
assert {"candle-core", "nalgebra", "safetensors", "zip"} <= {name for name, _ in listed}, listed
assert not [of for of in components if "licenses" not in of]
print(f"        {name}: {len(listed)} crates with their licences")
CODE

"$python" -m venv "$place/venv"
bin=$place/venv/bin
"$bin/pip" install --quiet "$wheel"
packages=$("$bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
for file in "$packages/hydro_mujoco/libhydro_plugin.so" "$packages/hydro_mujoco/bin/hydro"; do
  ! readelf -d "$file" | grep -E 'NEEDED.*mujoco|R(UN)?PATH' || die "$file names a libmujoco or a path to one"
done
say 'installed'

# No HOME, nothing writable but the working folder, no environment of the checkout.
mkdir "$place/elsewhere"
chmod -R a-w "$place/venv"
trap 'chmod -R u+w "$place"; rm -rf "$place"' EXIT
as=()
if [ "$(id -u)" = 0 ]; then
  # Without the right to write where no one may.
  as=(setpriv --bounding-set=-dac_override)
  ! "${as[@]}" touch "$packages/hydro_mujoco/x" 2>"$place/touch" || die 'the environment is not read-only'
fi
run() { (cd "$place/elsewhere" && "${as[@]}" env -i PATH="$bin:/usr/bin:/bin" PYTHONWARNINGS=error "$@"); }

run python - "$packages/hydro_mujoco/mjcf/b1_swim.xml" <<'CODE'
import sys
from pathlib import Path

import mujoco

text = Path(sys.argv[1]).read_text()
assert 'value="models/b1-task2"' in text
model = mujoco.MjModel.from_xml_string(text.replace('"models/b1-task2"', '"b1-relaxation"'))
data = mujoco.MjData(model)
mujoco.mj_step(model, data)
print(f"        MuJoCo {mujoco.__version__}: `import mujoco` alone knows hydro.wrench, which finds b1-relaxation")
CODE
say 'import mujoco'
run python - <<'CODE'
import time

import hydro_mujoco as hydro
import mujoco
import numpy as np

model = mujoco.MjModel.from_xml_path(hydro.scene("b1_swim"))
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, 0)
start = time.perf_counter()
for _ in range(1000):
    mujoco.mj_step(model, data)
took = time.perf_counter() - start
assert np.isfinite(data.qpos).all() and np.abs(hydro.wrench(model, data, "trunk")).max() > 1
print(f"        B1: 1000 steps in {took:.3f} s; force {hydro.wrench(model, data, 'trunk')[:3].round(1)} N")
CODE
say 'B1 by name, 1000 steps'
for example in boat rov fish; do
  run python -W ignore "$packages/hydro_mujoco/examples/water/$example.py" 2>&1 | sed 's/^/        /'
  say "example $example"
done
run hydro --help >"$place/help"
grep -q 'Usage: hydro' "$place/help" || die 'hydro --help prints no usage'
run hydro doctor | sed 's/^/        /'
run hydro inspect "$packages/hydro_mujoco/models/b1-relaxation" >"$place/inspect"
say 'hydro --help, hydro doctor, hydro inspect'
run python -m hydro_mujoco | sed 's/^/        /'
say 'python -m hydro_mujoco'
left=$(ls -A "$place/elsewhere")
[ -z "$left" ] || die "left in the working folder: $left"

# The tests of the package, without the checkout; those that are about it stay there.
"$python" -m pip install --quiet --target "$place/tools" pytest pytest-xdist hypothesis
mkdir "$place/tests"
cp "$checkout"/python/tests/*.py "$place/tests"
rm "$place"/tests/test_docs.py "$place"/tests/test_doctor.py
chmod a+rwx "$place/elsewhere"
run env PYTHONPATH="$place/tests:$place/tools" PYTHONWARNINGS=default HYPOTHESIS_STORAGE_DIRECTORY="$place/elsewhere" \
  python -m pytest --quiet --numprocesses auto --dist loadfile -p no:cacheprovider --import-mode=importlib -W ignore::hydro_mujoco.errors.Notice \
  --rootdir "$place/tests" "$place/tests" |
  tail -n 30 | sed 's/^/        /'
say 'the tests of the package'
HYDRO_DOCS_BIN=$bin HYDRO_PROGRAM=$packages/hydro_mujoco/bin/hydro HYDRO_PLUGIN=$packages/hydro_mujoco/libhydro_plugin.so \
  "$python" -m pytest --quiet --numprocesses auto -p no:cacheprovider "$checkout/python/tests/test_docs.py" | sed 's/^/        /'
say 'the code of README.md and docs/'

# Logs and environments with their extras, still without HOME, in site-packages that are read-only.
chmod -R u+w "$place/venv"
"$bin/pip" install --quiet "$wheel[gym,logs]"
chmod -R a-w "$place/venv"
rm -rf "$place/elsewhere" # where the tests wrote
mkdir "$place/elsewhere"
run env PYTHONWARNINGS=default python - <<'CODE' 2>&1 | sed 's/^/        /'
import os
import subprocess
import sys
from pathlib import Path

import gymnasium
import hydro_mujoco as hydro
from gymnasium.utils.env_checker import check_env

assert "HOME" not in os.environ
try:
    Path(hydro.__file__).with_name("x").touch()
except OSError:
    pass
else:
    sys.exit("site-packages are not read-only")
subprocess.run([sys.executable, Path(hydro.examples(), "logs", "dive.py"), "--out", "dive", "--seconds", "12"], check=True)
model = "dive/nominal.xml"
for log, read in (
    ("dive_ros2", hydro.trials.from_rosbag),
    ("dive.mcap", hydro.trials.from_mcap),
    ("dive.bin", hydro.trials.from_ardupilot),
):
    words = ["hydro", "trials", "convert", f"dive/{log}", "--model", model]
    proposed = subprocess.run([*words, "--dry-run"], check=True, capture_output=True, text=True)
    Path("map.toml").write_text(proposed.stdout)
    found = read(f"dive/{log}", model=model, mapping="map.toml")
    assert len(found) > 2 and not found.report.suspicions, found.report
    subprocess.run([*words, "--mapping", "map.toml", "--out", f"trials/{log}"], check=True, capture_output=True)
    written = len(list(Path("trials", log).glob("*.npz")))
    assert written == len(found), (written, found.report)
    print(f"{log}: {written} trials")
for name in ("B1Swim-v0", "RovStation-v0"):
    env = gymnasium.make(f"hydro_mujoco.envs:hydro_mujoco/{name}")
    check_env(env.unwrapped, skip_render_check=True)
    env.reset(seed=1)
    steps = [env.step(env.action_space.sample()) for _ in range(50)]
    many = gymnasium.make_vec(f"hydro_mujoco.envs:hydro_mujoco/{name}", num_envs=3)
    many.reset(seed=1)
    many.step(many.action_space.sample())
    print(f"{name}: checked, {len(steps)} steps, 3 at once")
CODE
rm -rf "$place/elsewhere"
mkdir "$place/elsewhere"
say 'logs and environments, read-only and without HOME'

# Another copy of the library, in MuJoCo's own folder.
chmod -R u+w "$place/venv"
cp "$packages/hydro_mujoco/libhydro_plugin.so" "$packages/mujoco/plugin/"
run env PYTHONWARNINGS=default python -m hydro_mujoco >"$place/two" 2>&1 || die "two copies: $(cat "$place/two")"
[ "$(grep -c 'that copy acts, and this one does not' "$place/two")" = 1 ] || die "two copies: $(cat "$place/two")"
rm "$packages/mujoco/plugin/libhydro_plugin.so"
say 'two copies: one acts, and says so'

# The release that the table calls equal: itself where pip has it, else by its headers.
if "$bin/pip" install --quiet --no-deps mujoco-core==4.0.1 2>"$place/pip"; then
  run python -m hydro_mujoco >"$place/equal" || die "mujoco-core 4.0.1: $(cat "$place/equal")"
  sed -n 's/^MuJoCo\|^water/        &/p' "$place/equal"
  grep -q '^MuJoCo       4.0.1 .*' "$place/equal" || die "not 4.0.1: $(cat "$place/equal")"
  say 'mujoco-core 4.0.1: installed by pip, and the plugin acts in it'
else
  (cd "$packages/mujoco/include/mujoco" && sha256sum --quiet --check -) <<'SUMS' || die 'the headers of mujoco-core 4.0.1, by their hashes, are others'
80eb97e20917e78ca227eae3506bdadf4bd29452318794f01c45d4edcbd3ca8f  mjmodel.h
770343465998c4bf5f71fe49de85cca26dfed8764e01af06d23069a979c8239d  mjdata.h
39e06e34906be7ac71746e9422fb79d8273589af2c44510c08680903f317834f  mjplugin.h
1daff79e0a5cd0771bb59215866cacc1dfc7b3817ba27a2836371365a4d03a45  mjspec.h
SUMS
  say "mujoco-core 4.0.1: not run, for pip does not have it ($(tail -1 "$place/pip")); its headers' hashes are those of 4.0.0"
fi

# One that it does not know: the installed library, whose version is changed.
cp "$(echo "$packages"/mujoco/libmujoco.so*)" "$place/libmujoco"
python3 - "$(echo "$packages"/mujoco/libmujoco.so*)" <<'CODE'
import re
import sys
from pathlib import Path

library = Path(sys.argv[1])
content = library.read_bytes()
versions = [(number).to_bytes(4, "little") for number in (4_000_000, 4_000_001)]
# `mov eax, VERSION; ret` of mj_version, and the text of mj_versionString.
content, calls = re.subn(b"\xb8(?:" + b"|".join(map(re.escape, versions)) + b")\xc3", b"\xb8" + (4_001_000).to_bytes(4, "little") + b"\xc3", content)
content, texts = re.subn(rb"\x004\.0\.[01]\x00", b"\x004.1.0\x00", content)
assert (calls, texts) == (1, 1), (calls, texts)
library.write_bytes(content)
CODE
run env PYTHONWARNINGS=default python -c 'import mujoco; assert mujoco.__version__ == "4.1.0"' >"$place/import" 2>&1 || die "$(cat "$place/import")"
! run python -m hydro_mujoco >"$place/python" 2>&1 || die 'python -m hydro_mujoco takes MuJoCo 4.1.0'
! run hydro doctor >"$place/program" 2>&1 || die 'hydro doctor takes MuJoCo 4.1.0'
for said in import python program; do
  [ "$(grep -c 'the running MuJoCo is 4.1.0: nothing is registered. Take the wheel mujoco==' "$place/$said")" = 1 ] ||
    die "a MuJoCo that is not known, $said: $(cat "$place/$said")"
done
cp "$place/libmujoco" "$(echo "$packages"/mujoco/libmujoco.so*)"
left=$(ls -A "$place/elsewhere")
[ -z "$left" ] || die "left in the working folder: $left"
say 'a MuJoCo that it does not know (4.1.0): import, both doctors say so once'

"$bin/pip" uninstall --quiet --yes mujoco mujoco-core
for doctor in 'python -m hydro_mujoco' 'hydro doctor'; do
  # shellcheck disable=SC2086
  ! run $doctor >"$place/none" 2>&1 || die "$doctor finds a MuJoCo where there is none"
  grep -q "pip install 'mujoco==4.0.0'" "$place/none" || die "$doctor without MuJoCo: $(cat "$place/none")"
done
say 'no MuJoCo: both doctors say what to install'
"$bin/pip" install --quiet --no-deps mujoco==4.0.0 mujoco-core==4.0.0

"$bin/pip" uninstall --quiet --yes hydro-mujoco
left=$(find "$place/venv" -iname '*hydro*')
[ -z "$left" ] || die "left after uninstalling: $left"
run python -c 'import mujoco' || die 'import mujoco warns after uninstalling'
say 'uninstalled, nothing left'
