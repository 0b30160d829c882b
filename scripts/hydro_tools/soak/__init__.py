"""Long runs of everything that acts: every released checkpoint, every effect alone and in pairs.

catalogue     effects with typical values, from the program's own list
scenes        the models: a vehicle with contacts and a stone that falls asleep; a checkpoint's robot
motion        how a run starts, is driven and is reset
energy        what water that only takes may leave
case          one run, and what is broken about it
campaign      all cases in an order, memory, the table
threads       models created, stepped and freed by many threads at once
"""


class SoakError(Exception):
    """A soak that cannot go on: a program that is missing, a model that does not compile."""
