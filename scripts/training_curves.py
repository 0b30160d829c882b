#!/usr/bin/env python3
"""Validation curves of trainings: a table, a csv and a figure."""

import sys

from hydro_tools.commands.training_curves import main

if __name__ == "__main__":
    sys.exit(main())
