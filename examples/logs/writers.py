"""Logs of a vehicle as its computers write them: ROS 2 messages in a bag or an MCAP file, ArduPilot's DataFlash.

Readings: imu_gyro [rad/s, FLU], attitude (world_from_body, w x y z, ENU and FLU), position [m, ENU], dvl [m/s, FLU],
velocity [m/s, ENU]; one row of each a time. Every log has its own rates, units, frames and clock.
"""

import dataclasses
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path

import mcap_ros2.writer
import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
#: Pressure at the surface [Pa], weight of a cubic metre of water [N].
SURFACE, WEIGHT = 101325.0, 1000.0 * 9.80665
#: Rows between messages, of rows 5 ms apart.
IMU_EVERY, ODOMETRY_EVERY, DVL_EVERY, PRESSURE_EVERY, COMMAND_EVERY = 2, 4, 20, 10, 4
#: What a message waits for before it is logged, at most [ns].
LATEST = 8_000_000


def messages(times, commands, readings, epoch: int) -> Iterator[tuple[int, str, str, object]]:
    """Log time [ns], topic, type and message, in the order of the log. epoch: of the first row [ns]."""
    random = np.random.default_rng(3)
    types = STORE.types
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    stamp, header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    twist, pose = types["geometry_msgs/msg/Twist"], types["geometry_msgs/msg/Pose"]
    none = np.zeros(9)
    found = []
    for row, time in enumerate(times):
        at = epoch + round(time * 1e9)
        head = header(stamp(at // 10**9, at % 10**9), "base_link")
        w, x, y, z = readings["attitude"][row]
        now = []
        if row % COMMAND_EVERY == 0:
            layout = types["std_msgs/msg/MultiArrayLayout"]([], 0)
            now.append(("/thrusters", "std_msgs/msg/Float64MultiArray", (layout, commands[row].copy())))
        if row % IMU_EVERY == 0:
            rates, felt = vector(*readings["imu_gyro"][row]), vector(0.0, 0.0, 9.81)
            turned = quaternion(x, y, z, w)
            now.append(("/imu/data", "sensor_msgs/msg/Imu", (head, turned, none, rates, none, felt, none)))
        if row % ODOMETRY_EVERY == 0:
            where = types["geometry_msgs/msg/Point"](*readings["position"][row])
            placed = types["geometry_msgs/msg/PoseWithCovariance"](pose(where, quaternion(x, y, z, w)), np.zeros(36))
            moving = twist(vector(*readings["dvl"][row]), vector(*readings["imu_gyro"][row]))
            moving = types["geometry_msgs/msg/TwistWithCovariance"](moving, np.zeros(36))
            now.append(("/odometry", "nav_msgs/msg/Odometry", (head, "base_link", placed, moving)))
        if row % DVL_EVERY == 0:
            moving = twist(vector(*readings["dvl"][row]), vector(0.0, 0.0, 0.0))
            now.append(("/dvl", "geometry_msgs/msg/TwistStamped", (head, moving)))
        if row % PRESSURE_EVERY == 0:
            pressure = SURFACE - WEIGHT * readings["position"][row, 2]
            now.append(("/pressure", "sensor_msgs/msg/FluidPressure", (head, pressure, 0.0)))
        for topic, kind, parts in now:
            found.append((at + int(random.integers(LATEST)), topic, kind, types[kind](*parts)))
    yield from sorted(found, key=lambda message: message[0])


def rosbag(path: Path, times, commands, readings, epoch: int, *, storage: StoragePlugin = StoragePlugin.SQLITE3):
    """A ROS 2 bag."""
    with Writer(path, version=9, storage_plugin=storage) as bag:
        connections = {}
        for at, topic, kind, message in messages(times, commands, readings, epoch):
            if topic not in connections:
                connections[topic] = bag.add_connection(topic, kind, typestore=STORE)
            bag.write(connections[topic], at, STORE.serialize_cdr(message, kind))


def mcap(path: Path, times, commands, readings, epoch: int, **options) -> None:
    """An MCAP file of ROS 2 messages."""
    with open(path, "wb") as file:
        writer, schemas = mcap_ros2.writer.Writer(file, **options), {}
        for at, topic, kind, message in messages(times, commands, readings, epoch):
            if kind not in schemas:
                text, _ = STORE.generate_msgdef(kind, ros_version=2)
                schemas[kind] = writer.register_msgdef(kind, text)
            writer.write_message(topic, schemas[kind], plain(message), log_time=at, publish_time=at)
        writer.finish()


def plain(value: object) -> object:
    """A message as dicts and lists."""
    if dataclasses.is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, list):
        return [plain(part) for part in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


class DataFlash:
    """A DataFlash log: formats, units, then messages."""

    #: Characters of ArduPilot's formats -> struct.
    FORMATS = {"Q": "Q", "B": "B", "b": "b", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "d": "d"} | {
        "n": "4s",
        "N": "16s",
        "Z": "64s",
    }
    UNITS = {"s": "s", "E": "rad/s", "o": "m/s/s", "d": "deg", "m": "m", "n": "m/s"} | {
        "P": "Pa",
        "Y": "us",
        "#": "instance",
    }

    def __init__(self, path: Path):
        self._file = open(path, "wb")  # noqa: SIM115
        self._layouts: dict[str, tuple[int, struct.Struct]] = {"FMT": (0x80, struct.Struct("<BB4s16s64s"))}
        self.format("FMT", "BBnNZ", "Type,Length,Name,Format,Columns", number=0x80)
        self.format("UNIT", "QbZ", "TimeUS,Id,Label")
        self.format("MULT", "Qbd", "TimeUS,Id,Mult")
        self.format("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
        for character, label in self.UNITS.items():
            self.write("UNIT", 0, ord(character), label.encode())
        self.write("MULT", 0, ord("F"), 1e-6)

    def format(self, name: str, fields: str, columns: str, units: str = "", *, number: int | None = None) -> None:
        """Declare a type of message. units: a character a column, `#` for the instance."""
        number = number or 0x80 + len(self._layouts)
        layout = struct.Struct("<" + "".join(self.FORMATS[field] for field in fields))
        self._layouts[name] = number, layout
        self.write("FMT", number, layout.size + 3, name.encode(), fields.encode(), columns.encode())
        if units:
            self.write("FMTU", 0, number, units.encode(), b"F" + b"-" * (len(units) - 1))

    def write(self, name: str, *values: object) -> None:
        """A message."""
        number, layout = self._layouts[name]
        self._file.write(struct.pack("<BBB", 0xA3, 0x95, number) + layout.pack(*values))

    def close(self) -> None:
        """End the file."""
        self._file.close()


def euler(quaternion: Sequence[float]) -> tuple[float, float, float]:
    """Roll, pitch and yaw [rad]."""
    w, x, y, z = quaternion
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    return roll, pitch, np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def dataflash(path: Path, times, commands, readings, *, boot: float = 17.25) -> None:
    """ArduSub's log: NED and FRD, degrees, pulses of 1100 to 1900 us, microseconds since boot."""
    log = DataFlash(path)
    log.format("IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "s#EEEooo")
    log.format("ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw", "sddd")
    log.format("XKF1", "QBffffff", "TimeUS,C,VN,VE,VD,PN,PE,PD", "s#nnnmmm")
    log.format("BARO", "QBff", "TimeUS,I,Alt,Press", "s#mP")
    log.format("RCOU", "Q" + "H" * 8, "TimeUS," + ",".join(f"C{n}" for n in range(1, 9)), "s" + "Y" * 8)
    for row, time in enumerate(times):
        at = round((boot + time) * 1e6)
        if row % COMMAND_EVERY == 0:
            log.write("RCOU", at, *np.round(1500 + 400 * commands[row]).astype(int))
        if row % IMU_EVERY == 0:
            x, y, z = readings["imu_gyro"][row]
            log.write("IMU", at, 0, x, -y, -z, 0.0, 0.0, -9.81)
        if row % ODOMETRY_EVERY == 0:
            roll, pitch, yaw = np.degrees(euler(readings["attitude"][row]))
            log.write("ATT", at, roll, -pitch, (90 - yaw) % 360)
            east, north, up = readings["position"][row]
            moving = readings["velocity"][row]
            log.write("XKF1", at, 0, moving[1], moving[0], -moving[2], north, east, -up)
        if row % PRESSURE_EVERY == 0:
            up = readings["position"][row, 2]
            log.write("BARO", at, 0, up, SURFACE - WEIGHT * up)
    log.close()
