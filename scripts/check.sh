#!/usr/bin/env bash
# What CI asks of the code, in one go: format, lints, documentation, tests with and without MuJoCo.
set -euo pipefail
cd "$(dirname "$0")/.."
export RUSTFLAGS="${RUSTFLAGS:-}"

step() { printf '\n== %s\n' "$*"; }

step 'format'
cargo fmt --check
step 'lints'
cargo clippy --all-targets --quiet -- -D warnings
step 'documentation'
RUSTDOCFLAGS='-D warnings' cargo doc --no-deps --document-private-items --quiet
step 'Python: format and lints'
.venv/bin/ruff format --quiet --check scripts
.venv/bin/ruff check --quiet scripts
step 'robot and scenes are what make_b1.py writes'
.venv/bin/python scripts/make_b1.py --check
.venv/bin/python scripts/make_gap_scenes.py --check
step 'tests with MuJoCo'
cargo build --quiet
cargo test --quiet
step 'tests without MuJoCo'
# Its own folder: a build without the feature leaves a library without entry points.
scripts/lend_build.sh target/pure
# What knows no MuJoCo and takes minutes has run above.
cargo test --quiet --no-default-features --features cli --lib --bins --target-dir target/pure -- --skip gap::tests --skip model:: --skip training:: --skip effects::
step 'training on a graphics card'
scripts/test_cuda.sh
