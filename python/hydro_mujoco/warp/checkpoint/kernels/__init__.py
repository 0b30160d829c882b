"""Warp kernels of checkpoints.

clock.py     when a sample is due in each world, and its features
encode.py    from features to what a network reads
dense.py     products, four worlds at a time
relaxing.py  the Relaxation-ODE
act.py       the force between samples, and where it acts
"""
