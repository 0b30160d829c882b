"""Hostile and odd inputs to the program and the plugin: made by kind from a seed, run under limits, judged."""


class HostileError(Exception):
    """A campaign that cannot be run."""
