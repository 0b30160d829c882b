"""ULog files for the tests: formats, subscriptions, messages (PX4 user guide, "ULog File Format")."""

import struct
from pathlib import Path

TYPES = {"uint64_t": "Q", "double": "d", "float": "f", "uint8_t": "B"}


class Ulog:
    """A log that is written message by message. formats: name -> [(type, field)], the timestamp first."""

    def __init__(self, path: Path, formats: dict[str, list[tuple[str, str]]]):
        self._file = open(path, "wb")  # noqa: SIM115
        self._file.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))
        self._record("B", bytes(40))
        self._layouts, self._numbers = {}, {}
        for name, fields in formats.items():
            text = "".join(f"{kind} {field};" for kind, field in fields)
            self._record("F", f"{name}:{text}".encode())
            codes = ""
            for kind, _ in fields:
                base, _, size = kind.partition("[")
                codes += (size.rstrip("]") or "1") + TYPES[base]
            self._layouts[name] = struct.Struct("<" + codes)

    def subscribe(self, name: str, instance: int = 0) -> None:
        number = len(self._numbers)
        self._numbers[name, instance] = number
        self._record("A", struct.pack("<BH", instance, number) + name.encode())

    def write(self, name: str, *values, instance: int = 0) -> None:
        self._record("D", struct.pack("<H", self._numbers[name, instance]) + self._layouts[name].pack(*values))

    def close(self) -> None:
        self._file.close()

    def _record(self, kind: str, content: bytes) -> None:
        self._file.write(struct.pack("<HB", len(content), ord(kind)) + content)
