"""Jobs on the nodes of a Ray cluster (https://docs.ray.io), which need none of our files.

`hydro_tools` and `hydro_mujoco` travel with the jobs (`py_modules`); Python and what it imports must be there. Results
come back through Ray's object store. Jobs of a lost node are done again on another one; nodes that join are used.
"""

import os
import socket
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from urllib.parse import urlsplit

import hydro_mujoco
import hydro_tools
from hydro_mujoco.jobs import JobError
from hydro_mujoco.jobs.executor import Executor, Work

#: Jobs under way for each core: one that it does, one that it finds when it is done.
AHEAD = 2
#: How often a job is done again whose node or worker was lost. What kills its worker each time is a fault.
RETRIES = 3
#: Seconds without a result after which a cluster without cores is reported.
PATIENCE = 30.0

# Read by Ray when it is imported. Nobody asked for a report of its use to its makers.
os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")


class Cluster(Executor):
    """The cluster at `address`: `auto`, `host:6379`, `ray://host:10001`, or `local` for one on this machine.

    packages: modules that jobs need on the nodes beside these.
    done_by: jobs done so far, by node.
    """

    other_machines = True

    def __init__(self, address: str, packages: Sequence[ModuleType] = ()):
        try:
            import ray
        except ImportError as error:
            raise JobError("Ray is not installed here: scripts/setup_venv.sh ray") from error
        if ray.is_initialized():
            raise JobError("this process is connected to a Ray cluster already: call ray.shutdown() first")
        sources = [str(Path(package.__file__).parent) for package in (hydro_tools, hydro_mujoco, *packages)]
        _refuse_silence(address)
        options = {"include_dashboard": False} if address == "local" else {}
        try:
            ray.init(
                address=address,
                log_to_driver=False,
                logging_level="ERROR",
                **options,
                runtime_env={"py_modules": sources, "excludes": ["__pycache__"]},
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise JobError(f"no Ray cluster to be had at `{address}`: {error}") from error
        self._ray, self.address, self.done_by = ray, address, Counter()

    @property
    def description(self):
        return ", ".join(f"node {node}: {jobs} jobs" for node, jobs in sorted(self.done_by.items()))

    def start(self, work):
        self._do = self._ray.remote(num_cpus=1, max_retries=RETRIES)(_do)
        self._work = self._ray.put(work)

    def window(self):
        # Asked each time: nodes come and go.
        return AHEAD * max(1, int(self._ray.cluster_resources().get("CPU", 0)))

    def submit(self, name, job):
        return self._do.options(name=name).remote(self._work, job)

    def first(self, running):
        while True:
            done, _ = self._ray.wait(list(running), num_returns=1, timeout=PATIENCE)
            if done:
                return done[0]
            if not self._ray.cluster_resources().get("CPU", 0):
                print(f"no node of the cluster at {self.address} has a core; waiting for one", file=sys.stderr)

    def result(self, handle):
        from ray.exceptions import RayError, RayTaskError

        try:
            node, result = self._ray.get(handle)
        except RayTaskError as error:
            # What the work raised, without Ray's account of where.
            raise (error.cause or error) from None
        except RayError as error:
            raise JobError(f"{type(error).__name__} (a lost job is tried {RETRIES} times more): {error}") from error
        self.done_by[node] += 1
        return result

    def stop(self, running):
        for handle in running:
            self._ray.cancel(handle, force=True)
        self._work = None

    def close(self):
        self._ray.shutdown()


def _refuse_silence(address: str) -> None:
    """Refuse host and port where nothing listens: Ray itself would try for minutes."""
    meant = _latest() if address == "auto" else address
    try:
        parts = urlsplit(meant if "://" in meant else f"//{meant}")
        if parts.port:
            socket.create_connection((parts.hostname, parts.port), timeout=10).close()
    except (OSError, ValueError) as error:
        raise JobError(
            f"no Ray cluster at `{address}` ({meant}): {error}; start one with `ray start --head`, or let `local` do it"
        ) from error


def _latest() -> str:
    """The address that `ray.init` takes for `auto`: RAY_ADDRESS, else the cluster last started here, or ""."""
    note = Path(os.environ.get("RAY_TMPDIR", "/tmp"), "ray", "ray_current_cluster")
    return os.environ.get("RAY_ADDRESS") or (note.read_text(encoding="utf-8").strip() if note.is_file() else "")


def _do(work: Work, job) -> tuple[str, bytes]:
    """Runs on a node; returns which, and the result."""
    import ray

    return f"{ray.util.get_node_ip_address()} {ray.get_runtime_context().get_node_id()[:8]}", work(job)
