"""The recording's description: its schema, its spelling in the file, and what is refused."""

import json
import math
import re
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from scissorcal.errors import InputError
from scissorcal.recipe import schemas_dir
from scissorcal.recording import (
    SAMPLE_DTYPE,
    Stroke,
    read_recording,
    recording_schema,
    write_recording,
)
from scissorcal.recording import schema as description
from scissorcal.recording.schema import RecordingMetadata, from_entries, stroke_records, to_entries
from tests.recording.made import made_recording

TEXT = ("format", "kind", "joint", "recipe_toml", "recovered_from")


def stored() -> dict[str, Any]:
    schema: dict[str, Any] = json.loads(
        (schemas_dir() / "recording.schema.json").read_text(encoding="utf-8")
    )
    return schema


def test_the_stored_schema_is_the_code_s() -> None:
    assert stored() == recording_schema()
    jsonschema.Draft202012Validator.check_schema(stored())


def test_the_page_on_recordings_has_the_layout_of_a_sample() -> None:
    page = schemas_dir().parent / "docs" / "recordings.md"
    if not page.is_file():
        pytest.skip("the documentation is not installed")
    stated = re.search(
        r"SAMPLE = (np\.dtype\(.*?\]\))", page.read_text(encoding="utf-8"), re.DOTALL
    )
    assert stated is not None
    fields = re.findall(r'\("(\w+)", "(<\w\d)"\)', stated[1])
    assert np.dtype(fields) == SAMPLE_DTYPE


def test_the_metadata_of_a_file_follows_the_schema(tmp_path: Path) -> None:
    path = write_recording(made_recording(50), tmp_path / "a.mcap")
    with path.open("rb") as stream:
        found = [record.metadata for record in make_reader(stream).iter_metadata()]
    described = [entries for entries in found if "format" in entries]
    assert len(described) == 2  # at the beginning and at the end
    assert described[0] == described[1]
    document = {
        key: value if key in TEXT else json.loads(value)
        for key, value in described[0].items()
        if key != "crc32"
    }
    jsonschema.validate(document, stored())
    assert document["strokes"][1]["speed"] is None
    document["colour"] = "red"
    with pytest.raises(jsonschema.ValidationError, match="colour"):
        jsonschema.validate(document, stored())


@given(
    recipe=st.text(),
    device=st.dictionaries(st.text(), st.none() | st.integers() | st.text() | st.floats()),
    radius=st.none() | st.floats(1e-3, 1.0),
    speed=st.floats(0, 10) | st.just(math.nan),
)
def test_any_description_comes_back(
    recipe: str, device: dict[str, Any], radius: float | None, speed: float
) -> None:
    device = {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in device.items()
    }
    metadata = RecordingMetadata(
        kind="friction",
        handle_radius_m=radius,
        strokes=stroke_records((Stroke(0, "press", speed),)),
        recipe_toml=recipe,
        device=device,
    )
    found = from_entries(to_entries(metadata))
    assert found == metadata
    assert repr(found.strokes_of_recording[0].speed) == repr(speed)


def test_numbers_that_json_lacks_become_null() -> None:
    metadata = RecordingMetadata(kind="friction", device={"limit": math.inf, "worst": [math.nan]})
    assert from_entries(to_entries(metadata)).device == {"limit": None, "worst": [None]}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "scissorcal-recording/9"}, "use the version of scissorcal that wrote it"),
        ({"format": ""}, "use the version"),
        ({"joint": "ball"}, "not valid"),
        ({"strokes": "[{"}, "not valid"),
        ({"strokes": '[{"index": 0, "kind": "dancing"}]'}, "not valid"),
        ({"handle_radius_m": "NaN"}, "not valid"),
        ({"colour": '"red"'}, "not valid"),
    ],
)
def test_other_descriptions_are_refused(change: dict[str, str], words: str) -> None:
    entries = {**to_entries(RecordingMetadata(kind="cut")), **change}
    with pytest.raises(ValueError, match="checksum"):
        from_entries(entries)
    del entries["crc32"]
    with pytest.raises(ValueError, match=words):
        from_entries({**entries, "crc32": description.checksum(entries)})


def test_a_recording_of_a_later_format_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spell = description.to_entries

    def later(metadata: RecordingMetadata) -> dict[str, str]:
        entries = {**spell(metadata), "format": "scissorcal-recording/2"}
        del entries["crc32"]
        return {**entries, "crc32": description.checksum(entries)}

    monkeypatch.setattr("scissorcal.recording.samplefile.to_entries", later)
    path = write_recording(made_recording(50), tmp_path / "a.mcap")
    with pytest.raises(InputError, match=r"scissorcal-recording/2.*use the version"):
        read_recording(path)
