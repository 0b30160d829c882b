#!/usr/bin/env bash
# What learning rate each kind of model is given in `hydro compare`: trains seed 0 of every kind with several under the budget
# of the tables, prints the least validation error of each.
#
#   scripts/learning_rates.sh task1     # on 1.2; scripts/compare.sh must have made the data; an hour or two on two cores
#   scripts/learning_rates.sh task2
#
# Stopped at any time, it goes on where it was. HYDRO_COMPARE_OUT (out/compare) holds the data, and rates-task1 or rates-task2 in it the trainings.
set -euo pipefail
task=${1:?usage: scripts/learning_rates.sh task1|task2}
cd "$(dirname "$0")/.."
out=${HYDRO_COMPARE_OUT:-out/compare}
case $task in
task1) data=$out/task1-data/1.2 epochs=8 latent=2 rates="0.001 0.002 0.004 0.008 0.016 0.032" ;;
task2) data=$out/task2 epochs=6 latent=6 rates="0.001 0.002 0.004 0.008" ;;
*)
  echo "learning_rates.sh: unknown task $task; there are task1 and task2" >&2
  exit 2
  ;;
esac
[ -e "$data/manifest.json" ] || {
  echo "learning_rates.sh: no data set in $data; scripts/compare.sh $task makes it" >&2
  exit 1
}
source scripts/setup.sh
cargo build --release --quiet
paper="--preset full --encoding raw"
export data epochs folder=$out/rates-$task

# learn NAME RATE FLAGS...: one training, unless its checkpoint is there.
learn() {
  local at=$folder/$1-$2
  [ -e "$at/card.json" ] || RAYON_NUM_THREADS=1 target/release/hydro train --data "$data" --out "$at" --overwrite \
    --epochs "$epochs" --patience "$epochs" --batch 32 --horizon 50 --seed 0 --learning-rate "$2" "${@:3}" > "$at.txt" 2>&1 ||
    echo "learning_rates.sh: $1 at $2: $(tail -n 1 "$at.txt")" >&2
}
export -f learn

mkdir -p "$folder"
while read -r name flags; do
  for rate in $rates; do echo "learn $name $rate $flags"; done
done <<MODELS | xargs -P "$(nproc)" -d '\n' -n 1 bash -c
mlp-ode --model mlp-ode $paper --latent $latent --without-skip
attention-ode --model attention-ode $paper --latent $latent --without-skip
cnode --model cnode $paper --control hermite
lstm --model lstm $paper --without-skip
mlp --model mlp $paper --without-skip
relaxation-ode --model relaxation-ode
relaxation-ode-modes --model relaxation-ode --modes 3
MODELS

.venv/bin/python - "$folder" <<'TABLE'
import json, sys
from pathlib import Path

for log in sorted(Path(sys.argv[1]).glob("*.run/log.jsonl")):
    records = [json.loads(line) for line in log.read_text().splitlines()]
    print(f"{log.parent.name.removesuffix('.run'):30} {min(record['validation'] for record in records):.4f}")
TABLE
