"""What is measured, a file each: `measure(settings)` gives groups of outcomes, `render(groups)` the section of the page,
`targets(groups)` the figures that have a limit.
"""

from . import batch, evaluate, memory, scaling, step, train

PARTS = {"evaluate": evaluate, "step": step, "train": train, "batch": batch, "memory": memory, "scaling": scaling}
