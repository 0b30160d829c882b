"""The version."""

#: Also in `pyproject.toml`; written into manifests.
__version__ = "0.1.0"
