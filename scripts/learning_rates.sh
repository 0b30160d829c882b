#!/usr/bin/env bash
# What learning rate each row of `hydro compare` is given: trains seed 0 of each with several under the budget of the tables and
# prints the least validation error that each came to.
#
#   scripts/learning_rates.sh task1             # on 1.2; scripts/compare.sh must have made the data; an hour on two cores
#   scripts/learning_rates.sh task2 lstm mlp    # these rows alone; all of them take two hours
#
# Stopped at any time, it goes on where it was. HYDRO_COMPARE_OUT (out/compare) holds the data, and the trainings in rates-TASK.
set -euo pipefail
task=${1:?usage: scripts/learning_rates.sh task1|task2 [ROW ...]}
shift
cd "$(dirname "$0")/.."
out=${HYDRO_COMPARE_OUT:-out/compare}
case $task in
task1) data=$out/task1-data set=1.2 rates="0.001 0.002 0.004 0.008 0.016 0.032 0.064" ;;
task2) data=$out/task2 set=2 rates="0.0005 0.001 0.002 0.004 0.008" ;;
*)
  echo "learning_rates.sh: unknown task $task; there are task1 and task2" >&2
  exit 2
  ;;
esac
[ -d "$data" ] || {
  echo "learning_rates.sh: no data set in $data; scripts/compare.sh $task makes it" >&2
  exit 1
}
rows=(mlp-ode-euler attention-ode-euler cnode-hermite-euler lstm relaxation-ode relaxation-ode-modes relaxation-ode-raw
  mlp-ode-informed attention-ode-informed cnode-informed lstm-informed mlp mlp-informed)
[ $# = 0 ] || rows=("$@")
source scripts/setup.sh
cargo build --release --quiet
export task data set folder=$out/rates-$task
mkdir -p "$folder"

# learn ROW RATE: one training. One that diverges is a finding; whatever else stops it is told.
learn() {
  local at=$folder/$2 job=$set/$1/seed-0
  [ ! -e "$at/$1.diverged" ] || return 0
  mkdir -p "$at"
  RAYON_NUM_THREADS=1 target/release/hydro compare "$task" --data "$data" --out "$at" --learning-rate "$2" --only "$job" \
    > "$at/$1.txt" 2>&1 && return 0
  grep -q 'the loss is' "$at/$1.txt" && touch "$at/$1.diverged" && return 0
  echo "learning_rates.sh: $1 at $2: $(tail -n 1 "$at/$1.txt")" >&2
  return 1
}
export -f learn

for row in "${rows[@]}"; do
  for rate in $rates; do echo "learn $row $rate"; done
done | xargs -P "$(nproc)" -d '\n' -n 1 bash -c

.venv/bin/python - "$folder" "$rates" "$set" <<'TABLE'
import json
import sys
from pathlib import Path

folder, rates, data = Path(sys.argv[1]), sys.argv[2].split(), sys.argv[3]
rows = sorted({log.stem for log in folder.glob("*/*.txt")})
print(f"{'':24}" + "".join(f"{rate:>12}" for rate in rates))
for row in rows:
    found = []
    for rate in rates:
        note = folder / rate / "jobs" / data / row / "seed-0" / "result.json"
        if note.exists():
            found.append(f"{json.loads(note.read_text())['training']['validation']:.4f}")
        else:
            found.append("not finite" if (folder / rate / f"{row}.diverged").exists() else "")
    print(f"{row:24}" + "".join(f"{value:>12}" for value in found))
TABLE
