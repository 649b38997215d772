"""The command line: a file for each command or group, thin calls of documented functions."""


def main() -> None:
    """Run the ``scissorcal`` command and leave the process with its exit code."""
    from scissorcal.cli.root import run

    run()
