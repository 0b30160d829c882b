#!/usr/bin/env bash
# Makes or renews a Python environment of the project: `scripts/setup_venv.sh NAME [FOLDER]`.
#   main       .venv          scripts, tests, lints
#   bench      .venv-bench    scripts/bench.py: PyTorch, torchdiffeq, ONNX Runtime
#   baselines  .venv-rivals   scripts/rivals.py: PySINDy, scikit-learn, mujoco.sysid
#   docs       .venv-docs     scripts/build_docs.py: the site, its notebooks
#   ray        .venv-ray      scripts with --ray, and all tests
# Each installs hydro_mujoco (python/) and scripts/ with its extras, editable; nothing happens where their pyproject.toml are as they were.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
usage='usage: scripts/setup_venv.sh main|bench|baselines|docs|ray [FOLDER]'
case ${1:?$usage} in
main) folder=.venv extras=tank,sysid,film,gaits,logs,warp,dev imports='cma, matplotlib, mujoco, mujoco_warp, pandas, rosbags, safetensors, scipy' ;;
bench) folder=.venv-bench extras=bench imports='matplotlib, mujoco, onnxruntime, torch, torchdiffeq' ;;
baselines) folder=.venv-rivals extras=baselines,dev imports='pysindy, sklearn, mujoco.sysid' ;;
docs) folder=.venv-docs extras=docs imports='ipykernel, jupytext, material, matplotlib, nbconvert' ;;
ray) folder=.venv-ray extras=ray,tank,sysid,dev imports='mujoco, ray, safetensors' ;;
*)
  echo "$usage" >&2
  exit 2
  ;;
esac
folder=${2:-$folder}
# Extras of hydro_mujoco.
package=gym,gps
packages=(pyproject.toml scripts/pyproject.toml)
if ! cat "${packages[@]}" | cmp -s - "$folder/.pyproject.toml"; then
  echo "setup: making $folder"
  [ -x "$folder/bin/python" ] || "${PYTHON:-python3}" -m venv "$folder"
  "$folder/bin/python" -m pip install --quiet --no-compile --disable-pip-version-check -e ".[$package]" -e "scripts[$extras]"
  "$folder/bin/python" -c "import hydro_mujoco, hydro_tools, $imports"
  cat "${packages[@]}" >"$folder/.pyproject.toml"
fi
