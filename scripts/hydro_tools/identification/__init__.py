"""MuJoCo's ellipsoid fluid fitted to towing data by `mujoco.sysid`.

measurements.py     conditions.csv of a towing tank, checked
water.py            the force of MuJoCo's water on B1 in a steady tow, computed by MuJoCo
coefficients.py     the 25 fluid coefficients, their defaults and bounds, as parameters of the toolbox
uncertainty.py      how far a measured mean may lie from the model: its error, and that of the model's form
toolbox.py          one least-squares fit by `mujoco.sysid`, and its intervals
fit.py              levels, then all coefficients under a prior; what comes out
identifiability.py  which coefficients the data see, and which only together
blocks.py           a bootstrap over leg configurations
split.py            held-out conditions; leaving out one leg configuration
scores.py           errors of a prediction, with their spread
study.py            the whole run: fit, held-out, left-out configurations, other priors
result.py           what it found, as the JSON of the report and as `identified.json`
page.py             the report for people
figures.py          its pictures

Frames: that of `trunk`, x forward, y left; upright, so its axes are the world's. A force is that of the water
on the robot. SI units.
"""
