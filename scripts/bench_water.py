#!/usr/bin/env python3
"""Costs of water without a network: each effect, each form of hull, waves, many boats at once."""

import sys

from hydro_tools.commands.bench_water import main

if __name__ == "__main__":
    sys.exit(main())
