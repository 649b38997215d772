"""A plate that the upper blade's tip touches: a compliant surface with friction, which may move.

The tip is a point in the plane of the blades (z = 0 of the rig's frame). Below the surface it is
pushed out along the normal by N = max(0, k depth + c d(depth)/dt), with at most mu N of friction
against sliding: an elastic bristle that slips at that force, so that a tip at rest is held.
Plain Python on floats, in closed form for each surface: nothing here is shared with the surfaces
that are fitted, tracked or controlled on.
"""

import math

from scissorcal.device.sim.specimen import Blade, TouchedPlate

STEP_S = 0.05
"""How long a stepping plate takes for its step, on a minimum-jerk path."""

_SWAY_PHASES = (0.0, 2.0, 4.0)

Triple = tuple[float, float, float]


class PlateContact:
    """The upper blade's tip on one plate; ``tick_s`` is the length of a step in seconds.

    The touch begins from above only: a tip that comes in from the side of the plate finds nothing
    until it has been above the surface. ``normal_N`` and ``depth_m`` are the truth at the last
    step; ``damping_J`` and ``friction_J`` are lost, ``carried_J`` is what a moving plate put in.
    """

    __slots__ = (
        "_above",
        "_across",
        "_at",
        "_base",
        "_bristle",
        "_plate",
        "_sinks",
        "_station",
        "_step",
        "_time",
        "_touches",
        "_turned",
        "_viscous",
        "carried_J",
        "damping_J",
        "depth_m",
        "friction_J",
        "normal_N",
        "place",
    )

    def __init__(self, blade: Blade, plate: TouchedPlate, step_s: float) -> None:
        length = blade.length_mm * 1e-3
        taper = math.tan(math.radians(blade.taper_deg))
        edge = blade.offset_mm * 1e-3 + length * (taper + 0.5 * blade.curvature_per_m * length)
        wave = blade.wave
        if wave is not None:
            edge += wave.at(length)[0]
        self._station = (length, edge, float(blade.moving_blades))
        self._plate = plate
        self._step = step_s
        self._time = 0.0
        self._base = _axes(plate.pitch_deg, plate.yaw_deg, plate.roll_deg)
        self._turned = 0.0
        self.place = _metres(plate.place_mm)
        self._above = True
        self._touches = False
        self._bristle = 0.0
        self._viscous = 0.0
        self._sinks = (0.0, 0.0, 0.0)
        self._at = self._across = (0.0, 0.0)
        self.normal_N = 0.0
        self.depth_m = 0.0
        self.damping_J = 0.0
        self.friction_J = 0.0
        self.carried_J = 0.0

    @property
    def time_s(self) -> float:
        """Seconds since the plate was put in."""
        return self._time

    def tip(self, opening: float, advance: float) -> tuple[float, float]:
        """The tip's place in the rig's frame, in m."""
        length, edge, moving = self._station
        sine, cosine = math.sin(opening / moving), math.cos(opening / moving)
        return advance + length * cosine - edge * sine, length * sine + edge * cosine

    def blocked(self, opening: float, advance: float) -> bool:
        """Whether the tip stands where the plate is."""
        gap, _, along = self._gap(*self.tip(opening, advance))
        return gap < 0.0 and self._within(along)

    def push(
        self, opening: float, advance: float, rate: float, advance_rate: float
    ) -> tuple[float, float]:
        """Torque (N m) and force (N) on the axes during one step, from the places at its middle."""
        before = self._axes_now()
        start = self.place
        self._move()
        x, y = self.tip(opening, advance)
        gap, normal, along = self._gap(x, y)
        if gap >= 0.0 or not self._above or not self._within(along):
            self._let_go(gap, along)
            return 0.0, 0.0
        by_x, by_y = -y / self._station[2], (x - advance) / self._station[2]
        carried = self._speed(x, y, start, before)
        speed = (by_x * rate + advance_rate - carried[0], by_y * rate - carried[1], -carried[2])
        force = self._force(-gap, normal, speed)
        self.carried_J += self._step * _dot(force, carried)
        self._touches = True
        self._at = (x, y)
        self._sinks = (
            -normal[0] * by_x - normal[1] * by_y,
            -normal[0],
            self._step * _dot(normal, carried),
        )
        return force[0] * by_x + force[1] * by_y, force[0]

    def stored_energy(self, opening: float, advance: float) -> float:
        """Elastic energy in joules where the axes stand now, half a step after the last push."""
        if not self._touches:
            return 0.0
        x, y = self.tip(opening, advance)
        depth = max(0.0, -self._gap(x, y)[0])
        (x_then, y_then), (across_x, across_y) = self._at, self._across
        bristle = self._bristle + across_x * (x - x_then) + across_y * (y - y_then)
        most = max(abs(self._bristle), self._plate.friction * depth)
        bristle = max(-most, min(bristle, most))
        return 0.5e3 * self._plate.stiffness_N_per_mm * (depth * depth + bristle * bristle)

    def settle(self, turned: float, slid: float) -> None:
        """Book what the damping took while the axes moved so far under the last push."""
        by_opening, by_advance, by_plate = self._sinks
        self.damping_J += self._viscous * (by_opening * turned + by_advance * slid + by_plate)

    def _force(self, depth: float, normal: Triple, speed: Triple) -> Triple:
        """Force on the tip, and the books of this step."""
        plate, step = self._plate, self._step
        stiffness = plate.stiffness_N_per_mm * 1e3
        sinking = -_dot(normal, speed)
        elastic = stiffness * depth
        push = max(0.0, elastic + plate.damping_N_s_per_m * sinking)
        flat = math.hypot(normal[0], normal[1])
        across = (normal[1] / flat, -normal[0] / flat)
        was = self._bristle
        trial = was + step * (across[0] * speed[0] + across[1] * speed[1])
        most = plate.friction * push / stiffness
        held = max(-most, min(trial, most))
        self._bristle = held
        self._across = across
        self.depth_m, self.normal_N = depth, push
        self._viscous = push - elastic
        self.friction_J += 0.5 * stiffness * (was + held) * (trial - held)
        drag = -stiffness * held
        return (
            push * normal[0] + drag * across[0],
            push * normal[1] + drag * across[1],
            push * normal[2],
        )

    def _let_go(self, gap: float, along: float) -> None:
        """No touch: what the bristle stored is lost, and so is a depth that was left sideways."""
        if gap >= 0.0 or not self._within(along):
            self._above = gap >= 0.0
        half = 0.5e3 * self._plate.stiffness_N_per_mm
        self.friction_J += half * self._bristle**2
        if self._touches and gap < 0.0:
            self.damping_J += half * self.depth_m**2
        self._touches = False
        self._bristle = self._viscous = self.normal_N = 0.0
        self._sinks = (0.0, 0.0, 0.0)
        self.depth_m = -gap

    def _gap(self, x: float, y: float) -> tuple[float, Triple, float]:
        """Distance of a point of the blades' plane above the surface, the normal, and its place
        along the plate's x axis."""
        plate = self._plate
        along_axis, across_axis, out_axis = self._axes_now()
        away = (x - self.place[0], y - self.place[1], -self.place[2])
        along = _dot(away, along_axis)
        if plate.surface == "plane":
            return _dot(away, out_axis), out_axis, along
        radius = (plate.radius_mm or 0.0) * 1e-3
        from_centre = _plus(away, radius, out_axis)
        if plate.surface == "cylinder":
            from_centre = _plus(from_centre, -_dot(from_centre, across_axis), across_axis)
        distance = math.sqrt(_dot(from_centre, from_centre))
        if distance < 1e-9:
            return -radius, out_axis, along
        unit = 1.0 / distance
        return distance - radius, tuple(unit * value for value in from_centre), along  # type: ignore[return-value]

    def _within(self, along: float) -> bool:
        low, high = self._plate.extent_mm
        return low * 1e-3 <= along <= high * 1e-3

    def _axes_now(self) -> tuple[Triple, Triple, Triple]:
        return _turned(self._base, self._turned)

    def _move(self) -> None:
        """Where the plate is half a step on."""
        self._time += self._step
        if self._plate.moves:
            self.place, self._turned = _moved(self._plate, self._time)

    def _speed(
        self, x: float, y: float, start: Triple, before: tuple[Triple, Triple, Triple]
    ) -> Triple:
        """Velocity of the plate's material at a point, from the last step to this one."""
        if not self._plate.moves:
            return 0.0, 0.0, 0.0
        axes = self._axes_now()
        away = (x - self.place[0], y - self.place[1], -self.place[2])
        was = start
        for now, then in zip(axes, before, strict=True):
            was = _plus(was, _dot(away, now), then)
        rate = 1.0 / self._step
        return rate * (x - was[0]), rate * (y - was[1]), -rate * was[2]


def plate_pose(plate: TouchedPlate, time_s: float) -> tuple[tuple[Triple, Triple, Triple], Triple]:
    """A plate's x, y and z axes and its place (m) in the rig's frame, so long after it was put in.

    >>> still = TouchedPlate(place_mm=(20.0, 10.0, 0.0))
    >>> axes, place = plate_pose(still, 1.0)
    >>> place, axes[2]
    ((0.02, 0.01, 0.0), (0.0, 1.0, 0.0))
    """
    place, turned = _moved(plate, time_s)
    return _turned(_axes(plate.pitch_deg, plate.yaw_deg, plate.roll_deg), turned), place


def _moved(plate: TouchedPlate, time_s: float) -> tuple[Triple, float]:
    """The place (m) and the turn (rad) about the rig's z: drift, sway and step."""
    since = (time_s - plate.step_at_s) / STEP_S
    share = 0.0 if since <= 0.0 else 1.0
    if 0.0 < since < 1.0:
        share = since**3 * (10.0 + since * (6.0 * since - 15.0))
    angle = 2.0 * math.pi * plate.sway_Hz * time_s
    sways = tuple(math.sin(angle + phase) - math.sin(phase) for phase in _SWAY_PHASES)
    x, y, z = (
        place + time_s * drift + sway * amplitude + share * step
        for place, drift, sway, amplitude, step in zip(
            plate.place_mm, plate.drift_mm_per_s, sways, plate.sway_mm, plate.step_mm, strict=True
        )
    )
    turned = math.radians(share * plate.step_turn_deg + math.sin(angle) * plate.sway_turn_deg)
    return _metres((x, y, z)), turned


def _turned(axes: tuple[Triple, Triple, Triple], angle: float) -> tuple[Triple, Triple, Triple]:
    if not angle:
        return axes
    sine, cosine = math.sin(angle), math.cos(angle)
    turned = [(cosine * x - sine * y, sine * x + cosine * y, z) for x, y, z in axes]
    return turned[0], turned[1], turned[2]


def _axes(pitch_deg: float, yaw_deg: float, roll_deg: float) -> tuple[Triple, Triple, Triple]:
    """The plate's x, y and z axes in the rig's frame: Rz(pitch) Ry(yaw) Rx(roll) of a plate whose x
    lies along the rig's and whose z, out of its face, along the rig's y."""
    cz, sz = math.cos(math.radians(pitch_deg)), math.sin(math.radians(pitch_deg))
    cy, sy = math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))
    cx, sx = math.cos(math.radians(roll_deg)), math.sin(math.radians(roll_deg))
    first = (cz * cy, sz * cy, -sy)
    second = (cz * sy * sx - sz * cx, sz * sy * sx + cz * cx, cy * sx)
    third = (cz * sy * cx + sz * sx, sz * sy * cx - cz * sx, cy * cx)
    return first, (-third[0], -third[1], -third[2]), second


def _metres(place_mm: Triple) -> Triple:
    return place_mm[0] * 1e-3, place_mm[1] * 1e-3, place_mm[2] * 1e-3


def _dot(a: Triple, b: Triple) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _plus(a: Triple, factor: float, b: Triple) -> Triple:
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]
