"""The header of a recording: read quickly by the index, and the same where there is none."""

import math
import subprocess
import sys
from pathlib import Path

import pytest

from scissorcal.errors import InputError
from scissorcal.recording import (
    Joint,
    RecordingFacts,
    RecordingWriter,
    read_header,
    read_recording,
    write_recording,
)
from scissorcal.recording.scan import MAGIC
from tests.recording.made import made_recording, made_samples, written_live


def test_a_header_has_what_the_recording_has_but_the_samples(tmp_path: Path) -> None:
    path = write_recording(made_recording(3000), tmp_path / "r.mcap")
    header, whole = read_header(path), read_recording(path)
    assert (header.kind, header.joint, header.handle_radius_m) == ("cut", Joint("rotary"), 0.06)
    assert repr(header.strokes) == repr(whole.strokes)
    assert (header.recipe_toml, header.device) == (whole.recipe_toml, whole.device)
    assert header.notes == ("Two frames were garbled.",)
    assert header.sample_count == 3000
    assert header.duration_s == pytest.approx(whole.duration_s, abs=1e-3)
    assert header.finished


def test_it_is_read_without_numpy_pydantic_or_mcap(tmp_path: Path) -> None:
    path = write_recording(made_recording(100), tmp_path / "r.mcap")
    program = (
        "import sys\n"
        "from scissorcal.recording import read_header\n"
        f"assert read_header({str(path)!r}).sample_count == 100\n"
        "sys.exit(str({'numpy', 'pydantic', 'mcap', 'zstandard'} & set(sys.modules) or '') or 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_strokes_that_are_found_from_the_motion_are_not_in_it(tmp_path: Path) -> None:
    with RecordingWriter(
        tmp_path / "r.mcap", "cut", facts=RecordingFacts(min_travel=0.1)
    ) as writer:
        writer.append(made_samples(2000))
    header = read_header(tmp_path / "r.mcap")
    assert (header.strokes, header.min_travel) == ((), 0.1)
    assert math.isnan(header.handle_radius_m)


@pytest.mark.parametrize("kept", [0.5, 0.9, 0.999])
def test_a_file_that_was_cut_off_is_read_whole(kept: float, tmp_path: Path) -> None:
    data = written_live(tmp_path / "r.mcap", made_samples(2000)).read_bytes()
    path = tmp_path / "half.mcap"
    path.write_bytes(data[: int(kept * len(data))])
    header = read_header(path)
    assert not header.finished
    assert header.sample_count == len(read_recording(path).samples) > 0
    assert header.notes == ("The hand rested.",)


def test_damaged_metadata_falls_back_on_the_intact_copy(tmp_path: Path) -> None:
    path = write_recording(made_recording(100), tmp_path / "r.mcap")
    data = path.read_bytes()
    for place in (data.find(b"stands for micro"), data.rfind(b"stands for micro")):
        damaged = bytearray(data)
        damaged[place] ^= 1
        path.write_bytes(damaged)
        assert read_header(path).recipe_toml == made_recording(1).recipe_toml


@pytest.mark.parametrize("data", [b"", b"time,opening\n1,2\n", MAGIC, MAGIC + bytes(60) + MAGIC])
def test_what_is_no_recording_is_refused_as_when_it_is_read(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "odd.mcap"
    path.write_bytes(data)
    with pytest.raises(InputError) as refusal:
        read_recording(path)
    with pytest.raises(InputError) as same:
        read_header(path)
    assert str(same.value) == str(refusal.value)
    with pytest.raises(InputError, match="does not exist"):
        read_header(tmp_path / "none.mcap")
