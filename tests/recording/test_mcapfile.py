"""The file is, byte for byte, what the MCAP library writes message by message."""

import io
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from scissorcal.recording import layout
from scissorcal.recording.mcapfile import McapFile
from tests.recording.made import made_samples

STEPS = st.lists(
    st.integers(0, 300) | st.sampled_from(["flush", "metadata", "attachment"]), max_size=12
)


def by_the_library(steps: list[Any], chunk_bytes: int) -> bytes:
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=chunk_bytes, compression=CompressionType.ZSTD)
    writer.start(profile=layout.PROFILE, library="us")
    schema = writer.register_schema("s", "ros2msg", b"float64 x")
    channel = writer.register_channel(layout.TOPIC, "cdr", schema, {"unit": "rad"})
    samples = made_samples(12 * 300)
    at = 0
    for step in steps:
        if step == "flush":
            writer.flush()
        elif step == "metadata":
            writer.flush()
            writer.add_metadata("note", {"note": "a sentence"})
        elif step == "attachment":
            writer.flush()
            writer.add_attachment(0, 7, "a.png", "image/png", b"\x89PNG")
        else:
            for sample in samples[at : at + step]:
                time = int(sample["host_time_ns"])
                data = layout.CDR_HEADER + sample.tobytes()
                writer.add_message(channel, time, data, time, int(sample["sequence"]))
            at += step
    writer.finish()
    return stream.getvalue()


def by_blocks(steps: list[Any], chunk_bytes: int) -> bytes:
    stream = io.BytesIO()
    file = McapFile(stream, "us", chunk_bytes)
    file.begin_channel("s", "ros2msg", b"float64 x", {"unit": "rad"})
    samples = made_samples(12 * 300)
    at = 0
    for step in steps:
        if step == "flush":
            file.flush()
        elif step == "metadata":
            file.flush()
            file.add_metadata("note", {"note": "a sentence"})
        elif step == "attachment":
            file.flush()
            file.attach(7, "a.png", "image/png", b"\x89PNG")
        else:
            file.add_samples(samples[at : at + step])
            at += step
    file.finish()
    return stream.getvalue()


@settings(max_examples=50)
@given(steps=STEPS, chunk_bytes=st.sampled_from([200, 1024, 5000, 65536]))
def test_the_bytes_are_the_librarys(steps: list[Any], chunk_bytes: int) -> None:
    assert by_blocks(steps, chunk_bytes) == by_the_library(steps, chunk_bytes)


def test_a_time_before_1970_counts_as_its_beginning() -> None:
    stream = io.BytesIO()
    file = McapFile(stream, "us", 1000)
    file.begin_channel("s", "ros2msg", b"", {})
    samples = made_samples(3)
    samples["host_time_ns"] = [-5, 10, 20]
    file.add_samples(samples)
    file.finish()
    from mcap.reader import make_reader

    stream.seek(0)
    times = [message.log_time for *_, message in make_reader(stream).iter_messages()]
    assert times == [0, 10, 20]
