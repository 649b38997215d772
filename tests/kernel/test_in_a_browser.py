"""The core in a real browser computes what the native core computes, bit for bit."""

import base64
import hashlib
from pathlib import Path

import numpy as np
import pytest

from scissorcal.kernel import Kernel
from scissorcal.kernel.tables import TABLE_NAMES, ModelTables
from scissorcal.kernel.web_module import web_module, web_numbers
from tests.browser import bundled, open_browser, open_file
from tests.kernel.test_web_module import MODELS, random_places

STEPS = 10**6

HARNESS = """
import { Kernel } from "./src/kernel";
const bytes = (text: string) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
const floats = (text: string) => new Float32Array(bytes(text).buffer);
(window as any).run = async (wasm: string, tables: any, numbers: number[], places: string) => {
  const kernel = new Kernel(await WebAssembly.compile(bytes(wasm)));
  const rows: any = {};
  for (const name of Object.keys(tables)) {
    const [x, y, slope] = tables[name].map(floats);
    rows[name] = { x, y, slope };
  }
  if (!kernel.load(rows, numbers)) throw new Error("refused");
  kernel.reset(0);
  const out = kernel.steps(floats(places));
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", out));
  return [Array.from(digest, (b) => b.toString(16).padStart(2, "0")).join(""), kernel.crack];
};
"""


def _text(values: object) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode()


def _tables(tables: ModelTables) -> dict[str, list[str]]:
    every = {name: getattr(tables, name) for name in TABLE_NAMES}
    return {name: [_text(one.x), _text(one.y), _text(one.slope)] for name, one in every.items()}


@pytest.fixture(scope="module")
def harness(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with the page's own binding of the module."""
    page = tmp_path_factory.mktemp("page") / "page.html"
    page.write_text(f"<!doctype html><script>{bundled(HARNESS)}</script>", encoding="utf-8")
    return page


@pytest.mark.slow
def test_a_million_steps_in_a_browser_are_the_native_ones(harness: Path) -> None:
    each = -(-STEPS // len(MODELS))
    felt = 0
    with open_browser() as browser:
        page, seen = open_file(browser, harness)
        for seed, (name, tables) in enumerate(MODELS.items()):
            places = random_places(each, seed=1000 + seed)
            native = Kernel(tables)
            wanted = native.step_many(places["opening"], places["rate"], places["advance"])
            felt += np.count_nonzero(wanted["torque"])
            found, crack = page.evaluate(
                "(given) => window.run(...given)",
                [
                    base64.b64encode(web_module()).decode(),
                    _tables(tables),
                    list(web_numbers(tables)),
                    _text(places.view("<f4")),
                ],
            )
            assert found == hashlib.sha256(wanted.tobytes()).hexdigest(), name
            assert np.float32(crack) == np.float32(native.crack), name
        assert not seen.errors
        assert seen.requests == [harness.as_uri()], "the page asked for itself alone"
    assert felt > STEPS / 20
