#!/usr/bin/env python3
"""Records truth rollouts of B1 for tests and for the closed loop."""

import sys

from hydro_tools.commands.record_rollouts import main

if __name__ == "__main__":
    sys.exit(main())
