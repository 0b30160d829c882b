#!/usr/bin/env bash
# Format, rules of the house, lints, documentation, tests.
#   scripts/check.sh              the whole workspace
#   scripts/check.sh fast [REV]   only the crates that differ from REV (default HEAD: what is not committed)
set -euo pipefail
cd "$(dirname "$0")/.."
source scripts/tests_of.sh

step() { printf '\n== %s  (%d s)\n' "$*" $SECONDS; }
python=.venv/bin/python
[ -x "$python" ] || {
  echo 'check.sh: no .venv; run scripts/setup.sh first' >&2
  exit 1
}

if [ "${1:-}" = fast ]; then
  rev=${2:-HEAD}
  changed=$({ git diff --name-only "$rev"; git ls-files --others --exclude-standard; } | sort -u)
  packages=()
  for crate in files frames effects gap model training; do
    grep -q "^crates/$crate/" <<<"$changed" && packages+=(-p "hydro-$crate")
  done
  grep -qE '^(src|tests|benches|fuzz|mjcf|models|build\.rs)' <<<"$changed" && packages+=(-p hydro)
  grep -qE '^Cargo\.(toml|lock)' <<<"$changed" && packages=(--workspace)
  step 'format, rules of the house'
  cargo fmt --all --check
  "$python" scripts/check_house.py
  if [ ${#packages[@]} -eq 0 ]; then
    printf '\nNo crate differs from %s.\n' "$rev"
  else
    step "lints: ${packages[*]}"
    cargo clippy "${packages[@]}" --all-targets --quiet -- -D warnings
    step "tests: ${packages[*]}"
    tests_of "${packages[@]}"
    step 'the other crates compile'
    cargo check --workspace --quiet
  fi
  if grep -qE '^(python|scripts)/.*\.py' <<<"$changed"; then
    step 'Python'
    "$python" -m ruff check --quiet scripts python
    "$python" -m ruff format --quiet --check scripts python
    "$python" -m mypy --no-error-summary
    "$python" -m pytest --quiet --numprocesses auto --dist loadfile python
    "$python" -m pytest --quiet --numprocesses auto --dist loadfile scripts/tests
  fi
  printf '\nDone in %d s. scripts/test.sh checks the rest.\n' $SECONDS
  exit
fi

step 'format, rules of the house'
cargo fmt --all --check
"$python" scripts/check_house.py
"$python" -m ruff check --quiet scripts python
"$python" -m ruff format --quiet --check scripts python
"$python" -m mypy --no-error-summary
step 'robot and scenes are what make_b1.py writes'
"$python" scripts/make_b1.py --check
"$python" scripts/make_gap_scenes.py --check
step 'lints'
cargo clippy --workspace --all-targets --quiet -- -D warnings
step 'lints without MuJoCo'
# Of the workspace, with a target that has the dependencies of tests: crates below are then the same as above, compiled once.
cargo clippy --workspace --no-default-features --features hydro/cli --lib --bins --test numerics --quiet -- -D warnings
if cargo deny --version >/dev/null 2>&1; then
  step "others' crates"
  checks=(licenses bans sources)
  if cargo deny fetch db >/dev/null 2>&1; then
    checks+=(advisories)
  else
    echo 'check.sh: the advisory database cannot be fetched: no crate is looked up there'
  fi
  cargo deny --log-level warn check "${checks[@]}"
else
  echo "check.sh: no cargo-deny: licences and advisories of others' crates are not checked (cargo install --locked cargo-deny)"
fi
step 'documentation'
RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps --document-private-items --quiet
step 'tests'
cargo build --quiet
tests_of --workspace
step 'examples in the documentation'
cargo test --workspace --doc --quiet
step 'training on a graphics card'
scripts/test_cuda.sh
