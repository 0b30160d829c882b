#!/usr/bin/env python3
"""Runs every released checkpoint and every effect, alone and in pairs, for long; counts what breaks."""

import sys

from hydro_tools.commands.soak import main

if __name__ == "__main__":
    sys.exit(main())
