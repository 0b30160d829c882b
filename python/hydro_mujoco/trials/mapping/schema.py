"""A mapping: which field of a log is which sensor, actuator, joint or state of a model."""

from collections.abc import Mapping as Dict
from dataclasses import dataclass, field

SCHEMA = "hydro-mapping/1"


@dataclass(frozen=True)
class Turn:
    """What turns a velocity from the world into a body, or back.

    attitude: source of world_from_body; into: `body` or `world`; mount: rotation (3, 3) from the axes of the velocity
    in the body to those that the attitude is of.
    """

    attitude: "Source"
    into: str
    mount: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Source:
    """Numbers of a log, and how they become the model's: raw -> table or pulse, or unit -> scale, offset -> frame.

    quantity: of the model's numbers, None for any; fields: paths, "" for a component that the log lacks; units: of
    each, None where they are SI; frame: that they are in; order, inverse: of a quaternion; table: raw and wanted
    values; pulse: width at -1, 0 and 1 [us]; constant: in place of a topic; clock: field with the time of each sample,
    None for the mapping's; delay: taken from the times [s]; turn: of a velocity whose frame is of the other kind.
    """

    where: str
    quantity: str | None = None
    topic: str = ""
    fields: tuple[str, ...] = ()
    units: tuple[str | None, ...] = ()
    frame: str | None = None
    order: str = "wxyz"
    inverse: bool = False
    scale: tuple[float, ...] = (1.0,)
    offset: tuple[float, ...] = (0.0,)
    table: tuple[tuple[float, float], ...] = ()
    pulse: tuple[float, float, float] | None = None
    constant: float | None = None
    clock: str | None = None
    delay: float = 0.0
    filter: bool = True
    turn: Turn | None = None


@dataclass(frozen=True)
class Time:
    """Clock and rows. clock: `log` or a field; unit: of that field; align: move it by its least delay against the log;
    period: between rows of sensors [s], control_period: of controls; None for the defaults.
    """

    clock: str = "log"
    unit: str = "s"
    align: bool = False
    period: float | None = None
    control_period: float | None = None


@dataclass(frozen=True)
class Trials:
    """Where trials begin and end [s of the log]: gap that ends one, windows, mode, the shortest, length of pieces."""

    gap: float = 1.0
    windows: tuple[tuple[float, float], ...] = ()
    mode: tuple[str, str, tuple[float | str, ...]] | None = None
    shortest: float = 2.0
    length: float | None = None


@dataclass(frozen=True)
class Water:
    """For pressures: density [kg/m^3], gravity [m/s^2], pressure at the surface [Pa], height of the surface [m]."""

    density: float = 1000.0
    gravity: float = 9.80665
    surface_pressure: float = 101325.0
    surface: float = 0.0


@dataclass(frozen=True)
class Mapping:
    """The whole of a mapping file.

    frames: of the model's world and body; state: body or joint -> part -> source; origin: latitude, longitude
    [degrees] and height [m] of the world's zero, None for that of the first fix.
    """

    name: str
    sensors: Dict[str, Source]
    actuators: Dict[str, Source]
    joints: Dict[str, Source] = field(default_factory=dict)
    state: Dict[str, Dict[str, Source]] = field(default_factory=dict)
    time: Time = field(default_factory=Time)
    trials: Trials = field(default_factory=Trials)
    water: Water = field(default_factory=Water)
    frames: tuple[str, str] = ("ENU", "FLU")
    origin: tuple[float, float, float] | None = None
