"""Age of the picture while a person drags in the studio, in headless Chromium (see README.md)."""

import argparse
import asyncio
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
from playwright.async_api import Page, async_playwright

SECONDS, RATE = 3.0, 20  # duration of the drag, and values per second
RADIUS = 40  # of the circle of the pointer, px
LIMIT = 100.0  # ms from the pointer event to the frame
SWITCHES = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader")
TICKS = os.sysconf("SC_CLK_TCK")

# stores times (ms) of each value: event, request, reply, and frame; and the durations of frames
WATCH = """([handle, frame, draws]) => {
  const { handles, link, view } = robsim;
  const [space, ball] = [view.space, handles.balls.get(handle)];
  const node = space.frames.findIndex((f) => f.name === frame && f.group === 'true');
  const log = (robsim.log = { values: [], requests: [], replies: [], frames: [] });
  window.addEventListener('pointermove', (event) => {
    if (!handles.tool.dragging) return;
    const times = event.getCoalescedEvents().map((each) => each.timeStamp);
    for (const time of times.length ? times : [event.timeStamp])
      log.values.push({ time, at: ball.position.toArray(), heard: performance.now() });
  });
  const [drag, draw] = [handles.drag, space.draw.bind(space)];
  const render = space.renderer.render.bind(space.renderer);
  let count = 0; // of drawn frames
  space.renderer.render = (...scene) => {
    count += 1;
    if (draws) render(...scene);
  };
  handles.drag = (name, pose) => {
    log.requests.push(performance.now());
    drag(name, pose);
  };
  link.socket.addEventListener('message', (event) => {
    const { type } = JSON.parse(event.data);
    if (type === 'entries' || type === 'rows') log.replies.push(performance.now());
  });
  space.draw = (now) => {
    const [start, before] = [performance.now(), count];
    draw(now);
    if (count === before) return;
    const at = space.frames[node].position.toArray();
    log.frames.push({ start: now, drew: start, end: performance.now(), at });
  };
}"""
PLACE = """(handle) => {
  const { space } = robsim.view;
  const p = robsim.handles.balls.get(handle).position.clone().project(space.camera);
  const box = space.renderer.domElement.getBoundingClientRect();
  return [box.left + ((p.x + 1) / 2) * box.width, box.top + ((1 - p.y) / 2) * box.height];
}"""


@contextmanager
def serve(name: str) -> Iterator[tuple[int, str]]:
    """Yield the process and the address of a studio of a shipped experiment."""
    import robsim as rs

    path = str(rs.examples.path(name))
    command = [sys.executable, "-u", "-m", "robsim", "studio", path, "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        words = (word for line in server.stdout for word in line.split())
        try:
            yield server.pid, next(word for word in words if word.startswith("http"))
        finally:
            server.terminate()


def read_cpu(root: int) -> dict[str, float]:
    """Return the CPU seconds of a process and its children; of a browser by type of process."""
    parents, cpu = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            words = (folder / "cmdline").read_text()
        except OSError:  # the process has ended
            continue
        parents[int(folder.name)] = int(fields[1])
        kind = words.partition("--type=")[2].partition("\0")[0].partition(" ")[0]
        kind = kind or ("browser" if "chromium" in words.partition("\0")[0] else "")
        cpu[int(folder.name)] = kind, (int(fields[11]) + int(fields[12])) / TICKS
    found: dict[str, float] = {}
    for process, (kind, seconds) in cpu.items():
        above = process
        while above not in (root, 0):
            above = parents.get(above, 0)
        if above == root:
            found[kind] = found.get(kind, 0.0) + seconds
    return found


async def drag(page: Page, handle: str) -> None:
    """Move the ball of a handle on a circle, at `RATE` values per second, without waiting."""
    x, y = await page.evaluate(PLACE, handle)
    await page.mouse.move(x, y)
    await page.mouse.down()
    count, moves = round(SECONDS * RATE), []
    start = asyncio.get_running_loop().time()
    for k in range(1, count + 1):
        await asyncio.sleep(max(start + k / RATE - asyncio.get_running_loop().time(), 0.0))
        turn = 2 * pi * k / count
        place = x + RADIUS * (cos(turn) - 1), y + RADIUS * sin(turn)
        moves.append(asyncio.create_task(page.mouse.move(*place)))
    await asyncio.sleep(0.5)
    await asyncio.gather(*moves)
    await page.mouse.up()


async def hold(page: Page, handle: str) -> None:
    """Select a handle by a click on its ball."""
    while not await page.evaluate("document.body.dataset.ready && robsim.handles?.balls.size"):
        await asyncio.sleep(0.1)
    for _ in range(10):
        await asyncio.sleep(0.5)
        await page.mouse.click(*await page.evaluate(PLACE, handle))
        await asyncio.sleep(0.5)
        if await page.evaluate("robsim.handles.choice.held") == handle:
            return
    raise RuntimeError(f"the ball of {handle} cannot be clicked")


async def measure(
    name: str, handle: str, play: bool, size: tuple[int, int], draws: bool
) -> dict[str, Any]:
    """Return the stored times of a drag, and the CPU seconds of server and browser.

    Unless `draws`, the page does everything but the drawing of the scene in 3-D.
    """
    with serve(name) as (server, address):
        async with async_playwright() as driver:
            path = shutil.which("chromium")
            browser = await driver.chromium.launch(executable_path=path, args=list(SWITCHES))
            window = {"width": size[0], "height": size[1]}
            page = await browser.new_page(viewport=window, reduced_motion="reduce")
            await page.goto(address)
            await hold(page, handle)
            if play:
                await page.evaluate("robsim.link.ask({play: true})")
                await asyncio.sleep(1.0)
            await page.evaluate(WATCH, [handle, handle.rpartition(".")[2], draws])
            before = read_cpu(os.getpid()), read_cpu(server)
            await drag(page, handle)
            after = read_cpu(os.getpid()), read_cpu(server)
            log = await page.evaluate("robsim.log")
            await browser.close()
    log["cpu"] = {kind: after[0][kind] - before[0].get(kind, 0.0) for kind in after[0]}
    log["server"] = sum(after[1].values()) - sum(before[1].values())
    return log


def find_ages(log: dict[str, Any]) -> np.ndarray:
    """Return the ms from each pointer event to the frame with its pose, or with a newer pose."""
    values, frames = log["values"], log["frames"]
    places = np.array([each["at"] for each in values])
    times = np.array([each["time"] for each in values])
    ages, shown = np.full(len(values), np.inf), 0
    for frame in frames:
        away = np.linalg.norm(places - frame["at"], axis=1)
        known = np.flatnonzero((away < 2e-4) & (times <= frame["end"]))
        if known.size and known[-1] >= shown:
            ages[shown : known[-1] + 1] = frame["end"] - times[shown : known[-1] + 1]
            shown = known[-1] + 1
    return ages


def report(title: str, log: dict[str, Any]) -> None:
    """Print the ages of the values, the frames, and the CPU per value."""
    ages, count = find_ages(log), len(log["values"])
    print(
        f"{title}: {count} values, {len(log['requests'])} requests, {len(log['replies'])} replies"
    )
    share = np.mean(ages < LIMIT)
    middle, late, most = np.percentile(ages, [50, 95, 100], method="nearest")
    print(
        f"  picture: {share:.0%} below {LIMIT:.0f} ms, median {middle:.0f}, p95 {late:.0f}, "
        f"most {most:.0f} ms"
    )
    starts = np.array([each["start"] for each in log["frames"]])
    drawn = np.array([each["end"] - each["drew"] for each in log["frames"]])
    wait = np.array([each["heard"] - each["time"] for each in log["values"]])
    print(
        f"  frames: {len(starts)}, every {np.median(np.diff(starts)):.0f} ms, drawn in "
        f"{np.median(drawn):.1f} ms; events reach the page after {np.median(wait):.0f} ms"
    )
    replies = np.array(log["replies"])
    delays = [replies[replies > asked][:1] - asked for asked in log["requests"]]
    delays = np.concatenate(delays) if delays else np.array([np.nan])
    middle, late = np.percentile(delays, [50, 95])
    print(f"  request to reply: median {middle:.0f}, p95 {late:.0f} ms")
    kinds = ", ".join(f"{kind} {1e3 * s / count:.0f}" for kind, s in log["cpu"].items() if kind)
    print(
        f"  CPU, ms: server {1e3 * log['server'] / len(log['requests']):.1f} per request; "
        f"browser per value {kinds}",
        flush=True,
    )


def main() -> None:
    """Drag the target while the run rests and while it plays."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--name", default="eye_in_hand")
    parser.add_argument("--handle", default="objects.plate")
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 800))
    given = parser.parse_args()
    for draws, play in product((False, True), (False, True)):
        log = asyncio.run(measure(given.name, given.handle, play, given.size, draws))
        title = f"{'playing' if play else 'paused'}, {'drawn' if draws else 'not drawn'}"
        report(title, log)


if __name__ == "__main__":
    main()
