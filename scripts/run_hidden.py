#!/usr/bin/env python3
"""Runs `hydro gap` on every hidden-effect case that has no verdict."""

import sys

from hydro_tools.commands.run_hidden import main

if __name__ == "__main__":
    sys.exit(main())
