#!/usr/bin/env bash
# Sets up and passes every test: `scripts/test.sh`.
#   --debian   also installs Debian's MuJoCo 2.2.2 and tests with it; without, it is tested where it is installed
set -euo pipefail
cd "$(dirname "$0")/.."
case ${1:-} in
'') ;;
--debian) export HYDRO_WITH_DEBIAN_MUJOCO=1 ;;
*)
  echo "test.sh: unknown argument $1; there is --debian" >&2
  exit 2
  ;;
esac
source scripts/setup.sh
source scripts/tests_of.sh
# The tests start Python a hundred times; without this each start compiles MuJoCo's and SciPy's modules where
# PYTHONDONTWRITEBYTECODE is set.
.venv/bin/python -m compileall -q -j 0 .venv/lib || true
step() { printf '\n== %s  (%d s)\n' "$*" $SECONDS; }

# A test in Python loads the library in this MuJoCo, whose layout is another.
other=target/mujoco-3.17.0
if [ ! -e "$other/complete" ]; then
  rm -rf "$other"
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --no-deps --target "$other" \
    mujoco==3.17.0 typing_extensions
  touch "$other/complete"
fi
export HYDRO_TEST_OTHER_WHEEL=$PWD/$other
# Here a missing .venv is a failure, not a reason to skip.
export HYDRO_REQUIRE_PYTHON=1

scripts/check.sh

step 'Python: the package'
.venv/bin/python -m pytest --quiet --numprocesses auto --dist loadfile python
step 'Python: the wheel, in an environment of its own; the code of README.md and docs/'
scripts/test_wheel.sh --dev
step 'Python: data, scenes, baselines, benchmark'
.venv/bin/python -m pytest --quiet --numprocesses auto --dist loadfile scripts/tests
step 'soak: every checkpoint and effect, alone and in pairs'
.venv/bin/python scripts/soak.py --quick
step 'documentation site: notebooks run, links hold'
PYTHON=.venv/bin/python scripts/setup_venv.sh docs
.venv-docs/bin/python scripts/build_docs.py --out out/site

# The other releases matter to the crate that binds MuJoCo alone; what is below it comes compiled from above.
step 'MuJoCo 3.17.0: the bindings fit it too'
scripts/lend_build.sh target/mujoco-3.17.0-build
MUJOCO_DIR="$PWD/$other/mujoco" cargo check -p hydro --lib --quiet --target-dir target/mujoco-3.17.0-build

if [ -e /usr/include/mujoco/mujoco.h ]; then
  step "Debian's MuJoCo 2.2.2: the same library as a passive callback"
  scripts/lend_build.sh target/debian
  export MUJOCO_DIR=/usr
  tests_of -p hydro --target-dir target/debian --lib --bin hydro --test plugin
else
  printf '\nMuJoCo 2.2.2 is not installed: not tested (scripts/test.sh --debian installs and tests it)\n'
fi
printf '\nAll tests passed in %d s\n' $SECONDS
