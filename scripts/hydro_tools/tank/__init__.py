"""A simulated towing tank for B1, in place of a measured one whose data are not public.

Nothing here is measured and nothing uses MuJoCo. Forces come from strip theory, one strip of a link at a time, so a
model fitted to these data meets a truth of another form than its own.

geometry.py      B1 in a posture, cut into strips
coefficients.py  drag and added-mass coefficients: literature, and what is judgement
drag.py          Morison drag of every strip in its own flow; added mass
wake.py          how much of the tow speed upstream links have given to the water at a strip
shedding.py      the unsteady lift of vortices
motion.py        prescribed motion: a tow from rest to rest, or conditions that switch
force.py         all of these along a motion: the force on the robot against time
conditions.py    the 192 conditions
cell.py          a load cell: zero, drift, noise, vibration, misalignment
recording.py     one run as the load cell records it: three tows in sequence
campaign.py      all runs as files: raw traces, their truth, the table of conditions
processing.py    raw traces -> hydrodynamic force, mean, spread and standard error of each condition
task1.py         trajectories of Tasks 1.1, 1.2 and 1.3
dataset.py       their data-set folders
figures.py       raw traces and force against speed, drawn

Base frame: that of `trunk`, x forward, y left, z up; the robot is upright and never turns. A force is
that of the water on the robot: a tow along +x meets a negative force.x. SI units throughout.
"""

#: Written into manifests beside the generator's name.
VERSION = "0.1.0"
