"""Made-up samples and files for the tests of the recording room."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.recording import (
    SAMPLE_DTYPE,
    Joint,
    Recording,
    RecordingFacts,
    RecordingWriter,
    Stroke,
)

EPOCH_NS = 1_700_000_000_000_000_000


def made_samples(count: int, *, seed: int = 0, strokes: bool = True) -> NDArray[np.void]:
    """One kilohertz of random but plausible samples; every field differs from sample to sample."""
    rng = np.random.default_rng(seed)
    samples = np.zeros(count, dtype=SAMPLE_DTYPE)
    index = np.arange(count)
    samples["sequence"] = 7 + index
    samples["flags"] = rng.integers(0, 2**32, count)
    samples["host_time_ns"] = EPOCH_NS + index * 1_000_000 + rng.integers(0, 400_000, count)
    samples["device_time_us"] = 5_000_000_000 + index * 1000
    samples["opening"] = 0.5 + 0.3 * np.cos(np.pi * index * 1e-3)
    for channel in ("advance", "motor_torque", "handle_force", "torque_command", "force_command"):
        samples[channel] = rng.normal(size=count)
    samples["stroke"] = index // 1000 % 2 if strokes else -1
    samples["latency_ns"] = rng.integers(0, 2**32, count)
    return samples


def made_recording(count: int = 3000) -> Recording:
    """A recording with all there can be, but for a file."""
    return Recording(
        kind="cut",
        samples=made_samples(count),
        strokes=(Stroke(0, "closing", 0.6, 0), Stroke(1, "excitation")),
        joint=Joint("rotary"),
        handle_radius_m=0.06,
        device={"name": "rig", "firmware_version": 3, "torque_limit": 1.25},
        recipe_toml='name = "paper"\n# µ stands for micro\n',
        notes=("Two frames were garbled.",),
    )


def written_live(path: Path, samples: NDArray[np.void], batch: int = 20) -> Path:
    """Write samples as a capture does: in small batches, with a note and an attachment."""
    with RecordingWriter(path, "friction", facts=RecordingFacts(recipe_toml="x = 1\n")) as writer:
        for start in range(0, len(samples), batch):
            if start == 10 * batch:
                writer.note("The hand rested.")
                writer.attach("blade.jpg", bytes(range(256)) * 4, "image/jpeg")
            writer.append(samples[start : start + batch])
    return path
