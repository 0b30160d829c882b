#!/usr/bin/env python3
"""Searches the learning rate of each row of `hydro compare` by validation error."""

import sys

from hydro_tools.commands.learning_rates import main

if __name__ == "__main__":
    sys.exit(main())
