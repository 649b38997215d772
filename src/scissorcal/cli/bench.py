"""``scissorcal bench``"""

from scissorcal.cli.lazy import group

_COMMANDS = {
    "trade": ("scissorcal.cli.bench_trade:trade", "What accuracy costs, knob by knob."),
    "extremes": ("scissorcal.cli.bench_extremes:extremes", "Where numbers stop being right."),
}


@group(_COMMANDS)
def bench() -> None:
    """Measure what accuracy costs, on this computer.

    \b
    Example:
      $ scissorcal bench trade --knob effort
    """
