#!/usr/bin/env bash
# Makes the rivals' own environment, .venv-rivals (or the folder given): PySINDy, SciPy, scikit-learn, mujoco.sysid.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
venv=${1:-.venv-rivals}
requirements=scripts/rivals/requirements.txt
if ! cmp -s "$requirements" "$venv/.requirements"; then
  echo "setup: making $venv"
  [ -x "$venv/bin/python" ] || "${PYTHON:-python3}" -m venv "$venv"
  "$venv/bin/python" -m pip install --quiet --disable-pip-version-check -r "$requirements"
  cp "$requirements" "$venv/.requirements"
fi
"$venv/bin/python" -c 'import pysindy, sklearn; from mujoco import sysid; sysid.optimize'
