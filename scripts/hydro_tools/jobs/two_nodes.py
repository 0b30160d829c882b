"""A Ray cluster of two nodes on this machine, one core each: to see and test what a cluster does.

Each node has its own scheduler, object store and workers; only the machine under them is one. `ray start` and
`ray stop` are not used: the latter would end whatever Ray runs on this machine.
"""

import os


class TwoNodes:
    """`with TwoNodes() as nodes`: its address, and a second node that can be killed."""

    def __init__(self):
        # Ray's way to stay on the loopback address, whatever its name says.
        os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"
        os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
        from ray.cluster_utils import Cluster

        node = {"num_cpus": 1, "node_ip_address": "127.0.0.1"}
        self._cluster = Cluster(initialize_head=True, head_node_args=node | {"include_dashboard": False})
        self._second = self._cluster.add_node(**node)
        self.address: str = self._cluster.address

    def __enter__(self) -> "TwoNodes":
        return self

    def __exit__(self, *_) -> None:
        self._cluster.shutdown()

    def kill_second(self) -> None:
        """SIGKILL to the second node: no goodbye, its workers and results are gone."""
        self._cluster.remove_node(self._second, allow_graceful=False)
