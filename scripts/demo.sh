#!/usr/bin/env bash
# The main job from a fresh machine: set up, make data, train a small model, swim with it, show how well.
# Ends with a table and demo/report.html. Run again, it goes on where it was stopped.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh

out=${HYDRO_DEMO_OUT:-demo}
started=$SECONDS
mkdir -p "$out"
step() { printf '\n== %s  (after %d s)\n' "$*" $((SECONDS - started)); }

step 'building'
cargo build --release --quiet
hydro=target/release/hydro
python=.venv/bin/python
"$hydro" doctor

step 'Task 2 data: 600 trajectories of 400 samples'
"$python" scripts/gen_task2.py --out "$out/task2" --trials 600 --seed 0 --resume

step 'rollouts that no model was trained on: 20 of 4 s, one of 10 minutes'
[ -e "$out/rollouts/rollouts.json" ] ||
  "$python" scripts/record_rollouts.py --out "$out/rollouts" --count 20 --duration 4 --seed 100 --overwrite
[ -e "$out/long/rollouts.json" ] ||
  "$python" scripts/record_rollouts.py --out "$out/long" --count 1 --minutes 10 --seed 101 --overwrite

step 'training our Relaxation-ODE'
"$hydro" train --data "$out/task2" --out "$out/model" --model relaxation-ode --preset demo --resume

step 'training a memoryless MLP beside it, given the same'
"$hydro" train --data "$out/task2" --out "$out/mlp" --model mlp --encoding links --preset demo --resume

step 'filming the robot under the learned wrench'
"$python" scripts/film.py --rollouts "$out/rollouts" --index 3 --seconds 4 --checkpoint "$out/model" --out "$out/swim.mp4" ||
  echo 'demo: no film (see above); the report goes without'

step 'open loop, closed loop, ten minutes'
video=()
[ -e "$out/swim.mp4" ] && video=(--video "$out/swim.mp4")
"$hydro" simulate --checkpoint "$out/model" --mlp "$out/mlp" --data "$out/task2" --rollouts "$out/rollouts" \
  --long "$out/long" --report "$out/report.html" "${video[@]}"

printf '\nDone in %d s. Open %s/report.html\n' $((SECONDS - started)) "$out"
