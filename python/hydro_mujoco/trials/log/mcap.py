"""MCAP files: ROS 2 (CDR), JSON and, where its package is installed, Protobuf messages."""

import contextlib
import io
import json
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, cast

from ...extras import extra
from .base import Log, Samples, Topic
from .extract import Extractor, Lister
from .stream import Stream, refuse_empty

#: The last bytes of a whole file.
MAGIC = b"\x89MCAP0\r\n"


class McapLog(Log):
    """An MCAP file, read a chunk at a time; of one that is cut, what is before the cut."""

    kind = "MCAP file"

    def __init__(self, path: Path):
        refuse_empty(path)
        super().__init__(path)
        extra("mcap", "mcap", self.kind)
        with open(path, "rb") as file:
            file.seek(max(path.stat().st_size - len(MAGIC), 0))
            self.is_cut = file.read() != MAGIC
        self._decoders: dict[int, Callable[[bytes], object] | None] = {}

    def topics(self) -> dict[str, Topic]:
        if self.is_cut:
            lister = Lister()
            for schema, channel, message in self._messages(None):
                lister.add(channel.topic, _type(schema), message.log_time, self._decoded(schema, channel, message))
            return lister.topics()
        return self._indexed_topics()

    def read(self, wanted: Mapping[str, Sequence[str]]) -> dict[str, Samples]:
        extractor = Extractor(self, wanted)
        for schema, channel, message in self._messages(set(wanted)):
            extractor.add(channel.topic, message.log_time, self._decoded(schema, channel, message))
        return extractor.samples()

    def _indexed_topics(self) -> dict[str, Topic]:
        """Topics by the summary; one message of each is decoded."""
        from mcap.reader import make_reader

        try:
            with open(self.path, "rb") as file:
                summary = make_reader(file).get_summary()
        except _faults() as error:
            raise self.damaged(error) from error
        if summary is None or summary.statistics is None:
            lister = Lister()
            for schema, channel, message in self._messages(None):
                lister.add(channel.topic, _type(schema), message.log_time, self._decoded(schema, channel, message))
            return lister.topics()
        statistics = summary.statistics
        span = (statistics.message_end_time - statistics.message_start_time) * 1e-9
        lister = Lister()
        counts: dict[str, int] = {}
        for number, channel in summary.channels.items():
            counts[channel.topic] = counts.get(channel.topic, 0) + statistics.channel_message_counts.get(number, 0)
        for topic in counts:
            for schema, channel, message in self._messages({topic}):
                lister.add(topic, _type(schema), message.log_time, self._decoded(schema, channel, message))
                break
        found = lister.topics()
        return {name: Topic(name, topic.type, counts[name], topic.fields, span) for name, topic in found.items()}

    def _messages(self, topics: set[str] | None) -> Iterator[tuple[Any, Any, Any]]:
        """Schema, channel and message, by log time where the file has an index, else in its order."""
        from mcap.reader import NonSeekingReader, make_reader

        read, last = 0, None
        with Stream(self.path) as stream:
            file = cast(IO[bytes], stream)
            try:
                reader = make_reader(file)
                is_indexed = not self.is_cut and (summary := reader.get_summary()) and summary.chunk_indexes
                if not is_indexed:
                    stream.seek(0)
                    reader = NonSeekingReader(file)
                # Either way a few chunks are in memory at a time; the other two would keep all messages.
                for schema, channel, message in reader.iter_messages(topics, log_time_order=bool(is_indexed)):
                    read, last = read + 1, message.log_time
                    self.since_start(message.log_time)
                    yield schema, channel, message
            except _faults() as error:
                if not self.is_cut or not read:
                    raise self.damaged(error) from error
        if self.is_cut:
            self._say_cut(read, last)

    def _say_cut(self, read: int, last: int | None) -> None:
        size = self.path.stat().st_size
        until = f", up to {self.since_start(last):.3f} s" if last is not None else ""
        note = f"the file is cut off after {size} bytes (it has no end record): {read} messages were read{until}"
        if note not in self.faults:
            self.faults.append(note)

    def _decoded(self, schema: Any, channel: Any, message: Any) -> Callable[[], object]:
        """A call that decodes the message."""
        if channel.id not in self._decoders:
            self._decoders[channel.id] = self._decoder(schema, channel)
        decoder = self._decoders[channel.id]

        def decode() -> object:
            if decoder is None:
                raise ValueError("no decoder")
            try:
                return decoder(message.data)
            except _faults() as error:
                raise ValueError(str(error)) from error

        return decode

    def _decoder(self, schema: Any, channel: Any) -> Callable[[bytes], object] | None:
        if channel.message_encoding == "json":
            return json.loads
        for factory in _factories(channel.message_encoding, self.kind):
            try:
                # The package prints a line of a definition that it cannot parse, before it raises an error of its own.
                with contextlib.redirect_stdout(io.StringIO()):
                    decoder = factory.decoder_for(channel.message_encoding, schema)
            except Exception as error:
                said = " ".join(str(error).split())[:200]
                self.faults.append(f"topic `{channel.topic}`: its schema `{schema.name}` cannot be read ({said})")
                return None
            if decoder:
                return decoder
        encoding = schema.encoding if schema else "none"
        self.faults.append(
            f"topic `{channel.topic}`: messages in {channel.message_encoding} with a schema in {encoding} cannot "
            "be decoded"
        )
        return None


def _factories(encoding: str, what: str) -> Iterable[Any]:
    if encoding == "protobuf":
        return [extra("mcap_protobuf.decoder", "mcap", f"{what} of Protobuf messages").DecoderFactory()]
    return [extra("mcap_ros2.decoder", "mcap", what).DecoderFactory()]


def _type(schema: Any) -> str:
    return schema.name if schema else ""


def _faults() -> tuple[type[Exception], ...]:
    """What reading a damaged file raises."""
    from mcap.exceptions import McapError

    compression = [extra(name, "mcap", "MCAP file") for name in ("lz4.frame", "zstandard")]
    errors = (RuntimeError, compression[1].ZstdError)
    return (McapError, struct.error, ValueError, KeyError, IndexError, EOFError, OSError, *errors)
