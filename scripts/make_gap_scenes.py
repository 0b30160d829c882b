#!/usr/bin/env python3
"""Writes mjcf/gap/b1_tow.xml and mjcf/gap/b1_swim.xml, or checks them."""

import sys

from hydro_tools.commands.make_gap_scenes import main

if __name__ == "__main__":
    sys.exit(main())
