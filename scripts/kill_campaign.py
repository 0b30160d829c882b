#!/usr/bin/env python3
"""Kills long commands, fills their disk, starts them twice, and holds what they leave to an undisturbed run."""

import sys

from hydro_tools.commands.kill_campaign import main

if __name__ == "__main__":
    sys.exit(main())
