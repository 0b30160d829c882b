"""Learning rates of `hydro compare`, searched by validation error.

search.py      the walk over rates, on any error function
trainings.py   the error of one rate: a training by `hydro compare`
table.py       errors by row and rate, in Markdown
"""


class TrainingError(Exception):
    """A training that failed, and not by diverging."""
