"""Coefficients that the tows determine, from the whitened Jacobian in units of the prior.

- A coefficient without a column exerts no force in any tow.
- The null space holds combinations that change no force: exact relations between columns.
- The data outweigh the prior where a coefficient's standard deviation falls below 1/sqrt(2) of the prior's, and almost
  none of its prior variance lies in the null space. Whether it is identified also depends on its bounds and on other
  priors, see `result`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from .coefficients import DEFAULT, NAMES, OFFSETS, kind
from .fit import Fit, Tank, whitened

#: Standard deviation after over before, below which the data outweigh the prior.
OUTWEIGHED = np.sqrt(0.5)
#: Share of its prior variance in the null space, up to which a coefficient is seen.
UNSEEN = 0.05
#: Singular values below this share of the largest are none; members of a relation below this are left out.
NOTHING, MEMBER = 1e-6, 0.02
#: Why a coefficient exerts no force in a tow.
SILENT = {
    "angular": "acts on a turning body; a tow does not turn B1",
    "Magnus": "acts on a turning body; a tow does not turn B1",
    "slender": "a sphere shows the same area from every side, and this drag is that of the difference",
    "Kutta": "a sphere's lift is nil whatever the coefficient",
}


@dataclass(frozen=True)
class Analysis:
    """silent: names without force, and why. names: of the acting coefficients. kept: standard deviation after over
    before, by name. unseen: share of each name's prior variance that lies in the null space. alike: the coefficient
    whose force looks most like it, and the cosine. strengths: singular values in units of the prior, offsets taken
    out, with the combination each belongs to. relations: a force that others make up, and of what. density: what no
    coefficient makes up of the density scale's force, a share of it.
    """

    silent: dict[str, str]
    names: tuple[str, ...]
    kept: dict[str, float]
    unseen: dict[str, float]
    alike: dict[str, tuple[str, float]]
    strengths: list[tuple[float, dict[str, float]]]
    relations: dict[str, dict[str, float]]
    density: float

    def outweighs(self, name: str) -> bool:
        """True where the data say more of it than the prior."""
        return name in self.kept and bool(self.kept[name] < OUTWEIGHED and self.unseen.get(name, 0.0) < UNSEEN)


def _relations(columns: np.ndarray, spread: np.ndarray, names: tuple[str, ...]) -> dict[str, dict[str, float]]:
    """Columns that others make up: by pivoted QR, the strongest columns staying independent."""
    _, upper, order = qr(columns * spread, mode="economic", pivoting=True)
    size = np.abs(np.diag(upper))
    rank = int((size > NOTHING * size[0]).sum())
    kept, made = order[:rank], order[rank:]
    shares = np.linalg.lstsq(columns[:, kept], columns[:, made], rcond=None)[0]
    return {
        names[j]: {names[k]: float(value) for k, value in zip(kept, column) if abs(value) > MEMBER}
        for j, column in zip(made, shares.T)
    }


def analyse(tank: Tank, fit: Fit) -> Analysis:
    """Coefficients that the tows of `tank` determine."""
    acting = tank.acting
    names = tuple(np.array(NAMES)[acting].tolist())
    jacobian = whitened(tank, fit.sd)
    after = np.linalg.inv(jacobian.T @ jacobian + np.diag(fit.spread**-2.0))
    kept = np.sqrt(np.diag(after)) / fit.spread
    # What offsets could explain does not count for coefficients.
    basis, _ = np.linalg.qr(jacobian[:, -2:])
    columns = jacobian[:, :-2] - basis @ (basis.T @ jacobian[:, :-2])
    spread = fit.spread[:-2]
    _, strength, rows = np.linalg.svd(columns * spread, full_matrices=False)
    nothing = strength < NOTHING * strength[0]
    cosines = columns.T @ columns / np.outer(*(np.linalg.norm(columns, axis=0),) * 2)
    np.fill_diagonal(cosines, 0.0)
    nearest = np.abs(cosines).argmax(axis=1)
    rest = tank.rest / fit.sd
    scaled = ((tank.columns @ DEFAULT) / fit.sd + rest).ravel()
    made = jacobian @ np.linalg.lstsq(jacobian, scaled, rcond=None)[0]
    return Analysis(
        silent={name: SILENT[kind(name)] for name, acts in zip(NAMES, acting) if not acts},
        names=names,
        kept=dict(zip((*names, *OFFSETS), (float(k) for k in kept))),
        unseen={name: float(share) for name, share in zip(names, (rows[nothing] ** 2).sum(axis=0))},
        alike={name: (names[k], float(cosines[i, k])) for i, (name, k) in enumerate(zip(names, nearest))},
        strengths=[
            (float(s), {name: float(v) for name, v in zip(names, row) if abs(v) > 0.25})
            for s, row in zip(strength, rows)
        ],
        relations=_relations(columns, spread, names),
        density=float(np.linalg.norm(scaled - made) / np.linalg.norm(scaled)),
    )
