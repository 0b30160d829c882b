#!/usr/bin/env python3
"""Measures Task 2 on two Ray nodes of this machine against two worker processes."""

import sys

from hydro_tools.commands.ray_two_nodes import main

if __name__ == "__main__":
    sys.exit(main())
