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
  # What cargo has compiled of others' crates serves again; those of the workspace are compiled in each place.
  export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$checkout/target}
  "$python" -m venv "$place/tools"
  "$place/tools/bin/pip" install --quiet build
  mkdir "$place/checkout"
  git ls-files -z --cached --others --exclude-standard | tar --create --null --files-from - | tar --extract --directory "$place/checkout"
  "$place/tools/bin/python" -m build --sdist --outdir "$place/dist" "$place/checkout" >"$place/sdist.log" || die "$(cat "$place/sdist.log")"
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
"$python" -m pip install --quiet --target "$place/tools" pytest hypothesis
mkdir "$place/tests"
cp "$checkout"/python/tests/*.py "$place/tests"
rm "$place"/tests/test_docs.py "$place"/tests/test_doctor.py
chmod a+rwx "$place/elsewhere"
run env PYTHONPATH="$place/tests:$place/tools" PYTHONWARNINGS=default HYPOTHESIS_STORAGE_DIRECTORY="$place/elsewhere" \
  python -m pytest --quiet -p no:cacheprovider --import-mode=importlib -W ignore::hydro_mujoco.errors.Notice \
  --rootdir "$place/tests" "$place/tests" |
  tail -n 30 | sed 's/^/        /'
say 'the tests of the package'
HYDRO_DOCS_BIN=$bin "$python" -m pytest --quiet -p no:cacheprovider "$checkout/python/tests/test_docs.py" | sed 's/^/        /'
say 'the code of README.md and docs/'

# Another copy of the library, in MuJoCo's own folder.
chmod -R u+w "$place/venv"
cp "$packages/hydro_mujoco/libhydro_plugin.so" "$packages/mujoco/plugin/"
run python -m hydro_mujoco >"$place/two" 2>&1 || die "two copies: $(cat "$place/two")"
[ "$(grep -c 'that copy acts, and this one does not' "$place/two")" = 1 ] || die "two copies: $(cat "$place/two")"
rm "$packages/mujoco/plugin/libhydro_plugin.so"
say 'two copies: one acts, and says so'

# The release that the table calls equal, then one that it does not know.
if "$bin/pip" install --quiet --no-deps mujoco-core==4.0.1 2>"$place/pip"; then
  run python -m hydro_mujoco | sed -n 's/^MuJoCo\|^water/        &/p'
  say 'mujoco-core 4.0.1'
else
  say "mujoco-core 4.0.1 is not to be had: $(tail -1 "$place/pip")"
fi

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
