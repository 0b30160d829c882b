"""Simulated swimming of B1: data sets, recorded rollouts, and how they are replayed.

What is not B1's own, from the plan of a trajectory to the manifest, is `hydro_mujoco.recording`.

scene.py       a truth scene, its joints and its density
regime.py      the ranges it is drawn from: the usual ones, and others outside them
gait.py        joint targets
plan.py        everything that is drawn at random for one trajectory
waters.py      the waters of the Task 2 data set
task2.py       trajectories of the Task 2 data set
dataset.py     the Task 2 data set
rollouts.py    a folder of recorded rollouts
replay.py      a recorded rollout, driven again in another water
closed_loop.py position and attitude error of such a replay
trial_replay.py  trials of `hydro gap`, replayed under a nominal and a patched model
measured/      real measurements as trials of `hydro gap`
"""

from hydro_mujoco import DataError

__all__ = ["VERSION", "DataError"]

#: Written into manifests beside the generator's name.
VERSION = "0.1.0"
