#!/usr/bin/env bash
# Sets up and passes every test: `scripts/test.sh`.
set -euo pipefail
cd "$(dirname "$0")/.."
export HYDRO_WITH_DEBIAN_MUJOCO=1
source scripts/setup.sh

scripts/check.sh

printf '\n== Python: data, scenes, plugin\n'
.venv/bin/python -m unittest discover -s scripts/tests

printf '\n== Debian MuJoCo 2.2.2: the same library as a passive callback\n'
MUJOCO_DIR=/usr cargo test --quiet --no-default-features --features mujoco --target-dir target/debian
