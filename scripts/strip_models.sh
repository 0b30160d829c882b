#!/usr/bin/env bash
# Checkpoints of water that remembers, wrench and joint torques, the added mass in the inertia: the paper's four, a memoryless
# perceptron and ours; each evaluated, swum in the plugin for 4 s and ten minutes, its curve drawn. Stopped at any time, it goes on where
# it was. One process at a time; hours.
#
#   scripts/strip_models.sh                   # every row
#   scripts/strip_models.sh lstm mlp-ode      # these rows
#
# HYDRO_STRIP_OUT (out/strip): folder of data and results, table.md and curves.svg among them. HYDRO_STRIP_SEEDS (0 1 2).
# HYDRO_STRIP_EPOCHS (40): most passes over the training split; another number wants another folder.
set -euo pipefail
cd "$(dirname "$0")/.."
rows=(mlp-ode attention-ode cnode lstm mlp relaxation-ode relaxation-ode-memory)
wanted=("$@")
[ $# -gt 0 ] || wanted=("${rows[@]}")
out=${HYDRO_STRIP_OUT:-out/strip}
epochs=${HYDRO_STRIP_EPOCHS:-40}
hydro=target/release/hydro
read -ra seeds <<<"${HYDRO_STRIP_SEEDS:-0 1 2}"
# The flags of `hydro train` in which the rows differ.
declare -A flags=(
  [mlp-ode]='--model mlp-ode'
  [attention-ode]='--model attention-ode'
  [cnode]='--model cnode --solver euler --learning-rate 1e-3'
  [lstm]='--model lstm --learning-rate 4e-3'
  [mlp]='--model mlp --encoding links --hidden 256,256 --learning-rate 4e-3'
  [relaxation-ode]='--model relaxation-ode --learning-rate 4e-3'
  [relaxation-ode-memory]='--model relaxation-ode --memory 64 --learning-rate 3e-3'
)
for row in "${wanted[@]}"; do
  [ -n "${flags[$row]:-}" ] || {
    echo "strip_models.sh: unknown row $row; there are ${rows[*]}" >&2
    exit 2
  }
done
source scripts/setup.sh
python=.venv/bin/python
cargo build --release --quiet

truth=(--water strip --added-mass inertia)
data=$out/strip-inertia
mkdir -p "$out"
[ -e "$data/manifest.json" ] || "$python" scripts/gen_task2.py "${truth[@]}" --out "$data" --trials 1000 --seed 0 --workers 1 --resume
# record FOLDER FLAGS...: unless it is there.
record() {
  [ -e "$1/rollouts.json" ] || "$python" scripts/record_rollouts.py "${truth[@]}" --out "$1" --overwrite "${@:2}"
}
record "$out/rollouts" --count 10 --duration 4 --seed 0
record "$out/long" --count 1 --minutes 10 --seed 1

# told FILE COMMAND...: the command's output in a file that is whole or absent.
told() {
  [ -e "$1" ] || { "${@:2}" >"$1.part" && mv "$1.part" "$1"; }
}
for row in "${wanted[@]}"; do
  read -ra own <<<"${flags[$row]}"
  for seed in "${seeds[@]}"; do
    place=$out/jobs/$row/seed-$seed
    mkdir -p "$place"
    "$hydro" train --data "$data" --out "$place/b1-strip-$row" --outputs generalised --preset release "${own[@]}" --epochs "$epochs" \
      --seed "$seed" --resume
    told "$place/open.json" "$hydro" evaluate --checkpoint "$place/b1-strip-$row" --data "$data" --json
    told "$place/closed.json" "$hydro" simulate --checkpoint "$place/b1-strip-$row" --rollouts "$out/rollouts" --long "$out/long" --json
  done
done
"$python" scripts/training_curves.py "$out"/jobs/*/seed-*/*.run --out "$out/curves" >"$out/curves.md"
ratios=()
! compgen -G "$out/jobs/relaxation-ode-memory/seed-*/open.json" >/dev/null || ratios=(--over relaxation-ode-memory)
"$python" scripts/strip_table.py "$out/jobs" "${ratios[@]}" >"$out/table.md"
cat "$out/table.md" "$out/curves.md"
