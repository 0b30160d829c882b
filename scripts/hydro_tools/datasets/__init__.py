"""Simulated swimming of B1: data sets, recorded rollouts, and how they are replayed.

scene.py       a truth scene, its joints and its density
features.py    state -> the 35 inputs of a force model
kinematics.py  the links as a tree, for models that are given their motion
regime.py      the ranges it is drawn from: the usual ones, and others outside them
gait.py        joint targets
plan.py        everything that is drawn at random for one trajectory
simulation.py  many plans -> states, features and labels, in a mujoco.batch
task2.py       one shard of the Task 2 data set
proof.py       refuses a machine that computes other bits than this one
dataset.py     the Task 2 data set: its shards by any executor
folder.py      a data-set folder: shards, resume, manifest
rollouts.py    a folder of recorded rollouts
files.py       whole files or none, fingerprints
randomness.py  random numbers of a seed and a key
arguments.py   command-line values of the generators
replay.py      a recorded rollout, driven again in another water
closed_loop.py position and attitude error of such a replay
trial_replay.py  trials of `hydro gap`, replayed under a nominal and a patched model
measured/      real measurements as trials of `hydro gap`
progress.py    a bar on a terminal, lines in a log
"""

#: Written into manifests beside the generator's name.
VERSION = "0.1.0"


class DataError(Exception):
    """A fault with a message for the user; the scripts print it and exit with 1."""
