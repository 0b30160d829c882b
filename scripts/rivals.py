#!/usr/bin/env python3
"""Runs other methods (the baselines) on the cases of `hydro gap`."""

import sys

from hydro_tools.commands.rivals import main

if __name__ == "__main__":
    sys.exit(main())
