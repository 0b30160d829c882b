"""Jobs (`hydro_mujoco.jobs`) on other machines, and jobs that are programs.

cluster.py     on the nodes of a Ray cluster
program.py     jobs that are command lines, their files packed
two_nodes.py   a Ray cluster on this machine, to try it
"""
