#!/usr/bin/env python3
"""Gaits of B1 learnt in a water, and swum again in another."""

import sys

from hydro_tools.commands.learn_gait import main

if __name__ == "__main__":
    sys.exit(main())
