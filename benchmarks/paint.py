"""How old a robot's message is when the browser has painted it.

The dashboard is measured by its own hook ``window.__onPaint`` in the animation frame
that has drawn a message.  Beside it stands a floor: a bare page that takes the same
messages straight from the same broker (MQTT over a WebSocket), parses them and paints
the newest in the next animation frame; no FIWARE, no rule, no history.  Both run in
the same Chromium in turns, so that both meet the same machine.

The age is taken against the robot's own stamp; robot and browser share one clock.
"""

import asyncio
import tempfile
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from playwright.async_api import Browser, async_playwright
from websockets.asyncio.server import ServerConnection, serve

from benchmarks.process import Usage, machine, percentile, print_table
from tests.browsers import chromium
from tests.processes import Site, children_of, site

ROUNDS, SECONDS, WARM_UP_S = 3, 10.0, 2.0
KINDS = ("odom", "lidar")
_FLAGS = (
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)

COLLECT = """() => {
  window.ages = {odom: [], lidar: [], detection: []};
  window.__onPaint = ({kind, stamp}) => {
    const now = performance.timeOrigin + performance.now();
    window.ages[kind].push(now - Date.parse(stamp));
  };
}"""
"""Ages in ms, for either page."""

FLOOR_PAGE = "<!doctype html><canvas id=map width=1000 height=800></canvas>"
FLOOR = """(address) => {
  const text = new TextEncoder(), utf8 = new TextDecoder();
  const canvas = document.getElementById('map').getContext('2d');
  const newest = new Map();
  let pending = new Uint8Array(0), asked = false;

  const packet = (type, ...parts) => {
    const body = parts.flatMap((part) => [...part]);
    const length = [];
    for (let rest = body.length; ; rest >>= 7) {
      length.push(rest > 127 ? (rest & 127) | 128 : rest);
      if (rest <= 127) break;
    }
    return new Uint8Array([type, ...length, ...body]);
  };
  const words = (value) => {
    const bytes = text.encode(value);
    return [bytes.length >> 8, bytes.length & 255, ...bytes];
  };
  const socket = new WebSocket(address);
  socket.binaryType = 'arraybuffer';
  socket.onopen = () => socket.send(
    packet(0x10, words('MQTT'), [4, 2, 0, 60], words('floor')));
  socket.onmessage = ({data}) => take(new Uint8Array(data));

  function take(bytes) {
    const all = new Uint8Array(pending.length + bytes.length);
    all.set(pending);
    all.set(bytes, pending.length);
    pending = all.subarray(readAll(all));
  }
  function readAll(all) {
    let start = 0;
    for (;;) {
      let length = 0, shift = 0, at = start + 1, digit = 128;
      while (digit & 128) {
        if (at >= all.length) return start;
        digit = all[at++];
        length |= (digit & 127) << shift;
        shift += 7;
      }
      if (at + length > all.length) return start;
      read(all[start], all.subarray(at, at + length));
      start = at + length;
    }
  }
  function read(type, body) {
    if (type >> 4 === 2) {
      socket.send(packet(0x82, [0, 1], words('/+/+/attrs'), [0]));
    } else if (type >> 4 === 3) {
      const size = (body[0] << 8) | body[1];
      const topic = utf8.decode(body.subarray(2, 2 + size));
      const message = JSON.parse(utf8.decode(body.subarray(2 + size)));
      if (topic.endsWith('_odom/attrs')) keep('odom', topic, message);
      if (topic.endsWith('_lidar2D/attrs')) keep('lidar', topic, message);
    }
  }
  function keep(kind, topic, message) {
    newest.set(topic, {kind, message});
    if (!asked) requestAnimationFrame(paint);
    asked = true;
  }
  function paint() {
    asked = false;
    canvas.clearRect(0, 0, 1000, 800);
    for (const {kind, message} of newest.values()) {
      (kind === 'odom' ? paintRobot : paintScan)(message);
    }
    for (const {kind, message} of newest.values()) {
      window.__onPaint({kind, stamp: message.TimeInstant});
    }
    newest.clear();
  }
  function paintRobot({base_pose_ground_truth: pose}) {
    canvas.fillRect(500 + 40 * pose.x, 400 - 40 * pose.y, 12, 12);
  }
  function paintScan({lidar_points: ranges, lidar_header: head}) {
    ranges.forEach((range, i) => {
      if (range === null) return;
      const angle = head.angle_min + i * head.angle_increment;
      canvas.fillRect(
        500 + 40 * range * Math.cos(angle), 400 - 40 * range * Math.sin(angle), 2, 2);
    });
  }
}"""

Ages = dict[str, list[float]]


@dataclass(frozen=True, slots=True)
class Result:
    """Ages (ms) that each page painted, and the cost of iVeg meanwhile."""

    dashboard: Ages
    floor: Ages
    cores: float


def main() -> None:
    with tempfile.TemporaryDirectory() as directory, site(Path(directory)) as place:
        demo = place.start("demo")
        place.wait_until_live()
        result = asyncio.run(_measure(place, demo.pid))
    _report(result)


async def _measure(place: Site, pid: int) -> Result:
    dashboard: Ages = {kind: [] for kind in KINDS}
    floor: Ages = {kind: [] for kind in KINDS}
    family = [pid, *children_of(pid)]
    before = sum(Usage.of(one).cpu_s for one in family)
    async with (
        _mqtt_over_websocket(place.settings["IVEG_MQTT_URL"]) as address,
        async_playwright() as playwright,
    ):
        browser = await playwright.chromium.launch(
            executable_path=chromium(), args=list(_FLAGS)
        )
        for _ in range(ROUNDS):
            _add(dashboard, await _watch_dashboard(browser, place))
            _add(floor, await _watch_floor(browser, address))
        await browser.close()
    spent = sum(Usage.of(one).cpu_s for one in family) - before
    return Result(dashboard, floor, spent / (2 * ROUNDS * (SECONDS + WARM_UP_S)))


async def _watch_dashboard(browser: Browser, place: Site) -> Mapping[str, list[float]]:
    page = await browser.new_page(viewport={"width": 1440, "height": 900})
    await page.goto(place.sign_in_link)
    await page.wait_for_selector('[data-robot][data-link="LIVE"]')
    await asyncio.sleep(WARM_UP_S)
    await page.evaluate(COLLECT)
    await asyncio.sleep(SECONDS)
    ages: Mapping[str, list[float]] = await page.evaluate("() => window.ages")
    await page.close()
    return ages


async def _watch_floor(browser: Browser, address: str) -> Mapping[str, list[float]]:
    page = await browser.new_page(viewport={"width": 1440, "height": 900})
    await page.set_content(FLOOR_PAGE)
    await page.evaluate(COLLECT)
    await page.evaluate(FLOOR, address)
    await asyncio.sleep(WARM_UP_S)
    await page.evaluate(COLLECT)
    await asyncio.sleep(SECONDS)
    ages: Mapping[str, list[float]] = await page.evaluate("() => window.ages")
    await page.close()
    return ages


@asynccontextmanager
async def _mqtt_over_websocket(mqtt_url: str) -> AsyncIterator[str]:
    """A WebSocket door to a broker: bytes in, bytes out (asyncio sets TCP_NODELAY)."""
    broker = urlsplit(mqtt_url)

    async def pipe(browser: ServerConnection) -> None:
        reader, writer = await asyncio.open_connection(broker.hostname, broker.port)

        async def back() -> None:
            while chunk := await reader.read(65536):
                await browser.send(chunk)

        returning = asyncio.create_task(back())
        async for frame in browser:
            writer.write(frame if isinstance(frame, bytes) else frame.encode())
        returning.cancel()
        writer.close()

    async with serve(pipe, "127.0.0.1", 0, compression=None) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        yield f"ws://127.0.0.1:{port}"


def _add(total: Ages, more: Mapping[str, list[float]]) -> None:
    for kind, ages in total.items():
        ages.extend(more[kind])


def _report(result: Result) -> None:
    head = ["message", "page", "painted", "P50 ms", "P95 ms", "P99 ms"]
    rows = []
    for kind in KINDS:
        pages = {"dashboard": result.dashboard[kind], "floor": result.floor[kind]}
        told = {name: _three(ages) for name, ages in pages.items()}
        for name, ages in pages.items():
            rows.append([kind, name, str(len(ages)), *(f"{t:.1f}" for t in told[name])])
        ratios = zip(told["dashboard"], told["floor"], strict=True)
        rows.append(
            [kind, "ratio", "", *(f"{ours / least:.2f}" for ours, least in ratios)]
        )
    print_table(f"Robot publishes → browser has painted ({machine()})", head, rows)
    print(f"iVeg with its robots and its FIWARE: {result.cores:.2f} cores")


def _three(ages: list[float]) -> list[float]:
    ordered = sorted(ages)
    return [percentile(ordered, share) for share in (0.50, 0.95, 0.99)]


if __name__ == "__main__":
    main()
