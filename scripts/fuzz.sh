#!/usr/bin/env bash
# Fuzzes the parsers of files, each a target of fuzz/: libFuzzer with AddressSanitizer.
#   scripts/fuzz.sh [TARGET|all] [SECONDS]     300 seconds each by default; JOBS at a time (2)
#   scripts/fuzz.sh list
# New inputs go to out/fuzz/TARGET, findings to fuzz/artifacts/TARGET, logs to out/fuzz/TARGET.log; a table is printed.
# Needs cargo-fuzz: cargo install --locked cargo-fuzz. Exits with 1 where there is a finding.
set -euo pipefail
cd "$(dirname "$0")/.."
which=${1:-all}
export SECONDS_EACH=${2:-300}
mapfile -t all < <(cd fuzz/fuzz_targets && ls -- *.rs | sed 's/\.rs$//')
if [ "$which" = list ]; then
  printf '%s\n' "${all[@]}"
  exit
fi
targets=("${all[@]}")
if [ "$which" != all ]; then
  [ -f "fuzz/fuzz_targets/$which.rs" ] || {
    echo "fuzz.sh: no target \`$which\`; there are: ${all[*]}" >&2
    exit 2
  }
  targets=("$which")
fi
[[ $SECONDS_EACH =~ ^[1-9][0-9]*$ ]] || {
  echo "fuzz.sh: SECONDS is \`$SECONDS_EACH\`; expected a whole number above zero" >&2
  exit 2
}
cargo fuzz --version >/dev/null 2>&1 || {
  echo 'fuzz.sh: no cargo-fuzz; cargo install --locked cargo-fuzz' >&2
  exit 2
}

# The flags of sanitizers are unstable: with this the pinned compiler takes them.
export RUSTC_BOOTSTRAP=1
if [ "$which" = all ]; then cargo fuzz build; else cargo fuzz build "$which"; fi

# Scratch folders of targets that read files, in memory where there is a file system of it.
shared=$(mktemp -d -p "$([ -d /dev/shm ] && echo /dev/shm || echo /tmp)")
trap 'rm -rf "$shared"' EXIT
export TMPDIR=$shared ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1

# Findings of this run are the files newer than it.
began=$shared/began
touch "$began"
fuzz() {
  target=$1
  mkdir -p "out/fuzz/$target" "fuzz/artifacts/$target"
  # 10 s and 2 GB for an input of 16 kB; no single allocation above 1 GB.
  TIMEFORMAT='%U %S'
  { time "fuzz/target/x86_64-unknown-linux-gnu/release/$target" "out/fuzz/$target" "fuzz/corpus/$target" \
    -artifact_prefix="fuzz/artifacts/$target/" -max_total_time="$SECONDS_EACH" -max_len=16384 -timeout=10 \
    -rss_limit_mb=2048 -malloc_limit_mb=1024 -print_final_stats=1 >"out/fuzz/$target.log" 2>&1; } \
    2>"out/fuzz/$target.seconds" || true
}
export -f fuzz
printf '%s\n' "${targets[@]}" | xargs -P "${JOBS:-2}" -I{} bash -c 'fuzz {}'

findings=0
echo '| target | processor seconds | executions | a processor second | findings | inputs that reach something new |'
echo '|---|---|---|---|---|---|'
for target in "${targets[@]}"; do
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "out/fuzz/$target.log")
  seconds=$(awk 'END { print int($1 + $2 + 0.5) }' "out/fuzz/$target.seconds")
  count=$(find "fuzz/artifacts/$target" -type f -newer "$began" | wc -l)
  corpus=$(find "out/fuzz/$target" -type f | wc -l)
  rate=$((${executions:-0} / (seconds > 0 ? seconds : 1)))
  if [ "${executions:-0}" -eq 0 ]; then
    echo "fuzz.sh: $target ran nothing: $(tail -n 1 "out/fuzz/$target.log")" >&2
    findings=$((findings + 1))
  fi
  echo "| \`$target\` | $seconds | ${executions:-0} | $rate | $count | $corpus |"
  findings=$((findings + count))
done
[ "$findings" -eq 0 ]
