"""Tests of what optional packages read or write are left out where these are not installed."""

from importlib.util import find_spec

LOGS = ("hypothesis", "mcap_ros2", "pandas", "pyarrow", "pymap3d", "pymavlink", "pyulog", "rosbags")
NEEDS = {"test_trials_*": LOGS, "test_boundary_elements.py": ("xarray",), "test_gps.py": ("pymap3d",)}
collect_ignore_glob = [tests for tests, names in NEEDS.items() if any(find_spec(name) is None for name in names)]
