#!/usr/bin/env bash
# The paper's experiments from a fresh machine, by one command each: sets up, makes the data, trains every model with every
# solver over three seeds, writes the tables. Stopped at any time, it goes on where it was.
#
#   scripts/compare.sh task1            # hours on two cores: a night
#   scripts/compare.sh task2 --quick    # a quarter of an hour beside the data
#
# HYDRO_COMPARE_OUT (out/compare) holds the data and the results; what follows the task is for `hydro compare`.
set -euo pipefail
task=${1:?usage: scripts/compare.sh task1|task2 [flags of hydro compare]}
shift
cd "$(dirname "$0")/.."
source scripts/setup.sh

out=${HYDRO_COMPARE_OUT:-out/compare}
python=.venv/bin/python
mkdir -p "$out"
cargo build --release --quiet

# record FOLDER FLAGS...: unless it is there.
record() {
  [ -e "$1/rollouts.json" ] || "$python" scripts/record_rollouts.py --out "$1" --overwrite "${@:2}"
}

case $task in
task1)
  "$python" scripts/gen_task1.py --out "$out/task1-data" --seed 0 --resume
  flags=(--data "$out/task1-data")
  ;;
task2)
  "$python" scripts/gen_task2.py --out "$out/task2" --trials 1000 --seed 0 --resume
  flags=(--data "$out/task2")
  for regime in speeds densities gaits; do
    "$python" scripts/gen_task2.py --out "$out/task2-$regime" --regime "$regime" --trials 60 --seed 0 --resume
    flags+=(--beyond "$regime=$out/task2-$regime")
  done
  record "$out/rollouts" --count 20 --duration 4 --seed 100
  record "$out/long" --count 1 --minutes 10 --seed 101
  flags+=(--rollouts "$out/rollouts" --long "$out/long")
  ;;
*)
  echo "compare.sh: unknown task $task; there are task1 and task2" >&2
  exit 2
  ;;
esac

quick=
for word in "$@"; do [ "$word" != --quick ] || quick=-quick; done
target/release/hydro compare "$task" "${flags[@]}" --out "$out/$task-results$quick" "$@"
