"""Errors and warnings of the package."""


class DataError(Exception):
    """A fault with a message for the user; commands print it and exit with 1."""


class Notice(UserWarning):
    """Something that a recording leaves out or assumes; commands print it."""
