"""A package as C: built without Python, warnings as errors, bit for bit as the kernel."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from scissorcal import examples
from scissorcal.errors import InputError
from scissorcal.kernel import StepFlag, c_sources
from scissorcal.package import ModelPackage, PackageSummary, open_package, put_review
from scissorcal.package.export import export_facts, write_c, write_header
from tests.package.test_signature import key_of, review_of

WARNINGS = (
    *("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror"),
    *("-Wconversion", "-Wdouble-promotion"),
)
ZIG = (sys.executable, "-m", "ziglang", "cc")
CORTEX_M4F = ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m4+vfp4d16sp")
STATES = 10_000

needs_compiler = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def run(*words: str | Path, cwd: Path, given: str = "") -> str:
    ran = subprocess.run(
        [str(word) for word in words],
        cwd=cwd,
        input=given,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def exported(package: ModelPackage, folder: Path) -> Path:
    write_c(package, export_facts(package, count=False), folder)
    return folder


def built(compiler: tuple[str, ...], folder: Path) -> Path:
    """The program, by a compiler alone."""
    sources = sorted(path.name for path in folder.glob("*.c"))
    run(*compiler, *WARNINGS, "-o", "stroke", *sources, "-lm", cwd=folder)
    return folder / "stroke"


def bits(values: object) -> np.ndarray:
    return np.asarray(values, dtype=np.float32).view(np.uint32)


def steps(text: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of a program's lines: inputs (n, 3), flags (n,), and torque, force and crack (n, 3)."""
    lines = [line.split() for line in text.splitlines() if not line.startswith("#")]
    inputs = np.array([[float(word) for word in line[:3]] for line in lines], dtype=np.float32)
    decimal = np.array([[float(word) for word in line[3:6]] for line in lines])
    exact = np.array([[float.fromhex(word) for word in line[7:]] for line in lines])
    assert np.array_equal(bits(decimal), bits(exact))
    return inputs, np.array([int(line[6]) for line in lines]), exact


def random_states(package: ModelPackage, rng: np.random.Generator) -> np.ndarray:
    """Crack, opening, rate and advance (n, 4) in float32: in the ranges and around them."""
    ranges = package.manifest.ranges
    wide = [(-0.3, 1.3), (-1.5, 1.5), (-0.2, 1.4)]
    unit = [rng.uniform(low, high, STATES) for low, high in wide]
    opening = ranges.opening_rad[0] + unit[0] * np.ptp(ranges.opening_rad)
    rate = unit[1] * ranges.opening_rate_rad_per_s[1]
    contact = ranges.contact_m[0] + unit[2] * np.ptp(ranges.contact_m)
    crack = rng.uniform(0.0, 0.1, STATES)
    states = np.column_stack([crack, opening, rate, crack - contact]).astype(np.float32)
    states[::1000, 2] = np.inf
    states[::1500, 1] = np.nan
    return states


def assert_equal_bits(program: Path, package: ModelPackage) -> None:
    """A stroke and random states, of the program and of the package's kernel."""
    kernel = package.kernel()
    inputs, flags, found = steps(run(program, cwd=program.parent))
    assert len(inputs) == 401
    for place, flag, values in zip(inputs.tolist(), flags, found, strict=True):
        out = kernel.step(*place)
        assert np.array_equal(bits(values), bits([out.torque, out.force, kernel.crack]))
        assert flag == out.flags

    states = random_states(package, np.random.default_rng(20))
    lines = [
        f"crack {crack.hex()}\n{opening.hex()} {rate.hex()} {advance.hex()}\n"
        for crack, opening, rate, advance in states.astype(np.float64).tolist()
    ]
    _, flags, found = steps(run(program, "-", cwd=program.parent, given="".join(lines)))
    wanted = []
    for crack, *place in states.tolist():
        kernel.reset(crack)
        out = kernel.step(*place)
        wanted.append((out.torque, out.force, kernel.crack, out.flags))
    assert np.array_equal(bits(found), bits([row[:3] for row in wanted]))
    assert np.array_equal(flags, [row[3] for row in wanted])
    assert np.mean(flags & StepFlag.TOUCHING > 0) > 0.1
    assert np.any(flags & StepFlag.INVALID)


@needs_compiler
@pytest.mark.parametrize("name", ["paper", "pad"])
def test_the_program_gives_the_kernels_bits(
    name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    summary: PackageSummary = request.getfixturevalue(name)
    package = open_package(summary.path, warn=False)
    folder = exported(package, tmp_path / "c")
    assert_equal_bits(built(("cc", "-pedantic"), folder), package)
    readme = (folder / "README.md").read_text(encoding="utf-8")
    assert package.manifest.content_hash in readme
    assert "signature: not signed" in readme
    assert f"error bound {package.manifest.bound.stated_Nm:.2g} N m" in readme


@needs_compiler
@pytest.mark.skipif(shutil.which("c++") is None, reason="no C++ compiler")
def test_a_program_in_cpp_links_with_the_step(paper: PackageSummary, tmp_path: Path) -> None:
    package = open_package(paper.path, warn=False)
    folder = exported(package, tmp_path / "c")
    (folder / "use.cpp").write_text(
        '#include "scissorcal_package.h"\n#include <cstdio>\n'
        "int main()\n{\n    sc_crack crack = {};\n    sc_step_output out;\n"
        "    sc_model_step(&scissorcal_package, &crack, 0.4f, -0.3f, -0.02f, &out);\n"
        '    std::printf("%a\\n", static_cast<double>(out.torque));\n}\n'
    )
    library = [path.name for path in folder.glob("sc_*.c")]
    run("cc", *WARNINGS, "-c", *library, cwd=folder)
    objects = [Path(name).with_suffix(".o") for name in library]
    warnings = ("-std=c++20", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off")
    run("c++", *warnings, "use.cpp", *objects, "-o", "use", cwd=folder)
    torque = float.fromhex(run(folder / "use", cwd=folder))
    assert torque == package.kernel().step(0.4, -0.3, -0.02).torque != 0.0


@pytest.mark.slow
def test_every_compiler_takes_it_and_gives_the_same_bits(
    paper: PackageSummary, tmp_path: Path
) -> None:
    package = open_package(paper.path, warn=False)
    folder = exported(package, tmp_path / "c")
    compilers = [ZIG]
    compilers += [(name,) for name in ("gcc", "clang") if shutil.which(name)]
    for compiler in compilers:
        assert_equal_bits(built(compiler, folder), package)
    free = (*CORTEX_M4F, "-fno-builtin", "-fno-math-errno", "-Ifreestanding", "-c")
    library = [path.name for path in folder.glob("sc_*.c")]
    for source in [*library, "freestanding/library.c"]:
        run(*ZIG, *WARNINGS, *free, source, "-o", "x.o", cwd=folder)
    (folder / "use.c").write_text(
        '#include "scissorcal_package.h"\n'
        "float torque_at(float opening);\n"
        "float torque_at(float opening)\n"
        "{\n    return sc_model_settled_torque(&scissorcal_package, opening, -0.1f, 0.03f);\n}\n"
    )
    run(*ZIG, *WARNINGS, *free, "use.c", "-o", "x.o", cwd=folder)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cmake") is None, reason="no cmake")
def test_cmake_builds_installs_and_pkg_config_finds_it(
    paper: PackageSummary, tmp_path: Path
) -> None:
    package = open_package(paper.path, warn=False)
    folder, place = exported(package, tmp_path / "c"), tmp_path / "installed"
    run("cmake", "-B", "build", cwd=folder)
    run("cmake", "--build", "build", cwd=folder)
    run("cmake", "--install", "build", "--prefix", place, cwd=folder)
    assert_equal_bits(folder / "build" / "stroke", package)
    if shutil.which("pkg-config") is None:
        pytest.skip("no pkg-config")
    (found,) = place.rglob("scissorcal-model.pc")
    said = run(
        *("env", f"PKG_CONFIG_PATH={found.parent}", "pkg-config"),
        *("--cflags", "--libs", "scissorcal-model"),
        cwd=folder,
    )
    flags = said.split()
    run("cc", folder / "main.c", *flags, "-o", "linked", cwd=tmp_path)
    assert run(tmp_path / "linked", cwd=tmp_path) == run(folder / "build/stroke", cwd=folder)


def test_the_program_names_a_line_that_it_cannot_read(
    paper: PackageSummary, tmp_path: Path
) -> None:
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    folder = exported(open_package(paper.path, warn=False), tmp_path / "c")
    program = built(("cc",), folder)
    ran = subprocess.run(
        [program, "-"], input="0.5 0 0\nnonsense\n", capture_output=True, text=True, check=False
    )
    assert ran.returncode == 2
    assert "line 2" in ran.stderr


def test_the_project_holds_the_steps_sources_and_no_other(
    paper: PackageSummary, tmp_path: Path
) -> None:
    folder = exported(open_package(paper.path, warn=False), tmp_path / "c")
    core = {path.name for path in c_sources().iterdir() if path.is_file()}
    taken = {path.name for path in folder.iterdir()} & core
    assert {"sc_model.c", "sc_release.c", "sc_fracture.c", "sc_turn.h"} <= taken
    assert not {name for name in taken if re.search("servo|block|pieces|hybrid|crack", name)}
    for name in taken:
        assert (folder / name).read_bytes() == (c_sources() / name).read_bytes()
    free = {path.name: path.read_bytes() for path in (folder / "freestanding").iterdir()}
    kept = c_sources() / "freestanding"
    assert free == {path.name: path.read_bytes() for path in kept.iterdir()}


def test_the_pages_figures_are_those_of_the_example(tmp_path: Path) -> None:
    page = Path(__file__).parents[2] / "docs" / "export.md"
    if not page.is_file():
        pytest.skip("runs from a checkout only")
    text = page.read_text(encoding="utf-8")
    package = open_package(examples.path("paper-package"), warn=False)
    facts = export_facts(package, count=False)
    write_c(package, facts, tmp_path / "c")
    files = [path.stat().st_size for path in (tmp_path / "c").rglob("*") if path.is_file()]
    stated = re.search(
        r"paper-c: (\d+) files, ([\d.]+) kB; tables (\d+) bytes, .* ([\d.e-]+) N", text
    )
    assert stated is not None
    count, kilobytes, tables, bound = map(float, stated.groups())
    assert (count, tables) == (len(files), facts.table_bytes)
    assert kilobytes == pytest.approx(sum(files) / 1000, rel=0.05)
    assert f"model {facts.model_bytes} bytes" in text
    assert bound == float(f"{package.manifest.bound.stated_Nm:.2g}")
    inputs, flags, found = steps(
        "\n".join(line.strip() for line in text.splitlines() if re.search(r" 0x.*p-\d+$", line))
    )
    assert len(inputs) == 2
    for place, flag, values in zip(inputs.tolist(), flags, found, strict=True):
        out = (kernel := package.kernel()).step(*place)
        assert np.array_equal(bits(values), bits([out.torque, out.force, kernel.crack]))
        assert flag == out.flags


def test_the_licence_is_that_of_the_project(paper: PackageSummary, tmp_path: Path) -> None:
    licence = Path(__file__).parents[2] / "LICENSE"
    if not licence.is_file():
        pytest.skip("runs from a checkout only")
    folder = exported(open_package(paper.path, warn=False), tmp_path / "c")
    assert (folder / "LICENSE").read_bytes() == licence.read_bytes()


def test_the_header_states_its_package_and_bytes(paper: PackageSummary, tmp_path: Path) -> None:
    package = open_package(paper.path, warn=False)
    facts = export_facts(package)
    size = write_header(package, facts, tmp_path / "paper.h")
    text = (tmp_path / "paper.h").read_text(encoding="utf-8")
    assert size == len(text.encode())
    assert f'SCISSORCAL_PACKAGE_HASH "{package.manifest.content_hash}"' in text
    floats = sum(int(n) for n in re.findall(r"^static const float \w+\[(\d+)\]", text, re.M))
    assert facts.table_bytes == 4 * floats
    assert f"tables {facts.table_bytes} bytes" in text
    assert "instructions" in text
    for refused in ("paper.txt", "paper.h"):
        with pytest.raises(InputError):
            write_header(package, facts, tmp_path / refused)
    write_header(package, facts, tmp_path / "paper.h", overwrite=True)


def test_a_folder_with_something_in_it_is_kept(paper: PackageSummary, tmp_path: Path) -> None:
    package = open_package(paper.path, warn=False)
    facts = export_facts(package, count=False)
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="already exists"):
        write_c(package, facts, tmp_path)
    write_c(package, facts, tmp_path, overwrite=True)
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_what_the_step_lacks_is_refused(paper: PackageSummary) -> None:
    package = open_package(paper.path, warn=False)
    piece = {
        "begin_m": 0.0,
        "upper_face_m": 5e-5,
        "scale": 1.0,
        "strips": [{"end_m": 0.1, "fracture_energy_J_per_m": 0.5}],
    }
    for change, words in (
        ({"pieces": [piece]}, "drawn plate of 1 pieces"),
        ({"plate_pose": "estimated"}, "pose of its plate"),
    ):
        facts = json.loads(package.manifest.model_dump_json()) | change
        other = type(package.manifest).model_validate_json(json.dumps(facts))
        with pytest.raises(InputError, match=words):
            export_facts(replace(package, manifest=other))


def test_the_signature_is_named_and_a_forged_one_refused(
    paper: PackageSummary, tmp_path: Path
) -> None:
    package = open_package(paper.path, warn=False)
    assert export_facts(package).signature == "not signed"
    lab = key_of(tmp_path, "lab")
    signed = put_review(package, review_of(package, lab, "accept"), tmp_path / "s.zip", lab)
    facts = export_facts(signed)
    assert facts.signature == "signed"
    write_header(signed, facts, tmp_path / "s.h")
    assert "signature: signed (signed with the key SHA256:" in (tmp_path / "s.h").read_text()
    forged = signed.manifest.model_copy(update={"review": None})
    with pytest.raises(InputError, match="not of this package"):
        export_facts(replace(signed, manifest=forged))
