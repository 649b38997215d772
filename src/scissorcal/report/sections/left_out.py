"""What this report does not cover: not needed by the scene, not chosen, or not there yet."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from scissorcal.calibration.result import FitResult
from scissorcal.recipe.requirements import requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.report.numbers import percent, short
from scissorcal.report.sections.rungs import RungRow, compare_rungs

SAME_WITHIN = 1e-3

PHOTOGRAPHED = ("blade photographs", "plate pose")
"""What photographs would give, as requirements name it where a scene does without."""

Reason = Literal["not needed", "not chosen", "not there yet"]


@dataclass(frozen=True)
class LeftOut:
    """One thing left out, why, and what that costs or how to have it."""

    what: str
    reason: Reason
    why: str


def list_left_out(
    recipe: Recipe, fits: Sequence[FitResult], geometry: Sequence[tuple[str, str]] = ()
) -> tuple[LeftOut, ...]:
    """What the scene does not name, what is missing, and the rungs that were passed over.

    ``geometry`` names fits of photographs that are missing, and says how to have them.
    """
    return (
        *(LeftOut(f"{what} fit", "not there yet", why) for what, why in geometry),
        *_missing(recipe, fits),
        *_not_needed(recipe),
        *_not_chosen(fits),
    )


def _missing(recipe: Recipe, fits: Sequence[FitResult]) -> Iterable[LeftOut]:
    have = {fit.what for fit in fits}
    if "friction" not in have:
        yield LeftOut(
            "friction fit",
            "not there yet",
            "Run `scissorcal capture friction`, then `scissorcal fit friction`.",
        )
    if "cut" not in have:
        what = "cut fit" if recipe.scene.cut else "press fit"
        yield LeftOut(
            what, "not there yet", "Run `scissorcal capture cut`, then `scissorcal fit cut`."
        )


def _not_needed(recipe: Recipe) -> Iterable[LeftOut]:
    scene = recipe.scene
    if not scene.cut:
        yield LeftOut(
            "toughness and fracture", "not needed", "Nothing is cut in this scene (`cut = false`)."
        )
    if not scene.render_friction:
        yield LeftOut(
            "friction in what is rendered",
            "not needed",
            "The scene says `render_friction = false`.",
        )
    needs = requirements(recipe)
    for item in needs.left_out:
        if item.name in PHOTOGRAPHED:
            yield LeftOut(item.name, "not needed", f"The recipe says `{item.why}`.")
    for target, words in (
        ("torque", "torque at the pivot"),
        ("handle_force", "force at the handle"),
        ("translation_force", "force along the cut"),
    ):
        if target not in scene.render:
            yield LeftOut(
                words, "not needed", f"The scene's `render` list does not name `{target}`."
            )


def _not_chosen(fits: Sequence[FitResult]) -> Iterable[LeftOut]:
    for fit in fits:
        rows = compare_rungs(fit)
        chosen = next((row for row in rows if row.chosen), None)
        for row in rows:
            if not row.chosen:
                yield LeftOut(f"{fit.what}: {row.name}", "not chosen", _cost(row, chosen))


def _cost(row: RungRow, chosen: RungRow | None) -> str:
    words = []
    if chosen and row.bic is not None and chosen.bic is not None:
        change = row.bic - chosen.bic
        words.append(f"its BIC is {short(abs(change))} {'above' if change >= 0 else 'below'}")
    if chosen and row.held_out_rms is not None and chosen.held_out_rms:
        change = row.held_out_rms / chosen.held_out_rms - 1.0
        words.append(f"its held-out error is {_compared(change)}")
    if not words or chosen is None:
        return "It was compared, but without figures."
    better = row.held_out_rms is not None and row.held_out_rms < (chosen.held_out_rms or 0.0)
    reason = " That gain is too small to feel, or not steady over strokes." if better else ""
    if row.equivalent:
        reason = " These data cannot tell it from the best rung; the cheapest of those is used."
    return f"Against {chosen.name}, {' and '.join(words)}.{reason}"


def _compared(change: float) -> str:
    if abs(change) < SAME_WITHIN:
        return "the same"
    return f"{percent(abs(change))} {'larger' if change > 0 else 'smaller'}"
