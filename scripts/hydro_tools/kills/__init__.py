"""Commands that write for long, disturbed at random moments, and their results beside those of undisturbed runs.

jobs.py      the commands, and what they are given
trouble.py   the disturbances
content.py   what a folder holds, without what may differ
campaign.py  cases by job, trouble and number; outcomes, table
"""


class KillsError(Exception):
    """A campaign that cannot be run."""
