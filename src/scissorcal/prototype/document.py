"""The page as one document."""

import html
import json

from scissorcal.prototype.scene import Scene

POLICY = "default-src 'none'"


def page_of(scene: Scene, *, socket: str | None = None) -> str:
    """The whole page of a scene; ``socket`` is the path of the server's socket, None offline."""
    server = json.dumps(None if socket is None else {"socket": socket}).replace("<", "\\u003c")
    name = html.escape(scene.name)
    return (
        f'<!doctype html><meta charset="utf-8"><title>{name}</title><h1>{name}</h1>'
        f'<script type="application/json" id="server">{server}</script>'
    )
