"""The parts of the benchmarks, one a file.

Each has `measure(settings)`: outcomes by group; `render(groups)`: its section of the page; `targets(groups)`: the
figures that have a limit.
"""

from . import batch, evaluate, memory, scaling, step, train

PARTS = {"evaluate": evaluate, "step": step, "train": train, "batch": batch, "memory": memory, "scaling": scaling}
