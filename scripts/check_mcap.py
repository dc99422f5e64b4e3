#!/usr/bin/env python3
"""Reads recordings of `track --mcap` with the readers of others: `mcap` (Foxglove's) and `rosbags` (its own definitions of ROS 2).

    check_mcap.py DOMECAST BUILD

BUILD is the build of thumb24. Every topic is decoded by rosbags' definitions, and the definitions in the file are the same
ones; wrenches are `track`'s bit for bit; pictures are the files' bytes or pixels; times rise. A recording that is cut off at any
byte, or whose program is killed, is readable to its last whole chunk.
"""

import io
import json
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

REPOSITORY = Path(__file__).resolve().parent.parent
STORE = get_typestore(Stores.ROS2_JAZZY)
SCALARS = ["force_x_n", "force_y_n", "force_z_n", "moment_x_nmm", "moment_y_nmm", "moment_z_nmm"]
STATES = "ok missing lost merged identity_unsure dirty smeared glare partly_hidden hidden".split()
faults = []


def expect(holds, what):
    if not holds:
        faults.append(what)
    return holds


def run(*words, **more):
    return subprocess.run([str(w) for w in words], check=True, capture_output=True, **more)


def messages_of(path):
    """Every message of a whole recording, by topic, decoded by rosbags: (time, message)."""
    found = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        expect(summary is not None and summary.statistics is not None, f"{path.name}: no summary")
        expect(reader.get_header().profile == "ros2", f"{path.name}: its profile is not ros2")
        for schema in summary.schemas.values():
            expect(schema.encoding == "ros2msg", f"{schema.name}: encoding {schema.encoding}")
            for name, definition in get_types_from_msg(schema.data.decode(), schema.name).items():
                ours = [(field, kind) for field, kind in definition[1]]
                theirs = [(field, kind) for field, kind in STORE.fielddefs[name][1]]
                expect(ours == theirs, f"{name}: the file defines {ours}, rosbags {theirs}")
        last = 0
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            expect(channel.message_encoding == "cdr", f"{channel.topic}: {channel.message_encoding}")
            expect(message.log_time >= last, f"{channel.topic}: its time falls")
            last = message.log_time
            decoded = STORE.deserialize_cdr(message.data, schema.name)
            # the very bytes: nothing is left over, and padding is where others put it
            expect(bytes(STORE.serialize_cdr(decoded, schema.name)) == bytes(message.data), f"{channel.topic}: other bytes")
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
        count = sum(len(of_topic) for of_topic in found.values())
        expect(summary.statistics.message_count == count, f"{path.name}: its summary counts other messages")
        expect(len(summary.chunk_indexes) > 1, f"{path.name}: {len(summary.chunk_indexes)} chunks")
    for topic, of_topic in found.items():
        times = [at for at, _ in of_topic]
        expect(all(a < b for a, b in zip(times, times[1:])), f"{topic}: its times do not rise")
    return found


def records_of(path):
    """`track --format records`: frame, wrench or None, pose about the reference point or None."""
    for words in struct.iter_unpack("<QdQQ26d", path.read_bytes()):
        numbers = words[4:]
        yield words[0], None if np.isnan(numbers[12]) else numbers[12:18], None if np.isnan(numbers[0]) else numbers[:6]


def stamp_ns(header):
    return header.stamp.sec * 10**9 + header.stamp.nanosec


def check_numbers(found, records, lines, constants, times_ns):
    at_time = {topic: dict(of_topic) for topic, of_topic in found.items()}
    bits = lambda values: struct.pack(f"{len(values)}d", *values)
    compared = 0
    for (frame, wrench, pose), line, at in zip(records, lines, times_ns, strict=True):
        status = at_time["/domecast/status"].get(at)
        if not expect(status is not None, f"frame {frame}: no status at its time"):
            continue
        expect(stamp_ns(status.header) == at, f"frame {frame}: its stamp is another time")
        one = status.status[0]
        values = {pair.key: pair.value for pair in one.values}
        expect(one.message == line["status"] and values["problems"] == ",".join(line["problems"]), f"frame {frame}: status {one}")
        expect((one.level == 0) == (line["status"] == "ok"), f"frame {frame}: level {one.level} of {line['status']}")
        stamped = at_time.get("/domecast/wrench", {}).get(at)
        expect((stamped is None) == (wrench is None), f"frame {frame}: wrench {stamped} of {wrench}")
        if wrench is not None and stamped is not None:
            f, t = stamped.wrench.force, stamped.wrench.torque
            expect(bits([f.x, f.y, f.z]) == bits(wrench[:3]), f"frame {frame}: force {f} is not {wrench[:3]}")
            expect(bits([t.x, t.y, t.z]) == bits([m * 1e-3 for m in wrench[3:]]), f"frame {frame}: torque {t} of {wrench[3:]}")
            scalars = [at_time[f"/domecast/wrench/{name}"][at].data for name in SCALARS]
            expect(bits(scalars) == bits(wrench), f"frame {frame}: scalars {scalars} are not {wrench}")
            compared += 1
        posed = at_time.get("/domecast/pose", {}).get(at)
        expect((posed is None) == (pose is None), f"frame {frame}: pose {posed}")
        if pose is not None and posed is not None:
            p, q = posed.pose.position, posed.pose.orientation
            matrix = np.array(line["pose"])
            expect(np.allclose([p.x, p.y, p.z], matrix[:3, 3] * 1e-3, atol=1e-9), f"frame {frame}: position {p}")
            x, y, z, w = q.x, q.y, q.z, q.w
            turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                             [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                             [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
            expect(np.allclose(turn, matrix[:3, :3], atol=3e-9), f"frame {frame}: orientation {q}")
        transforms = {t.child_frame_id: t for t in at_time["/tf"][at].transforms}
        expect(("domecast_sensor" in transforms) == (pose is not None), f"frame {frame}: /tf {list(transforms)}")
        if constants.get("springs"):
            v = transforms["domecast_wrench"].transform.translation
            expect(np.allclose([v.x, v.y, v.z], np.array(constants["springs"]["at_mm"]) * 1e-3), f"/tf: wrench at {v}")
        check_dots(at_time["/domecast/dots"][at], line, constants, frame)
    return compared


def check_dots(cloud, line, constants, frame):
    kinds = {2: "u1", 6: "<u4", 7: "<f4"}
    fields = np.dtype({"names": [f.name for f in cloud.fields], "formats": [kinds[f.datatype] for f in cloud.fields],
                       "offsets": [f.offset for f in cloud.fields], "itemsize": cloud.point_step})
    dots = np.frombuffer(bytes(cloud.data), fields)
    expect(len(dots) == cloud.width == len(line["black_dots"]), f"frame {frame}: {len(dots)} dots")
    places = np.array([dot["surface_mm"] for dot in constants["black_dots"]])
    expect(np.allclose(np.stack([dots[a] for a in "xyz"], 1), places * 1e-3, atol=1e-8), f"frame {frame}: places of dots")
    for dot, ours in zip(dots, line["black_dots"], strict=True):
        expect(dot["id"] == ours["id"] and STATES[dot["state"]] == ours["state"], f"frame {frame}: dot {dot}")
        moved = np.array(ours["displacement_mm"] or [np.nan] * 3)
        found = [dot["dx"], dot["dy"], dot["dz"]]
        expect(np.allclose(found, moved * 1e-3, atol=2e-9, rtol=1e-6, equal_nan=True), f"frame {frame}: dot {found} of {moved}")


def whole_chunks(data):
    """Where each chunk of a recording ends, and how many messages there are up to there."""
    ends, at, count = [], 8, 0
    while at + 9 <= len(data):
        kind, length = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        at += 9 + length
        if kind == 0x06:
            chunk = Chunk.read(ReadDataStream(io.BytesIO(data[at - length:at])))
            count += sum(isinstance(record, Message) for record in breakup_chunk(chunk))
            ends.append((at, count))
        if kind == 0x0F:
            break
    return ends


def readable(data):
    """How many messages the reader of streams gets out of what there is."""
    count = 0
    try:
        for record in StreamReader(io.BytesIO(data), validate_crcs=True).records:
            count += isinstance(record, Message)
    except (McapError, struct.error, EOFError):
        pass
    return count


def check_cuts(path, cuts):
    data = path.read_bytes()
    ends = whole_chunks(data)
    expect(len(ends) > 2 and ends[-1][1] == readable(data), f"{path.name}: {len(ends)} chunks, {readable(data)} messages")
    chance = random.Random(4)
    places = {end + off for end, _ in ends for off in (-1, 0, 1)} | {chance.randrange(9, len(data)) for _ in range(cuts)}
    for cut in sorted(place for place in places if place <= len(data)):
        wanted = max((count for end, count in ends if end <= cut), default=0)
        expect(readable(data[:cut]) == wanted, f"cut at {cut}: {readable(data[:cut])} messages, {wanted} in whole chunks")
    return len(places)


def check_kill(domecast, constants, frames, folder, seed):
    """Frames through a pipe, each line waited for; then kill -9."""
    path = folder / f"killed-{seed}.mcap"
    child = subprocess.Popen([domecast, "track", "-", "--constants", constants, "--mcap", path, "--fields", "wrench"],
                             stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    count = random.Random(seed).randrange(20, 45)
    for k in range(count):
        child.stdin.write(frames[k % len(frames)])
        child.stdin.flush()
        child.stdout.readline()
    child.send_signal(signal.SIGKILL)
    child.wait()
    statuses = 0
    try:
        for record in StreamReader(io.BytesIO(path.read_bytes())).records:
            statuses += isinstance(record, Message) and record.channel_id == 12
    except McapError:
        pass
    # a chunk holds a megabyte: two frames of 640 x 480 in colour; the frame of the last line may not be recorded yet
    expect(statuses >= count - 3, f"killed after {count} frames: {statuses} are readable")
    refused = subprocess.run([domecast, "track", "-", "--constants", constants, "--mcap", path], input=b"", capture_output=True)
    expect(refused.returncode == 1 and path.stat().st_size > 0, "a killed recording was replaced without --force")
    return count, statuses


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    domecast, build = os.path.abspath(sys.argv[1]), Path(sys.argv[2]).resolve()
    constants_path = build / "constants/constants.json"
    constants = json.loads(constants_path.read_text())
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as base:
        base = Path(base)
        run(domecast, "simulate", REPOSITORY / "designs/scenes/push.json", "--frames", "24", "--out", base / "pushed", "--quiet")
        files = sorted((base / "pushed").glob("frame_*.png"))
        frames = base / "frames"
        frames.mkdir()
        for k, file in enumerate(files):
            (frames / f"{k:04}.png").write_bytes(file.read_bytes())
        # one that says nothing, one that cannot be read, one that came as JPEG
        dark = np.zeros((constants["camera"]["height"], constants["camera"]["width"], 3), np.uint8)
        cv2.imwrite(str(frames / f"{len(files):04}.png"), dark)
        (frames / f"{len(files) + 1:04}.png").write_bytes(files[0].read_bytes()[:500])
        cv2.imwrite(str(frames / f"{len(files) + 2:04}.jpg"), cv2.imread(str(files[3])), [cv2.IMWRITE_JPEG_QUALITY, 95])
        count = len(files) + 3
        times_s = [0.05 * k + 1.7e9 for k in range(count)]
        (base / "times").write_text("".join(f"{t!r}\n" for t in times_s))
        track = [domecast, "track", frames, "--constants", constants_path, "--times", base / "times", "--quiet"]
        run(*track, "--out", base / "a.rec", "--format", "records")
        run(*track, "--out", base / "a.jsonl", "--mcap", base / "a.mcap")
        found = messages_of(base / "a.mcap")
        lines = [json.loads(line) for line in (base / "a.jsonl").read_text().splitlines()]
        times_ns = [round(t * 1e9) for t in times_s]
        compared = check_numbers(found, list(records_of(base / "a.rec")), lines, constants, times_ns)
        expect(compared >= len(files), f"only {compared} wrenches were compared")
        pictures = [(m.format, bytes(m.data)) for _, m in found["/domecast/image/compressed"]]
        wanted = [("jpeg" if p.suffix == ".jpg" else "png", p.read_bytes()) for p in sorted(frames.iterdir())]
        del wanted[len(files) + 1]
        expect(pictures == wanted, "the pictures are not the files' bytes")

        # raw frames and the skin's heights
        run(domecast, "simulate", REPOSITORY / "designs/scenes/lit.json", "--out", base / "lit", "--quiet")
        run(domecast, "simulate", REPOSITORY / "designs/scenes/ball.json", "--frames", "3", "--out", base / "ball", "--quiet")
        pressed = [cv2.imread(str(p)) for p in sorted((base / "ball").glob("frame_*.png"))]
        ppm = [cv2.imencode(".ppm", picture)[1].tobytes() for picture in pressed]
        # chunks end by frames' times too; three frames with heights are more than a megabyte each
        run(domecast, "track", "-", "--constants", constants_path, "--out", base / "b.jsonl", "--mcap", base / "b.mcap", "--shape",
            base / "shapes", "--rest", base / "lit/frame_0000.png", "--quiet", input=b"".join(ppm))
        found = messages_of(base / "b.mcap")
        for k, (_, image) in enumerate(found["/domecast/image"]):
            pixels = np.frombuffer(bytes(image.data), np.uint8).reshape(image.height, image.width, 3)
            expect(image.encoding == "rgb8" and np.array_equal(pixels[..., ::-1], pressed[k]), f"raw frame {k}: other pixels")
        heights = found["/domecast/height"]
        expect(len(heights) == 3, f"{len(heights)} maps of heights")
        for k, (_, image) in enumerate(heights):
            metres = np.frombuffer(bytes(image.data), "<f4").reshape(image.height, image.width)
            mm = np.load(base / f"shapes/frame_{k:04}.height.npy").astype(float)
            expect(image.encoding == "32FC1" and np.array_equal(metres, (mm * 1e-3).astype("f4"), equal_nan=True), f"height {k}")
            expect(np.isfinite(metres).mean() > 0.2, f"height {k}: nothing is known")
        cuts = check_cuts(base / "a.mcap", 150)
        again = subprocess.run([str(w) for w in [*track, "--out", base / "a.jsonl", "--mcap", base / "a.mcap"]], capture_output=True)
        expect(again.returncode == 0, f"an unchanged recording is not replaced: {again.stderr.decode()}")
        kills = [check_kill(domecast, constants_path, ppm, base, seed) for seed in range(3)]
        size = (base / "a.mcap").stat().st_size
    for fault in faults[:20]:
        print(f"FAIL {fault}")
    print(f"mcap: {compared} wrenches bit for bit, {size / count / 1e3:.0f} kB a frame, {cuts} cuts, "
          f"kills (frames, readable) {kills}, {len(faults)} failed, {time.monotonic() - began:.0f} s")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
