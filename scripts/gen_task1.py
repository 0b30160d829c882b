#!/usr/bin/env python3
"""Makes the towing tank's raw traces and the Task 1 data sets 1.1, 1.2 and 1.3."""

import sys

from hydro_tools.commands.gen_task1 import main

if __name__ == "__main__":
    sys.exit(main())
