#!/usr/bin/env python3
"""Makes the hidden-effect cases of `hydro gap` and their sealed answers."""

import sys

from hydro_tools.commands.gen_hidden import main

if __name__ == "__main__":
    sys.exit(main())
