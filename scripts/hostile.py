#!/usr/bin/env python3
"""Gives hostile and odd inputs to `hydro` and to the plugin, and counts what is refused, accepted and broken."""

import sys

from hydro_tools.commands.hostile import main

if __name__ == "__main__":
    sys.exit(main())
