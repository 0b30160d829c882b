"""The rivals written in Python, and MuJoCo's own steps; each module is a process: `python -m bench.contenders.<name>`."""
