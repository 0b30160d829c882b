"""`hydro` and other implementations timed in alternation: see README.md here and scripts/bench.sh."""

from ..repository import ROOT

#: Raw blocks, one file a part.
RESULTS = ROOT / "benches/results"
#: Weights, data and scenes that the implementations share; made anew where it is missing.
WORK = ROOT / "out/bench"
#: Where the plugin and the Rust implementation are built.
LIBRARY = ROOT / "target/release/libhydro_plugin.so"


class BenchmarkError(Exception):
    """An implementation failed, or computes something else than the others."""
