#!/usr/bin/env python3
"""Writes B1's URDF and MuJoCo scenes from one table, or checks them."""

import sys

from hydro_tools.commands.make_b1 import main

if __name__ == "__main__":
    sys.exit(main())
