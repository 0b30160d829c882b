#!/usr/bin/env bash
# Builds and checks all that a release is made of, and uploads nothing: `scripts/release.sh [FOLDER]` (default: out/release).
# FOLDER gets the wheel, the sdist, site.tar.gz (the documentation), sbom.json (CycloneDX: what pip installs with the wheel), crates.txt
# (every crate in the wheel, with its licence) and SHA256SUMS.
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-out/release}
mkdir -p "$out"
out=$(cd "$out" && pwd)
python=${PYTHON:-$PWD/.venv/bin/python}
die() {
  echo "release.sh: $*" >&2
  exit 1
}

[ -z "$(git status --porcelain)" ] || die 'commit first: a release is of one commit'
[ -z "$(ls -A "$out")" ] || die "$out is not empty"
version=$("$python" -c 'import hydro_mujoco; print(hydro_mujoco.__version__)')
"$python" -m pytest --quiet scripts/tests/test_versions.py || die 'versions differ'

scripts/test_wheel.sh --out "$out"

tools=$(mktemp -d)
trap 'rm -rf "$tools"' EXIT
"$python" -m venv "$tools/installed"
"$tools/installed/bin/pip" install --quiet --disable-pip-version-check "$out"/*.whl

# The notebooks run on what the wheel holds; target/ may be empty.
installed=$(echo "$tools"/installed/lib/python3*/site-packages/hydro_mujoco)
PYTHON=$python scripts/setup_venv.sh docs
HYDRO_PLUGIN=$installed/libhydro_plugin.so HYDRO_PROGRAM=$installed/bin/hydro \
  .venv-docs/bin/python scripts/build_docs.py --out out/site --external
tar --create --gzip --sort=name --owner=0 --group=0 --mtime="@$(git log -1 --format=%ct)" --file "$out/site.tar.gz" --directory out site

"$python" -m venv "$tools/venv"
"$tools/venv/bin/pip" install --quiet --disable-pip-version-check twine cyclonedx-bom
"$tools/venv/bin/twine" check --strict "$out"/*.whl "$out"/hydro_mujoco-*.tar.gz
"$tools/venv/bin/cyclonedx-py" environment "$tools/installed/bin/python" --output-format JSON --output-file "$out/sbom.json"
sed -i "s|file://$out/||" "$out/sbom.json" # where this machine keeps the wheel
cargo tree --locked --package hydro --edges normal --prefix none --format '{p} {l}' | sed 's/ ([^)]*)//g' | sort -u >"$out/crates.txt"
(cd "$out" && sha256sum -- *.whl *.tar.gz sbom.json crates.txt | tee SHA256SUMS)
echo "hydro $version, commit $(git rev-parse --short HEAD), in $out; next: docs/releasing.md"
