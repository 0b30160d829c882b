"""Cases of `hydro gap` on a BlueROV2 whose truth is Fossen's equations in NumPy, without MuJoCo.

numbers.py      the vehicle in public numbers, and where they are from
fossen.py       equations of motion of M vehicles, stepped by RK4; readings
parts.py        what of the water a nominal can lack; the truth's own forms of it; uncertain numbers
nominal.py      the MJCF that a tool gets, dry or with any of the parts
manoeuvres.py   how the vehicle is driven: wrenches, depth hold
strength.py     how strongly a part shows in the readings
case.py         the list of cases; one case, made and written
"""
