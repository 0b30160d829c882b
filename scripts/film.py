#!/usr/bin/env python3
"""Films the swimming robot with its force arrows."""

import sys

from hydro_tools.commands.film import main

if __name__ == "__main__":
    sys.exit(main())
