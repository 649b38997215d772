"""Mutants of every format: a right value or a sentence, never a crash, a hang, a fault.

`python -m tests.foreign.mutate --count 2000` reads more of them and prints a table; `--commands`
reads them through whole commands.
"""

from collections.abc import Iterator

import pytest

from tests.foreign.commands import COMMANDS
from tests.foreign.mutate import Reader, run
from tests.foreign.mutations import mutate
from tests.foreign.samples import SAMPLES


def test_mutants_follow_from_their_numbers() -> None:
    data = bytes(range(256)) * 20
    assert [mutate(data, str(i)) for i in range(50)] == [mutate(data, str(i)) for i in range(50)]
    assert sum(mutate(data, str(i)) != data for i in range(50)) > 40


@pytest.fixture(scope="module")
def reader() -> Iterator[Reader]:
    with Reader() as opened:
        yield opened


@pytest.mark.parametrize("name", SAMPLES)
def test_some_mutants_of_a_format(name: str, reader: Reader) -> None:
    tally = run(reader, name, 6)
    assert tally.count == 6
    assert not tally.faults, "\n".join(tally.faults[:5])


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLES)
def test_many_mutants_of_a_format(name: str, reader: Reader) -> None:
    tally = run(reader, name, 150)
    assert tally.count == 150
    assert not tally.faults, "\n".join(tally.faults[:5])


@pytest.fixture(scope="module")
def commands() -> Iterator[Reader]:
    with Reader(by_commands=True) as opened:
        yield opened


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_mutants_through_whole_commands(name: str, commands: Reader) -> None:
    tally = run(commands, name, 40)
    assert tally.count == 40
    assert not tally.faults, "\n".join(tally.faults[:5])
