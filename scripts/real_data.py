#!/usr/bin/env python3
"""Makes trials of `hydro gap` from real measurements, runs and checks them."""

import sys

from hydro_tools.commands.real_data import main

if __name__ == "__main__":
    sys.exit(main())
