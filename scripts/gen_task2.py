#!/usr/bin/env python3
"""Makes the Task 2 data set: B1 swims freely while gait, pushes and density switch."""

import sys

from hydro_tools.commands.gen_task2 import main

if __name__ == "__main__":
    sys.exit(main())
