#!/usr/bin/env python3
"""Runs the jobs of `hydro compare` on a Ray cluster and prints the tables here."""

import sys

from hydro_tools.commands.compare_ray import main

if __name__ == "__main__":
    sys.exit(main())
