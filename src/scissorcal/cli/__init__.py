"""The command line: one file per command, each a thin call of a documented function."""


def main() -> None:
    """Run the ``scissorcal`` command and leave the process with its exit code."""
    from scissorcal.cli.root import run

    run()
