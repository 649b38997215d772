"""Write the figures of docs/build: python -m tests.builds"""

from .page import write

if __name__ == "__main__":
    write()
