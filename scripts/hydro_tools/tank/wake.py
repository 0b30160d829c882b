"""Wakes: how much of the tow speed upstream links have given to the water at a strip.

Behind a bar of breadth d and drag coefficient C the water follows the tow at the share

    w = sqrt(C d / x_s) exp(-ln 2 (y / b)^2),   b = sqrt(C d x_s) / 4,   x_s = x + 4 d / C

of its speed, x downstream of the bar and y off its projection on a plane across the flow: E. Huse,
Interaction in deep-sea riser arrays, OTC 7237 (1993), the wake of DNV-RP-F203. Several wakes add as
the root of their squares (ibid.).

Judgement: a short link counts as a bar of the aspect of its frontal area; close behind it, within one
breadth, the wake is let in linearly; the share is capped at CAP; drift DRIFT of the wake with the tow.
What overtakes a robot that brakes is left out: water never moves faster than the robot does.
"""

from dataclasses import dataclass

import numpy as np

from .drag import Strips
from .geometry import frontal

#: Largest share of the tow speed in a wake.
CAP = 0.8
#: A wake drifts after the tow: it meets a strip when the robot has gone this many times the distance.
DRIFT = 1.25
#: Speed at which coefficients of the wakes are taken [m/s]; they hardly change within the tank's range.
REFERENCE_SPEED = 0.35
#: Weaker wakes are left out.
FELT = 1e-3


@dataclass(frozen=True)
class Wakes:
    """share [S,B]: water's speed at a strip over the tow speed, from each link; travel [S,B] m: what the robot
    goes from the passage of the link to that of the strip.
    """

    share: np.ndarray
    travel: np.ndarray


def wakes(strips: Strips, direction: np.ndarray) -> Wakes:
    """Wakes of a tow along the unit vector `direction` [3], base frame."""
    body = strips.body
    count = len(body.links)
    share, travel = np.zeros((len(body.link), count)), np.zeros((len(body.link), count))
    velocity = np.broadcast_to(REFERENCE_SPEED * direction, body.centre.shape)
    resistance = -strips.drag(velocity) @ direction
    for number, link in enumerate(body.links):
        own = body.link == number
        drag_area = resistance[own].sum() / (0.5 * strips.density * REFERENCE_SPEED**2)
        # The link's axis and the strips, seen along the flow.
        axis = link.end - link.start
        flat = axis - axis @ direction * direction
        span = np.sqrt(flat @ flat)
        height, width = frontal(link, direction)
        coefficient = drag_area / (height * width)
        reach = body.centre - link.start
        place = np.clip(reach @ flat / max(span**2, 1e-12), 0.0, 1.0) if span > 1e-6 else np.full(len(reach), 0.5)
        offset = reach - place[:, None] * axis
        downstream = -(offset @ direction)
        lateral = np.sqrt(np.maximum(np.sum(offset**2, axis=1) - downstream**2, 0.0))
        behind = np.maximum(downstream, 0.0) + 4.0 * width / coefficient
        half = 0.25 * np.sqrt(coefficient * width * behind)
        strength = np.sqrt(coefficient * width / behind) * np.exp(-np.log(2.0) * (lateral / half) ** 2)
        onset = np.clip(downstream / width, 0.0, 1.0)
        strength *= onset
        share[:, number] = np.where(own | (strength < FELT), 0.0, strength)
        travel[:, number] = DRIFT * np.maximum(downstream, 0.0)
    return Wakes(share, travel)
