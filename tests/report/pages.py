"""Read a report back the way a browser would: elements, text, links, what it would fetch."""

import json
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

VOID = {"meta", "br", "hr", "img", "input", "link", "col", "wbr", "source", "area", "base", "embed"}
UNSEEN = {"style", "script", "title"}


@dataclass
class Page:
    """What a page holds: ``elements`` as (tag, attributes) in order, ``text`` as it is read."""

    source: str
    elements: list[tuple[str, dict[str, str]]] = field(default_factory=list)
    text: str = ""
    unbalanced: list[str] = field(default_factory=list)

    def all(self, tag: str, **wanted: str) -> list[dict[str, str]]:
        """Attributes of every element of one tag whose attributes are as wanted."""
        return [
            attributes
            for name, attributes in self.elements
            if name == tag and all(attributes.get(key) == value for key, value in wanted.items())
        ]

    @property
    def ids(self) -> list[str]:
        """Every id, in order."""
        return [attributes["id"] for _, attributes in self.elements if "id" in attributes]

    def values(self, attribute: str) -> list[str]:
        """Every value of one attribute."""
        return [found[attribute] for _, found in self.elements if attribute in found]


def panel_of(twin: dict[str, Any], name: str) -> dict[str, Any]:
    """The panel of a twin by its address; KeyError where it has none."""
    found = {panel["id"]: panel for panel in twin["panels"]}
    panel: dict[str, Any] = found[name]
    return panel


def values_of(panel: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Rows of a panel by name, each with its values by name."""
    return {
        row["name"]: {value["name"]: value for value in row.get("values", ())}
        for row in panel.get("rows", ())
    }


def read_page(path: Path) -> Page:
    """Parse a page; ``unbalanced`` names tags that close out of turn or never."""
    page = Page(path.read_text(encoding="utf-8"))
    reader = _Reader(page)
    reader.feed(page.source)
    reader.close()
    page.unbalanced += reader.open
    page.text = " ".join(page.text.split())
    return page


def read_twin(path: Path) -> dict[str, Any]:
    """Parse the twin as strict JSON: NaN and infinities are refused."""

    def refuse(name: str) -> Any:
        raise ValueError(f"{name} is not JSON")

    twin = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    assert isinstance(twin, dict)
    return twin


class _Reader(HTMLParser):
    def __init__(self, page: Page) -> None:
        super().__init__(convert_charrefs=True)
        self.page = page
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.page.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.page.elements.append((tag, {name: value or "" for name, value in attrs}))

    def handle_endtag(self, tag: str) -> None:
        if self.open and self.open[-1] == tag:
            self.open.pop()
        else:
            self.page.unbalanced.append(f"/{tag}")

    def handle_data(self, data: str) -> None:
        if not UNSEEN & set(self.open):
            self.page.text += data + " "
