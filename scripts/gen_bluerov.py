#!/usr/bin/env python3
"""Makes cases of `hydro gap` on a BlueROV2 whose truth is Fossen's equations, without MuJoCo."""

import sys

from hydro_tools.commands.gen_bluerov import main

if __name__ == "__main__":
    sys.exit(main())
