"""The Unitree B1 as one table of numbers, and the files written from it.

table.py        links, joints, inertias, with their sources
composition.py  links welded together
hull.py         ellipsoids that displace the water
looks.py        shapes for the eye and for contact
identified.py   identified.json: fluid coefficients that `real_to_sim.py` found
urdf.py         the URDF
mjcf.py         the MuJoCo scenes
gap_scenes.py   the scenes as nominal models of `hydro gap`
files.py        every file by its path
text.py         numbers and elements as text
"""
