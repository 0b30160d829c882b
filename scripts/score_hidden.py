#!/usr/bin/env python3
"""Scores verdicts on hidden-effect cases against the sealed answers."""

import sys

from hydro_tools.commands.score_hidden import main

if __name__ == "__main__":
    sys.exit(main())
