#!/usr/bin/env python3
"""A step of two builds of the plugin, in turn."""

import sys

from hydro_tools.commands.bench_step import main

if __name__ == "__main__":
    sys.exit(main())
