#!/usr/bin/env python3
"""Results of scripts/strip_models.sh as a table."""

import sys

from hydro_tools.commands.strip_table import main

if __name__ == "__main__":
    sys.exit(main())
