"""Real measurements as trials of `hydro gap`, and an independent fit of them.

roll_decay.py, ball_drops.py, crazyflie.py  the csv files: rows, first state or hops
captive.py, glider.py  likewise: a table of steady states, logs with a prescribed joint
trial.py       a trial file
case.py        a case folder: nominal.xml and trials
gap.py         `hydro gap run` on it
reference.py   fits by SciPy alone
scipy_fits.py  those fits, case by case, printed
"""


class MeasuredError(Exception):
    """The measurements, or a request about them, cannot be used as they are."""
