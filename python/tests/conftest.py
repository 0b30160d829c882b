"""Tests of logs are left out where the packages that read and write them are not installed."""

from importlib.util import find_spec

PACKAGES = ("hypothesis", "mcap_ros2", "pandas", "pyarrow", "pymavlink", "pyulog", "rosbags")
collect_ignore_glob = ["test_trials_*"] if any(find_spec(name) is None for name in PACKAGES) else []
