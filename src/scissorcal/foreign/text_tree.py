"""YAML, JSON and XML of other programs as dicts, lists and text, by Python alone.

No number is converted, no tag obeyed, nothing expanded: aliases and document types are refused, and
so is what nests too deeply. What a text means is the caller's.
"""

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import yaml

DEEPEST = 32
"""Levels of a text; camera files have four."""

TYPE_KEY = "type_id"
"""Key under which a mapping has the type that its tag or attribute states."""

Tree = str | list[Any] | dict[str, Any]


def parse_yaml(text: str) -> list[Tree]:
    """The documents of YAML or JSON; ValueError with the reason where it is neither.

    A type such as ``!!opencv-matrix`` is the mapping's ``type_id``, as it is in JSON and XML. The
    directive ``%YAML:1.0`` of OpenCV is passed over, and so are comments of JSON that begin a line.

    >>> parse_yaml("rows: 3\\ndata: [1., .Nan]")
    [{'rows': '3', 'data': ['1.', '.Nan']}]
    """
    import yaml

    plain = re.sub(r"\A\s*%YAML:?[^\n]*\n", "", text.lstrip("\ufeff"))
    plain = re.sub(r"(?m)^\s*//[^\n]*$", "", plain).replace("\t", " ")
    try:
        return [_tree(node, 0) for node in yaml.compose_all(plain, Loader=_loader())]
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())[:120]) from None
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def parse_xml(text: str) -> dict[str, Tree]:
    """An XML document as what is within its root; ValueError with the reason where it is none.

    An element with elements is a dict; one without is its text. Of elements called ``_``, which
    are a list of OpenCV, the last is kept; any other name stands once.
    """
    from xml.parsers import expat

    open_elements: list[tuple[str, dict[str, Any], list[str]]] = [("", {}, [])]

    def begin(name: str, attributes: dict[str, str]) -> None:
        if len(open_elements) > DEEPEST:
            raise ValueError("it is nested too deeply")
        stated = {TYPE_KEY: attributes[TYPE_KEY]} if TYPE_KEY in attributes else {}
        open_elements.append((name, stated, []))

    def end(_: str) -> None:
        name, inner, words = open_elements.pop()
        if name in open_elements[-1][1] and name != "_":
            raise ValueError(f"{name[:40]} stands there twice")
        open_elements[-1][1][name] = inner if set(inner) - {TYPE_KEY} else "".join(words)

    def refuse(*_: Any) -> None:
        raise ValueError("it has a document type, which no camera file needs")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.CharacterDataHandler = lambda words: open_elements[-1][2].append(words)
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(text.lstrip("\ufeff \t\r\n").encode(), True)
    except (expat.ExpatError, UnicodeError) as error:
        raise ValueError(str(error)) from None
    root = next(iter(open_elements[0][1].values()))
    return root if isinstance(root, dict) else {}


def _loader() -> "type[yaml.Loader]":
    import yaml

    class Plain(yaml.SafeLoader):
        """Composes nodes; refuses what would expand, or nest too deeply."""

        depth = 0

        def compose_node(self, parent: Any, index: Any) -> Any:
            event: Any = self.peek_event()  # type: ignore[no-untyped-call]
            if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
                raise yaml.YAMLError("anchors and aliases (&, *) are not read: write values out")
            self.depth += 1
            if self.depth > DEEPEST:
                raise yaml.YAMLError("it is nested too deeply")
            node = super().compose_node(parent, index)
            self.depth -= 1
            return node

    return Plain  # type: ignore[return-value]


def _tree(node: Any, level: int) -> Tree:
    import yaml

    if isinstance(node, yaml.ScalarNode):
        return str(node.value)
    if isinstance(node, yaml.SequenceNode):
        return [_tree(one, level + 1) for one in node.value]
    found: dict[str, Any] = {}
    tag = str(node.tag).rpartition(":")[2]
    if tag != "map":
        found[TYPE_KEY] = tag
    for key, value in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise yaml.YAMLError("a key that is not text")
        if str(key.value) in found:
            raise yaml.YAMLError(f"{str(key.value)[:40]} stands there twice")
        found[str(key.value)] = _tree(value, level + 1)
    return found
