"""Water of strips that remembers: the truth of Task 2 with added mass and wakes, by no code of the plugin.

strips.py      the links of a robot, cut into strips that ride on MuJoCo's bodies; those of B1
wake.py        the water that a strip has set in motion: the memory
added_mass.py  Kirchhoff's equations of the bodies' added mass
buoyancy.py    ellipsoids, deep or cut by the surface
kinematics.py  velocities and Jacobians of the bodies of many simulations at once
forces.py      what the water does to the robot at one state
simulation.py  many plans through this water, the added mass in MuJoCo's own mass matrix
"""
