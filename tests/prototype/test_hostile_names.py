"""What a package, a recipe or a file is called becomes text on the page, never markup or script."""

import asyncio
import json
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from scissorcal.package import build_package, open_package
from scissorcal.prototype.document import page_of
from scissorcal.prototype.page_parts import State
from scissorcal.prototype.scene import Scene, scene_of
from scissorcal.recording import RecordingWriter
from tests.package.fits import cut_fit, friction_fit, recipe

from .made import a_browser, a_server, heard, samples_of

NAMES = (
    "</script><script>alert(1)</script>",
    "<!--<script>",
    "<img src=x onerror=alert(1)>",
    "'\"><svg onload=alert(1)>",
    "{{kernel}}{{scene}}{{policy}}",
    "\\u003cscript\\u003e",
    "]]>\u2028\u2029\u202e&lt;b&gt;",
)


class Elements(HTMLParser):
    """The elements of a page with their attributes, and the text in those of data."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, tuple[str, ...]]] = []
        self.data: dict[str, str] = {}
        self._within = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, tuple(name for name, _ in attrs)))
        self._within = dict(attrs).get("id") or ""

    def handle_data(self, data: str) -> None:
        if self._within:
            self.data[self._within] = self.data.get(self._within, "") + data

    def handle_endtag(self, tag: str) -> None:
        self._within = ""

    def handle_comment(self, data: str) -> None:
        self.found.append(("comment", ()))


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    chosen = recipe()
    friction = friction_fit(coulomb=0.014, stribeck=0.004, viscous=0.002)
    path = tmp_path_factory.mktemp("package") / "paper.zip"
    cut = cut_fit(chosen, kappa=0.75, energy=0.52)
    build_package(chosen, friction, cut, path, np.random.default_rng(1))
    return scene_of(open_package(path, warn=False), made_utc="2026-11-24T00:00:00Z", version="1")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("socket", [None, "/rig?token=a"])
def test_a_name_is_text_in_the_page(name: str, socket: str | None, scene: Scene) -> None:
    plain = Elements(page_of(scene.model_copy(update={"name": "paper"}), socket=socket))
    page = page_of(
        scene.model_copy(update={"name": name, "states": (State(label=name, sentence=name),)}),
        socket=socket,
    )
    found = Elements(page)
    assert found.found == plain.found
    assert json.loads(found.data["server"]) == (socket and {"socket": socket})
    if "scene" in found.data:
        told = json.loads(found.data["scene"])
        assert (told["name"], told["states"]) == (name, [{"label": name, "sentence": name}])


@pytest.mark.parametrize("name", ["<img src=x onerror=alert(1)>", "'\" x", "\u202egnp.", "a\nb"])
def test_a_file_name_is_told_as_data(name: str, tmp_path: Path) -> None:
    async def trial() -> None:
        (tmp_path / "captures").mkdir()
        path = tmp_path / "captures" / f"{name}.mcap"
        async with a_server(tmp_path) as server, a_browser(server) as page:
            with RecordingWriter(path, "render") as writer:
                writer.append(samples_of(0, 1000))
                said = await heard(page, lambda message: message["kind"] == "samples")
            assert said["recording"] == f"{name}.mcap"

    asyncio.run(trial())
