"""How large the product is: lines, files, classes and public names of each room.

`python -m benchmarks.house` prints the table; CHANGELOG records its last line at each version. A
public function has no underscore before its name, or before its class's. Parameters do not count
self and cls; ``x=x`` are arguments passed on by their own name.
"""

import ast
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src" / "scissorcal"


@dataclass
class Size:
    """Counts of one room, or of all."""

    lines: int = 0
    files: int = 0
    classes: int = 0
    dataclasses: int = 0
    public_functions: int = 0
    most_parameters: int = 0
    passed_on: int = 0

    def add(self, other: "Size") -> None:
        """Add a file's or a room's counts to these."""
        for field in fields(self):
            counts = getattr(self, field.name), getattr(other, field.name)
            joined = max(counts) if field.name == "most_parameters" else sum(counts)
            setattr(self, field.name, joined)


def rooms(source: Path = SOURCE) -> dict[str, Size]:
    """The size of each room: a package or module directly below ``source``."""
    sizes: dict[str, Size] = {}
    for path in sorted(source.rglob("*.py")):
        if "node_modules" not in path.parts:
            room = path.relative_to(source).with_suffix("").parts[0]
            sizes.setdefault(room, Size()).add(size_of(path.read_text(encoding="utf-8")))
    return sizes


def size_of(text: str) -> Size:
    """The counts of one file."""
    tree = ast.parse(text)
    size = Size(lines=text.count("\n"), files=1)
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            size.classes += 1
            size.dataclasses += any("dataclass" in ast.dump(d) for d in node.decorator_list)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            size.most_parameters = max(size.most_parameters, len(_parameters(node)))
        elif isinstance(node, ast.Call):
            size.passed_on += sum(
                isinstance(word.value, ast.Name) and word.value.id == word.arg
                for word in node.keywords
            )
    size.public_functions = sum(1 for _ in _public_functions(tree))
    return size


def _parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    given = function.args
    names = [a.arg for a in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return [name for name in names if name not in ("self", "cls")]


def _public_functions(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    bodies = [tree.body]
    bodies += [c.body for c in tree.body if isinstance(c, ast.ClassDef) and c.name[0] != "_"]
    for body in bodies:
        for node in body:
            if isinstance(node, ast.FunctionDef) and node.name[0] != "_":
                yield node


def main() -> None:
    """Print the table, the largest room first, and the total."""
    sizes = rooms()
    total = Size()
    for size in sizes.values():
        total.add(size)
    ordered = sorted(sizes.items(), key=lambda room: -room[1].lines)
    print("| room | " + " | ".join(f.name.replace("_", " ") for f in fields(Size)) + " |")
    print("|---" * (1 + len(fields(Size))) + "|")
    for name, size in [*ordered, ("all", total)]:
        print(f"| {name} | " + " | ".join(str(getattr(size, f.name)) for f in fields(Size)) + " |")


if __name__ == "__main__":
    main()
