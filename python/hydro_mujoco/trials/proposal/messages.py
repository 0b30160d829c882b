"""Known messages: which of their fields measure what, in which unit and frame.

Sources: ROS common_interfaces and REP 103, 145; PX4 msg/*.msg; ArduPilot's log messages; MAVLink common.xml.
"""

from dataclasses import dataclass

from ..units import ACCELERATION, ATTITUDE, FIELD, FORCE, LENGTH, PRESSURE, RATE, TORQUE, VELOCITY

#: What moves an actuator.
COMMAND = "command"
#: Commands of one message at most.
MOST_COMMANDS = 32


@dataclass(frozen=True)
class Group:
    """Fields that belong together. frame_kind: `body`, `world`, `attitude` or None, as of the model's sensors.

    unit: of all, or of each; names: of the actuator that a single field commands, where the message's definition says
    it, and then no other.
    """

    quantity: str
    frame_kind: str | None
    fields: tuple[str, ...]
    unit: str | tuple[str, ...] | None = None
    frame: str | None = None
    order: str | None = None
    names: tuple[str, ...] = ()


def _xyz(prefix: str, form: str = "{}.{}", axes: str = "xyz") -> tuple[str, ...]:
    return tuple(form.format(prefix, axis) for axis in axes)


def _array(prefix: str, size: int = 3) -> tuple[str, ...]:
    return tuple(f"{prefix}[{index}]" for index in range(size))


def _commands(form: str, unit: str | None, first: int = 0) -> tuple[Group, ...]:
    numbers = range(first, first + MOST_COMMANDS)
    return tuple(Group(COMMAND, None, (form.format(number),), unit) for number in numbers)


#: What the channels of a pilot's remote control move, from the first on (ArduSub, "RC Input and Output").
_PILOT = (
    ("pitch",),
    ("roll",),
    ("throttle", "heave", "vertical"),
    ("yaw",),
    ("forward", "surge"),
    ("lateral", "sway"),
)


def _pilot(form: str, first: int = 0) -> tuple[Group, ...]:
    return tuple(
        Group(COMMAND, None, (form.format(first + number),), "us", names=names) for number, names in enumerate(_PILOT)
    )


def _geodetic(*fields: str, unit: tuple[str, str, str] | None = None) -> Group:
    """A position by latitude, longitude and height."""
    return Group(LENGTH, "world", fields, unit, "WGS84")


def _pose(prefix: str) -> tuple[Group, ...]:
    return (
        Group(LENGTH, "world", _xyz(f"{prefix}position"), None, "ENU"),
        Group(ATTITUDE, "attitude", _xyz(f"{prefix}orientation", axes="xyzw"), None, "ENU/FLU", "xyzw"),
    )


def _twist(prefix: str) -> tuple[Group, ...]:
    return (
        Group(VELOCITY, "body", _xyz(f"{prefix}linear"), None, "FLU"),
        Group(RATE, "body", _xyz(f"{prefix}angular"), None, "FLU"),
    )


_ROS = {
    "sensor_msgs/Imu": (
        Group(RATE, "body", _xyz("angular_velocity"), None, "FLU"),
        Group(ACCELERATION, "body", _xyz("linear_acceleration"), None, "FLU"),
        Group(ATTITUDE, "attitude", _xyz("orientation", axes="xyzw"), None, "ENU/FLU", "xyzw"),
    ),
    "nav_msgs/Odometry": (*_pose("pose.pose."), *_twist("twist.twist.")),
    "geometry_msgs/Pose": _pose(""),
    "geometry_msgs/PoseStamped": _pose("pose."),
    "geometry_msgs/PoseWithCovarianceStamped": _pose("pose.pose."),
    "geometry_msgs/TransformStamped": (
        Group(LENGTH, "world", _xyz("transform.translation"), None, "ENU"),
        Group(ATTITUDE, "attitude", _xyz("transform.rotation", axes="xyzw"), None, "ENU/FLU", "xyzw"),
    ),
    "geometry_msgs/Twist": _twist(""),
    "geometry_msgs/TwistStamped": _twist("twist."),
    "geometry_msgs/TwistWithCovarianceStamped": _twist("twist.twist."),
    "geometry_msgs/AccelStamped": (Group(ACCELERATION, "body", _xyz("accel.linear"), None, "FLU"),),
    "geometry_msgs/PointStamped": (Group(LENGTH, "world", _xyz("point"), None, "ENU"),),
    "geometry_msgs/QuaternionStamped": (
        Group(ATTITUDE, "attitude", _xyz("quaternion", axes="xyzw"), None, "ENU/FLU", "xyzw"),
    ),
    "geometry_msgs/WrenchStamped": (
        Group(FORCE, "body", _xyz("wrench.force"), None, "FLU"),
        Group(TORQUE, "body", _xyz("wrench.torque"), None, "FLU"),
    ),
    "sensor_msgs/NavSatFix": (_geodetic("latitude", "longitude", "altitude"),),
    "sensor_msgs/FluidPressure": (Group(PRESSURE, None, ("fluid_pressure",), "Pa"),),
    "sensor_msgs/MagneticField": (Group(FIELD, "body", _xyz("magnetic_field"), "T", "FLU"),),
    "std_msgs/Float64MultiArray": _commands("data[{}]", None),
    "std_msgs/Float32MultiArray": _commands("data[{}]", None),
    "std_msgs/Float64": (Group(COMMAND, None, ("data",)),),
    "std_msgs/Float32": (Group(COMMAND, None, ("data",)),),
    "mavros_msgs/RCOut": _commands("channels[{}]", "us"),
    "mavros_msgs/RCIn": _pilot("channels[{}]"),
    "mavros_msgs/OverrideRCIn": _pilot("channels[{}]"),
}
#: Before PX4 1.15 integers of 1e-7 degrees and millimetres.
_PX4_GPS = (
    _geodetic("latitude_deg", "longitude_deg", "altitude_msl_m"),
    _geodetic("lat", "lon", "alt", unit=("degE7", "degE7", "mm")),
    Group(VELOCITY, "world", ("vel_n_m_s", "vel_e_m_s", "vel_d_m_s"), None, "NED"),
)
_PX4 = {
    "sensor_combined": (
        Group(RATE, "body", _array("gyro_rad"), None, "FRD"),
        Group(ACCELERATION, "body", _array("accelerometer_m_s2"), None, "FRD"),
    ),
    "vehicle_angular_velocity": (Group(RATE, "body", _array("xyz"), None, "FRD"),),
    "vehicle_acceleration": (Group(ACCELERATION, "body", _array("xyz"), None, "FRD"),),
    "vehicle_attitude": (Group(ATTITUDE, "attitude", _array("q", 4), None, "NED/FRD", "wxyz"),),
    "vehicle_local_position": (
        Group(LENGTH, "world", ("x", "y", "z"), None, "NED"),
        Group(VELOCITY, "world", ("vx", "vy", "vz"), None, "NED"),
    ),
    "vehicle_global_position": (_geodetic("lat", "lon", "alt"),),
    "vehicle_gps_position": _PX4_GPS,
    "sensor_gps": _PX4_GPS,
    "vehicle_odometry": (
        Group(LENGTH, "world", _array("position"), None, "NED"),
        Group(ATTITUDE, "attitude", _array("q", 4), None, "NED/FRD", "wxyz"),
        Group(VELOCITY, "world", _array("velocity"), None, "NED"),
        Group(RATE, "body", _array("angular_velocity"), None, "FRD"),
    ),
    "vehicle_air_data": (Group(PRESSURE, None, ("baro_pressure_pa",), "Pa"),),
    "sensor_baro": (Group(PRESSURE, None, ("pressure",), "Pa"),),
    "vehicle_magnetometer": (Group(FIELD, "body", _array("magnetometer_ga"), "G", "FRD"),),
    "actuator_motors": _commands("control[{}]", None),
    "actuator_outputs": _commands("output[{}]", "us"),
}
_XKF1 = (
    Group(LENGTH, "world", ("PN", "PE", "PD"), None, "NED"),
    Group(VELOCITY, "world", ("VN", "VE", "VD"), None, "NED"),
)
_ARDUPILOT = {
    "IMU": (
        Group(RATE, "body", _xyz("Gyr", "{}{}", "XYZ"), None, "FRD"),
        Group(ACCELERATION, "body", _xyz("Acc", "{}{}", "XYZ"), None, "FRD"),
    ),
    "ATT": (Group(ATTITUDE, "attitude", ("Roll", "Pitch", "Yaw"), "deg", "NED/FRD"),),
    "XKF1": _XKF1,
    "NKF1": _XKF1,
    "GPS": (_geodetic("Lat", "Lng", "Alt"),),
    "POS": (_geodetic("Lat", "Lng", "Alt"),),
    "BARO": (Group(PRESSURE, None, ("Press",), "Pa"),),
    "MAG": (Group(FIELD, "body", _xyz("Mag", "{}{}", "XYZ"), "mG", "FRD"),),
    "RCOU": _commands("C{}", "us", 1),
    "RCIN": _pilot("C{}", 1),
}


_SCALED_IMU = (
    Group(RATE, "body", _xyz("gyro", "{1}{0}"), "mrad/s", "FRD"),
    Group(ACCELERATION, "body", _xyz("acc", "{1}{0}"), "mg", "FRD"),
    Group(FIELD, "body", _xyz("mag", "{1}{0}"), "mG", "FRD"),
)
_MAVLINK = {
    "ATTITUDE": (
        Group(ATTITUDE, "attitude", ("roll", "pitch", "yaw"), "rad", "NED/FRD"),
        Group(RATE, "body", ("rollspeed", "pitchspeed", "yawspeed"), None, "FRD"),
    ),
    "LOCAL_POSITION_NED": _PX4["vehicle_local_position"],
    "GLOBAL_POSITION_INT": (
        _geodetic("lat", "lon", "alt", unit=("degE7", "degE7", "mm")),
        Group(VELOCITY, "world", ("vx", "vy", "vz"), "cm/s", "NED"),
    ),
    "GPS_RAW_INT": (_geodetic("lat", "lon", "alt", unit=("degE7", "degE7", "mm")),),
    "SCALED_IMU": _SCALED_IMU,
    "SCALED_IMU2": _SCALED_IMU,
    "SCALED_PRESSURE": (Group(PRESSURE, None, ("press_abs",), "hPa"),),
    "SCALED_PRESSURE2": (Group(PRESSURE, None, ("press_abs",), "hPa"),),
    "RC_CHANNELS": _pilot("chan{}_raw", 1),
    "RC_CHANNELS_OVERRIDE": _pilot("chan{}_raw", 1),
    "SERVO_OUTPUT_RAW": _commands("servo{}_raw", "us", 1),
}
_KNOWN = {**_ROS, **_PX4, **_ARDUPILOT, **_MAVLINK}


def groups(kind: str) -> tuple[Group, ...] | None:
    """The groups of a type of message; None where it is not known."""
    return _KNOWN.get(kind.replace("/msg/", "/"))
