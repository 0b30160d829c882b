"""Settings of each method, as tuned on cases of its own (see README.md)."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Settings:
    """smooth_s: width of the local parabolas [s]; test_s: length of a test function [s]; folds: of the
    cross-fit (0: none); options: of the method itself.
    """

    smooth_s: float = 0.2
    test_s: float = 1.0
    folds: int = 4
    options: dict = field(default_factory=dict)


METHODS = {
    "stlsq": Settings(test_s=0.5, options={"threshold": 0.2, "alpha": 1.0, "least_share": 0.5}),
    "ensemble": Settings(test_s=0.5, options={"threshold": 0.3, "alpha": 0.1, "inclusion": 0.9, "least_share": 0.5}),
    "bindy": Settings(test_s=1.0, options={"prior": 1.0, "correlation": 10.0, "least_share": 0.8}),
    "sysid": Settings(folds=0, options={"segments": 24, "iterations": 6}),
    "sysid_bic": Settings(folds=0, options={"segments": 12, "iterations": 4, "most": 2}),
    "network": Settings(folds=0, options={"hidden": (16,), "alpha": 1.0, "smooth_s": 0.2}),
}
SPARSE = ("stlsq", "ensemble", "bindy")
#: Those that name effects.
NAMING = (*SPARSE, "sysid_bic")
