"""Docstrings as Markdown for the API pages: examples in fences, roles as code."""

import re
from typing import Any

import griffe

ROLE = re.compile(r":\w+:`~?([^`]+)`")


class MarkdownDocstrings(griffe.Extension):
    """Rewrite each docstring as it is read; mkdocs.yml names this class."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Rewrite the docstring of one module, class, function or constant."""
        if obj.docstring:
            obj.docstring.value = as_markdown(obj.docstring.value)


def as_markdown(docstring: str) -> str:
    """Return a docstring with ``>>>`` examples in fences."""
    lines: list[str] = []
    fenced = False
    for line in docstring.splitlines():
        if line.lstrip().startswith(">>>") and not fenced:
            lines += ["", "```pycon"]
            fenced = True
        elif fenced and not line.strip():
            lines.append("```")
            fenced = False
        lines.append(line if fenced else ROLE.sub(r"`\1`", line))
    return "\n".join([*lines, *(["```"] if fenced else [])])
