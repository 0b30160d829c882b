#!/usr/bin/env bash
# Installs what is missing on Debian 12: a C toolchain, libclang (bindgen), EGL (offscreen video), the
# project's .venv with MuJoCo. Sourced by the scripts beside it; safe to run again.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

missing=()
need() { # need FILE-OR-GLOB PACKAGE...
  compgen -G "$1" >/dev/null || missing+=("${@:2}")
}
need '/usr/bin/cc' build-essential
need '/usr/lib/llvm-*/lib/libclang.so*' libclang-dev # libclang-cpp.so is another library
need '/usr/lib/*/libEGL.so.1' libegl1 libgl1-mesa-dri
need "/usr/lib/*/dri/swrast_dri.so" libgl1-mesa-dri
need '/usr/lib/python3*/ensurepip' python3-venv
if [ "${HYDRO_WITH_DEBIAN_MUJOCO:-}" = 1 ]; then
  need '/usr/include/mujoco/mujoco.h' libmujoco-dev
  need '/usr/bin/mujoco-testspeed' libmujoco-samples
fi
if [ ${#missing[@]} -gt 0 ]; then
  echo "setup: installing Debian packages: ${missing[*]}"
  as_root=()
  if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || {
      echo "setup: not root and no sudo; install these by hand: ${missing[*]}" >&2
      exit 1
    }
    as_root=(sudo)
  fi
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi

command -v cargo >/dev/null || {
  echo "setup: no cargo; install Rust (rustup) first, then run this again" >&2
  exit 1
}

python=${PYTHON:-python3}
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
  echo "setup: $("$python" --version) found; Python 3.11 or newer is needed (set PYTHON=...)" >&2
  exit 1
}
PYTHON=$python scripts/setup_venv.sh main
