#!/usr/bin/env python3
"""Builds the documentation site, its notebooks executed, every link inside it checked."""

import sys

from hydro_tools.commands.build_docs import main

if __name__ == "__main__":
    sys.exit(main())
