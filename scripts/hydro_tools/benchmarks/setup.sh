#!/usr/bin/env bash
# Makes the benchmarks' own environment, .venv-bench (or the folder given): PyTorch, torchdiffeq, ONNX Runtime, MuJoCo.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
venv=${1:-.venv-bench}
requirements=scripts/bench/requirements.txt
if ! cmp -s "$requirements" "$venv/.requirements"; then
  echo "setup: making $venv"
  [ -x "$venv/bin/python" ] || "${PYTHON:-python3}" -m venv "$venv"
  "$venv/bin/python" -m pip install --quiet --disable-pip-version-check -r "$requirements"
  cp "$requirements" "$venv/.requirements"
fi
"$venv/bin/python" -c 'import matplotlib, mujoco, onnxruntime, torch, torchdiffeq'
