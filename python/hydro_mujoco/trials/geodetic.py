"""Latitude, longitude and height of WGS84 as metres about an origin.

By way of earth-centred coordinates, exactly: pymap3d (M. Hirsch, "PyMap3D", J. Open Source Software 3(23), 580, 2018).
"""

import numpy as np

from ..extras import extra


def is_fix(values: np.ndarray) -> np.ndarray:
    """True for rows that are a fix (n,). values: latitude, longitude [rad], (n, 2 or 3).

    Receivers write 0, 0 where they have none.
    """
    return np.isfinite(values[:, :2]).all(1) & values[:, :2].any(1)


def local(values: np.ndarray, origin: tuple[float, float, float]) -> np.ndarray:
    """East, north and up [m] of the plane that touches the ellipsoid at an origin, (n, 3); NaN where there is no fix.

    values: latitude, longitude [rad], height [m], (n, 3); a height that is NaN counts as the origin's, and leaves
        `up` NaN.
    origin: latitude, longitude [degrees], height [m]. Heights have one datum, whichever: the ellipsoid or the sea's.

    Raises:
        DataError: pymap3d is not there.
    """
    geodesy = extra("pymap3d", "gps", "a position in WGS84")
    found = np.full(values.shape, np.nan)
    rows = is_fix(values)
    latitude, longitude, height = values[rows].T
    whole = np.where(np.isfinite(height), height, origin[2])
    degrees = np.degrees(latitude), np.degrees(longitude), whole
    found[rows] = np.column_stack(geodesy.geodetic2enu(*degrees, *origin))
    found[rows, 2] = np.where(np.isfinite(height), found[rows, 2], np.nan)
    return found
