"""The rivals written in Python, and MuJoCo's own steps; each module is a process: `python -m hydro_tools.benchmarks.implementations.<name>`."""
