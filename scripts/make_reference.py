#!/usr/bin/env python3
"""Writes the reference pages: effects, attributes, environments."""

import sys

from hydro_tools.commands.make_reference import main

if __name__ == "__main__":
    sys.exit(main())
