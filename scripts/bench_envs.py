#!/usr/bin/env python3
"""Steps a second of the Gymnasium environments, one and many at once."""

import sys

from hydro_tools.commands.bench_envs import main

if __name__ == "__main__":
    sys.exit(main())
