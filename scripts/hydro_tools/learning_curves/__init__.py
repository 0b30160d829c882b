"""Validation curves of `hydro train`.

curve.py    the log of a training, read and checked
files.py    curves as csv and as a figure
"""
