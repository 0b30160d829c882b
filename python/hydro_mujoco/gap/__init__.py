"""What a simulation lacks: `hydro gap` from Python.

workflow.py   `run(nominal, trials, out=...)`: the program, from trials to a case
case.py       `Case`: verdict, named effects, patched model, report
catalogue.py  `effects()`: the catalogue of effects that can be named
trials.py     trials in memory -> a folder of files that the program reads
"""

from .case import Case, Gap, NamedEffect, Value
from .catalogue import Effect, Parameter, effects
from .trials import Trial
from .workflow import run

__all__ = ["Case", "Effect", "Gap", "NamedEffect", "Parameter", "Trial", "Value", "effects", "run"]
