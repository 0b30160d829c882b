#!/usr/bin/env python3
"""Linear and quadratic drag fitted to a data set, as a yardstick for a learned model."""

import sys

from hydro_tools.commands.fit_drag import main

if __name__ == "__main__":
    sys.exit(main())
