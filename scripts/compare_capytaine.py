#!/usr/bin/env python3
"""Motions of a moored box in waves: the plugin beside Capytaine's linear potential flow (pip install capytaine)."""

import sys

from hydro_tools.commands.compare_capytaine import main

if __name__ == "__main__":
    sys.exit(main())
