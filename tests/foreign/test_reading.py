"""What is no file, too large, or hostile is refused at once, with a sentence, before it is read."""

import os
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scissorcal.calibration import VerifyResult, load
from scissorcal.control import read_path
from scissorcal.errors import InputError
from scissorcal.foreign import Format, open_foreign, parse_json, read_foreign, reading
from scissorcal.package import open_package
from scissorcal.recipe import load_recipe, parse_recipe, probed_surface, read_drawing
from scissorcal.recording import import_table, read_header, read_recording, run_end
from scissorcal.vision import frames_of, read_camera_file, read_photo, read_rig_positions
from tests.recording.logs import COLUMNS
from tests.recording.made import made_samples, written_live

KIND = Format("a test", 1000, "Write it again.")
READERS: dict[str, Callable[[Path], Any]] = {
    "a.mcap": read_recording,
    "header.mcap": read_header,
    "a.csv": lambda path: import_table(path, columns=COLUMNS),
    "a.mat": lambda path: import_table(path, columns=COLUMNS),
    "a.parquet": lambda path: import_table(path, columns=COLUMNS),
    "a.jpg": read_photo,
    "a.yml": read_camera_file,
    "a.zip": open_package,
    "a.toml": load_recipe,
    "path.csv": read_path,
    "positions.csv": read_rig_positions,
    "plate.svg": read_drawing,
    "heights.csv": lambda path: probed_surface(path, 0.02),
    "cut.verify.json": lambda path: load(path, VerifyResult),
    "a.mp4": lambda path: next(frames_of(str(path))),
}


def refused(read: Callable[[Path], Any], path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", READERS)
def test_no_reader_waits_for_a_pipe_or_reads_a_device_or_a_folder(
    name: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    os.mkfifo(path)
    assert "a named pipe" in refused(READERS[name], path)
    path.unlink()
    path.symlink_to("/dev/zero")
    assert "a device" in refused(READERS[name], path)
    path.unlink()
    path.mkdir()
    assert "a folder" in refused(READERS[name], path)


def test_a_file_that_is_too_large_missing_or_of_an_impossible_name(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(bytes(1001))
    assert "more than 0.001 MB" in refused(lambda file: read_foreign(file, KIND), path)
    path.write_bytes(bytes(1000))
    assert len(read_foreign(path, KIND)) == 1000
    assert "does not exist" in refused(lambda file: read_foreign(file, KIND), tmp_path / "none")
    with pytest.raises(InputError, match="cannot be the name"):
        read_foreign(Path("a\0b"), KIND)


def test_a_pipe_that_takes_the_place_of_a_file_is_refused_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"a")
    regular = path.stat()
    path.unlink()
    os.mkfifo(path)
    monkeypatch.setattr(Path, "stat", lambda _: regular)
    with pytest.raises(InputError, match="named pipe"), open_foreign(path, KIND):
        pass


@pytest.mark.parametrize(
    "error", [AttributeError("x"), RecursionError(), MemoryError(), KeyError()]
)
def test_whatever_a_parser_raises_is_one_sentence(error: Exception) -> None:
    words = r"^a\.bin .*Write it again\.$"
    with pytest.raises(InputError, match=words) as caught, reading("a.bin", KIND):
        raise error
    assert caught.value.__cause__ is error
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a":' * 5000, "9" * 5000, "[1", b"\xff", "1 2"])
def test_json_that_is_none_is_one_sentence(text: str | bytes) -> None:
    with pytest.raises(InputError, match=r"^a\.json .*Write it again\.$"):
        parse_json(text, "a.json", "Write it again.")


def test_toml_with_numbers_of_thousands_of_digits(tmp_path: Path) -> None:
    for value in ("9" * 6000, "9" * 400, "[" * 5000, "1e999999999"):
        with pytest.raises(InputError, match=r"^recipe\.toml"):
            parse_recipe(f"[material]\nthickness_mm = {value}\n", "recipe.toml")


def test_a_recipe_of_long_lines_is_refused_in_bounded_work() -> None:
    text = f'a = "{"x" * 900_000}"\n' + "b = 1\n" * 2000
    with pytest.raises(InputError, match=r"^recipe\.toml, line 3"):
        parse_recipe(text, "recipe.toml")


def png(width: int, height: int) -> bytes:
    def chunk(name: bytes, body: bytes) -> bytes:
        return (
            struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        )

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(1, 60_000_000), (60_000_000, 1), (70_000, 5), (30_000, 30_000)])
def test_a_header_of_millions_of_pixels_is_refused_before_memory_is_taken(
    size: tuple[int, int], tmp_path: Path
) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(png(*size))
    program = (
        "import resource, sys\n"
        "from pathlib import Path\n"
        "from scissorcal.errors import InputError\n"
        "from scissorcal.foreign.isolated import close_children\n"
        "from scissorcal.vision.photo import read_photo\n"
        "try:\n    read_photo(Path(sys.argv[1]))\n"
        "except InputError as error:\n    print(error)\n"
        "close_children()\n"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)\n"
    )
    command = [sys.executable, "-c", program, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    said, kilobytes = done.stdout.splitlines()
    assert "pixels" in said
    assert int(kilobytes) < 150_000


def chunked(path: Path, plain: bytes) -> Path:
    """A recording with one chunk of these bytes before its first."""
    import zstandard

    data = written_live(path, made_samples(50)).read_bytes()
    packed = zstandard.compress(plain)
    body = struct.pack("<QQQII4sQ", 0, 0, len(plain), zlib.crc32(plain), 4, b"zstd", len(packed))
    body += packed
    head = struct.unpack_from("<BQ", data, 8)[1] + 17
    path.write_bytes(data[:head] + struct.pack("<BQ", 6, len(body)) + body + data[head:])
    return path


def test_a_run_of_messages_is_compared_in_proportion_to_its_length(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Messages of two channels in turn: what is compared grows with the bytes, not their square."""
    import numpy as np

    from scissorcal.recording import MESSAGE_DTYPE, chunks

    looked = 0

    class Counting:
        uint8 = np.uint8
        argmin = staticmethod(np.argmin)

        @staticmethod
        def frombuffer(data: bytes, dtype: Any, count: int, at: int) -> Any:
            nonlocal looked
            looked += count
            return np.frombuffer(data, dtype, count, at)

    monkeypatch.setattr(chunks, "np", Counting)
    counted = []
    for pairs in (1000, 4000):
        messages = np.zeros(3 * pairs, MESSAGE_DTYPE)
        messages["opcode"], messages["length"] = 5, MESSAGE_DTYPE.itemsize - 9
        messages["channel"] = np.arange(3 * pairs) % 3 // 2 + 1
        looked = 0
        read_recording(chunked(tmp_path / f"{pairs}.mcap", messages.tobytes()))
        counted.append(looked)
        (tmp_path / f"{pairs}.mcap").unlink()
    assert counted[1] < 5 * counted[0]
    assert run_end(messages.tobytes(), 0, MESSAGE_DTYPE.itemsize) == 2 * MESSAGE_DTYPE.itemsize


def test_a_chunk_that_unpacks_to_much_more_than_its_file_is_left_out(tmp_path: Path) -> None:
    path = chunked(tmp_path / "a.mcap", bytes(30_000_000))
    recording = read_recording(path)
    assert len(recording.samples) == 50
    assert any("claims 30000000 bytes" in note for note in recording.notes)


def test_many_damaged_places_are_counted_not_listed(tmp_path: Path) -> None:
    data = written_live(tmp_path / "a.mcap", made_samples(50)).read_bytes()
    broken = struct.pack("<BQ", 0x0D, 3) + b"abc"
    attachment = struct.pack("<BQ", 0x09, 3) + b"abc"
    head = struct.unpack_from("<BQ", data, 8)[1] + 17
    path = tmp_path / "b.mcap"
    path.write_bytes(data[:head] + (broken + attachment) * 3000 + data[head:])
    notes = read_recording(path).notes
    assert len(notes) < 40
    assert any("further places are damaged" in note for note in notes)


def test_no_column_is_named_by_a_superscript(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("1,2,3\n2,3,4\n")
    for column in ("²", "9" * 5000, "-1"):
        with pytest.raises(InputError, match="has no column"):
            import_table(path, columns={"opening": column, "motor_torque": "1"}, rate_Hz=100.0)


def test_a_log_with_a_cell_of_a_megabyte(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text('t,angle,torque\n0,"' + "1" * 1_000_000 + '",2\n1,2,3\n')
    assert "a.csv" in refused(lambda file: import_table(file, columns=COLUMNS), path)
