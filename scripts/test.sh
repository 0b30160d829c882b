#!/usr/bin/env bash
# Sets up and passes every test: `scripts/test.sh`.
set -euo pipefail
cd "$(dirname "$0")/.."
export HYDRO_WITH_DEBIAN_MUJOCO=1
source scripts/setup.sh

printf '\n== MuJoCo 3.17.0: the bindings fit it too\n'
other=target/mujoco-3.17.0
[ -d "$other/mujoco" ] ||
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --target "$other" mujoco==3.17.0 typing_extensions
# `check` leaves no library behind; the tests that follow load the one of the wheel in .venv.
MUJOCO_DIR="$PWD/$other/mujoco" cargo check --quiet --lib
export HYDRO_TEST_OTHER_WHEEL=$PWD/$other

scripts/check.sh

printf '\n== Python: data, scenes, benchmark\n'
.venv/bin/python -m pytest scripts/tests

printf '\n== Debian MuJoCo 2.2.2: the same library as a passive callback\n'
scripts/lend_build.sh target/debian
MUJOCO_DIR=/usr cargo test --quiet --target-dir target/debian --lib --bins --test fish -- --skip gap::tests --skip model:: --skip training:: --skip effects::
