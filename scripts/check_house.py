#!/usr/bin/env python3
"""Checks the rules of the house that no compiler checks."""

import sys

from hydro_tools.commands.check_house import main

if __name__ == "__main__":
    sys.exit(main())
