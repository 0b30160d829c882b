"""Implementations in Python (PyTorch, ONNX Runtime, MuJoCo's own steps).

Each module is a process: `python -m hydro_tools.benchmarks.implementations.<name>`.
"""
