#!/usr/bin/env python3
"""Prints how far a scene strays from recorded rollouts in closed loop."""

import sys

from hydro_tools.commands.simulate import main

if __name__ == "__main__":
    sys.exit(main())
