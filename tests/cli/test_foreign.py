"""Files of others that are no files, damaged or hostile: a sentence, exit 2 and one object."""

import json
import os
from pathlib import Path

import pytest

from tests.cli.conftest import Cli
from tests.foreign.test_reading import png

COMMANDS = {
    "pipe as a photograph": (["capture", "camera", "-i", "{}/a.jpg"], "pipe", "a.jpg"),
    "device as a recording": (["recording", "show", "{}/a.mcap"], "/dev/zero", "a.mcap"),
    "header of 60 million rows": (["capture", "camera", "-i", "{}/a.png"], png, "a.png"),
    "superscript as a column": (
        ["import", "{}/a.csv", "-c", "opening=²", "-c", "motor_torque=1", "--rate-hz", "100"],
        b"1,2\n2,3\n3,4\n",
        "a.csv",
    ),
    "camera that nests": (["import", "{}/a.yaml"], b"a: " + b"[" * 9000, "a.yaml"),
    "camera of 6,000 digits": (["import", "{}/a.yml"], b"width: " + b"9" * 6000, "a.yml"),
    "camera that expands": (["import", "{}/b.yml"], b"a: &a [x]\nb: [*a, *a]\n", "b.yml"),
    "damaged MATLAB file": (
        ["import", "{}/a.mat", "-c", "opening=q", "-c", "motor_torque=u", "--rate-hz", "100"],
        b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"\x0e\0\0\0\xff\xff\xff\x7f" * 9,
        "a.mat",
    ),
    "recipe of 6,000 digits": (
        ["init", "{}/new", "--recipe", "{}/a.toml"],
        b"a = " + b"9" * 6000,
        "a.toml",
    ),
    "no package": (["package", "check", "{}/a.zip"], b"PK\x03\x04" + bytes(100), "a.zip"),
    "fit of a fifo": (["report", "compare", "{}/a.nc", "{}/a.nc"], "pipe", "a.nc"),
    "report that nests": (["report", "compare", "{}/a.json", "{}/a.json"], b"[" * 9000, "a.json"),
}


@pytest.mark.parametrize("case", COMMANDS)
def test_a_foreign_file_ends_in_one_sentence_and_one_object(
    case: str, cli: Cli, workspace: Path, tmp_path: Path
) -> None:
    words, content, name = COMMANDS[case]
    path = tmp_path / name
    if content == "pipe":
        os.mkfifo(path)
    elif isinstance(content, str):
        path.symlink_to(content)
    else:
        path.write_bytes(content if isinstance(content, bytes) else content(1, 60_000_000))
    said = cli(*(word.format(tmp_path) for word in words), "--json")
    assert said.code in (2, 5), said.err
    found = json.loads(said.out)
    assert found["result"]["exit_code"] == said.code
    assert name in found["result"]["error"]
    assert "Unexpected failure" not in said.err


def test_many_logs_are_imported_and_the_bad_ones_named(workspace: Path, cli: Cli) -> None:
    logs = [workspace / f"run{number}.csv" for number in range(4)]
    for log in logs:
        rows = [f"{0.01 * i:.2f},{20 + 10 * (i % 200 > 100)},{i % 7}" for i in range(400)]
        log.write_text("t_s,angle_deg,force_g\n" + "\n".join(rows) + "\n", encoding="utf-8")
    logs[1].write_text("t_s,angle_deg,force_g\n1,2,3\n0,1,2\n", encoding="utf-8")
    columns = ("-c", "time=t_s", "-c", "opening=angle_deg", "-c", "handle_force=force_g")
    said = cli("import", *logs, *columns, "--json")
    assert said.code == 2
    assert "1 of 4 logs were not imported; the other 3 were" in said.err
    assert "run1.csv, line 3" in said.err
    assert len(said.envelope["files"]) == 3
    assert len(list((workspace / "captures").glob("friction-*.mcap"))) == 3
    said = cli("import", logs[0], logs[2], *columns)
    assert said.code == 0
    assert "2 logs imported" in said.out
