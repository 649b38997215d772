"""A package as an FMU: valid, and step for step what the package's kernel computes."""

import shutil
import subprocess
import warnings
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np
import pytest

from scissorcal import Blades, Friction, Material, build_package
from scissorcal.errors import InputError
from scissorcal.kernel import Kernel, StepFlag
from scissorcal.package import ModelPackage, PackageSummary, open_package
from scissorcal.package.export import export_facts, fmu, write_c, write_fmu
from scissorcal.package.export.draw_tables import draw_tables
from scissorcal.package.export.fmu_description import NAMES, model_description

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import fmpy
    from fmpy.fmi1 import FMICallException
    from fmpy.fmi3 import FMU3Slave
    from fmpy.validation import validate_fmu

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")

INPUTS, OUTPUTS = NAMES[1:4], NAMES[4:7]
STEP_s = 2.0**-10
"""Times of the steps are exact, so that an importer interpolates no input."""
STEPS = 500


@pytest.fixture(scope="module")
def package(paper: PackageSummary) -> ModelPackage:
    return open_package(paper.path, warn=False)


@pytest.fixture(scope="module")
def file(package: ModelPackage, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU with this computer's binary alone."""
    path = tmp_path_factory.mktemp("fmu") / "paper.fmu"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fmu, "find_spec", lambda name: None)
        made = write_fmu(package, export_facts(package, count=False), path)
    assert len(made.platforms) == 1
    return path


@pytest.fixture(scope="module")
def unpacked(file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unpacked")
    fmpy.extract(str(file), unzipdir=str(folder))
    return folder


class Run:
    """An instance in initialization mode, and the messages that it logged."""

    def __init__(self, folder: Path, token: str | None = None) -> None:
        self.messages: list[str] = []
        described = fmpy.read_model_description(str(folder))
        self.slave = FMU3Slave(
            instanceName="run",
            guid=token or described.instantiationToken,
            modelIdentifier=described.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
        )
        self.slave.instantiate(logMessage=lambda *words: self.messages.append(words[3].decode()))

    def start(self, **parameters: float) -> "Run":
        for name, value in parameters.items():
            setter = self.slave.setInt32 if name == "draw" else self.slave.setFloat64
            setter([NAMES.index(name)], [value])
        self.slave.enterInitializationMode(startTime=0.0)
        self.slave.exitInitializationMode()
        return self

    def get(self) -> list[float]:
        values = self.slave.getFloat64([NAMES.index(name) for name in OUTPUTS])
        return [*values, *self.slave.getUInt32([NAMES.index("flags")])]

    def set(self, place: Any) -> None:
        references = [NAMES.index(name) for name in INPUTS]
        self.slave.setFloat64(references, [float(part) for part in place])

    def step(self, index: int, place: Any) -> list[float]:
        self.set(place)
        self.slave.doStep(index * STEP_s, STEP_s)
        return self.get()


@contextmanager
def running(folder: Path) -> Iterator[Run]:
    run = Run(folder)
    yield run
    run.slave.freeInstance()


def stroke(package: ModelPackage) -> np.ndarray:
    """Opening, rate and advance (n, 3) in float32: closing, opening again, closing."""
    low, high = package.manifest.ranges.opening_rad
    phase = np.linspace(0.0, 3.0 * np.pi, STEPS)
    opening = low + 0.5 * (high - low) * (1.0 + np.cos(phase))
    rate = np.gradient(opening, STEP_s)
    advance = np.linspace(-0.02, 0.02, STEPS)
    return np.column_stack([opening, rate, advance]).astype(np.float32)


def kernel_steps(kernel: Kernel, places: np.ndarray) -> np.ndarray:
    rows = []
    for place in places.tolist():
        out = kernel.step(*place)
        rows.append((out.torque, out.force, kernel.crack, out.flags))
    return np.array(rows)


def test_the_fmu_is_valid(file: Path, package: ModelPackage) -> None:
    assert validate_fmu(str(file)) == []
    described = fmpy.read_model_description(str(file))
    assert described.fmiVersion == "3.0"
    names = [variable.name for variable in described.modelVariables]
    assert tuple(names[: len(NAMES)]) == NAMES
    cut = package.manifest.provenance.cut
    assert f"cut.{cut.parameters[0].name}" in names
    assert package.manifest.content_hash in described.description
    assert "signature: not signed" in described.description


def test_equal_packages_give_equal_fmus(
    file: Path, package: ModelPackage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fmu, "find_spec", lambda name: None)
    made = fmu.build_fmu(package, export_facts(package, count=False))
    with zipfile.ZipFile(file) as archive:
        names = [name for name in archive.namelist() if not name.startswith("binaries/")]
        texts = {name: archive.read(name) for name in names}
    file.with_name("again.fmu").write_bytes(made.data)
    with zipfile.ZipFile(file.with_name("again.fmu")) as archive:
        assert {name: archive.read(name) for name in names} == texts


def test_a_simulated_stroke_has_the_kernels_bits(file: Path, package: ModelPackage) -> None:
    places = stroke(package)
    time = np.arange(STEPS) * STEP_s
    kind = [("time", np.float64), *((name, np.float64) for name in INPUTS)]
    signals = np.array([(t, *row) for t, row in zip(time, places.tolist(), strict=True)], kind)
    result = fmpy.simulate_fmu(
        str(file),
        stop_time=float(time[-1]),
        step_size=STEP_s,
        output_interval=STEP_s,
        input=signals,
        output=[*OUTPUTS, "flags"],
    )
    wanted = kernel_steps(package.kernel(), places[:-1])
    found = np.array([list(row)[1:] for row in result.tolist()])[1:]
    assert np.array_equal(found, wanted)
    assert np.any(found[:, 3].astype(int) & StepFlag.ADVANCED)


def test_before_the_first_step_nothing_has_moved(unpacked: Path, package: ModelPackage) -> None:
    place = stroke(package)[200]
    kernel = package.kernel()
    kernel.reset(0.01)
    with running(unpacked) as run:
        run.start(crack_start=0.01)
        run.set(place)
        torque, force, crack, _ = run.get()
        out = kernel.step(*place.tolist())
        assert (torque, force, crack) == (out.torque, out.force, float(np.float32(0.01)))
        assert run.step(0, place)[2] == kernel.crack


@pytest.mark.parametrize("draw", [0, 7, 200])
def test_a_draw_is_simulated_by_its_index(unpacked: Path, package: ModelPackage, draw: int) -> None:
    tables = draw_tables(package)
    places = stroke(package)
    with running(unpacked) as run:
        run.start(draw=draw)
        found = np.array([run.step(index, place) for index, place in enumerate(places)])
        count = tables.parameters.shape[1]
        stated = run.slave.getFloat64([len(NAMES) + index for index in range(count)])
    assert np.array_equal(found, kernel_steps(Kernel(tables.models[draw]), places))
    assert not np.array_equal(found, kernel_steps(package.kernel(), places))
    assert np.array_equal(stated, tables.parameters[1 + draw])


def test_the_largest_index_holds_the_posterior_means(package: ModelPackage) -> None:
    tables, record = draw_tables(package), package.manifest.provenance
    assert record.friction is not None
    fitted = (*record.cut.parameters, *record.friction.parameters)
    wanted = [p.mean for p in fitted]
    assert tables.parameters[-1] == pytest.approx(wanted, rel=1e-12)
    assert not np.array_equal(tables.parameters[-1], tables.parameters[0])


def test_draws_tables_follow_the_exact_law_of_their_draw(pad: PackageSummary) -> None:
    """Without a ripple, so that the kernel's torque is the mean that the exact law has."""
    package = open_package(pad.path, warn=False)
    tables, ranges = draw_tables(package), package.manifest.ranges
    rng, limit = np.random.default_rng(8), package.manifest.limits.torque_Nm
    opening, contact = rng.uniform(*ranges.opening_rad, 400), rng.uniform(*ranges.contact_m, 400)
    rate = -rng.uniform(*ranges.opening_rate_rad_per_s, 400)
    exact = package._drawn.torque(opening, rate, contact).clip(-limit, limit)
    assert tables.varied == ("response",)
    for model, wanted in zip(tables.models[:-1], exact, strict=True):
        torque = Kernel(model).torque(opening, rate, contact).clip(-limit, limit)
        assert np.max(np.abs(torque - wanted)) < package.manifest.bound.stated_Nm


def test_steps_backwards_of_no_length_and_over_a_gap_are_refused(
    unpacked: Path, package: ModelPackage
) -> None:
    places = stroke(package)
    with running(unpacked) as run:
        run.start()
        for index in range(3):
            run.step(index, places[index])
        before = run.get()
        for at, size, words in (
            (1, STEP_s, "does not heal"),
            (3, 0.0, "above 0"),
            (3, -STEP_s, "above 0"),
            (3, np.nan, "above 0"),
            (5, STEP_s, "without gaps"),
        ):
            with pytest.raises(FMICallException) as refused:
                run.slave.doStep(at * STEP_s, size)
            assert refused.value.status == 3
            assert words in run.messages[-1]
            assert run.get() == before
        run.step(3, places[3])


def test_a_copied_state_is_stepped_again_from_its_time(
    unpacked: Path, package: ModelPackage
) -> None:
    places = stroke(package)
    with running(unpacked) as run:
        run.start(draw=3)
        for index in range(100):
            run.step(index, places[index])
        kept = run.slave.getFMUState()
        first = [run.step(index, places[index]) for index in range(100, 200)]
        run.slave.setFMUState(kept)
        again = [run.step(index, places[index]) for index in range(100, 200)]
        run.slave.freeFMUState(kept)
    assert first == again


def test_an_input_that_cannot_be_evaluated_is_a_warning(
    unpacked: Path, package: ModelPackage
) -> None:
    place = stroke(package)[100]
    with running(unpacked) as run:
        run.start()
        crack = run.step(0, place)[2]
        torque, force, still, flags = run.step(1, (np.nan, 0.0, 0.0))
        assert (torque, force, still) == (0.0, 0.0, crack)
        assert int(flags) == StepFlag.INVALID
        assert "cannot be evaluated" in run.messages[-1]


def test_parameters_are_set_before_a_run_and_draws_exist(unpacked: Path) -> None:
    with running(unpacked) as run:
        for draw in (-2, 201):
            with pytest.raises(FMICallException):
                run.slave.setInt32([NAMES.index("draw")], [draw])
        run.start(draw=200)
        for name, setter in (("draw", "setInt32"), ("crack_start", "setFloat64")):
            with pytest.raises(FMICallException):
                getattr(run.slave, setter)([NAMES.index(name)], [0])
            assert "until initialization" in run.messages[-1]
        with pytest.raises(FMICallException):
            run.slave.setFloat64([NAMES.index("torque")], [1.0])
        run.slave.reset()
        run.start()
        assert run.slave.getInt32([NAMES.index("draw")]) == [-1]


def test_the_binary_of_another_fmu_is_refused(unpacked: Path) -> None:
    with pytest.raises(Exception, match="Failed to instantiate"):
        Run(unpacked, token="{another}")


def test_what_is_not_supported_says_its_name(unpacked: Path) -> None:
    with running(unpacked) as run:
        run.start()
        with pytest.raises(FMICallException):
            run.slave.enterEventMode()
        assert run.messages[-1] == "the FMU does not support fmi3EnterEventMode"


def test_without_a_compiler_the_fmu_has_sources_only(
    package: ModelPackage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fmu, "find_spec", lambda name: None)
    monkeypatch.setattr(fmu.shutil, "which", lambda name: None)
    made = write_fmu(package, export_facts(package, count=False), tmp_path / "s.fmu")
    assert made.platforms == ()
    assert "sources only" in made.notes[0]
    assert validate_fmu(str(tmp_path / "s.fmu")) == []
    with pytest.raises(InputError, match=r"ends in \.fmu"):
        write_fmu(package, export_facts(package, count=False), tmp_path / "s.zip")


@pytest.mark.slow
def test_an_importer_compiles_the_sources_to_the_same_bits(
    file: Path, package: ModelPackage, tmp_path: Path
) -> None:
    """As an importer does: what buildDescription.xml names, with the function prefix overridden."""
    fmpy.extract(str(file), unzipdir=str(tmp_path))
    (files,) = Xml.parse(tmp_path / "sources" / "buildDescription.xml").iter("SourceFileSet")
    names = [source.attrib["name"] for source in files.iter("SourceFile")]
    (binary,) = (tmp_path / "binaries").rglob("*.so")
    before = binary.read_bytes()
    binary.unlink()
    words = ["cc", "-shared", "-fPIC", "-DFMI3_OVERRIDE_FUNCTION_PREFIX"]
    words += files.attrib["compilerOptions"].split()
    words += ["-Wall", "-Wextra", "-Werror", *names, "-o", str(binary), "-lm"]
    subprocess.run(words, cwd=tmp_path / "sources", check=True)
    assert binary.read_bytes() != before
    places = stroke(package)
    with running(tmp_path) as run:
        run.start()
        found = np.array([run.step(index, place) for index, place in enumerate(places)])
    assert np.array_equal(found, kernel_steps(package.kernel(), places))


@pytest.mark.slow
def test_ziglang_builds_the_other_platforms(package: ModelPackage, tmp_path: Path) -> None:
    pytest.importorskip("ziglang")
    made = write_fmu(package, export_facts(package, count=False), tmp_path / "all.fmu")
    assert {"x86_64-linux", "aarch64-linux", "x86_64-windows"} <= set(made.platforms)
    assert validate_fmu(str(tmp_path / "all.fmu")) == []
    with zipfile.ZipFile(tmp_path / "all.fmu") as archive:
        heads = {
            name.split("/")[1]: archive.read(name)[:4]
            for name in archive.namelist()
            if name.startswith("binaries/")
        }
    assert heads["aarch64-linux"] == b"\x7fELF"
    assert heads["x86_64-windows"][:2] == b"MZ"


def test_numbers_that_were_stated_are_not_called_fitted(tmp_path: Path) -> None:
    paper = Material(force_N=(2.0, 0.1), exponent=1.4, toughness_J_per_m2=4000.0, thickness_mm=0.1)
    blades, friction = Blades(length_mm=75.0, taper_deg=2.0), Friction(coulomb_Nm=0.01)
    facts = export_facts(build_package(paper, blades, friction, tmp_path / "p.zip"), count=False)
    described = model_description(facts, 201).decode()
    write_c(open_package(tmp_path / "p.zip", warn=False), facts, tmp_path / "c")
    written = [path.read_text(encoding="utf-8") for path in (tmp_path / "c").glob("*[dh]")]
    assert "N; mean of the draws 2.0" in described
    assert len(written) > 3
    for text in (described, *written):
        assert "fitted" not in text
        assert "posterior mean" not in text
