"""Cases of `hydro gap` on random systems, for tuning: no method should be tuned on the systems that it is judged by.

build.py   a random nominal: bodies, joints, hulls, actuators, sensors, and how it is driven
cases.py   what is hidden in it, and how strongly
"""
