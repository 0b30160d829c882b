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
task1) data=$out/task1-data/1.2 epochs=8 latent=2 ours=hydrodynamic rates="0.001 0.002 0.004 0.008 0.016 0.032 0.064" ;;
task2) data=$out/task2 epochs=6 latent=6 ours=links rates="0.0005 0.001 0.002 0.004 0.008" ;;
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
export data epochs folder=$out/rates-$task
mkdir -p "$folder"

# learn ROW RATE FLAGS...: one training; what it said stands beside it.
learn() {
  local at=$folder/$1-$2
  [ ! -e "$at.failed" ] || return 0
  RAYON_NUM_THREADS=1 target/release/hydro train --data "$data" --out "$at" --resume --epochs "$epochs" --patience "$epochs" \
    --batch 32 --horizon 50 --seed 0 --learning-rate "$2" "${@:3}" > "$at.txt" 2>&1 && return 0
  grep -q 'the loss is' "$at.txt" && touch "$at.failed" && return 0
  echo "learning_rates.sh: $1 at $2: $(tail -n 1 "$at.txt")" >&2
  return 1
}
export -f learn

full="--preset full"
raw="$full --encoding raw"
rows="mlp-ode-euler --model mlp-ode $raw --latent $latent --without-skip
attention-ode-euler --model attention-ode $raw --latent $latent --without-skip
cnode-hermite-euler --model cnode --solver euler $raw --control hermite
lstm --model lstm $raw --without-skip
relaxation-ode --model relaxation-ode
relaxation-ode-modes --model relaxation-ode --modes 3
relaxation-ode-raw --model relaxation-ode --encoding raw
mlp-ode-informed --model mlp-ode $full --encoding $ours
attention-ode-informed --model attention-ode $full --encoding $ours
cnode-informed --model cnode --solver euler $full --encoding hydrodynamic
lstm-informed --model lstm $full --encoding $ours
mlp --model mlp $raw --without-skip
mlp-informed --model mlp --hidden 256,256 --encoding $ours"

while read -r row flags; do
  [ $# = 0 ] || [[ " $* " == *" $row "* ]] || continue
  for rate in $rates; do echo "learn $row $rate $flags"; done
done <<< "$rows" | xargs -P "$(nproc)" -d '\n' -n 1 bash -c

.venv/bin/python - "$folder" "$rates" <<'TABLE'
import json
import sys
from pathlib import Path

folder, rates = Path(sys.argv[1]), sys.argv[2].split()
rows = sorted({log.parent.name.removesuffix(".run").rpartition("-")[0] for log in folder.glob("*.run/log.jsonl")})
print(f"{'':24}" + "".join(f"{rate:>12}" for rate in rates))
for row in rows:
    found = []
    for rate in rates:
        at = folder / f"{row}-{rate}"
        if at.with_name(f"{at.name}.failed").exists():
            found.append("not finite")
        elif (at / "card.json").exists():
            records = map(json.loads, (folder / f"{at.name}.run/log.jsonl").read_text().splitlines())
            found.append(f"{min(record['validation'] for record in records):.4f}")
        else:
            found.append("")
    print(f"{row:24}" + "".join(f"{value:>12}" for value in found))
TABLE
