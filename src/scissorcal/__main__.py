"""The command line as ``python -m scissorcal``, where its script is not on the path."""

from scissorcal.cli import main

if __name__ == "__main__":
    main()
