"""Cases of `hydro gap` on others' robots: nominals from the wheels of dm-control, gymnasium-robotics and robosuite.

wheels.py   MJCF out of wheels
mend.py     what has to be changed so that an MJCF is the nominal of a case
robots.py   the robots: file, sensors, how they are driven, which effects make sense
cases.py    the list of cases
"""
