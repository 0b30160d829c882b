#!/usr/bin/env bash
# The main job from a fresh machine: set up, make data, train a small model, swim with it, show how well.
# Ends with a table and demo/report.html. Run again, it goes on where it was stopped.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh

out=${HYDRO_DEMO_OUT:-demo}
trials=${HYDRO_DEMO_TRIALS:-300}
minutes=${HYDRO_DEMO_MINUTES:-4}
started=$SECONDS
mkdir -p "$out"
step() { printf '\n== %s (%d s)\n' "$*" $((SECONDS - started)); }

step 'building'
cargo build --release --quiet
hydro=target/release/hydro
"$hydro" doctor

step "Task 2 data: $trials trajectories of 4 s"
.venv/bin/python scripts/gen_task2.py --out "$out/task2" --trials "$trials" --seed 0 --resume

step 'held-out rollouts'
[ -e "$out/rollouts/rollouts.json" ] ||
  .venv/bin/python scripts/record_rollouts.py --out "$out/rollouts" --count 12 --duration 4 --seed 100
[ -e "$out/long/rollouts.json" ] ||
  .venv/bin/python scripts/record_rollouts.py --out "$out/long" --count 1 --duration 600 --seed 101

step "training the attention-ODE, at most $minutes minutes"
"$hydro" train --data "$out/task2" --out "$out/model" --preset demo --minutes "$minutes" --resume

step 'training the memoryless MLP, at most 1 minute'
"$hydro" train --data "$out/task2" --out "$out/mlp" --model mlp --preset demo --minutes 1 --resume

step 'filming'
.venv/bin/python scripts/film.py --rollouts "$out/rollouts" --checkpoint "$out/model" --out "$out/swim.mp4" \
  --frame "$out/swim.png" || echo 'demo: no film (see above); the report goes without'

step 'open loop, closed loop, ten minutes'
video=()
[ -e "$out/swim.mp4" ] && video=(--video "$out/swim.mp4")
"$hydro" simulate --checkpoint "$out/model" --mlp "$out/mlp" --data "$out/task2" --rollouts "$out/rollouts" \
  --long "$out/long" --report "$out/report.html" "${video[@]}"

printf '\nDone in %d s. Open %s/report.html\n' $((SECONDS - started)) "$out"
