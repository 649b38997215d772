"""A parser in a child process: its answer, and every way in which it dies as one sentence."""

import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal.errors import InputError, ScissorcalError
from scissorcal.foreign import Format, isolated, parse_isolated
from scissorcal.foreign.isolated import MOST_HELD_BYTES
from tests.guard import GUARD_S

KIND = Format("a test", 10_000, "Write it again.", memory_bytes=600_000_000, processor_s=20)
HERE = "tests.foreign.parsers"


def refusal(name: str, kind: Format = KIND) -> str:
    with pytest.raises(InputError) as caught:
        parse_isolated(f"{HERE}:{name}", b"abc", "a.bin", kind)
    return str(caught.value)


def test_numbers_text_and_lists_come_back() -> None:
    found = parse_isolated(f"{HERE}:good", b"\x01\x02", "a.bin", KIND, factor=3)
    np.testing.assert_array_equal(found["numbers"], [3.0, 6.0])
    assert found["numbers"].flags.writeable
    assert (found["text"], found["flags"]) == ("µ", [True, None, 1.5])
    assert found["pid"] != os.getpid()


def test_one_child_serves_many_files() -> None:
    pids = {parse_isolated(f"{HERE}:good", b"a", "a.bin", KIND)["pid"] for _ in range(20)}
    assert len(pids) == 1


def test_a_child_that_ended_while_it_waited_is_replaced() -> None:
    first = parse_isolated(f"{HERE}:good", b"a", "a.bin", KIND)["pid"]
    os.kill(first, signal.SIGKILL)
    os.waitid(os.P_PID, first, os.WEXITED | os.WNOWAIT)
    assert parse_isolated(f"{HERE}:good", b"a", "a.bin", KIND)["pid"] != first


def test_threads_have_children_of_their_own() -> None:
    pids: list[int] = []

    def read() -> None:
        found = (parse_isolated(f"{HERE}:good", b"a" * 5000, "a.bin", KIND) for _ in range(5))
        pids.extend(one["pid"] for one in found)

    threads = [threading.Thread(target=read) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(pids) == 15
    assert len(set(pids)) <= 3


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("crash", "is damaged: its parser crashed (SIGSEGV)"),
        ("abort", "is damaged: its parser crashed (SIGABRT)"),
        ("leave", "is damaged: its parser crashed (exit code 7)"),
        ("grow", "is damaged: it takes more than 0.6 GB of memory"),
        ("fail", "or it is damaged (AttributeError: no such thing)"),
        ("nothing_plain", "or it is damaged (TypeError: set is no plain value)"),
        ("not_there", "or it is damaged (AttributeError"),
        ("write_a_file", "No usable temporary directory"),
    ],
)
def test_what_goes_wrong_is_a_sentence_and_the_next_file_is_read(name: str, words: str) -> None:
    said = refusal(name)
    assert said.startswith("a.bin ")
    assert words in said
    assert said.endswith("Write it again.")
    assert parse_isolated(f"{HERE}:good", b"\x05", "b.bin", KIND)["numbers"] == [5.0]


def test_an_input_error_of_a_parser_is_passed_on_as_it_is() -> None:
    assert refusal("refuse") == "a.bin has the wrong colour."


def test_limits_of_time_and_of_an_answers_size() -> None:
    assert "within 0.5 s" in refusal("wait", replace(KIND, wall_s=0.5))
    assert "more than 1 s of processor time" in refusal("spin", replace(KIND, processor_s=1))
    said = refusal("large", replace(KIND, memory_bytes=10**8))
    assert "unpacks to more than 0.1 GB" in said or "more than 0.1 GB of memory" in said


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells what a process holds")
def test_what_an_earlier_parser_keeps_is_not_the_next_files() -> None:
    more = replace(KIND, memory_bytes=2_000_000_000)
    kept = parse_isolated(f"{HERE}:keep", b"a", "a.bin", more, size=1_500_000_000)
    size = 300_000_000
    assert parse_isolated(f"{HERE}:need", b"a", "b.bin", KIND, size=size) == size
    assert "more than 0.6 GB of memory" in refusal("grow")
    assert parse_isolated(f"{HERE}:good", b"a", "a.bin", KIND)["pid"] == kept


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells what a process holds")
def test_a_child_that_keeps_too_much_is_replaced() -> None:
    more = replace(KIND, memory_bytes=6_000_000_000)
    kept = parse_isolated(f"{HERE}:keep", b"a", "a.bin", more, size=MOST_HELD_BYTES)
    assert parse_isolated(f"{HERE}:good", b"a", "a.bin", KIND)["pid"] != kept


def test_words_of_a_library_do_not_mix_with_the_answer(capfd: pytest.CaptureFixture[str]) -> None:
    assert parse_isolated(f"{HERE}:talk", b"", "a.bin", KIND) == "said"
    assert capfd.readouterr() == ("", "")


FINDS_TESTS = {
    **os.environ,
    "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, sys.path)]),
}
"""A child is given the folders that modules come from, but never the current one."""


def test_a_fork_starts_a_child_of_its_own() -> None:
    program = (
        "import os\n"
        "from tests.foreign.test_isolated import HERE, KIND\n"
        "from scissorcal.foreign import parse_isolated\n"
        "ask = lambda: parse_isolated(f'{HERE}:good', b'a', 'a.bin', KIND)['pid']\n"
        "first = ask()\n"
        "forked = os.fork()\n"
        "if not forked:\n"
        "    os._exit(0 if ask() != first else 1)\n"
        "assert os.waitpid(forked, 0)[1] == 0\n"
        "assert ask() == first\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, env=FINDS_TESTS)


def test_a_child_ends_with_its_parent() -> None:
    program = (
        "import os\n"
        "from tests.foreign.test_isolated import HERE, KIND\n"
        "from scissorcal.foreign import parse_isolated\n"
        "print(parse_isolated(f'{HERE}:good', b'a', 'a.bin', KIND)['pid'], flush=True)\n"
        "os.kill(os.getpid(), 9)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=FINDS_TESTS
    )
    pid = int(done.stdout)
    until = time.monotonic() + GUARD_S
    while _runs(pid):
        assert time.monotonic() < until, "the child still runs"
        time.sleep(0.02)


def _runs(pid: int) -> bool:
    try:
        return "State:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


def test_where_no_process_can_be_started_it_is_not_the_files_fault(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    isolated.close_children()
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none"))
    with pytest.raises(ScissorcalError, match="cannot be started") as caught:
        parse_isolated(f"{HERE}:good", b"a", "a.bin", KIND)
    assert not isinstance(caught.value, InputError)
