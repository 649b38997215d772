"""Files that come from elsewhere: opened, bounded and parsed so that none can end the program.

Every room reads foreign files through this one. `open_foreign` and what is built on it
(`read_foreign`, `read_foreign_text`, `read_json`) take regular files of at most the format's size.
`reading` turns what a parser raises into one sentence that names the file. `parse_isolated` runs a
parser that is written in C in a child process with limits of memory and time.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
