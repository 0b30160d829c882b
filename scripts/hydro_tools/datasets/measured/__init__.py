"""Real measurements as trials of `hydro gap`, and an independent fit of what they hold."""


class MeasuredError(Exception):
    """The measurements, or a request about them, cannot be used as they are."""
