"""The list of BlueROV2 cases, and one case, made and written like those of gen_hidden.py."""

import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path

import mujoco
import numpy as np

from ..hidden_cases import HiddenCaseError, measurement, trialfile
from ..hidden_cases.case import LIKE, SCHEMA, halves
from ..hidden_cases.frames import exponential, product
from ..hidden_cases.scenes import without_plugins
from ..hidden_cases.strength import Layout
from . import fossen, manoeuvres, nominal, strength
from .parts import CENTRE, RELATIVE, WATER, WEIGHED, Hidden, Part, draw, perturbed

SYSTEM = "bluerov"
#: Step of the truth [s], row period [s].
STEP, PERIOD = 0.001, 0.02
#: Trials and seconds of a whole case and of a quick one; trials kept back.
SIZES = {False: (10, 20.0, 4), True: (4, 6.0, 2)}


@dataclass(frozen=True)
class Spec:
    """The plan of a case. name: `dry`, `dry_current`, `null`, or the one part that is missing."""

    name: str
    suite: str
    seed: int
    quick: bool = False
    noise: float = 1.0
    configuration: str = "heavy"

    @property
    def case_id(self) -> str:
        """A name that tells nothing."""
        text = f"bluerov {self.name} {self.suite} {self.seed} {self.quick} {self.configuration}"
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    @property
    def missing(self) -> tuple[Part, ...]:
        """Parts that the nominal lacks and the truth has."""
        if self.name == "null":
            return ()
        if self.name.startswith("dry"):
            return tuple(part for part in Part if part in WATER or self.name == "dry_current")
        return (Part(self.name),)

    @property
    def had(self) -> frozenset[Part]:
        """Parts that the nominal has."""
        return WATER - set(self.missing)

    @property
    def kind(self) -> str:
        """null, single or several."""
        return {0: "null", 1: "single"}.get(len(self.missing), "several")

    def generator(self, stream: int) -> np.random.Generator:
        """Random numbers of one purpose; the same truth for both suites of sensors."""
        word = int.from_bytes(hashlib.sha256(self.name.encode()).digest()[:4])
        return np.random.default_rng([self.seed, word, stream])


NAMES = ("dry", "dry_current", "null", *(part.value for part in Part))


def plan(seed: int, *, quick: bool, configuration: str = "heavy") -> list[Spec]:
    """Every case of a seed: each name with both suites of sensors."""
    return [Spec(name, suite, seed, quick, configuration=configuration) for name in NAMES for suite in nominal.SUITES]


class Case:
    """Makes the truth of a spec, drives it, writes it."""

    def __init__(self, spec: Spec):
        self.spec = spec
        self.xml = nominal.mjcf(spec.had, spec.suite, spec.noise, spec.configuration)
        self.model = mujoco.MjModel.from_xml_string(without_plugins(self.xml))
        self.layout = Layout.from_model(self.model)
        rng = spec.generator(1)
        self.truth, self.amounts = perturbed(spec.had, rng, spec.configuration)
        self.hidden = [draw(part, rng) for part in spec.missing]
        for hidden in self.hidden:
            self.truth = hidden.put(self.truth)
        self.trials, seconds, self.kept_back = SIZES[spec.quick]
        self.rows = round(seconds / PERIOD)
        self.recorder = measurement.recorder(spec.generator(2), PERIOD)

    def run(self) -> tuple[fossen.Recording, list[str]]:
        """All trials, shown and kept back."""
        rng = self.spec.generator(3)
        states, pilot, modes = manoeuvres.drive(
            rng, self.trials + self.kept_back, self.rows, PERIOD, self.spec.configuration
        )
        record = fossen.run(self.truth, states, pilot, rows=self.rows, period=PERIOD, hold=nominal.STEP, step=STEP)
        if not np.isfinite(record.readings).all() or record.states[:, :, 2].max() > -0.3:
            raise HiddenCaseError(f"{self.spec.name}: the truth diverged or came within 0.3 m of the surface")
        return record, modes

    def answered(self) -> list[Hidden]:
        """The hidden parts as the nominal would have to be mended."""
        out = []
        for hidden in self.hidden:
            if hidden.part is Part.BUOYANCY_OFFSET and not self.spec.had:
                # The dry nominal lifts the hull in its centre of mass, wherever that is.
                hidden = Hidden(hidden.part, hidden.values - self.truth.centre[0])
            out.append(hidden)
        return out

    def make(self, out: Path) -> dict:
        """Write the case; returns its answer."""
        spec = self.spec
        record, modes = self.run()
        shown = self.trials
        at = np.round((np.arange(1, self.rows + 1) * PERIOD - nominal.STEP) / STEP).astype(int)
        part_shown = fossen.Recording(
            record.times, record.readings[:shown], record.commands[:shown], record.states[:shown]
        )
        outputs = strength.Outputs(spec.suite, spec.noise)
        effects, projected, raw, distances = [], 0.0, 0.0, {}
        for hidden in self.answered():
            own, distances = strength.measure(
                part_shown,
                part_shown.readings[:, at],
                PERIOD,
                self.truth,
                hidden,
                spec.had,
                outputs,
                rivals=spec.kind == "single",
            )
            projected, raw = max(projected, own["projected"]), max(raw, own["raw"])
            effects.append(
                {
                    "effect": hidden.part.value,
                    "target": "hull",
                    "comparable": hidden.comparable,
                    "parameters": hidden.parameters(),
                    "strength": own,
                }
            )
        near = [kind for kind, distance in distances.items() if distance < LIKE]
        answer = {
            "schema": SCHEMA,
            "id": spec.case_id,
            "system": SYSTEM,
            "name": spec.name,
            "suite": spec.suite,
            "kind": spec.kind,
            "effects": effects,
            "lookalikes": near,
            "identifiable": spec.kind != "null" and not near and projected >= LIKE,
            "distances": distances,
            "twin": None,
            "strength": {"projected": projected, "raw": raw, "asked": []},
            "noise": spec.noise,
            "recorder": asdict(self.recorder),
            "style": "normal",
            "modes": modes[:shown],
            "perturbations": self.amounts,
            "truth_step": STEP,
            "truth_integrator": "Runge-Kutta of fossen.py",
        }
        public = {
            "schema": SCHEMA,
            "id": spec.case_id,
            "system": SYSTEM,
            "nominal": "nominal.xml",
            "trials": shown,
            "row_period": PERIOD,
            "format": "csv" if nominal.LOGGED[spec.suite] else "npz",
            "uncertainty": {
                "mass": WEIGHED,
                "inertia": RELATIVE,
                "com_m": CENTRE,
                "fluid": RELATIVE,
                "gain": RELATIVE,
                "damping": RELATIVE,
            },
        }
        with halves(out, spec.case_id) as (open_part, secret_part):
            (open_part / "trials").mkdir()
            (secret_part / "never_shown").mkdir()
            (open_part / "nominal.xml").write_text(self.xml)
            rng = spec.generator(4)
            for trial in range(shown + self.kept_back):
                kept = trial >= shown
                folder = secret_part / "never_shown" if kept else open_part / "trials"
                self._log(rng, folder / f"trial_{trial - shown if kept else trial:02d}", record, trial)
            (open_part / "case.json").write_text(json.dumps(public, indent=1) + "\n")
            (secret_part / "answer.json").write_text(json.dumps(answer, indent=1) + "\n")
        return answer

    def _log(self, rng: np.random.Generator, stem: Path, record: fossen.Recording, trial: int) -> None:
        """One trial as the recorder takes it."""
        columns = [nominal.COLUMNS[name] for name in nominal.SUITES[self.spec.suite]]
        values = np.concatenate([record.readings[trial][:, c] for c in columns], 1)
        times = np.arange(self.rows + 1) * PERIOD
        labels, readings = measurement.log(
            rng, self.recorder, self.layout, record.times, values, rows=self.rows, period=PERIOD, lead=nominal.STEP
        )
        logged = nominal.LOGGED[self.spec.suite]
        if logged:
            trialfile.write_csv(
                stem.with_suffix(".csv"), self.model, times, record.commands[trial], labels, readings, only=logged
            )
            return
        # As a rig that stood still could know it: a third of a row's noise off.
        first = record.states[trial, 0]
        state = np.zeros(1 + 7 + 6)
        noise = {name: nominal.NOISE[name] * self.spec.noise / 3 for name in ("position", "attitude")}
        state[1:4] = first[:3] + rng.normal(0, noise["position"], 3)
        state[4:8] = product(first[3:7], exponential(rng.normal(0, noise["attitude"], 3)))
        trialfile.write_npz(
            stem.with_suffix(".npz"), self.model, times, record.commands[trial], labels, readings, state
        )


__all__ = ["NAMES", "Case", "Spec", "plan"]
