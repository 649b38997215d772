"""A page that follows a recording while it is written, as a load beside a loop.

    python -m benchmarks.latency_page FOLDER < a pipe that ends with the loop

Serves the recordings of a folder as ``scissorcal prototype`` does, to a client in a process of its
own that takes every message. When stdin ends, it prints what the page got as JSON: samples, samples
lost, messages a second, the delay from a sample's arrival at this computer to the page, and the
server's share of a processor.
"""

import asyncio
import json
import resource
import sys
import time
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np

from scissorcal.prototype.server import PrototypeServer
from scissorcal.recording import read_recording


async def serve(folder: Path) -> dict[str, Any]:
    """Serve until stdin ends; what the client found, and what it cost."""
    server = PrototypeServer(lambda _: ("<!doctype html>", "default-src 'none'"), folder, folder)
    async with server:
        words = [sys.executable, "-W", "ignore", "-m", "benchmarks.latency_page", server.url]
        client = await asyncio.create_subprocess_exec(*words, stdout=asyncio.subprocess.PIPE)
        while not server.watching:
            await asyncio.sleep(0.01)
        print("ready", flush=True)
        began, used = time.monotonic(), _used_s()
        await asyncio.to_thread(sys.stdin.read)
        share = (_used_s() - used) / (time.monotonic() - began)
    out, _ = await client.communicate()
    return {**delays(folder, json.loads(out)), "server_share": share}


async def watch(url: str) -> dict[str, Any]:
    """Take messages as a page does, until the server ends."""
    arrived, lost = [], 0
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(url.replace("/?", "/rig?")) as socket,
    ):
        async for message in socket:
            found = json.loads(message.data)
            if found["kind"] == "samples":
                arrived.append((time.time(), found["time_s"]))
                lost += found["lost"]
    return {"arrived": arrived, "lost": lost, "client_s": _used_s()}


def delays(folder: Path, seen: dict[str, Any]) -> dict[str, Any]:
    """Delay of each sample, from its arrival at the computer, which the recording states."""
    (path,) = folder.glob("*.mcap")
    samples = read_recording(path).samples
    device_s = 1e-6 * (samples["device_time_us"] - samples["device_time_us"][0])
    host_s = 1e-9 * samples["host_time_ns"]
    rows = [(at, time_s) for at, times in seen["arrived"] for time_s in times]
    at, time_s = np.array(rows).T
    found = at - np.interp(time_s, device_s, host_s)
    moments = np.array([at for at, _ in seen["arrived"]])
    return {
        "samples": len(rows),
        "lost": seen["lost"],
        "messages_a_s": float(len(moments) / (moments[-1] - moments[0])),
        "delay_ms": [float(1e3 * each) for each in np.percentile(found, [50, 99, 100])],
        "pause_ms": [float(1e3 * each) for each in np.percentile(np.diff(moments), [50, 99, 100])],
        "client_s": seen["client_s"],
    }


def _used_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    what = sys.argv[1]
    print(json.dumps(asyncio.run(watch(what) if what.startswith("http") else serve(Path(what)))))
