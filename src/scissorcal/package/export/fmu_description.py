"""What an FMU states of itself: modelDescription.xml and sources/buildDescription.xml."""

import uuid
from collections.abc import Sequence
from xml.etree import ElementTree as Xml

from scissorcal.identity import VERSION
from scissorcal.package.export.facts import ExportFacts
from scissorcal.package.records import Parameter

_NAMESPACE = uuid.UUID("6ba7b811-9dad-11d1-80b4-00c04fd430c8")  # of addresses, RFC 4122
_UNITS: dict[str, dict[str, int]] = {
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "m": {"m": 1},
    "s": {"s": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
}
OUTPUTS = ("torque", "force", "crack", "flags")
INPUTS = ("opening", "rate", "advance")
NAMES = ("time", *INPUTS, *OUTPUTS, "draw", "crack_start")
"""Variables in the order of their references, as fmu.h has them; the parameters follow."""


def model_identifier(facts: ExportFacts) -> str:
    """The package's name as C takes it."""
    name = "".join(c if c.isascii() and c.isalnum() else "_" for c in facts.manifest.name)
    return name if name[0].isalpha() else f"package_{name}"


def token(facts: ExportFacts) -> str:
    """What binds a binary to its description: of package, version and signature."""
    text = f"{facts.manifest.content_hash}/{VERSION}/{facts.signature}"
    return f"{{{uuid.uuid5(_NAMESPACE, text)}}}"


def parameters(facts: ExportFacts) -> list[tuple[str, Parameter]]:
    """The fits' parameters by their names in the FMU, in the order of their references."""
    record = facts.manifest.provenance
    parts = {"cut": record.cut, "friction": record.friction}
    return [
        (f"{what}.{parameter.name}", parameter)
        for what, part in parts.items()
        if part
        for parameter in part.parameters
    ]


def start_values(facts: ExportFacts) -> tuple[float, float]:
    """Opening (rad) and advance (m) before anything is set: open, at the nearest contact."""
    ranges = facts.manifest.ranges
    return ranges.opening_rad[1], -ranges.contact_m[0]


def model_description(facts: ExportFacts, draws: int) -> bytes:
    """modelDescription.xml of an FMU with that many draws, that of the means among them."""
    manifest, own = facts.manifest, parameters(facts)
    root = Xml.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=manifest.name,
        instantiationToken=token(facts),
        description=" ".join(f"{line}." for line in (*facts.identity, *facts.covered)),
        version=manifest.content_hash[:16],
        license="BSD-3-Clause for the sources; the tables belong to the lab that built them",
        generationTool=f"scissorcal {VERSION}",
        variableNamingConvention="structured",
    )
    step = 1.0 / manifest.mechanics.loop_rate_Hz
    Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=model_identifier(facts),
        canHandleVariableCommunicationStepSize="true",
        canGetAndSetFMUState="true",
    )
    _units(Xml.SubElement(root, "UnitDefinitions"))
    categories = Xml.SubElement(root, "LogCategories")
    for name in ("logStatusWarning", "logStatusError"):
        Xml.SubElement(categories, "Category", name=name)
    Xml.SubElement(root, "DefaultExperiment", startTime="0.0", stopTime="1.0", stepSize=repr(step))
    _variables(Xml.SubElement(root, "ModelVariables"), facts, own, draws)
    _structure(Xml.SubElement(root, "ModelStructure"), len(own))
    return _text(root)


def build_description(facts: ExportFacts, sources: Sequence[str]) -> bytes:
    """sources/buildDescription.xml: what an importer compiles."""
    root = Xml.Element("fmiBuildDescription", fmiVersion="3.0")
    build = Xml.SubElement(root, "BuildConfiguration", modelIdentifier=model_identifier(facts))
    files = Xml.SubElement(
        build, "SourceFileSet", language="C99", compilerOptions="-ffp-contract=off"
    )
    for name in sources:
        Xml.SubElement(files, "SourceFile", name=name)
    return _text(root)


def _units(parent: Xml.Element) -> None:
    for name, powers in _UNITS.items():
        unit = Xml.SubElement(parent, "Unit", name=name)
        base = Xml.SubElement(unit, "BaseUnit")
        for name_of_base, power in powers.items():
            base.set(name_of_base, str(power))


_FIXED = {"causality": "parameter", "variability": "fixed", "initial": "exact"}
_CALCULATED = {"causality": "output", "initial": "calculated"}
_FLAGS = "1 invalid, 2 touching, 4 advanced, 8 out of range, 16 beyond tip, 32 not cutting"
_DRAW = (
    "index of the draw that is simulated, of the posterior or of the stated numbers; -1: the "
    "package's own parameters; the largest: the means (medians where a mean and an sd do not "
    "describe the draws)"
)


def _variables(
    parent: Xml.Element, facts: ExportFacts, own: Sequence[tuple[str, Parameter]], draws: int
) -> None:
    """In the order of their references."""
    opening, advance = start_values(facts)

    def add(kind: str, name: str, description: str, **more: str) -> None:
        facts = {"name": name, "valueReference": str(len(parent)), "description": description}
        Xml.SubElement(parent, kind, facts | more)

    def real(name: str, unit: str, description: str, **more: str) -> None:
        add("Float64", name, description, unit=unit, **{"variability": "continuous"} | more)

    real("time", "s", "simulated time", causality="independent")
    for name, unit, start, words in (
        ("opening", "rad", opening, "opening of the blades"),
        ("rate", "rad/s", 0.0, "rate of the opening, negative while closing"),
        ("advance", "m", advance, "place of the pivot along the cut"),
    ):
        real(name, unit, f"{words}; held over each step", causality="input", start=f"{start!r}")
    real("torque", "N.m", "torque on the pivot, positive opens; not limited", **_CALCULATED)
    real("force", "N", "force on the pivot along the cut; not limited", **_CALCULATED)
    real("crack", "m", "place of the crack's tip; it never goes back", **_CALCULATED)
    add("UInt32", "flags", _FLAGS, variability="discrete", **_CALCULATED)
    add("Int32", "draw", _DRAW, start="-1", min="-1", max=str(draws - 1), **_FIXED)
    real("crack_start", "m", "place of the crack's tip at the start", start="0.0", **_FIXED)
    calculated = {"causality": "calculatedParameter", "variability": "fixed"}
    record = facts.manifest.provenance
    parts = {"cut": record.cut, "friction": record.friction}
    stated = {what for what, part in parts.items() if part and part.stated}
    for name, item in own:
        mean = "mean of the draws" if name.partition(".")[0] in stated else "posterior mean"
        words = f"{item.unit}; {mean} {item.mean:.6g}, sd {item.sd:.2g}; value of the draw"
        add("Float64", name, words, initial="calculated", **calculated)


def _structure(parent: Xml.Element, parameters_count: int) -> None:
    """Outputs follow from the inputs of a step; at the start from the two parameters, too."""
    inputs = [str(NAMES.index(name)) for name in INPUTS]
    draw, start = (str(NAMES.index(name)) for name in ("draw", "crack_start"))
    for name in OUTPUTS:
        Xml.SubElement(
            parent, "Output", valueReference=str(NAMES.index(name)), dependencies=" ".join(inputs)
        )
    for name in OUTPUTS:
        known = [start] if name == "crack" else [*inputs, draw, start]
        Xml.SubElement(
            parent,
            "InitialUnknown",
            valueReference=str(NAMES.index(name)),
            dependencies=" ".join(known),
        )
    for index in range(parameters_count):
        Xml.SubElement(
            parent,
            "InitialUnknown",
            valueReference=str(len(NAMES) + index),
            dependencies=draw,
        )


def _text(root: Xml.Element) -> bytes:
    Xml.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + Xml.tostring(root) + b"\n"
