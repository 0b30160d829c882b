#!/usr/bin/env bash
# Pins the Python packages of every environment with their hashes: scripts/locks/NAME.in to NAME.txt, for every platform and
# Python from 3.11 on. Versions that are pinned already stay; `--upgrade` takes the newest ones. Needs uv: pip install uv
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
command -v uv >/dev/null || {
  echo 'lock.sh: no uv; pip install uv' >&2
  exit 2
}
for names in scripts/locks/*.in; do
  uv pip compile "$names" --output-file "${names%.in}.txt" --quiet --universal --generate-hashes --python-version 3.11 \
    --no-annotate --custom-compile-command scripts/lock.sh --no-emit-package hydro-mujoco --no-emit-package hydro-tools "$@"
done
