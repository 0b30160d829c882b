"""Other methods on the cases of `hydro gap`: sparse regression, system identification, residual network.

See README.md here.
"""


class BaselineError(Exception):
    """A case, or a request about it, cannot be used as it is."""
