"""The scissors: angles and lengths as scissorcal.model computes them."""

from collections.abc import Callable

import numpy as np
from benchmarks.drawings.canvas import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    SHEET,
    SHEET_CUT,
    STEEL,
    Drawing,
    Point,
)

from scissorcal.model import Edge, edge_height

OPENING = float(np.radians(30.0))
THICKNESS_M = 0.012
DEPTH_M = 0.0028
SHEET_FROM_M = 0.012
EDGE = Edge("line", offset_m=-0.008, taper_rad=float(np.radians(2.0)), length_m=0.075)
HANDLE_M = 0.060


def contact_of(edge: Edge, opening: float, height: float) -> float:
    """Return the contact at which the edge stands ``height`` (m) over the x axis."""
    low, high = 0.0, edge.length_m
    for _ in range(60):
        middle = 0.5 * (low + high)
        if float(edge_height(edge, middle, opening / 2).height) < height:
            low = middle
        else:
            high = middle
    return low


def geometry() -> Drawing:
    """Scissors with opening, edge slope, indentation, contact and handle radius."""
    drawing = Drawing(1100, 690, "Geometry of the scissors: theta, psi, phi, delta, x_c, X, R")
    contact = contact_of(EDGE, OPENING, THICKNESS_M / 2 - DEPTH_M)
    view = edge_height(EDGE, contact, OPENING / 2)
    scale, pivot = 7.0, (490.0, 200.0)

    def place(x: float, y: float) -> Point:
        return pivot[0] + 1e3 * scale * x, pivot[1] - 1e3 * scale * y

    _sheet(drawing, place, contact, 0.081)
    _scissors(drawing, place)
    _angles(drawing, place)
    _lengths(drawing, place, contact)
    _handles(drawing, place)
    _close_up(drawing, contact, float(view.height), float(np.arctan(view.slope)))
    drawing.text(
        (24, 672),
        "Opening 30 deg, edge offset -8 mm, taper 2 deg; thickness and indentation enlarged.",
        GREY,
        13,
    )
    return drawing


def _blade(side: int) -> list[tuple[float, float]]:
    """One blade's outline in metres, turned by half the opening; ``side`` is 1 or -1."""
    beta = OPENING / 2
    stations = np.linspace(-0.006, EDGE.length_m, 40)
    edge = EDGE.offset_at(stations)
    back = np.array([[EDGE.length_m, -0.0035], [0.055, 0.004], [0.02, 0.008], [-0.006, 0.008]])
    along = np.concatenate([stations, back[:, 0]])
    across = np.concatenate([edge, back[:, 1]])
    x = along * np.cos(beta) - across * np.sin(beta)
    y = along * np.sin(beta) + across * np.cos(beta)
    return list(zip(x.tolist(), (side * y).tolist(), strict=True))


def _sheet(
    drawing: Drawing, place: Callable[[float, float], Point], contact: float, end: float
) -> None:
    half = THICKNESS_M / 2
    for low, high, fill in ((SHEET_FROM_M, contact, SHEET_CUT), (contact, end, SHEET)):
        corners = [(low, half), (high, half), (high, -half), (low, -half)]
        drawing.area([place(*corner) for corner in corners], fill, "#b9a25d")


def _scissors(drawing: Drawing, place: Callable[[float, float], Point]) -> None:
    beta = OPENING / 2
    for side in (-1, 1):
        outline = [place(*corner) for corner in _blade(side)]
        drawing.area(outline, STEEL, BLUE, fill_opacity="0.75", stroke_width="1.8")
        far = (-HANDLE_M * np.cos(beta), -side * HANDLE_M * np.sin(beta))
        root = (-0.005 * np.cos(beta), -side * 0.005 * np.sin(beta))
        drawing.line([place(*root), place(float(far[0]), float(far[1]))], BLUE, 9, opacity="0.55")
        tip = (EDGE.length_m * np.cos(beta), side * EDGE.length_m * np.sin(beta))
        drawing.line(
            [place(float(far[0]), float(far[1])), place(float(tip[0]), float(tip[1]))],
            INK,
            1.0,
            stroke_dasharray="9 4 2 4",
        )
    drawing.line([place(-0.066, 0.0), place(0.084, 0.0)], GREY, 1.0, stroke_dasharray="4 4")
    drawing.text(place(0.0825, 0.0012), "x", GREY)
    drawing.dot(place(0.0, 0.0), 6, "#ffffff", INK)
    drawing.text(place(0.0, -0.0038), "pivot", INK, 14, text_anchor="middle")


def _angles(drawing: Drawing, place: Callable[[float, float], Point]) -> None:
    beta = OPENING / 2
    centre = place(0.0, 0.0)
    drawing.arc(centre, 455, -beta, beta, GREEN)
    label = (centre[0] + 466 * np.cos(0.55 * beta), centre[1] - 466 * np.sin(0.55 * beta))
    drawing.text((float(label[0]), float(label[1])), "θ (opening)", GREEN, 16)
    drawing.arc(centre, 70, 1.15, 1.95, ORANGE)
    drawing.text((centre[0] - 4, centre[1] - 84), "τ > 0 opens", ORANGE, 15, text_anchor="middle")
    for station, words in ((0.046, "edge e(s)"),):
        x = station * np.cos(beta) - float(EDGE.offset_at(station)) * np.sin(beta)
        y = station * np.sin(beta) + float(EDGE.offset_at(station)) * np.cos(beta)
        at = place(float(x), float(y))
        drawing.line([at, (at[0] - 60, at[1] - 122)], GREY, 1.0)
        drawing.text((at[0] - 64, at[1] - 128), words, INK, 14, text_anchor="middle")


def _lengths(drawing: Drawing, place: Callable[[float, float], Point], contact: float) -> None:
    rows = (
        (-0.0235, 0.0, contact, "x_c (contact)", ORANGE),
        (-0.0300, SHEET_FROM_M, contact, "X (crack)", PURPLE),
        (-0.0300, 0.0, SHEET_FROM_M, "-x_n", GREY),
    )
    for level, low, high, words, colour in rows:
        a, b = place(low, level), place(high, level)
        drawing.measure(a, b, colour)
        drawing.text(((a[0] + b[0]) / 2, a[1] - 7), words, colour, 15, text_anchor="middle")
    for x in (0.0, SHEET_FROM_M, contact):
        drawing.line([place(x, -0.0005), place(x, -0.0315)], GREY, 0.8, stroke_dasharray="2 3")
    top, bottom = place(0.0775, THICKNESS_M / 2), place(0.0775, -THICKNESS_M / 2)
    drawing.measure(top, bottom)
    drawing.text((top[0] + 8, place(0.0, -0.004)[1]), "h", INK, 15)
    drawing.text(place(0.0130, -0.0055), "cut", GREY, 13)
    drawing.text(place(0.0640, -0.0055), "sheet", GREY, 13)


def _handles(drawing: Drawing, place: Callable[[float, float], Point]) -> None:
    beta = OPENING / 2
    for side in (-1, 1):
        x, y = -HANDLE_M * float(np.cos(beta)), side * HANDLE_M * float(np.sin(beta))
        end = place(x, y)
        normal = (float(np.sin(beta)), float(np.cos(beta)) * side)
        start = (end[0] - 62 * normal[0], end[1] - 62 * normal[1])
        drawing.dot(end, 11, "#ffffff", BLUE)
        drawing.arrow([start, (end[0] - 12 * normal[0], end[1] - 12 * normal[1])], ORANGE, 2.4)
        drawing.text((start[0] - 10, start[1] + 6), "F_u", ORANGE, 16, text_anchor="end")
    a, b = place(0.0, 0.0), place(-HANDLE_M * float(np.cos(beta)), -HANDLE_M * float(np.sin(beta)))
    shift = (-34 * float(np.sin(beta)), 34 * float(np.cos(beta)))
    drawing.measure((a[0] + shift[0], a[1] + shift[1]), (b[0] + shift[0], b[1] + shift[1]))
    drawing.text((0.5 * (a[0] + b[0]) - 40, 0.5 * (a[1] + b[1]) + 62), "R (handle radius)", INK)


def _close_up(drawing: Drawing, contact: float, height: float, psi: float) -> None:
    """Enlarge the contact, in a separate frame."""
    scale, left, top, wide, tall = 23.0, 430.0, 440.0, 646.0, 208.0
    origin = (left + 250.0, top + tall - 22.0)

    def place(x: float, y: float) -> Point:
        return origin[0] + 1e3 * scale * (x - contact), origin[1] - 1e3 * scale * y

    drawing.parts.append(
        f'<clipPath id="close"><rect x="{left:g}" y="{top:g}" width="{wide:g}" height="{tall:g}"'
        ' rx="8"/></clipPath><g clip-path="url(#close)">'
    )
    half = THICKNESS_M / 2
    reach = 0.019
    body = [(contact - reach, half), (contact, half), (contact, 0.0), (contact - reach, 0.0)]
    drawing.area([place(*p) for p in body], SHEET_CUT)
    body = [(contact, half), (contact + reach, half), (contact + reach, -0.002), (contact, -0.002)]
    drawing.area([place(*p) for p in body], SHEET, "#b9a25d")
    run = float(np.tan(psi))
    blade = [
        (contact - reach, height - reach * run),
        (contact + reach, height + reach * run),
        (contact - reach, height + 0.02),
    ]
    drawing.area([place(*p) for p in blade], STEEL, BLUE, fill_opacity="0.7", stroke_width="2")
    drawing.line(
        [place(contact - reach, 0.0), place(contact + reach, 0.0)],
        GREY,
        1.0,
        stroke_dasharray="4 4",
    )
    drawing.line(
        [place(contact - 0.0075, half), place(contact, half)],
        "#b9a25d",
        1.0,
        stroke_dasharray="3 3",
    )
    drawing.parts.append("</g>")
    tip = place(contact, height)
    drawing.measure(place(contact, 0.0), tip, PURPLE)
    drawing.text((tip[0] + 8, place(0.0, height / 2)[1] + 5), "φ (edge height)", PURPLE, 16)
    drawing.measure(tip, place(contact, half), ORANGE)
    drawing.text(
        (tip[0] - 12, place(0.0, (height + half) / 2)[1] + 5),
        "δ (indentation)",
        ORANGE,
        16,
        text_anchor="end",
    )
    drawing.text(
        (place(contact - 0.0078, half)[0], place(0.0, half)[1] + 5),
        "y_top",
        INK,
        15,
        text_anchor="end",
    )
    drawing.line([tip, (tip[0] + 168, tip[1])], GREY, 1.0, stroke_dasharray="3 3")
    drawing.arc(tip, 138, 0.0, psi, GREEN)
    drawing.text((tip[0] + 146, tip[1] - 14), "ψ (edge slope angle) = θ/2 + α", GREEN, 16)
    drawing.dot(tip, 5, ORANGE, INK)
    drawing.line([(tip[0] - 3, tip[1] + 3), (tip[0] - 52, tip[1] + 34)], GREY, 1.0)
    drawing.text((tip[0] - 56, tip[1] + 46), "crack tip", INK, 14, text_anchor="end")
    drawing.parts.append(
        f'<rect x="{left:g}" y="{top:g}" width="{wide:g}" height="{tall:g}" rx="8" fill="none"'
        f' stroke="{GREY}"/>'
    )
    drawing.text((24, 470), "The contact, enlarged:", INK, 16)
    drawing.text((24, 494), "f = g(δ) presses on the sheet at the", INK, 14)
    drawing.text((24, 514), "crack tip; δ = y_top - φ(x_c, θ).", INK, 14)
    drawing.text((24, 542), "The crack advances while the edges", INK, 14)
    drawing.text((24, 562), "release more than the sheet takes:", INK, 14)
    drawing.text((24, 582), "m g(δ) tan ψ > J_c h (m moving blades).", INK, 14)
    drawing.text((24, 610), "τ = g(δ) (x_c + φ tan ψ), F_u = τ / R.", INK, 14)
