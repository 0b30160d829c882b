#!/usr/bin/env python3
"""Replays trials in plain MuJoCo under a nominal model and under the patched one."""

import sys

from hydro_tools.commands.replay import main

if __name__ == "__main__":
    sys.exit(main())
