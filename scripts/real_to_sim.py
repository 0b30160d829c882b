#!/usr/bin/env python3
"""Fits MuJoCo's fluid coefficients of B1 to the towing data."""

import sys

from hydro_tools.commands.real_to_sim import main

if __name__ == "__main__":
    sys.exit(main())
