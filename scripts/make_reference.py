#!/usr/bin/env python3
"""Writes the reference pages of effects and attributes from the program's own lists."""

import sys

from hydro_tools.commands.make_reference import main

if __name__ == "__main__":
    sys.exit(main())
