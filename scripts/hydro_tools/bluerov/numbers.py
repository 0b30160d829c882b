"""A BlueROV2 Heavy in public numbers. Body frame x forward, y left, z up, origin in the centre of mass.

Masses, volume, inertia, centre of buoyancy, added mass and drag: M. von Benzon, F. F. Sorensen, E. Uth, J. Jouffroy,
J. Liniger, S. Pedersen, "An Open-Source Benchmark Simulator: Control of a BlueROV2 Underwater Robot", J. Mar. Sci. Eng.
10(12), 1898 (2022), https://doi.org/10.3390/jmse10121898; checked against two public codes that take them over, not
against the article. Their frame has y right and z down; half a turn about x leaves every number of a diagonal as it is.
Places of the thrusters: C.-J. Wu, "6-DoF Modelling and Control of a Remotely Operated Vehicle", Flinders University
2018, and codes that take them over. Thrust of a T200: about 40 N astern and 51 N ahead at 16 V by its maker; 40 N here.
"""

import numpy as np

#: Mass [kg], displaced volume [m^3], moments of inertia about x, y, z [kg m^2].
MASS, VOLUME = 13.5, 0.0134
INERTIA = np.array([0.26, 0.23, 0.37])
#: Centre of buoyancy from the centre of mass [m].
BUOYANCY_CENTRE = np.array([0.0, 0.0, 0.01])
#: Density of fresh water [kg/m^3], gravity as MuJoCo has it [m/s^2].
DENSITY, GRAVITY = 1000.0, 9.81
#: Diagonal of the added mass: surge, sway, heave [kg], roll, pitch, yaw [kg m^2].
ADDED_MASS = np.array([6.36, 7.12, 18.68, 0.189, 0.135, 0.222])
#: Linear drag [N s/m], [N m s/rad].
LINEAR_DRAG = np.array([13.7, 0.0, 33.0, 0.0, 0.8, 0.0])
#: Quadratic drag [N s^2/m^2], [N m s^2/rad^2].
QUADRATIC_DRAG = np.array([141.0, 217.0, 190.0, 1.19, 0.47, 1.5])
#: Length, breadth, height [m].
EXTENTS = np.array([0.457, 0.575, 0.254])
#: Thrust at command 1 [N].
THRUST = 40.0

_SLANT = np.sqrt(0.5)
#: Thrusters, `heavy`: four in the horizontal at 45 degrees, four upright; `standard`: two upright. Places [n, 3] m.
PLACES = {
    "heavy": np.array(
        [
            [0.156, -0.111, -0.085],
            [0.156, 0.111, -0.085],
            [-0.156, -0.111, -0.085],
            [-0.156, 0.111, -0.085],
            [0.120, -0.218, 0.0],
            [0.120, 0.218, 0.0],
            [-0.120, -0.218, 0.0],
            [-0.120, 0.218, 0.0],
        ]
    ),
    "standard": np.array(
        [
            [0.156, -0.111, -0.085],
            [0.156, 0.111, -0.085],
            [-0.156, -0.111, -0.085],
            [-0.156, 0.111, -0.085],
            [0.0, -0.111, 0.0],
            [0.0, 0.111, 0.0],
        ]
    ),
}
_FLAT = np.array([[_SLANT, _SLANT, 0], [_SLANT, -_SLANT, 0], [_SLANT, -_SLANT, 0], [_SLANT, _SLANT, 0]])
#: Direction of the thrust at a positive command [n, 3].
AXES = {
    "heavy": np.concatenate([_FLAT, np.tile([0.0, 0.0, 1.0], (4, 1))]),
    "standard": np.concatenate([_FLAT, np.tile([0.0, 0.0, 1.0], (2, 1))]),
}

#: Places of the inertial unit and of the DVL [m].
IMU, DVL = np.array([0.05, 0.0, 0.04]), np.array([-0.08, 0.0, -0.12])
#: The earth's field in the world (x north, z up) [gauss], about that of Denmark.
FIELD = np.array([0.17, 0.0, -0.47])


def allocation(configuration: str) -> np.ndarray:
    """Wrench [6, n] (N, N m, about the origin) of a unit command of each thruster."""
    places, axes = PLACES[configuration], AXES[configuration]
    return THRUST * np.concatenate([axes, np.cross(places, axes)], 1).T
