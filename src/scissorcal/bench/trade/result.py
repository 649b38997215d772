"""What a run of `bench trade` ends in, as its JSON twin holds it."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

from pydantic import TypeAdapter, ValidationError

from scissorcal.bench.trade.point import Curve, Spread
from scissorcal.errors import InputError, MissingError
from scissorcal.foreign import read_json
from scissorcal.foreign.formats import STATE

TradeFormat = Literal["scissorcal-trade/1"]
FORMAT: TradeFormat = "scissorcal-trade/1"


@dataclass(frozen=True)
class Trade:
    """All knobs of one scene as they were measured.

    ``tolerance`` is the scene's and ``limit`` the part of it that one knob may use, both as shares
    of the scene's largest torque. ``baseline`` is the step that times are compared with.
    ``measured_now`` of ``measured`` samples were made by the run that wrote this, the others by
    earlier runs on the same inputs and machine. ``together`` compares the present settings with all
    recommended ones at once; None where one knob alone was asked for, where nothing was recommended
    that changes this measurement, and where the budget left no present fits to compare with.
    """

    format: TradeFormat
    created: datetime
    scissorcal_version: str
    recipe_name: str
    material: str
    simulated: bool
    machine: str
    workers: int
    seconds: float
    budget_s: float | None
    tolerance: float
    limit: float
    baseline: Spread
    measured: int
    measured_now: int
    curves: tuple[Curve, ...]
    together: Curve | None
    sentences: tuple[str, ...]
    notes: tuple[str, ...] = ()


def read_trade(path: Path) -> Trade:
    """Read a JSON twin back.

    Raises MissingError where there is none, InputError where it is of another version or damaged.
    """
    if not path.is_file():
        raise MissingError(f"There is no {path} yet: run 'scissorcal bench trade' first.")
    try:
        plain = read_json(path, STATE)
        stated = plain["format"]
    except (InputError, KeyError, TypeError):
        raise InputError(
            f"{path} holds no results of 'bench trade': remove it and run 'scissorcal bench trade'."
        ) from None
    if stated != FORMAT:
        raise InputError(
            f"{path} is of format {stated}, and this version reads {FORMAT}: run 'scissorcal bench "
            "trade', which writes it anew."
        )
    try:
        return TypeAdapter(Trade).validate_python(plain)
    except ValidationError as error:
        where = ".".join(str(part) for part in error.errors()[0]["loc"])
        raise InputError(
            f"{path} is damaged at {where}: run 'scissorcal bench trade', which writes it anew."
        ) from None
