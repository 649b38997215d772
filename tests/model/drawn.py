"""Drawings as the page writes them, the pieces that Python makes of them, and golden vectors."""

import json
from typing import Any

import numpy as np
import pytest

from scissorcal.model.plate_pieces import Layer, Outline, Region, layer_pieces
from tests.model.golden_outlines import FILE


def pieces_of(given: dict[str, Any]) -> list[Any]:
    """What the recipe's rules make of a drawing (lengths in mm); ValueError where it is refused."""

    def outline(corners: Any) -> Outline:
        return Outline((1e-3 * np.array(corners, dtype=np.float64),))

    layers = [
        Layer(
            one["name"],
            one["thickness_mm"] * 1e-3,
            one["toughness_ratio"],
            outline(one["outline"]),
            tuple(outline(hole) for hole in one["holes"]),
            tuple(Region(outline(r["outline"]), r["toughness_ratio"]) for r in one["regions"]),
        )
        for one in given["layers"]
    ]
    return numbers(layer_pieces(layers, 1e-3 * given["cut_line_mm"]))


def numbers(pieces: Any) -> list[Any]:
    """Each piece in mm: begin, top, thickness, then ends and ratios of its strips."""
    return [
        [1e3 * piece.begin_m, 1e3 * piece.top_m, 1e3 * piece.thickness_m]
        + [value for strip in piece.strips for value in (1e3 * strip.end_m, strip.toughness_ratio)]
        for piece in pieces
    ]


def golden_cases() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8"))["cases"]
    return found


def golden_files() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8"))["files"]
    return found


def assert_pieces(found: list[Any] | None, case: dict[str, Any]) -> None:
    """Hold the pieces that were found, None for a refusal, to those of a golden case."""
    wanted = case["pieces"]
    assert (found is None) == (wanted is None), case["title"]
    if found is None:
        return
    assert [len(one) for one in found] == [len(one) for one in wanted]
    for one, other in zip(found, wanted, strict=True):
        assert one == pytest.approx(other, abs=case["tolerance_mm"])
