"""Film of the swimming robot.

choreography.py   the built-in run: a trot that becomes a paddle
stage.py          what is drawn beside the robot: force arrows and drifting specks
frames.py         a run rendered frame by frame
webp.py           animated WebP
"""
