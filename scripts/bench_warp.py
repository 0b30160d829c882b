#!/usr/bin/env python3
"""Steps a second in MuJoCo Warp with hydro's water, against the plugin under mujoco.rollout."""

import sys

from hydro_tools.commands.bench_warp import main

if __name__ == "__main__":
    sys.exit(main())
