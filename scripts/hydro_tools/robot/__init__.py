"""The Unitree B1 as one table of numbers, and the files written from it."""
