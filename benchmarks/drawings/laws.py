"""The model's parts, each computed by scissorcal: friction, response, residuals, priors."""

import numpy as np
from benchmarks.drawings.canvas import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, Drawing
from benchmarks.drawings.charts import Chart

from scissorcal.model import FrictionLaw, Response, friction_torque
from scissorcal.model.friction_terms import PARAMETERS

PRIORS = ("inertia", "coulomb", "viscous", "stribeck_rate", "presliding_length")

FRICTION = FrictionLaw(
    {
        "coulomb_pos": 0.0133,
        "coulomb_neg": 0.0145,
        "viscous_pos": 0.0040,
        "viscous_neg": 0.0044,
        "stribeck": 0.0043,
        "stribeck_rate": 0.12,
    }
)


def friction_law() -> Drawing:
    """Friction over the rate, its parts, and its build-up after a reversal."""
    drawing = Drawing(1100, 400, "Friction over the rate, and after a reversal")
    chart = Chart(drawing, (70, 50, 600, 270), (-1.6, 1.6), (-30.0, 30.0))
    chart.axes(
        "opening rate, rad/s", "Friction, mN m", (-1.5, -1, -0.5, 0, 0.5, 1, 1.5), (-20, 0, 20)
    )
    for rates in (np.linspace(-1.55, -0.002, 120), np.linspace(0.002, 1.55, 120)):
        torque = 1e3 * np.asarray(friction_torque(FRICTION, np.full(120, 0.5), rates))
        chart.curve(rates, torque, BLUE)
        dry = 14.5 if rates[0] < 0 else 13.3
        chart.curve(
            (rates[0], rates[-1]), (np.sign(rates[0]) * dry,) * 2, GREY, 1.2, stroke_dasharray="5 4"
        )
    chart.note(0.62, 9.0, "Coulomb, opening", GREY)
    chart.note(0.1, 24.5, "Stribeck: more near rest", ORANGE)
    chart.note(1.0, 16.0, "viscous: the slope", ORANGE)
    chart.note(-1.5, -9.0, "Coulomb, closing", GREY)
    build = Chart(drawing, (740, 50, 320, 270), (0.0, 0.06), (-1.1, 1.1))
    build.axes(
        "way after a reversal, rad", "Share of dry friction", (0, 0.02, 0.04, 0.06), (-1, 0, 1)
    )
    way = np.linspace(0.0, 0.06, 120)
    build.curve(way, 1.0 - 2.0 * np.exp(-way / 0.01), PURPLE)
    build.curve((0.0, 0.0, 0.06), (-1.0, 1.0, 1.0), GREY, 1.2, stroke_dasharray="5 4")
    build.note(0.018, -0.1, "presliding: builds up over", PURPLE)
    build.note(0.018, -0.25, "presliding_length", PURPLE)
    return drawing


def response_laws() -> Drawing:
    """The response candidates over the indentation."""
    drawing = Drawing(1100, 380, "Response of the material over the indentation")
    chart = Chart(drawing, (80, 50, 620, 260), (0.0, 0.3), (0.0, 2.2))
    chart.axes(
        "indentation, mm", "Force across the blades, N", (0, 0.1, 0.2, 0.3), (0, 0.5, 1, 1.5, 2)
    )
    depth = np.linspace(0.0, 0.3e-3, 120)
    power = Response("power", force=0.65, exponent=1.55, reference_m=1.5e-4)
    stiffening = Response("exponential", force=0.65, exponent=1.55, reference_m=1.5e-4)
    chart.curve(1e3 * depth, np.asarray(power.force_at(depth)), BLUE)
    shown = depth[depth < 0.255e-3]
    chart.curve(1e3 * shown, np.asarray(stiffening.force_at(shown)), ORANGE)
    drawing.dot(chart.at(0.15, 0.65), 5, INK)
    chart.note(0.155, 0.5, "force at the reference depth: shared by both", INK)
    drawing.text((740, 110), "power: paper, cloth", BLUE, 15)
    drawing.text((740, 140), "exponential: stiffens like tissue", ORANGE, 15)
    drawing.text((740, 180), "spline: three free shapes; needs presses", GREY, 15)
    drawing.text((740, 200), "as deep as the scene goes", GREY, 15)
    return drawing


def likelihood() -> Drawing:
    """From samples to what a likelihood compares: windows of a sweep, segments of a cut."""
    drawing = Drawing(1100, 420, "What the likelihood compares")
    rng = np.random.default_rng(7)
    time = np.arange(0.0, 1.0, 0.004)
    truth = 17.0 + 2.0 * np.sin(5.0 * time)
    noise = np.zeros(time.size)
    for k in range(1, time.size):
        noise[k] = 0.6 * noise[k - 1] + rng.normal(0.0, 0.9)
    chart = Chart(drawing, (70, 60, 440, 280), (0.0, 1.0), (10.0, 24.0))
    chart.axes("time in one sweep, s", "Empty sweep: drive, mN m", (0, 0.5, 1), (10, 15, 20))
    for t, y in zip(time, truth + noise, strict=True):
        drawing.dot(chart.at(float(t), float(y)), 1.6, "#aab4be")
    chart.curve(time, truth, BLUE)
    for k in range(0, time.size, 25):
        middle, level = float(time[k : k + 25].mean()), float((truth + noise)[k : k + 25].mean())
        drawing.dot(chart.at(middle, level), 5, ORANGE)
    chart.note(0.03, 23.0, "grey samples, orange windows, blue law", GREY)
    chart.note(
        0.03, 11.0, "neighbouring windows are not independent: they count by their worth", GREY
    )
    opening = np.linspace(44.0, 26.0, 1800)
    saw = 8.0 + 0.9 * (44.0 - opening) + 4.0 * (1.0 - np.mod((44.0 - opening) * 3.0, 1.0))
    load = np.clip((44.0 - opening) / 1.5, 0.0, 1.0)
    torque = np.where(opening > 42.5, 12.0 * load**1.5, saw)
    cut = Chart(drawing, (600, 60, 460, 280), (26.0, 44.0), (0.0, 32.0))
    cut.axes(
        "opening, deg (closing runs to the left)",
        "Cut: torque, mN m",
        (26, 30, 35, 40, 44),
        (0, 10, 20, 30),
    )
    cut.curve(opening, torque, "#aab4be", 1.0)
    for low, high, colour, words in (
        (42.5, 44.0, GREEN, "loading"),
        (36.0, 42.4, ORANGE, ""),
        (27.0, 35.8, ORANGE, "running: mean torque and period of the teeth"),
    ):
        inside = (opening >= low) & (opening <= high)
        mean = float(torque[inside].mean())
        cut.curve((low, high), (mean, mean), colour, 4)
        if words:
            cut.note(
                high if low > 40 else 26.3,
                mean + 6.5,
                words,
                colour,
                text_anchor="end" if low > 40 else "start",
            )
    return drawing


def priors() -> Drawing:
    """Default priors of friction: median and the range that holds 90 %, on a logarithmic axis."""
    drawing = Drawing(1100, 340, "Default priors of friction: median and the range that holds 90 %")
    chart = Chart(drawing, (250, 50, 800, 210), (-6.0, 0.5), (0.0, 5.0))
    chart.axes("", "", range(-6, 1), (), lambda power: f"1e{power:g}")
    for number, name in enumerate(PRIORS):
        prior = PARAMETERS[name].prior
        assert prior is not None
        median, factor, _ = prior.of("rotary")
        y = 4.5 - number
        low, high = np.log10(median / factor), np.log10(median * factor)
        chart.curve((low, high), (y, y), BLUE, 6)
        drawing.dot(chart.at(float(np.log10(median)), y), 7, ORANGE)
        words = f"{name}, {PARAMETERS[name].unit('rad', 'N m')}"
        drawing.text((240, chart.at(0, y)[1] + 5), words, INK, 14, text_anchor="end")
    drawing.text(
        (250, 310),
        "On the virtual rig a capture of two minutes leaves 0.2 % of this width for Coulomb "
        "friction, in its logarithm: posterior contraction.",
        GREY,
        14,
    )
    return drawing
