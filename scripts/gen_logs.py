#!/usr/bin/env python3
"""Makes logs of simple marine experiments by SciPy's integrators, for `hydro gap` without any of MuJoCo's mechanics."""

import sys

from hydro_tools.commands.gen_logs import main

if __name__ == "__main__":
    sys.exit(main())
