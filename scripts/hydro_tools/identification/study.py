"""The whole run: the fit, its prediction of held-out tows, and the results of other choices."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from hydro_mujoco.recording.progress import Progress

from . import blocks, identifiability
from .coefficients import DEFAULT
from .fit import Fit, Prior, Tank, density_scale, identify
from .measurements import Measurements
from .split import held_out

#: Decimals of a coefficient in the scene.
DECIMALS = 4
#: Priors beside the one that is used.
OTHER_PRIORS = (Prior(0.25), Prior(1.0), Prior(2.0), Prior(0.5, levelled=False))


@dataclass(frozen=True)
class Study:
    """Over N tows: held [N] out; predicted forces by model [N,2] N; those of fits without each tow's configuration
    [N,2] N, and their coefficients by configuration; the fit, its bootstrap and analysis; fits under other priors with
    their predictions.
    """

    tows: Measurements
    held: np.ndarray
    fit: Fit
    prior: Prior
    density: float
    predicted: dict[str, np.ndarray]
    left_out: np.ndarray
    left_out_coefficients: dict[int, np.ndarray]
    replicates: np.ndarray
    analysis: identifiability.Analysis
    others: list[tuple[Prior, Fit, np.ndarray]]


def run(tows: Measurements, share: float, seed: int, *, prior: Prior | None = None) -> Study:
    """Everything the report tells; the held-out tows are only predicted."""
    prior = prior or Prior()
    held = held_out(tows, share, seed)
    whole = Tank.from_tows(tows)
    tank = whole.take(~held)
    configurations = np.unique(tows.configuration)
    progress = Progress(1 + len(configurations) + len(OTHER_PRIORS), "fits")

    fit = identify(tank, prior)
    fit = dataclasses.replace(fit, coefficients=np.round(fit.coefficients, DECIMALS))
    scale, offsets = density_scale(tank, fit.sd)
    predicted = {
        "default": whole.water.force(DEFAULT),
        "density": whole.water.force(DEFAULT, scale) + offsets,
        "identified": fit.predict(whole.water),
    }
    progress.advance()

    left_out, coefficients = np.empty_like(tows.force), {}
    for number in configurations:
        rows = tows.configuration == number
        without = identify(whole.take(~rows), prior)
        left_out[rows], coefficients[int(number)] = without.predict(whole.water)[rows], without.coefficients
        progress.advance()
    others = []
    for other in OTHER_PRIORS:
        found = identify(tank, other)
        others.append((other, found, found.predict(whole.water)))
        progress.advance()
    return Study(
        tows,
        held,
        fit,
        prior,
        scale,
        predicted,
        left_out,
        coefficients,
        blocks.bootstrap(tank, fit, prior, seed),
        identifiability.analyse(tank, fit),
        others,
    )
