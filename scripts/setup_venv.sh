#!/usr/bin/env bash
# Makes or renews a Python environment of the project: `scripts/setup_venv.sh NAME [FOLDER]`.
#   main       .venv          scripts, tests, lints
#   bench      .venv-bench    scripts/bench.py: PyTorch, torchdiffeq, ONNX Runtime
#   baselines  .venv-rivals   scripts/rivals.py: PySINDy, scikit-learn, mujoco.sysid
#   docs       .venv-docs     scripts/build_docs.py: the site, its notebooks
#   ray        .venv-ray      scripts with --ray, and all tests
# Each installs the packages of scripts/locks/NAME.txt, whose hashes pip checks, and hydro_mujoco and scripts/ editable; nothing
# happens where these files are as they were. scripts/lock.sh writes the locks.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
usage='usage: scripts/setup_venv.sh main|bench|baselines|docs|ray [FOLDER]'
name=${1:?$usage}
case $name in
main) folder=.venv imports='cma, matplotlib, mujoco, mujoco_warp, pandas, rosbags, safetensors, scipy' ;;
bench) folder=.venv-bench imports='matplotlib, mujoco, onnxruntime, torch, torchdiffeq' ;;
baselines) folder=.venv-rivals imports='pysindy, sklearn, mujoco.sysid' ;;
docs) folder=.venv-docs imports='ipykernel, jupytext, material, matplotlib, nbconvert' ;;
ray) folder=.venv-ray imports='mujoco, ray, safetensors' ;;
*)
  echo "$usage" >&2
  exit 2
  ;;
esac
folder=${2:-$folder}
lock=scripts/locks/$name
made_of=(pyproject.toml scripts/pyproject.toml "$lock.in" "$lock.txt")
if ! cat "${made_of[@]}" | cmp -s - "$folder/.made_of"; then
  echo "setup: making $folder"
  [ -x "$folder/bin/python" ] || "${PYTHON:-python3}" -m venv "$folder"
  install=("$folder/bin/python" -m pip install --quiet --no-compile --disable-pip-version-check)
  "${install[@]}" --require-hashes -r "$lock.txt"
  "${install[@]}" --no-deps --no-build-isolation -r "$lock.in"
  "$folder/bin/python" -c "import hydro_mujoco, hydro_tools, $imports"
  cat "${made_of[@]}" >"$folder/.made_of"
fi
