"""Write the figures of docs/build, all or those of some marks: python -m tests.builds [MARK ...]"""

import sys

from .page import write

if __name__ == "__main__":
    write(sys.argv[1:])
