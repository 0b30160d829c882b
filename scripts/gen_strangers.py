#!/usr/bin/env python3
"""Makes cases of `hydro gap` on others' robots from the wheels of three packages."""

import sys

from hydro_tools.commands.gen_strangers import main

if __name__ == "__main__":
    sys.exit(main())
