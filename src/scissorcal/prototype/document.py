"""The page as one document: the built template, what it shows, the kernel, and what it may do."""

import base64
import hashlib
import html
import json
import re
from functools import cache
from pathlib import Path

from scissorcal.kernel.web_module import browser_file, web_module
from scissorcal.prototype.scene import Scene

TEMPLATE = Path(__file__).parent / "built" / "page.html"
PLACES = ("title", "policy", "scene", "server", "kernel")
_PLACE = re.compile(r"\{\{(" + "|".join(PLACES) + r")\}\}")
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_STYLE = re.compile(r"<style>(.*?)</style>", re.DOTALL)


def page_of(scene: Scene, *, socket: str | None = None) -> str:
    """The whole page of a scene; ``socket`` is the path of the server's socket, None offline.

    Nothing that the scene says becomes markup or script: it stands in elements of data, in which
    every "<" is escaped. Raises MissingError where the page was not built and cannot be.
    """
    server = None if socket is None else {"socket": socket}
    filled = {
        "title": html.escape(scene.name),
        "policy": html.escape(policy_of(served=socket is not None)),
        "scene": _data(scene.model_dump_json()),
        "server": _data(json.dumps(server)),
        "kernel": base64.b64encode(web_module()).decode(),
    }
    return _PLACE.sub(lambda place: filled[place[1]], _template())


def ensure_page() -> None:
    """Build what the page takes where a checkout lacks it; MissingError where that cannot be."""
    _template()
    web_module()


def policy_of(*, served: bool) -> str:
    """The page's Content-Security-Policy: its own script and style by hash, nothing from elsewhere.

    ``'wasm-unsafe-eval'`` lets the kernel's WebAssembly run, which the page holds itself. A served
    page may open sockets to where it came from, an offline page to nowhere.
    """
    page, opens = _template(), "'self'" if served else "'none'"
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src {_hash(_SCRIPT, page)} 'wasm-unsafe-eval'",
            f"style-src {_hash(_STYLE, page)}",
            f"connect-src {opens}",
            "img-src data:",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )


@cache
def _template() -> str:
    page = browser_file(TEMPLATE).decode("utf-8")
    found = sorted(place[1] for place in _PLACE.finditer(page))
    if found != sorted(PLACES):
        raise ValueError(f"{TEMPLATE} has the places {found}, not each of {PLACES} once")
    return page


def _hash(element: re.Pattern[str], page: str) -> str:
    """The source expression of the one element of its kind that has no attributes."""
    (text,) = element.findall(page)
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def _data(text: str) -> str:
    """JSON as it may stand in an element of data: no end tag, no comment, no markup."""
    return text.replace("<", "\\u003c")
