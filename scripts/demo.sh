#!/usr/bin/env bash
# The main job from a fresh machine, with the wheel that users install. First the released checkpoint swims: a film and how far it
# strays from the truth. Then a small model is trained on new data and shown the same way; that ends with a table and
# demo/report.html. Stopped at any time and run again, it goes on where it was. HYDRO_DEMO_OUT (demo) is the folder of all it makes.
set -euo pipefail
cd "$(dirname "$0")/.."
started=$SECONDS
source scripts/setup.sh

out=${HYDRO_DEMO_OUT:-demo}
mkdir -p "$out"
hydro=$out/venv/bin/hydro
python=.venv/bin/python
step() { printf '\n== %s  (after %d s)\n' "$*" $((SECONDS - started)); }

# record FOLDER FLAGS...: unless it is there.
record() {
  [ -e "$1/rollouts.json" ] || "$python" scripts/record_rollouts.py --out "$1" --overwrite "${@:2}"
}

# film FILM CHECKPOINT: unless it is there; without a renderer the report goes without.
film() {
  [ -e "$1" ] || "$python" scripts/film.py --rollouts "$out/rollouts" --index 3 --seconds 4 --checkpoint "$2" --out "$1" ||
    echo 'demo: no film (see above); the report goes without'
}

# report PAGE FILM FLAGS...: the table, and the same as a page.
report() {
  local video=()
  [ ! -e "$2" ] || video=(--video "$2")
  "$hydro" simulate --rollouts "$out/rollouts" --long "$out/long" --report "$1" "${video[@]}" "${@:3}"
}

step 'building; meanwhile recording runs that no model was trained on: 20 of 4 s, one of 10 minutes'
# The recording needs Python alone. It is done long before the build, and says what is wrong in its log.
{
  record "$out/rollouts" --count 20 --duration 4 --seed 100
  record "$out/long" --count 1 --minutes 10 --seed 101
} >"$out/record.log" 2>&1 &
recording=$!
# A build that fails leaves no recorder behind.
trap 'kill "$recording" 2>/dev/null || true' EXIT
cargo build --release
step 'the wheel, in an environment of its own'
"$python" -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir "$out/wheel" .
[ -x "$out/venv/bin/python" ] || "$python" -m venv "$out/venv"
"$out/venv/bin/pip" install --quiet --disable-pip-version-check --force-reinstall --no-deps "$out"/wheel/hydro_mujoco-*.whl
"$out/venv/bin/pip" install --quiet --disable-pip-version-check "$out"/wheel/hydro_mujoco-*.whl
wait "$recording" || {
  cat "$out/record.log" >&2
  exit 1
}
"$hydro" doctor

step 'the released checkpoint swims'
film "$out/first.mp4" models/b1-relaxation
report "$out/first.html" "$out/first.mp4" --checkpoint models/b1-relaxation
printf '\nThe first picture, after %d s: open %s/first.html\n' $((SECONDS - started)) "$out"

step 'data to train on: 600 trajectories of 400 samples'
"$python" scripts/gen_task2.py --water ellipsoid --out "$out/task2" --trials 600 --seed 0 --resume

step 'training a small Relaxation-ODE'
"$hydro" train --data "$out/task2" --out "$out/model" --model relaxation-ode --preset demo --resume

step 'training a memoryless MLP on the same data and features, to compare'
"$hydro" train --data "$out/task2" --out "$out/mlp" --model mlp --encoding links --preset demo --resume

step 'the trained model swims'
film "$out/swim.mp4" "$out/model"
report "$out/report.html" "$out/swim.mp4" --checkpoint "$out/model" --mlp "$out/mlp" --data "$out/task2"

printf '\nDone in %d s. Open %s/report.html\n' $((SECONDS - started)) "$out"
