"""Making of many cases, in worker processes where asked for."""

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed

from hydro_mujoco.recording.progress import Progress


def make_all(make: Callable, todo: Sequence, jobs: int, progress: Progress) -> list[str]:
    """Calls `make` with each of `todo` in `jobs` processes; returns what went wrong, which `make` returns, or None."""
    faults = []

    def count(fault: str | None) -> None:
        faults.extend([fault] if fault else [])
        progress.advance()

    if jobs <= 1 or len(todo) <= 1:
        for one in todo:
            count(make(one))
    else:
        with ProcessPoolExecutor(jobs) as pool:
            for done in as_completed([pool.submit(make, one) for one in todo]):
                count(done.result())
    return faults
