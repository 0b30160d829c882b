#!/usr/bin/env bash
# lend_build.sh TARGET_DIR: starts a second build folder from what target/debug holds, so that dependencies and the crates
# below the root, which take minutes, are compiled once. Does nothing where the folder has a build already.
set -euo pipefail
cd "$(dirname "$0")/.."
to=${1:?usage: lend_build.sh TARGET_DIR}/debug
if [ -d "$to" ] || [ ! -d target/debug/deps ]; then exit 0; fi
beside=$to.$$
trap 'rm -rf "$beside"' EXIT
mkdir -p "$beside"
# With their times: by these cargo knows what is fresh. The root crate is built anew, its features differ.
cp -a target/debug/deps target/debug/build target/debug/.fingerprint "$beside"
mv "$beside" "$to"
