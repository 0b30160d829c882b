#!/usr/bin/env bash
# The plugin under sanitizers and valgrind, in a host of C that loads, steps, copies, resets and frees models on threads.
#   scripts/sanitize.sh [asan] [tsan] [valgrind] [miri]     all by default; logs in out/sanitize
#   asan      AddressSanitizer in the plugin and the host, leaks too; and in `hydro gap run` on the trials of examples/tether
#   tsan      ThreadSanitizer in the plugin, 64 threads of the host; MuJoCo and the host are as they are
#   valgrind  memcheck, of target/release/libhydro_plugin.so
#   miri      tests of the crates that touch nothing foreign; skipped where cargo-miri is not installed
# asan and tsan build the plugin anew, in target/asan and target/tsan. Exits with 1 where one reports anything.
set -uo pipefail
cd "$(dirname "$0")/.."
out=out/sanitize
host=scripts/hydro_tools/sanitize/host.c
mkdir -p "$out"
python=.venv/bin/python
mujoco=$("$python" -c 'import mujoco, pathlib; print(pathlib.Path(mujoco.__file__).parent)') || {
  echo 'sanitize.sh: no MuJoCo in .venv; run scripts/setup.sh first' >&2
  exit 2
}
models=(examples/water/boat.xml examples/water/rov.xml examples/water/fish.xml mjcf/b1_swim.xml)
failed=0

# host_of NAME FLAGS...: compiles the host.
host_of() {
  local name=$1 library
  shift
  library=$(ls "$mujoco"/libmujoco.so.* | head -1)
  gcc -std=c11 -g -O1 -Wall -Wextra -Werror "$@" -I"$mujoco/include" "$host" -o "$out/$name" "$library" \
    -Wl,-rpath,"$mujoco" -lpthread -lm
}

# plugin_of NAME [FLAGS]: builds plugin and program with a sanitizer; the flags are unstable, and with this the pinned compiler takes them.
plugin_of() {
  RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=$1 ${2:-}" CARGO_TARGET_DIR="target/$1" CARGO_PROFILE_RELEASE_OPT_LEVEL=1 \
    CARGO_PROFILE_RELEASE_STRIP=false CARGO_PROFILE_RELEASE_DEBUG=line-tables-only \
    cargo build --release --quiet --lib --bin hydro --target x86_64-unknown-linux-gnu
}

# judge NAME STATUS: the last lines of its log.
judge() {
  local verdict='nothing found'
  if [ "$2" -ne 0 ]; then
    verdict="FAILED with $2"
    failed=1
  fi
  printf '\n== %s: %s (%s)\n' "$1" "$verdict" "$out/$1.log"
  tail -n 4 "$out/$1.log"
}

asan() {
  plugin_of address && host_of host-asan -fsanitize=address || return 1
  # Own effects and registries live as long as the process: these are reachable, and no leaks.
  ASAN_OPTIONS=detect_leaks=1:halt_on_error=1 "$out/host-asan" \
    target/address/x86_64-unknown-linux-gnu/release/libhydro_plugin.so 8 4 "${models[@]}" || return 1
  "$python" examples/tether/make_trials.py --out "$out/tether" &&
    ASAN_OPTIONS=detect_leaks=0:halt_on_error=1 target/address/x86_64-unknown-linux-gnu/release/hydro gap run --overwrite \
      --model examples/tether/nominal.xml --trials "$out/tether/trials" --out "$out/tether/gap"
}

tsan() {
  # The standard library is as it is: of its locks the sanitizer does not see those that had to be waited for, so those of the
  # registry are of a crate. The host starts the runtime of the plugin's own compiler; the C compiler's knows other functions.
  local runtime
  runtime=$(rustc --print sysroot)/lib/rustlib/x86_64-unknown-linux-gnu/lib/librustc-stable_rt.tsan.a
  plugin_of thread -Cunsafe-allow-abi-mismatch=sanitizer && host_of host-tsan \
    -rdynamic -Wl,--whole-archive "$runtime" -Wl,--no-whole-archive -ldl -lrt || return 1
  TSAN_OPTIONS=halt_on_error=0:ignore_noninstrumented_modules=1 "$out/host-tsan" \
    target/thread/x86_64-unknown-linux-gnu/release/libhydro_plugin.so 64 2 "${models[@]}"
}

memcheck() {
  host_of host-plain || return 1
  valgrind --leak-check=full --show-leak-kinds=definite --errors-for-leak-kinds=definite --error-exitcode=99 \
    "$out/host-plain" target/release/libhydro_plugin.so 2 2 "${models[@]}"
}

miri() {
  MIRIFLAGS=-Zmiri-disable-isolation cargo +nightly miri test -p hydro-frames -p hydro-files &&
    MIRIFLAGS=-Zmiri-disable-isolation cargo +nightly miri test -p hydro-effects own:: sea::
}

for name in ${*:-asan tsan valgrind miri}; do
  case $name in
  asan | tsan) "$name" >"$out/$name.log" 2>&1 ;;
  valgrind) memcheck >"$out/$name.log" 2>&1 ;;
  miri)
    if ! cargo +nightly miri --version >/dev/null 2>&1; then
      printf '\n== miri: skipped, not installed: rustup +nightly component add miri rust-src\n'
      continue
    fi
    miri >"$out/$name.log" 2>&1
    ;;
  *)
    echo "sanitize.sh: unknown argument $name; there are asan, tsan, valgrind, miri" >&2
    exit 2
    ;;
  esac
  judge "$name" $?
done
exit "$failed"
