#!/usr/bin/env bash
# Training on a graphics card against training on the processor: `scripts/test_cuda.sh`.
# Needs the CUDA toolkit (nvcc) and a card; without them it says so and passes.
set -euo pipefail
cd "$(dirname "$0")/.."
if ! nvidia-smi > /dev/null 2>&1; then
  echo 'no graphics card: training on one is not tested here'
  exit 0
fi
if ! command -v nvcc > /dev/null; then
  echo 'a graphics card, but no nvcc to build for it: training on one is not tested here'
  exit 0
fi
# A build for another set of features would leave a library without entry points: a folder of its own.
HYDRO_REQUIRE_CUDA=1 cargo test --quiet --no-default-features --features cuda --target-dir target/cuda --test numerics cuda::
