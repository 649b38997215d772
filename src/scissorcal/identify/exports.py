"""Write an identified joint for other programs, with what each of them cannot express.

Every text says by how much (rms and 99 % of the log's windows, in N m or N) the target's law is off
the fitted one.
"""

import json
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np

from scissorcal.calibration import friction_curve
from scissorcal.identify.joint import Identified
from scissorcal.identify.simple import full_friction, law_of, simple_law, stateless_friction
from scissorcal.identify.words import plain

TIMESTEP_S = 0.001
INTEGRATOR = "implicitfast"
"""Of MuJoCo: it takes damping at the end of the step, without which stiff damping is unstable."""


def export_text(joint: Identified, target: str) -> str:
    """The text of a file for ``target``, one of `TARGETS`."""
    return TARGETS[target](joint)


def off_by(joint: Identified, target: str) -> float:
    """Rms by which the target's friction is off the fitted law, over the motion of the log."""
    if target in ("mujoco", "urdf", "sdf"):
        return simple_law(joint.fit, constant=target == "mujoco").rms
    if target == "c":
        left = full_friction(joint.fit) - stateless_friction(joint.fit)
        return float(np.sqrt(np.mean(left**2)))
    return 0.0


def _facts(joint: Identified, constant: bool) -> list[str]:
    """Sentences on what a Coulomb and viscous law leaves, and on where the numbers are from."""
    fit = joint.fit
    law, unit = simple_law(fit, constant=constant), fit.effort_unit
    lacking = _lacking(joint, constant)
    return [
        f"Identified from {', '.join(recording.source for recording in joint.recordings)}: "
        f"{fit.candidate}.",
        f"Friction here is off the fitted law by {law.rms:.3g} {unit} rms (99 %: {law.worst:.3g} "
        f"{unit}) over the motion of the log, and leaves {law.measured_rms:.3g} {unit} rms of the "
        f"measured effort, where the fitted law leaves {joint.rms:.3g}.",
        *([f"Not expressed: {', '.join(lacking)}."] if lacking else []),
        *_unsized(joint),
    ]


def _unsized(joint: Identified) -> list[str]:
    """A sentence on what the figures of an export leave out: no series of a fit has it."""
    values = joint.fit.best
    named = (("load_share", "what the load adds"), ("cogging_cos", "cogging"))
    lacking = [words for name, words in named if name in values]
    return [f"These figures are without {' and '.join(lacking)}."] if lacking else []


def _lacking(joint: Identified, constant: bool) -> list[str]:
    values = joint.fit.best
    named = (
        ("coulomb_pos", "friction that differs by direction"),
        ("stribeck", "Stribeck friction"),
        ("angle_slope", "change of friction with the position"),
        ("presliding_share", "build-up of friction after reversals"),
        ("load_share", "friction by load"),
        ("cogging_cos", "cogging"),
    )
    lacking = [words for name, words in named if name in values]
    lacking += [f"the term {plain(name)}" for name in joint.fit.structure.get("adopt", ())]
    if not constant and ("offset" in values or "coulomb_pos" in values):
        lacking.append("a constant effort")
    return lacking


def _mujoco(joint: Identified) -> str:
    fit = joint.fit
    law, plain = simple_law(fit, constant=True), simple_law(fit, constant=False)
    inertia, unit = fit.best["inertia"], fit.effort_unit
    kind = "slide" if fit.position_unit == "m" else "hinge"
    added = TIMESTEP_S * law.viscous
    facts = [
        *_facts(joint, constant=True),
        f"Without the constant effort (the actuator below) it is off by {plain.rms:.3g} {unit} "
        f"rms; then damping={plain.viscous:.6g} frictionloss={plain.coulomb:.6g} are closest.",
        f"Timestep {TIMESTEP_S:g} s, integrator {INTEGRATOR}: its implicit step adds timestep x "
        f"damping = {added:.3g} to the inertia ({added / inertia:.2%}).",
        "Armature is the inertia of the joint with all that moved; the body's mass is a "
        "placeholder.",
    ]
    low, high = _range(joint)
    return f"""<mujoco model="identified">
{_xml_comment(facts)}
  <compiler angle="radian"/>
  <option timestep="{TIMESTEP_S:g}" integrator="{INTEGRATOR}" gravity="0 0 0"/>
  <worldbody>
    <body name="moving">
      <joint name="joint" type="{kind}" axis="1 0 0" armature="{inertia:.9g}"
             damping="{law.viscous:.9g}" frictionloss="{law.coulomb:.9g}"/>
      <inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/>
    </body>
  </worldbody>
  <actuator>
    <general name="constant" joint="joint" gainprm="0" biastype="affine"
             biasprm="{-law.offset:.9g} 0 0"/>
  </actuator>
  <custom>
    <numeric name="recorded_range" data="{low:.9g} {high:.9g}"/>
  </custom>
</mujoco>
"""


def _link(joint: Identified) -> tuple[bool, float, float]:
    """Whether the joint is linear; mass and inertia of a link, of which the joint shows one."""
    inertia = joint.fit.best["inertia"]
    linear = joint.fit.position_unit == "m"
    return (True, inertia, 1e-6) if linear else (False, 1e-3, inertia)


def _urdf(joint: Identified) -> str:
    fit, law = joint.fit, simple_law(joint.fit, constant=False)
    linear, mass, turned = _link(joint)
    low, high = _range(joint)
    facts = [
        *_facts(joint, constant=False),
        "The inertia is that of the link below, about the joint's axis; limits are what was "
        "recorded.",
    ]
    fastest = float(np.max(np.abs(fit.series.opening_rate)))
    most = float(np.max(np.abs(fit.series.measured)))
    return f"""<?xml version="1.0"?>
<robot name="identified">
{_xml_comment(facts)}
  <link name="base"/>
  <link name="moving">
    <inertial>
      <mass value="{mass:.9g}"/>
      <inertia ixx="{turned:.9g}" iyy="{turned:.9g}" izz="{turned:.9g}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="joint" type="{"prismatic" if linear else "revolute"}">
    <parent link="base"/>
    <child link="moving"/>
    <axis xyz="1 0 0"/>
    <limit lower="{low:.9g}" upper="{high:.9g}" effort="{most:.6g}" velocity="{fastest:.6g}"/>
    <dynamics damping="{law.viscous:.9g}" friction="{law.coulomb:.9g}"/>
  </joint>
</robot>
"""


def _sdf(joint: Identified) -> str:
    law = simple_law(joint.fit, constant=False)
    linear, mass, turned = _link(joint)
    low, high = _range(joint)
    return f"""<?xml version="1.0"?>
<sdf version="1.9">
{_xml_comment(_facts(joint, constant=False))}
  <model name="identified">
    <link name="base"/>
    <link name="moving">
      <inertial>
        <mass>{mass:.9g}</mass>
        <inertia>
          <ixx>{turned:.9g}</ixx><iyy>{turned:.9g}</iyy><izz>{turned:.9g}</izz>
        </inertia>
      </inertial>
    </link>
    <joint name="joint" type="{"prismatic" if linear else "revolute"}">
      <parent>base</parent>
      <child>moving</child>
      <axis>
        <xyz>1 0 0</xyz>
        <limit><lower>{low:.9g}</lower><upper>{high:.9g}</upper></limit>
        <dynamics><damping>{law.viscous:.9g}</damping><friction>{law.coulomb:.9g}</friction></dynamics>
      </axis>
    </joint>
  </model>
</sdf>
"""


def _c(joint: Identified) -> str:
    fit, law = joint.fit, law_of(joint.fit)
    left, unit = off_by(joint, "c"), fit.effort_unit
    values = fit.best

    def level(name: str, side: str) -> str:
        return repr(float(law[f"{name}_{side}"]))

    adopted = list(fit.structure.get("adopt", ()))
    lacking = [
        *(["build-up of friction after reversals"] if "presliding_share" in values else []),
        *(["friction by load"] if "load_share" in values else []),
        *(["cogging"] if "cogging_cos" in values else []),
        *([f"the added terms {plain(', '.join(adopted))}"] if adopted else []),
    ]
    facts = [
        f"Identified from {', '.join(recording.source for recording in joint.recordings)}: "
        f"{fit.candidate}.",
        f"Off the fitted law by {left:.3g} {unit} rms over the motion of the log"
        + (f": not expressed is {', '.join(lacking)}." if lacking else "."),
        *_unsized(joint),
        f"Position in {fit.position_unit}, effort in {unit}.",
    ]
    comment = "\n".join(f" * {fact}" for fact in facts)
    return f"""/*
{comment}
 */
#ifndef IDENTIFIED_JOINT_H
#define IDENTIFIED_JOINT_H
#include <math.h>

#define JOINT_INERTIA {values["inertia"]!r}
#define JOINT_OFFSET {float(values.get("offset", 0.0))!r}

/* Friction that the drive must overcome; 0 at rest. */
static inline double joint_friction(double position, double rate)
{{
    const double coulomb = rate > 0.0 ? {level("coulomb", "pos")} : {level("coulomb", "neg")};
    const double viscous = rate > 0.0 ? {level("viscous", "pos")} : {level("viscous", "neg")};
    const double away = position - ({law.angle_center!r});
    const double factor = 1.0 + {float(law["angle_slope"])!r} * away
        + {float(law["angle_curvature"])!r} * away * away;
    const double slow = rate / {(float(law["stribeck_rate"]) or 1.0)!r};
    const double level = coulomb + {float(law["stribeck"])!r} * exp(-slow * slow);
    const double sign = (rate > 0.0) - (rate < 0.0);
    return factor * (sign * level + viscous * rate);
}}

/* Effort that moves the joint so: inertia, friction and offset. */
static inline double joint_effort(double position, double rate, double acceleration)
{{
    return JOINT_INERTIA * acceleration + joint_friction(position, rate) + JOINT_OFFSET;
}}
#endif
"""


def _json(joint: Identified) -> str:
    fit = joint.fit
    return json.dumps(result_of(joint) | {"law": dict(fit.structure)}, indent=2, default=_plain)


def result_of(joint: Identified) -> dict[str, Any]:
    """All that was identified, as plain values."""
    fit = joint.fit
    return {
        "law": fit.candidate,
        "position_unit": fit.position_unit,
        "effort_unit": fit.effort_unit,
        "parameters": [
            parameter.as_dict() | {"name": plain(parameter.name)} for parameter in fit.parameters
        ],
        "rms": joint.rms,
        "relative_rms": joint.relative_rms,
        "delay_s": asdict(joint.delay) if joint.delay else None,
        "not_identified": [asdict(gap) for gap in joint.gaps],
        "simple_laws": {
            "symmetric": asdict(simple_law(fit, constant=False)),
            "with_constant": asdict(simple_law(fit, constant=True)),
        },
        "ripple": [asdict(ripple) for ripple in joint.ripples],
        "notes": list(joint.notes),
    }


def _csv(joint: Identified) -> str:
    fit = joint.fit
    curve = friction_curve(fit)
    effort = fit.effort_unit.replace(" ", "")
    rows = [f"rate_{fit.position_unit}_per_s,friction_{effort},q05_{effort},q95_{effort}"]
    if curve is not None:
        columns = (curve.rate, curve.friction, curve.low, curve.high)
        rows += [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    return "\n".join(rows) + "\n"


def _range(joint: Identified) -> tuple[float, float]:
    opening = joint.fit.series.opening
    return float(opening.min()), float(opening.max())


def _xml_comment(sentences: list[str]) -> str:
    inner = "\n".join(f"    {sentence.replace('--', '- -')}" for sentence in sentences)
    return f"  <!--\n{inner}\n  -->"


def _plain(value: object) -> object:
    return value.tolist() if hasattr(value, "tolist") else str(value)


TARGETS: dict[str, Callable[[Identified], str]] = {
    "mujoco": _mujoco,
    "urdf": _urdf,
    "sdf": _sdf,
    "c": _c,
    "json": _json,
    "csv": _csv,
}
"""What writes each target's file."""
