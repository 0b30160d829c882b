"""Gaits of B1: a pattern generator with feedback, learnt in one water and swum in another.

generator.py   twelve joint targets from parameters, time, attitude and depth
waters.py      B1 in the learned water, fitted drag, the inertia box, the truth, strip theory; many at once
episode.py     robots that swim; what a way is worth
learning.py    CMA-ES, resumable
gait_file.py   `hydro-gait/1`
replay.py      a gait in another water
table.py       gaits beside each other
drag.json      drag of the trunk fitted to 160 trajectories of Task 2 (scripts/fit_drag.py --out)
"""
