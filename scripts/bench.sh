#!/usr/bin/env bash
# Times `hydro` beside other implementations, in alternation; writes benches/RESULTS.md and the raw blocks beside it.
#   scripts/bench.sh [--quick] [--only PART ...] [--report]
# --quick: three minutes, into out/bench/quick, to see that everything works. See scripts/hydro_tools/benchmarks/README.md.
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/setup.sh
scripts/setup_venv.sh bench
case " $* " in
  *" --report "*) ;;
  *) cargo build --release --lib --bins --bench implementation ;;
esac
exec .venv-bench/bin/python scripts/bench.py "$@"
