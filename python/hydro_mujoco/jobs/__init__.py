"""Independent jobs spread over processes or machines; who asks receives their results one by one.

executor.py    what every executor does: a stream of results with a bounded number of jobs under way
here.py        in this process, one after the other
processes.py   in worker processes of this machine

A job is any value that can be pickled. The work is a callable that can be pickled too: job -> bytes. It is sent
to each worker once. Workers need not share a file system: only bytes come back, and who asks writes them.
"""


class JobError(Exception):
    """A job failed, or its workers could not be had; the message says which and why."""
