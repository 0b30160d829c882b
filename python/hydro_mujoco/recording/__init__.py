"""What every recorder has, whatever its robot and its water.

plan.py        what happens in one trajectory, and what is drawn at random for it
system.py      a compiled model: what moves, what is a feature, where the water's wrench is read
features.py    state -> the inputs of a force model; names, units, frames
simulation.py  many plans -> states, features and labels, in a mujoco.batch
shards.py      the bytes of one shard: the work that a worker does
dataset.py     a data set: its shards by any executor, resume, manifest
folder.py      a data-set folder: shards, resume, manifest
kinematics.py  the links as a tree, for models that are given their motion
proof.py       refuses a machine that computes other bits than this one
lock.py        a folder that one process works in
files.py       whole files or none, fingerprints
randomness.py  random numbers of a seed and a key
arguments.py   command-line values of the recorders
progress.py    a bar on a terminal, lines in a log
"""
