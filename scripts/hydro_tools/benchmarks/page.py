"""`RESULTS.md`, from the records of the parts."""

from pathlib import Path

from .markdown import digits, table
from .parts import PARTS

#: What people wrote beside the numbers: why a target is missed, what was tried.
REMARKS = Path(__file__).with_name("remarks.md")

HEAD = """# Benchmarks: what was measured

Written by `scripts/bench.sh` from the raw blocks in `results/`; do not edit (`scripts/bench.sh --report` writes it again
without measuring). Implementations are live processes that are timed in turn, block by block, so that a busy machine slows them alike; a
ratio is taken within each round, and its median and quartiles over the rounds are shown. Before anything is timed, every implementation must
compute the same numbers. Trust the ratios more than the times.
"""


def _machine(machine: dict) -> str:
    caches = ", ".join(f"{name} {size}" for name, size in machine["caches"].items())
    packages = ", ".join(f"{name} {version}" for name, version in machine["packages"].items())
    kind = "virtual machine" if machine["virtual"] else "machine"
    return (
        f"{machine['cpu']} (family {machine['family']}, {machine['vectors']}), {kind} with {machine['cores']} cores, caches of a core: "
        f"{caches}; {machine['memory_gib']} GiB, Linux {machine['kernel']}; rustc {machine['rustc']}, Python {machine['python']}, "
        f"{packages}."
    )


def _runs(records: dict) -> str:
    rows = [
        [
            part,
            record["commit"],
            record["date"],
            f"{100 * record['others']:.0f} %",
            "quick" if record["quick"] else "full",
        ]
        for part, record in records.items()
    ]
    return table(["part", "commit", "when", "taken by other programs", "run"], rows)


#: Share of the machine taken by other programs beyond which a part's times say nothing of its targets.
BUSY = 0.1


def _targets(records: dict) -> str:
    rows = []
    for part, record in records.items():
        busy = record["others"] > BUSY
        for target in PARTS[part].targets(record["groups"]):
            sign = "at least" if target.least else "at most"
            verdict = "machine too busy to say" if busy and target.timed else "met" if target.met else "**missed**"
            rows.append([target.what, f"{sign} {target.limit:g}", digits(target.value), verdict])
    return table(["figure", "target", "measured", ""], rows)


def page(records: dict) -> str:
    """The whole page; a part that has no record is left out."""
    machines = {_machine(record["machine"]): None for record in records.values()}
    parts = [HEAD, "\n\n".join(machines) + "\n", _runs(records), "## Targets\n", _targets(records), REMARKS.read_text()]
    groups = {part: record["groups"] for part, record in records.items()}
    for part, own in groups.items():
        module = PARTS[part]
        # Memory shows the peaks that the other parts noted.
        shown = module.render(own, groups) if part == "memory" else module.render(own)
        parts += [f"## {module.TITLE}\n", shown]
    return "\n".join(parts)
