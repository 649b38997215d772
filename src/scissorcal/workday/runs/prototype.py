"""The page of a workspace's package: what it shows, and what it may start on a rig."""

import asyncio
import signal
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.device.capture import CLEAR_REQUEST
from scissorcal.device.trajectory import EMPTY_REQUEST
from scissorcal.errors import InputError, needs_extra
from scissorcal.files import replacing
from scissorcal.identity import VERSION
from scissorcal.kernel import Capability
from scissorcal.package import open_package
from scissorcal.prototype.document import ensure_page, page_of, policy_of
from scissorcal.prototype.page_parts import Hand, LayersPart, Numbers, State, layers_part
from scissorcal.prototype.rig_commands import RigCommand
from scissorcal.prototype.scene import Scene, scene_of
from scissorcal.recipe.load import read_text
from scissorcal.recipe.plate_layers import drawn_layers
from scissorcal.recording import Recording, read_header, read_recording
from scissorcal.render.engine import REQUEST
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import NONE, PrototypeOptions
from scissorcal.workday.plan import make_plan
from scissorcal.workday.rigs import SIM
from scissorcal.workday.runs.fit import available, load_result
from scissorcal.workday.runs.package import built_package
from scissorcal.workday.runs.render import unsettled_states
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.prototype.server import PrototypeServer

SIM_REQUEST = "The virtual rig moves by itself: nobody has to keep clear."
TRACK_REQUEST = (
    "The motors stay off. Move the handles so that the blade's tip taps the plate, at several "
    "places."
)
HAND_POINTS = 1500
"""Of a recorded hand: 30 s at 50 Hz."""
LONGEST_HAND_s = 60.0


def workspace_scene(
    workspace: Workspace, package_path: Path | None = None, now: datetime | None = None
) -> Scene:
    """What a page shows of the workspace's package (or another): with measured strokes and hands.

    Raises MissingError where there is no package, with the command that builds it, and what opening
    one raises.
    """
    path = package_path or built_package(workspace, "show")
    engine = Engine.of(workspace)
    fits = [load_result(engine, what) for what in available(engine, ("cut", "friction"))]
    package = open_package(path, warn=False)
    scene = scene_of(
        package,
        made_utc=(now or datetime.now(UTC)).strftime("%Y-%m-%dT%H:%M:%SZ"),
        version=VERSION,
        fits=fits,
        hands=workspace_hands(workspace),
        states=() if package_path else (*_origin(workspace), *_unsettled(engine)),
    )
    if package_path:
        return scene
    recipe = read_text(workspace.recipe_path)
    added = {"recipe": recipe, "drawn_plate": workspace_plate(workspace)}
    return scene.model_copy(update={**added, "next_step": make_plan(workspace).next_command or ""})


def workspace_plate(workspace: Workspace) -> LayersPart | None:
    """The plate whose outlines stand in files, which a page cannot read; None where there are none.

    None, too, where a file is gone or wrong: the page then says what it cannot draw.
    """
    recipe = workspace.recipe()
    if not recipe.plate.drawings:
        return None
    try:
        layers = drawn_layers(recipe.plate, workspace.root)
    except InputError:
        return None
    return layers_part(recipe.plate.cut_line_mm, layers)


def _origin(workspace: Workspace) -> tuple[State, ...]:
    """A sentence where recordings of the workspace come from a virtual rig, as they state."""
    paths = [*workspace.recordings("friction"), *workspace.recordings("cut")]
    stated = []
    for path in paths:
        try:
            device = read_header(path).device
        except InputError:
            continue  # 'recording show' says what is wrong with it
        stated.append(bool(int(device.get("capabilities", 0)) & Capability.SIMULATOR))
    if not any(stated):
        return ()
    which = "all" if all(stated) else f"{sum(stated)} of {len(stated)}"
    sentence = f"Simulated: {which} recordings of friction and cuts come from a virtual rig."
    return (State(label="simulated", sentence=sentence),)


def _unsettled(engine: Engine) -> tuple[State, ...]:
    """What is unsettled in the workspace, labelled by the state of its step."""
    return tuple(State(label=state, sentence=said) for state, said in unsettled_states(engine))


def workspace_hands(workspace: Workspace) -> tuple[Hand, ...]:
    """How the blades were moved in the newest recordings of a cut and of a rendering.

    Of several sheets it is the first. A recording that cannot be read gives none.
    """
    found = []
    for kind in ("cut", "render"):
        paths = workspace.recordings("cut" if kind == "cut" else "render")
        try:
            hand = _hand(read_recording(paths[-1])) if paths else None
        except InputError:
            continue  # 'recording show' says what is wrong with it
        if hand is not None:
            found.append(hand)
    return tuple(found)


def _hand(recording: Recording) -> Hand | None:
    samples = recording.samples
    numbers = [stroke.index for stroke in recording.strokes if stroke.sheet <= 0]
    own = np.flatnonzero(np.isin(samples["stroke"], numbers))
    if len(own) < 2:
        return None
    samples = samples[own[0] : own[-1] + 1]
    time_s = 1e-6 * (samples["device_time_us"] - samples["device_time_us"][0])
    moved = np.isfinite(samples["opening"]) & np.isfinite(samples["advance"])
    samples, time_s = samples[moved], time_s[moved]
    within = time_s <= LONGEST_HAND_s
    every = max(1, -(-int(within.sum()) // HAND_POINTS))
    kept = np.flatnonzero(within)[::every]
    if len(kept) < 2:
        return None
    return Hand(
        name=Path(recording.source).stem.encode("utf-8", "replace").decode(),
        time=Numbers.of(time_s[kept]),
        opening=Numbers.of(samples["opening"][kept]),
        advance=Numbers.of(samples["advance"][kept]),
    )


def rig_commands(
    workspace: Workspace, device: str, *, camera: str = NONE, package_path: Path | None = None
) -> tuple[RigCommand, ...]:
    """The commands of a rig that a page may start, with the sentence that each asks first."""
    sim = device == SIM
    on = ("--device", device, "--workspace", str(workspace.root))
    paced = (*on, "--realtime") if sim else on
    package = ("--package", str(package_path.absolute())) if package_path else ()

    def asks(request: str) -> str:
        return SIM_REQUEST if sim else request

    found = [
        RigCommand("render", ("render", *paced, *package), asks(REQUEST)),
        RigCommand("capture friction", ("capture", "friction", *paced), asks(EMPTY_REQUEST)),
        RigCommand("capture cut", ("capture", "cut", *paced), asks(CLEAR_REQUEST)),
    ]
    if camera != NONE:
        words = ("track", *on, "--camera", camera)
        found.append(RigCommand("track", words, asks(TRACK_REQUEST)))
    return tuple(found)


def prototype_server(workspace: Workspace, options: PrototypeOptions) -> "PrototypeServer":
    """A server of the package's page that follows the workspace's rig; see `serve`.

    Raises InputError where aiohttp is not installed or a camera has no device, MissingError where
    the page was not built and cannot be, and what `workspace_scene` raises.
    """
    _require_aiohttp()
    from scissorcal.prototype.server import PrototypeServer

    device, camera, package_path = options.device, options.camera, options.package_path
    if camera != NONE and device == NONE:
        raise InputError("--camera is for a track that the page starts: name a --device, too.")
    scene = workspace_scene(workspace, package_path)
    ensure_page()
    commands: tuple[RigCommand, ...] = ()
    if device != NONE:
        commands = rig_commands(workspace, device, camera=camera, package_path=package_path)
    return PrototypeServer(
        lambda socket: (page_of(scene, socket=socket), policy_of(served=True)),
        workspace.captures_dir,
        workspace.root,
        commands,
        port=options.port,
    )


def serve(server: "PrototypeServer", ready: Callable[[str], None]) -> str:
    """Serve until Ctrl-C (or a request to terminate); returns the address without its token.

    ``ready`` is told the address with its token. A command that the page started is ended first.
    Raises InputError where the port is taken.
    """

    async def run() -> str:
        over = asyncio.Event()
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, over.set)
        async with server:
            ready(server.url)
            await server.run(over)
            return server.url.partition("?")[0]

    return asyncio.run(run())


def export_page(
    workspace: Workspace, path: Path, package_path: Path | None = None, *, overwrite: bool = False
) -> int:
    """Write the package's page as one file that needs no server and no network; gives its bytes.

    Raises InputError where the file is there already, unless ``overwrite``, or is not named as a
    page, and what `workspace_scene` raises.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{path} would not open in a browser: name a file that ends in .html.")
    if path.is_dir() or (path.exists() and not overwrite):
        raise InputError(f"{path} already exists: name another file, or give --overwrite.")
    scene = workspace_scene(workspace, package_path)
    data = page_of(scene).encode("utf-8")
    with replacing(path) as part:
        part.write_bytes(data)
    return len(data)


def _require_aiohttp() -> None:
    """InputError, with the remedy, where the server's library is not installed."""
    try:
        import aiohttp  # noqa: F401
    except ImportError:
        export = "write the page into a file with 'scissorcal package export --html FILE'"
        raise needs_extra("The page's server", "aiohttp", "prototype", export) from None
