"""Warp kernels of checkpoints.

clock.py       when a sample is due in each world, and its features
encode.py      from features to what a network reads
dense.py       products, four worlds at a time
relaxing.py    the Relaxation-ODE
stepping.py    steps of a force that follows a differential equation
attending.py   attention of the newest sample over a window
recurrent.py   cells of an LSTM
controlled.py  the CNODE's step
act.py         the force between samples, and where it acts
"""
