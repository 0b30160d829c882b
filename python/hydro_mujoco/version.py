"""The version."""

#: The wheel's, and Cargo.toml's, which the build compares; written into manifests.
__version__ = "0.2.0"
