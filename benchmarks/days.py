"""Options of the benchmarks that run days by seed."""

import argparse
from pathlib import Path


def day_options(doc: str | None, *, first: int, count: int) -> argparse.ArgumentParser:
    """A parser whose help is the first line of ``doc``, with --first, --count and --json."""
    parser = argparse.ArgumentParser(description=(doc or "").splitlines()[0])
    parser.add_argument("--first", type=int, default=first, help="first seed")
    parser.add_argument("--count", type=int, default=count, help="days")
    parser.add_argument("--json", type=Path, help="file for the rows")
    return parser
