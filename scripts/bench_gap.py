#!/usr/bin/env python3
"""Time and memory of `hydro gap run` against the number of trials."""

import sys

from hydro_tools.commands.bench_gap import main

if __name__ == "__main__":
    sys.exit(main())
