"""Rival methods on the cases of `hydro gap`: sparse regression, system identification, residual network."""


class RivalError(Exception):
    """A case, or a request about it, cannot be used as it is."""
