#!/usr/bin/env python3
"""Times `hydro` beside other implementations and writes benches/RESULTS.md; scripts/bench.sh prepares it."""

import sys

from hydro_tools.commands.bench import main

if __name__ == "__main__":
    sys.exit(main())
