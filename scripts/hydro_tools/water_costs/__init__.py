"""Costs of water without a network: scenes with and without the plugin, stepped in turn.

meshes.py   spheres as meshes
scene.py    a free body with a link, a thruster and a wall, in any water or in none
rows.py     the rows of the table: every effect of the catalogue, hulls, matrices, currents, waves
timing.py   microseconds a step, block by block in turn
batch.py    64 boats at once
"""
