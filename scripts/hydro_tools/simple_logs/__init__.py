"""Logs of simple marine experiments: equations of motion by SciPy, nominals without any water.

surge      a torpedo's surge: thruster lag, drags, added mass
boat       a model ship in the plane, with or without a current: Fossen's equations of three degrees of freedom
heave      an underwater vehicle's heave, depth alone measured: buoyancy, drags, added mass
tank       forced sway in a tank, the force measured (a planar motion mechanism): drags, added mass
pendulum   a ball on a rod under water, its angle measured: buoyancy, drag of the ball, friction of the pin

The first three begin at rest under commands that are there from the first row on. Rows are labelled as `docs/gap.md`
has it: a row at t holds the commands of t, and the readings of t less one step of the nominal.
"""
