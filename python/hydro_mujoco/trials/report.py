"""What a conversion did, dropped and suspects."""

from dataclasses import dataclass, field
from typing import Any


@dataclass
class Report:
    """Gathered while a log is converted.

    signals: what became of each sensor, actuator and joint; notes: what was done or dropped; suspicions: what looks
    wrong; trials: of each, name, start in the log [s] and rows; offsets: of clocks against the log's, by topic [s].
    """

    log: str
    kind: str
    is_table: bool = False
    signals: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    suspicions: list[str] = field(default_factory=list)
    trials: list[dict[str, Any]] = field(default_factory=list)
    offsets: dict[str, float] = field(default_factory=dict)

    def note(self, text: str) -> None:
        """Something that was done."""
        if text not in self.notes:
            self.notes.append(text)

    def suspect(self, text: str) -> None:
        """Something that looks wrong."""
        if text not in self.suspicions:
            self.suspicions.append(text)

    def json(self) -> dict[str, Any]:
        """For programs, `hydro-conversion/1`."""
        return {
            "schema": "hydro-conversion/1",
            "log": self.log,
            "kind": self.kind,
            "trials": self.trials,
            "signals": self.signals,
            "notes": self.notes,
            "suspicions": self.suspicions,
        }

    def __str__(self) -> str:
        lines = [f"{self.log} ({self.kind}): {len(self.trials)} trials"]
        lines += [
            f"  {t['name']}  from {t['start']:.3f} s, {t['seconds']:.2f} s, {t['rows']} rows {t['period']:g} s apart, "
            f"{'with' if t['initial_state'] else 'without'} a start"
            for t in self.trials
        ]
        lines += [f"  {s['name']}: {s['what']}" for s in self.signals]
        lines += [f"note: {text}" for text in self.notes]
        lines += [f"SUSPECT: {text}" for text in self.suspicions]
        return "\n".join(lines)
