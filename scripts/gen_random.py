#!/usr/bin/env python3
"""Makes cases of `hydro gap` on random systems."""

import sys

from hydro_tools.commands.gen_random import main

if __name__ == "__main__":
    sys.exit(main())
