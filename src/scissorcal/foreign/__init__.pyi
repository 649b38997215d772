from .formats import DRAWING as DRAWING
from .formats import PACKAGE as PACKAGE
from .formats import RECORDS as RECORDS
from .formats import REPORT as REPORT
from .formats import Format as Format
from .isolated import parse_isolated as parse_isolated
from .reading import decode_text as decode_text
from .reading import first_line as first_line
from .reading import open_foreign as open_foreign
from .reading import parse_json as parse_json
from .reading import read_foreign as read_foreign
from .reading import read_foreign_text as read_foreign_text
from .reading import read_json as read_json
from .reading import reading as reading
from .reading import refuse_unless_regular as refuse_unless_regular

__all__ = [
    "Format",
    "decode_text",
    "first_line",
    "open_foreign",
    "parse_isolated",
    "parse_json",
    "read_foreign",
    "read_foreign_text",
    "read_json",
    "reading",
    "refuse_unless_regular",
]
