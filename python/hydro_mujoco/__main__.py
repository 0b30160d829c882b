"""`python -m hydro_mujoco`: which MuJoCo, which package, where the plugin came from, whether it acts."""

import sys

from .doctor import main

sys.exit(main())
