"""Whatever happens to a file's bytes, complete chunks come back, and the place is named."""

import random
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.recording import Recording, read_attachments, read_recording
from tests.recording.made import made_samples, written_live

MESSAGE_BYTES = 9 + 22 + 4 + 80


@dataclass(frozen=True)
class Whole:
    """A finished file, and (from its own index) where each chunk ends and what it holds."""

    data: bytes
    samples: NDArray[np.void]
    chunk_starts: list[int]
    chunk_ends: list[int]
    chunk_counts: list[int]
    folder: Path

    def cut(self, size: int) -> Path:
        path = self.folder / "cut.mcap"
        path.write_bytes(self.data[:size])
        return path

    def with_bytes(self, at: int, new: bytes) -> Path:
        path = self.folder / "damaged.mcap"
        path.write_bytes(self.data[:at] + new + self.data[at + len(new) :])
        return path


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    folder = tmp_path_factory.mktemp("damage")
    samples = made_samples(2500)
    path = written_live(folder / "whole.mcap", samples)
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunks = sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)
    starts = [chunk.chunk_start_offset for chunk in chunks]
    counts = [chunk.uncompressed_size // MESSAGE_BYTES for chunk in chunks]
    # Only the first chunk holds more than messages: the schema and the channel.
    counts[0] = len(samples) - sum(counts[1:])
    ends = [chunk.chunk_start_offset + chunk.chunk_length for chunk in chunks]
    return Whole(path.read_bytes(), samples, starts, ends, counts, folder)


def read_or_refusal(path: Path) -> Recording | InputError:
    try:
        return read_recording(path)
    except InputError as error:
        return error


def check_cut(whole: Whole, size: int) -> int | None:
    """Cut a file and check what comes back; return the samples lost before the cut, if any."""
    path = whole.cut(size)
    complete = sum(
        n for n, end in zip(whole.chunk_counts, whole.chunk_ends, strict=True) if end <= size
    )
    found = read_or_refusal(path)
    if isinstance(found, InputError):
        assert complete == 0
        assert str(path) in str(found)
        return None
    assert len(found.samples) == complete
    np.testing.assert_array_equal(found.samples, whole.samples[:complete])
    if size < len(whole.data):
        assert any("not finished" in note for note in found.notes)
    started = sum(
        n for n, start in zip(whole.chunk_counts, whole.chunk_starts, strict=True) if start < size
    )
    return started - complete


def test_cuts_of_the_beginning(whole: Whole) -> None:
    for size in [*range(1, 60), *range(60, whole.chunk_ends[0] + 40, 29)]:
        check_cut(whole, size)


def test_cuts_anywhere_keep_all_complete_chunks(whole: Whole) -> None:
    rng = random.Random(3)
    sizes = {rng.randrange(1, len(whole.data)) for _ in range(100)}
    sizes |= {end + by for end in whole.chunk_ends for by in (-1, 0, 1)}
    lost = [check_cut(whole, size) for size in sorted(sizes)]
    # One chunk at most, which is an eighth of a second and a batch of 20 ms.
    assert max(n for n in lost if n is not None) <= 146


@given(share=st.floats(0, 1))
def test_any_cut(whole: Whole, share: float) -> None:
    check_cut(whole, max(1, round(share * len(whole.data))))


@given(at=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_a_flipped_bit_never_changes_a_sample(whole: Whole, at: float, bit: int) -> None:
    place = int(at * len(whole.data))
    path = whole.with_bytes(place, bytes([whole.data[place] ^ (1 << bit)]))
    found = read_or_refusal(path)
    if isinstance(found, InputError):
        assert place < 8, found
        return
    # What is kept is the original with at most the chunks around the flip taken out.
    kept = np.isin(whole.samples["sequence"], found.samples["sequence"])
    np.testing.assert_array_equal(found.samples, whole.samples[kept])
    assert np.count_nonzero(~kept) <= 2 * max(whole.chunk_counts)


def test_a_wrong_length_costs_no_chunk_but_its_own(whole: Whole) -> None:
    """A length that runs past the following chunks hides none of them."""
    heads = [8, *whole.chunk_starts[:2]]
    for place, bit in (
        (head + byte, bit) for head in heads for byte in range(1, 9) for bit in (0, 3, 7)
    ):
        path = whole.with_bytes(place, bytes([whole.data[place] ^ (1 << bit)]))
        found = read_recording(path)
        kept = np.isin(whole.samples["sequence"], found.samples["sequence"])
        np.testing.assert_array_equal(found.samples, whole.samples[kept])
        assert np.count_nonzero(~kept) <= max(whole.chunk_counts)


def test_a_damaged_chunk_is_left_out_with_its_place(whole: Whole) -> None:
    place = whole.chunk_starts[3] + 500
    found = read_recording(whole.with_bytes(place, b"\0\0\0\0"))
    before, lost = sum(whole.chunk_counts[:3]), whole.chunk_counts[3]
    expected = np.concatenate([whole.samples[:before], whole.samples[before + lost :]])
    np.testing.assert_array_equal(found.samples, expected)
    notes = " ".join(found.notes)
    assert f"bytes from {whole.chunk_starts[3]} on are damaged" in notes
    assert f"{lost} of {len(whole.samples)} samples cannot be read" in notes
    assert f"{lost} frames are missing in 1 gap" in notes


def test_damage_to_the_first_chunk_costs_only_that_chunk(whole: Whole) -> None:
    found = read_recording(whole.with_bytes(whole.chunk_starts[0] + 100, b"\xff" * 50))
    np.testing.assert_array_equal(found.samples, whole.samples[whole.chunk_counts[0] :])


def test_garbage_between_chunks_is_skipped(whole: Whole) -> None:
    start = whole.chunk_starts[2]
    found = read_recording(whole.with_bytes(start, b"\xee" * 30))
    assert len(found.samples) == len(whole.samples) - whole.chunk_counts[2]
    assert any(f"bytes from {start} to" in note for note in found.notes)


def test_a_chunk_with_a_false_size_is_not_unpacked(whole: Whole) -> None:
    bomb = zstandard.compress(bytes(200_000_000))
    head = struct.pack("<QQQI", 0, 0, 200_000_000, 0) + struct.pack("<I", 4) + b"zstd"
    body = head + struct.pack("<Q", len(bomb)) + bomb
    record = b"\x06" + struct.pack("<Q", len(body)) + body
    end = whole.chunk_ends[-1]
    path = whole.folder / "bomb.mcap"
    path.write_bytes(whole.data[:end] + record)
    found = read_recording(path)
    assert len(found.samples) == len(whole.samples)
    assert any("claims 200000000 bytes" in note for note in found.notes)


def test_a_damaged_attachment_is_named_and_left_out(whole: Whole) -> None:
    place = whole.data.index(bytes(range(256)) * 4)
    path = whole.with_bytes(place + 77, b"\0")
    assert read_attachments(path) == ()
    assert any("blade.jpg" in note for note in read_recording(path).notes)


def test_the_second_description_serves_when_the_first_is_damaged(whole: Whole) -> None:
    place = whole.data.index(b"rotary")
    found = read_recording(whole.with_bytes(place, b"ratary"))
    assert found.joint.kind == "rotary"
    assert len(found.samples) == len(whole.samples)
    assert any("the description" in note for note in found.notes)


def foreign_mcap(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE)
        writer.start()
        channel = writer.register_channel("/camera", "json", 0)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.mcap", b"", r"is empty \(0 bytes\).*Capture again"),
        ("a.mcap", b"\x89MC", "cut off within its first 8 bytes"),
        ("a.mcap", b"\x89PNG\r\n\x1a\n" + bytes(200), "a PNG image"),
        ("a.mcap", b"time,opening\n0,1\n", "is text, not a recording.*import"),
        ("a.mcap", b"PAR1" + bytes(100), "Parquet"),
        ("a.mcap", bytes(range(256)) * 9, "an unknown format"),
        ("a.mcap", b"\x89MCAP0\r\n" + bytes(range(200, 256)) * 9, "description is missing"),
        ("a.mcap", b"\x89MCAP0\r\n", "without a recording's description"),
    ],
)
def test_what_is_no_recording_is_refused_in_words(
    tmp_path: Path, name: str, data: bytes, words: str
) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InputError, match=words) as caught:
        read_recording(path)
    assert str(path) in str(caught.value)
    assert caught.value.exit_code == 2


def test_other_mcap_files_are_refused_by_their_topics(tmp_path: Path) -> None:
    foreign_mcap(tmp_path / "a.mcap")
    with pytest.raises(InputError, match=r"another program \(topics: /camera\).*import"):
        read_recording(tmp_path / "a.mcap")


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_recording(tmp_path / "a.mcap")
    with pytest.raises(InputError, match="cannot be read"):
        read_recording(tmp_path)


@given(data=st.binary(max_size=300))
def test_random_bytes_are_refused(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "random.mcap"
    for start in (b"", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n\x06"):
        path.write_bytes(start + data)
        with pytest.raises(InputError):
            read_recording(path)
