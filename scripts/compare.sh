#!/usr/bin/env bash
# The paper's experiments from a fresh machine, by one command each: sets up, makes the data, trains every model with every
# solver over three seeds, writes the tables. Stopped at any time, it goes on where it was.
#
#   scripts/compare.sh task1                      # hours on two cores: a night
#   scripts/compare.sh task2 --quick              # in water that remembers; a quarter of an hour beside the data
#   scripts/compare.sh task2 ellipsoid --quick    # in MuJoCo's own fluid
#
# HYDRO_COMPARE_OUT (out/compare) holds the data and the results; flags that follow are for `hydro compare`.
set -euo pipefail
task=${1:?usage: scripts/compare.sh task1 or task2 [strip|ellipsoid] [flags of hydro compare]}
shift
suffix= truth=()
if [ "$task" = task2 ]; then
  water=strip
  if [ $# -gt 0 ] && [[ $1 != -* ]]; then
    water=$1
    shift
  fi
  case $water in
  # The added mass is in the inertia: with its force in the label a simulation is unstable.
  strip) suffix=-strip truth=(--water strip --added-mass inertia) ;;
  ellipsoid) truth=(--water ellipsoid) ;;
  *)
    echo "compare.sh: unknown water $water; there are strip and ellipsoid" >&2
    exit 2
    ;;
  esac
fi
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
  data=$out/task2$suffix
  "$python" scripts/gen_task2.py "${truth[@]}" --out "$data" --trials 1000 --seed 0 --resume
  flags=(--data "$data")
  for regime in speeds densities gaits; do
    "$python" scripts/gen_task2.py "${truth[@]}" --out "$data-$regime" --regime "$regime" --trials 60 --seed 0 --resume
    flags+=(--beyond "$regime=$data-$regime")
  done
  record "$out/rollouts$suffix" "${truth[@]}" --count 20 --duration 4 --seed 100
  record "$out/long$suffix" "${truth[@]}" --count 1 --minutes 10 --seed 101
  flags+=(--rollouts "$out/rollouts$suffix" --long "$out/long$suffix")
  ;;
*)
  echo "compare.sh: unknown task $task; there are task1 and task2" >&2
  exit 2
  ;;
esac

quick=
for word in "$@"; do [ "$word" != --quick ] || quick=-quick; done
target/release/hydro compare "$task" "${flags[@]}" --out "$out/$task$suffix-results$quick" "$@"
