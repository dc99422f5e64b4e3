#!/usr/bin/env python3
"""Runs `domecast live` on its player, as a user with a camera would, and judges what comes out.

    check_live.py DOMECAST BUILD OTHER [--all]

BUILD is the build of thumb24, OTHER that of another sensor with frames of the same size. On one core, at 60 frames a second: every
frame that came is read or counted as pushed out, each reading is `track`'s bit for bit, memory stays, a device that is unplugged
comes back, wrong constants are named. The page answers to this machine's own names alone, a browser that does not read holds
nothing up, and in Chromium, where that is at hand, the page shows what is read. Ages are reported, not judged: they are the machine's
too. --all plays 3,000 frames instead of 600.
"""

import json
import os
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from rosbags.typesys import Stores, get_typestore

from check_hardness import RIGID, SIZE, network, with_metadata

REPOSITORY = Path(__file__).resolve().parent.parent
RATE = 60
BAD = {"foreign_constants", "markers_do_not_fit", "markers_missing", "no_marks", "turned", "mirrored", "key_unsure", "beyond_springs"}
faults = []


def expect(holds, what):
    if not holds:
        faults.append(what)
    return holds


def one_core():
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


class Live:
    """A run of `live`: its readings and events as they come, and its memory."""

    def __init__(self, domecast, device, constants, *more, watch_memory=False, before=one_core):
        words = [domecast, "live", device, "--constants", constants, "--json", *more]
        self.child = subprocess.Popen([str(w) for w in words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=before)
        self.readings, self.events, self.lines, self.memory_kb = [], [], [], []
        self.began, self.watch_memory = time.monotonic(), watch_memory
        self.thread = threading.Thread(target=self._read)
        self.thread.start()

    def _read(self):
        for line in self.child.stdout:
            if line.startswith(b'{"event"'):
                self.events.append((time.monotonic() - self.began, json.loads(line)))
                continue
            self.lines.append(line)
            if self.watch_memory and len(self.lines) % 50 == 0:
                status = Path(f"/proc/{self.child.pid}/status").read_text()
                self.memory_kb.append(int(re.search(r"VmRSS:\s+(\d+)", status)[1]))

    def event(self, name, wait_s=20):
        until = time.monotonic() + wait_s
        while time.monotonic() < until:
            for at, event in self.events:
                if event["event"] == name:
                    return at, event
            if not self.thread.is_alive():
                break
            time.sleep(0.01)
        for at, event in self.events:
            if event["event"] == name:
                return at, event
        return None, None

    def end(self, wanted=0):
        self.thread.join()
        self.child.wait()
        errors = self.child.stderr.read().decode()
        expect(self.child.returncode == wanted, f"exit code {self.child.returncode}: {errors[-500:]}")
        self.readings = [json.loads(line) for line in self.lines]
        return self


def file_of(number, files):
    """The player goes back and forth."""
    last = len(files) - 1
    at = number % (2 * last)
    return files[min(at, 2 * last - at)]


def check_readings(domecast, constants, files, folder, count):
    """Every frame counted, every reading `track`'s, memory flat; returns what was measured."""
    live = Live(domecast, f"player:{files[0].parent}?rate={RATE}&frames={count}", constants, "--record", folder / "a.mcap",
                watch_memory=True).end()
    _, started = live.event("started")
    _, ended = live.event("ended")
    expect(started and started["size"] == [640, 480], f"started: {started}")
    expect(len(live.readings) + ended["dropped"] == count, f"{len(live.readings)} readings, {ended['dropped']} dropped of {count}")
    expect(live.readings[-1]["frame"] == count - 1, f"the last frame is {live.readings[-1]['frame']}: the newest must be kept")
    memory = live.memory_kb
    grown = (memory[-1] - memory[len(memory) // 4]) / 1024
    expect(grown < 4, f"memory grew by {grown:.1f} MB from a quarter to the end")

    played = folder / "played"
    played.mkdir()
    for reading in live.readings:
        (played / f"{reading['frame']:06}.png").symlink_to(file_of(reading["frame"], files))
    (folder / "times").write_text("".join(f"{r['frame'] / RATE!r}\n" for r in live.readings))
    track = [domecast, "track", played, "--constants", constants, "--times", folder / "times", "--quiet"]
    tracked = subprocess.run([str(w) for w in track], check=True, capture_output=True).stdout.splitlines()
    own = re.compile(rb',"age_ms":[\d.]+,"dropped":\d+\}$')
    others = sum(own.sub(b"}", line.strip()) != line_of_track for line, line_of_track in zip(live.lines, tracked, strict=True))
    expect(others == 0, f"{others} of {len(tracked)} readings are not those of track")

    store, found = get_typestore(Stores.ROS2_JAZZY), []
    subprocess.run([str(w) for w in [*track, "--format", "records", "--out", folder / "a.rec"]], check=True)
    with (folder / "a.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(topics=["/domecast/wrench/force_z_n"]):
            found.append(store.deserialize_cdr(message.data, schema.name).data)
    words = memoryview((folder / "a.rec").read_bytes()).cast("d")
    wanted = [words[30 * k + 18] for k in range(len(words) // 30)]
    expect(found == [v for v in wanted if v == v], "the recording's forces are not those of track")
    return ended, grown


def check_faults(domecast, constants, files, count):
    """Faults of cameras: counted, named, the same from a seed, and none ends the reading."""
    device = f"player:{files[0].parent}?rate={RATE}&frames={count}&drop=0.03&repeat=0.03&tear=0.03&delay=0.05&delay_ms=8&seed=7"
    first = Live(domecast, device, constants, "--fields", "wrench").end()
    _, ended = first.event("ended")
    numbers = {r["frame"] for r in first.readings}
    if ended["dropped"] == 0:
        missing = count - len(numbers)
        expect(0.5 * 0.03 * count < missing < 2 * 0.03 * count, f"{missing} of {count} frames never came")
    named = {problem for r in first.readings for problem in r["problems"]}
    for problem in ("frozen", "gap"):
        expect(problem in named, f"{problem} is not named: {named}")
    return len(numbers), sorted(named)


def check_unplug(domecast, constants, files):
    live = Live(domecast, f"player:{files[0].parent}?rate={RATE}&frames=240&unplug=60,150&unplug_s=0.4", constants, "--fields", "wrench").end()
    names = [event["event"] for _, event in live.events]
    expect(names == ["started", "unplugged", "replugged", "unplugged", "replugged", "ended"], f"events: {names}")
    after = [event["after_s"] for _, event in live.events if event["event"] == "replugged"]
    for early, late in [(60, 150), (150, 240)]:
        expect(any(early < r["frame"] < late and r["wrench"] for r in live.readings), f"nothing is measured from {early} to {late}")
    expect(live.readings[-1]["frame"] == 239, "the end is not reached")
    return [a - 0.4 for a in after]


def check_wrong(domecast, constants, other, files, folder):
    """Wrong constants are named; so is a wrong size, at once."""
    live = Live(domecast, f"player:{files[0].parent}?rate={RATE}&frames=90", other, "--fields", "wrench").end()
    at, event = live.event("no_measurement")
    first = live.event("started")[0]
    if expect(event is not None, f"wrong constants are not named: {[r['status'] for r in live.readings][-3:]}"):
        expect(event["status"] in BAD and "constants" in event["message"], f"wrong constants: {event}")
    expect(not any(r["wrench"] for r in live.readings if r["status"] == "ok"), "a wrench by wrong constants passes for ok")
    resized = json.loads(Path(constants).read_text())
    resized["camera"]["width"] += 2
    (folder / "resized.json").write_text(json.dumps(resized))
    refused = subprocess.run([domecast, "live", f"player:{files[0].parent}", "--constants", folder / "resized.json"], capture_output=True)
    expect(refused.returncode == 1 and b"640 x 480" in refused.stderr and b"642 x 480" in refused.stderr, f"wrong size: {refused}")
    for device in ("/dev/null", "/dev/no-camera", "player:/no/folder", f"player:{files[0].parent}?drop=x"):
        refused = subprocess.run([domecast, "live", device, "--constants", constants], capture_output=True)
        expect(refused.returncode == 1 and device.split("?")[0].removeprefix("player:").encode() in refused.stderr, f"{device}: {refused}")
    return at - first if at else None


def ask(port, *lines, wait_s=3):
    """The status line of an answer to the lines of a request."""
    with socket.create_connection(("127.0.0.1", port), timeout=wait_s) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).encode())
        try:
            return connection.recv(65536).decode(errors="replace")
        except (TimeoutError, ConnectionError):
            return ""


def code(answer):
    return int(answer.split(" ")[1]) if answer.startswith("HTTP/1.1 ") else 0


def check_page(domecast, constants, files, rest):
    """Who is answered; that a browser which does not read holds nothing up; what the events say."""
    live = Live(domecast, f"player:{files[0].parent}?rate={RATE}&frames={20 * RATE}", constants, "--show", "--rest", rest, "--fields", "wrench")
    _, started = live.event("started")
    port = int(started["page"].rsplit(":", 1)[1].strip("/"))
    host = f"Host: 127.0.0.1:{port}"
    for target in ("/", "/live.js", "/live.css"):
        answer = ask(port, f"GET {target} HTTP/1.1", host)
        expect(code(answer) == 200 and "Content-Security-Policy: default-src 'none'" in answer, f"{target}: {answer[:80]}")
        expect("access-control" not in answer.lower(), f"{target}: lets others read it")
    expect(code(ask(port, "GET / HTTP/1.1", f"Host: localhost:{port}", f"Origin: http://localhost:{port}")) == 200, "its own origin")
    for bad in ([f"Host: evil.example:{port}"], [f"Host: 127.0.0.1.evil.example:{port}"], ["Host: 127.0.0.1"], [],
                [host, "Origin: http://evil.example"], [host, "Origin: null"], [host, f"Origin: https://127.0.0.1:{port}"],
                [host, f"Origin: http://127.0.0.1:{port + 1}"], [host, f"Host: evil.example:{port}"]):
        for target in ("/", "/events"):
            answer = ask(port, f"GET {target} HTTP/1.1", *bad)
            expect(code(answer) in (400, 403) and not answer.partition("\r\n\r\n")[2], f"{bad} {target}: {answer[:80]}")
    expect(code(ask(port, "GET /events HTTP/1.1", host, "Sec-Fetch-Site: cross-site")) == 403, "another site's request")
    expect(code(ask(port, "POST / HTTP/1.1", host)) == 405 and code(ask(port, "GET /x HTTP/1.1", host)) == 404, "method, target")
    others = [a for a in socket.gethostbyname_ex(socket.gethostname())[2] if not a.startswith("127.")]
    for address in others:
        with socket.socket() as probe:
            probe.settimeout(2)
            expect(probe.connect_ex((address, port)) != 0, f"the page answers on {address}")
    # one that asks for events and never reads, and one that sends no end of a head
    slow = socket.create_connection(("127.0.0.1", port))
    slow.sendall(f"GET /events HTTP/1.1\r\n{host}\r\n\r\n".encode())
    mute = socket.create_connection(("127.0.0.1", port))
    mute.sendall(b"GET / HTTP/1.1\r\nX: ")
    with socket.create_connection(("127.0.0.1", port), timeout=5) as connection:
        connection.sendall(f"GET /events HTTP/1.1\r\n{host}\r\n\r\n".encode())
        text, until = b"", time.monotonic() + 5
        while text.count(b"\n\ndata: ") < 3 and time.monotonic() < until:
            text += connection.recv(1 << 20)
    events = [json.loads(part[6:]) for part in text.split(b"\n\n")[1:-1] if part.startswith(b"data: ")]
    if expect(len(events) >= 2, f"only {len(events)} events: {text[:200]}"):
        last = events[-1]
        expect(last["image"].startswith("data:image/jpeg;base64,") and last["skin"].startswith("data:image/png;base64,"), "pictures")
        expect(len(last["dots"]) > 100 and len(last["tractions"]) > 100 and last["wrench"] and last["samples"], f"event: {list(last)}")
        frames = [event["frame"] for event in events]
        expect(frames == sorted(set(frames)), f"events repeat frames: {frames}")
    seen = browse(started["page"]) if shutil.which("chromedriver") else None
    live.end()
    slow.close()
    mute.close()
    _, ended = live.event("ended")
    return ended, seen


def browse(url):
    """The page in Chromium: what it shows and says."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.support.ui import WebDriverWait

    with tempfile.TemporaryDirectory() as profile:
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium") or shutil.which("chromium-browser")
        for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", f"--user-data-dir={profile}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
        try:
            driver.get(url)
            wait = WebDriverWait(driver, 15)
            wait.until(lambda d: d.execute_script("return document.body.dataset.frame"))
            first = int(driver.execute_script("return document.body.dataset.frame"))
            wait.until(lambda d: int(d.execute_script("return document.body.dataset.frame")) > first + 10)
            drawn = driver.execute_script("""
                return ['view', 'skin', 'force', 'torque'].map(id => { const c = document.getElementById(id);
                  const p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
                  return new Set([...Array(4000).keys()].map(k => p.slice(4 * ((k * 7919) % (p.length / 4)), 4 * ((k * 7919) % (p.length / 4)) + 3).join())).size; })""")
            expect(min(drawn[:2]) > 20 and min(drawn[2:]) > 1, f"colours drawn in the canvases: {drawn}")
            status = driver.execute_script("return document.getElementById('status').textContent")
            numbers = driver.execute_script("return document.getElementById('numbers').textContent")
            expect(status == "ok" and "frames/s" in numbers, f"the page says \"{status}\", \"{numbers}\"")
            from_elsewhere = driver.execute_script(
                "return performance.getEntriesByType('resource').map(e => e.name).filter(n => !n.startsWith(location.origin) && !n.startsWith('data:'))")
            expect(not from_elsewhere, f"loaded from elsewhere: {from_elsewhere}")
            said = [entry["message"] for entry in driver.get_log("browser") if "favicon" not in entry["message"]]
            expect(not said, f"the console says: {said}")
            return numbers
        finally:
            driver.quit()


def statuses_in(path):
    """How many readings are in a recording that may be cut off."""
    topics, statuses = {}, 0
    with path.open("rb") as file:
        try:
            for record in StreamReader(file).records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                statuses += isinstance(record, Message) and topics[record.channel_id] == "/domecast/status"
        except McapError:
            pass
    return statuses


def check_ends(domecast, constants, files, folder):
    """Ctrl-C ends in good order; kill -9 leaves a recording to its last chunk."""
    device = f"player:{files[0].parent}?rate={RATE}&frames=100000"
    live = Live(domecast, device, constants, "--record", folder / "b.mcap", "--fields", "wrench")
    live.event("started")
    while len(live.lines) < 60:
        time.sleep(0.05)
    live.child.send_signal(signal.SIGINT)
    live.end()
    expect(live.event("ended")[1] is not None, "Ctrl-C: no summary")
    with (folder / "b.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
        counts = {summary.channels[k].topic: v for k, v in summary.statistics.channel_message_counts.items()}
        expect(counts.get("/domecast/status") == len(live.lines), f"Ctrl-C: {counts} of {len(live.lines)} readings")
    killed = Live(domecast, device, constants, "--record", folder / "c.mcap", "--fields", "wrench")
    while len(killed.lines) < 60:
        time.sleep(0.05)
    killed.child.send_signal(signal.SIGKILL)
    killed.end(wanted=-signal.SIGKILL)
    statuses = statuses_in(folder / "c.mcap")
    expect(statuses >= len(killed.lines) - 32, f"kill -9: {statuses} of {len(killed.lines)} readings are in the recording")


def check_heights(domecast, constants, rest, folder):
    """Heights in a recording are those of `track --shape`, of the frame whose time they carry."""
    frames = folder / "pressed"
    subprocess.run([domecast, "simulate", REPOSITORY / "designs/scenes/ball.json", "--frames", "3", "--out", folder / "ball", "--quiet"], check=True)
    frames.mkdir()
    for file in (folder / "ball").glob("frame_*.png"):
        shutil.copy(file, frames)
    subprocess.run([domecast, "track", frames, "--constants", constants, "--shape", folder / "maps", "--rest", rest, "--out",
                    folder / "pressed.jsonl", "--quiet"], check=True)
    live = Live(domecast, f"player:{frames}?rate=2", constants, "--record", folder / "h.mcap", "--rest", rest, "--fields", "wrench")
    live.end()
    store, off, times = get_typestore(Stores.ROS2_HUMBLE), [], {"status": [], "height": []}
    with (folder / "h.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(topics=["/domecast/status", "/domecast/height"]):
            kind = channel.topic.rsplit("/", 1)[1]
            times[kind].append(message.log_time)
            if kind == "height":
                image = store.deserialize_cdr(message.data, schema.name)
                found = 1e3 * np.frombuffer(bytes(image.data), "<f4").reshape(image.height, image.width)
                wanted = np.load(folder / f"maps/frame_{len(off):04}.height.npy")
                off.append(np.nanmax(np.abs(found - wanted)) if (np.isnan(found) == np.isnan(wanted)).all() else np.inf)
    expect(times["height"] == times["status"] and len(off) == 3, f"heights: {times}")
    expect(max(off, default=np.inf) < 1e-6, f"heights: off by {off} mm")


def check_model(domecast, constants, files, folder):
    """What a model says (here one of random weights) is what it says in `track`, byte for byte; without a frame at rest it is refused."""
    model, lines = folder / "model.onnx", folder / "felt.jsonl"
    model.write_bytes(with_metadata(network(8, SIZE, len(RIGID), [8, 16]), [[0, 255]] + [[0, 100]] * len(RIGID)))
    named = ("--constants", constants, "--rest", files[0], "--hardness", model)
    subprocess.run([domecast, "track", files[0].parent, *named, "--out", lines, "--quiet"], check=True)
    wanted = [json.loads(line)["hardness"] for line in lines.read_text().splitlines()]
    live = Live(domecast, f"player:{files[0].parent}?rate=10", *named[1:])
    live.end()
    found = [reading["hardness"] for reading in live.readings]
    expect(found == wanted and any(wanted), f"hardness: {found} where track has {wanted}")
    alone = subprocess.run([domecast, "live", f"player:{files[0].parent}", "--constants", constants, "--hardness", model], capture_output=True, text=True)
    expect(alone.returncode == 2 and "--rest" in alone.stderr, f"hardness without a frame at rest: {alone.returncode} {alone.stderr}")
    return sum(one is not None for one in found)


def check_full(domecast, constants, files, folder):
    """A disk that takes no more (here: a limit of the file's size, which the system answers alike) ends the recording by name, not the reading."""
    place, limit = folder / "full.mcap", 3_000_000

    def full():
        # the write fails then, and no signal ends the program
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        one_core()

    device = f"player:{files[0].parent}?rate={RATE}&frames=180"
    live = Live(domecast, device, constants, "--record", place, "--fields", "wrench", before=full)
    live.end(wanted=1)
    lost, ended = (live.event(name)[1] for name in ("recording_lost", "ended"))
    expect(lost and str(place) in lost["message"] and "too large" in lost["message"], f"a full disk: {lost}")
    expect(ended and ended["frames"] == len(live.lines) == 180, f"a full disk: the reading ends, {ended}")
    statuses = statuses_in(place)
    expect(0.3 * limit < place.stat().st_size <= limit and statuses > 0, f"a full disk: {statuses} readings in {place.stat().st_size} bytes")
    return statuses


def main():
    words = [word for word in sys.argv[1:] if word != "--all"]
    if len(words) != 3:
        sys.exit(__doc__)
    domecast = os.path.abspath(words[0])
    constants, other = (Path(word).resolve() / "constants/constants.json" for word in words[1:])
    count = 3_000 if "--all" in sys.argv else 600
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as base:
        base = Path(base)
        for scene, frames in (("push", 16), ("lit", 1)):
            subprocess.run([domecast, "simulate", REPOSITORY / f"designs/scenes/{scene}.json", "--frames", str(frames), "--out",
                            base / scene, "--quiet"], check=True)
        files = []
        (base / "frames").mkdir()
        for k, file in enumerate(sorted((base / "push").glob("frame_*.png"))):
            files.append(base / f"frames/{k:04}.png")
            files[-1].write_bytes(file.read_bytes())
        ended, grown = check_readings(domecast, constants, files, base, count)
        ages = "age p50 {age_p50_ms:.2f}, p99 {age_p99_ms:.2f}, at most {age_max_ms:.2f} ms".format(**ended)
        print(f"live: {count} frames at {RATE} Hz on one core: {ages}; {ended['dropped']} pushed out; memory {grown:+.1f} MB")
        came, named = check_faults(domecast, constants, files, 300)
        print(f"live: {came} of 300 frames with faults, named {', '.join(named)}")
        back = check_unplug(domecast, constants, files)
        print(f"live: back {', '.join(f'{1e3 * b:.0f} ms' for b in back)} after it was plugged in again")
        wrong = check_wrong(domecast, constants, other, files, base)
        print(f"live: wrong constants are named after {wrong:.2f} s" if wrong else "live: wrong constants are not named")
        ended, seen = check_page(domecast, constants, files, base / "lit/frame_0000.png")
        print("live: with the page: age p50 {age_p50_ms:.2f}, p99 {age_p99_ms:.2f} ms, {dropped} pushed out;".format(**ended), seen or "no Chromium")
        check_ends(domecast, constants, files, base)
        check_heights(domecast, constants, base / "lit/frame_0000.png", base)
        print(f"live: a model states {check_model(domecast, constants, files, base)} times what it states in track")
        kept = check_full(domecast, constants, files, base)
        print(f"live: a disk that is full ends the recording, not the reading; {kept} readings are in it")
    for fault in faults[:20]:
        print(f"FAIL {fault}")
    print(f"live: {len(faults)} failed, {time.monotonic() - began:.0f} s")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
