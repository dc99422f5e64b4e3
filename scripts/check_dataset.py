#!/usr/bin/env python3
"""Judges `domecast dataset`: what it writes is whole, reproducible, balanced, and leaks no class.

    scripts/check_dataset.py [domecast] [--spec SPEC] [--videos N] [--keep DIR]

Reads the shards with tarfile and numpy alone. A logistic regression of our own (numpy) tries to tell the class from what must not
tell it: frames before the contact, force range, speed, last time, sizes, seed, key, and from everything with shuffled labels; and it
must tell the class from the frames after the contact, or the test would have no teeth.
"""
import argparse
import io
import json
import math
import os
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent


def read_set(folder):
    """Index and videos of a set, as the guide shows it."""
    index = json.loads((folder / "dataset.json").read_text())
    videos = {}
    for shard in index["shards"]:
        with tarfile.open(folder / shard["file"]) as tar:
            for member in tar:
                key, name = member.name.split(".", 1)
                videos.setdefault(key, {})[name] = tar.extractfile(member).read()
    for video in videos.values():
        video["sizes"] = [len(video[name]) for name in sorted(video)]
        for name in [n for n in video if n.endswith(".npy")]:
            video[name] = np.load(io.BytesIO(video[name]))
        video["json"] = json.loads(video["json"])
    return index, videos


def shard_bytes(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.glob("*.tar"))}


def logistic(x, y, ridge=1.0, steps=50):
    """Weights of a logistic regression with a ridge, by Newton's method."""
    x = np.c_[np.ones(len(x)), x]
    w = np.zeros(x.shape[1])
    penalty = ridge * np.eye(x.shape[1])
    penalty[0, 0] = 1e-9
    for _ in range(steps):
        p = 1 / (1 + np.exp(-np.clip(x @ w, -30, 30)))
        hess = (x * (p * (1 - p) + 1e-6)[:, None]).T @ x + penalty
        step = np.linalg.solve(hess, x.T @ (p - y) + penalty @ w)
        w -= step
        if np.abs(step).max() < 1e-8:
            break
    return w


def accuracy(x, y, groups, folds=5, seed=0):
    """Right answers in folds that keep pairs together: a pair's twin is never in the training half."""
    x = np.asarray(x, float)
    x = (x - x.mean(0)) / (x.std(0) + 1e-12)
    if x.shape[1] > 24:
        # many numbers: their leading principal components
        u, s, _ = np.linalg.svd(x, full_matrices=False)
        x = u[:, :24] * s[:24]
        x /= x.std(0) + 1e-12
    order = np.random.default_rng(seed).permutation(np.unique(groups))
    right = 0
    for fold in range(folds):
        test = np.isin(groups, order[fold::folds])
        w = logistic(x[~test], y[~test])
        right += int(((np.c_[np.ones(test.sum()), x[test]] @ w > 0) == y[test]).sum())
    return right, len(y)


def binomial_interval(right, count, z=2.576):
    """Wilson's interval, 99 of 100."""
    p = right / count
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * math.sqrt(p * (1 - p) / count + z * z / (4 * count * count)) / (1 + z * z / count)
    return middle - half, middle + half


def check(ok, what):
    print(("ok    " if ok else "FAULT ") + what, flush=True)
    if not ok:
        check.faults += 1


check.faults = 0


def run(program, *arguments, **more):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, **more)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done


def small_spec(path, out, videos, **changes):
    spec = json.loads(path.read_text())
    base = path.parent
    spec["design"] = str((base / spec["design"]).resolve())
    for shape in spec["shapes"]:
        if shape["shape"]["kind"] == "mesh":
            shape["shape"]["file"] = str((base / shape["shape"]["file"]).resolve())
    spec.update(videos=videos, **changes)
    out.write_text(json.dumps(spec))
    return out


def structure(index, videos):
    """Names, types and shapes as the guide says, balance, twins, splits apart."""
    t, h, w, n = index["frames"], index["height"], index["width"], index["dots"]["count"]
    columns = index["readings"]["columns"]
    shapes = {"frames.npy": ((t, h, w, 3), "u1"), "rest.npy": ((h, w, 3), "u1"),
              "readings.npy": ((t, len(columns)), "f4"), "dots.npy": ((t, n, 3), "f4")}
    right = all(v[name].shape == s and v[name].dtype == np.dtype(d)
                for v in videos.values() for name, (s, d) in shapes.items())
    check(right and len(videos) == index["videos"], f"{len(videos)} videos with the arrays that the index names")
    labels = [v["json"] for v in videos.values()]
    check(all(v["sizes"] == next(iter(videos.values()))["sizes"] for v in videos.values()), "all entries of a kind have one size")
    twins = {}
    for label in labels:
        twins.setdefault(label["twin"], []).append(label)
    own = ("key", "class", "label", "youngs_modulus_mpa", "log10_youngs_modulus_mpa", "seed", "truth")
    shared = all(len(pair) == 2 and {k: v for k, v in pair[0].items() if k not in own} ==
                 {k: v for k, v in pair[1].items() if k not in own} for pair in twins.values())
    check(shared, "twins share all but stiffness, seed and what comes of them")
    if index["classes"]:
        check(all({a["label"], b["label"]} == {0, 1} for a, b in twins.values()), "each pair has one of each class")
    found = {split: sum(l["split"] == split for l in labels) for split in index["splits"]}
    check(found == index["splits"], f"splits {found}")
    for what in (lambda l: l["sensor"], lambda l: l["shape"]["name"], lambda l: l["twin"]):
        by = {}
        for label in labels:
            by.setdefault(what(label), set()).add(label["split"])
        check(all(len(splits) == 1 for splits in by.values()), f"{len(by)} sensors, shapes or pairs are in one split each")
    low, high = index["spec"]["press"]["peak_force_n"]
    slices = index["spec"]["press"]["load_slices"]
    def split_of(force):
        k = min(int(slices * math.log(force / low) / math.log(high / low)), slices - 1)
        return "test" if k % 4 == 2 else "val" if k % 8 == 4 else "train"
    wrong = sum(split_of(l["peak_force_n"]) != l["split"] for l in labels)
    check(wrong <= 0.01 * len(labels), f"loads are in the slices of their split ({wrong} at a rounded border)")


def physics(index, videos):
    """The readings agree with the truth within their noise, and frames before the contact hold none."""
    columns = index["readings"]["columns"]
    at = columns.index
    noise = index["spec"]["readings"]["noise"]
    if index["readings"]["kind"] != "model":
        return
    worst_force, still, shift = 0.0, 0.0, 0.0
    for video in videos.values():
        r, label = video["readings.npy"].astype(float), video["json"]
        first = label["first_contact_frame"]
        force = np.linalg.norm(r[:, 1:4], axis=1)
        truth = np.array(label["truth"]["force_n"])
        worst_force = max(worst_force, np.max(np.abs(force - truth) - 0.03 * truth))
        still = max(still, np.abs(r[:first, 1:4]).max())
        dots = video["dots.npy"]
        found = dots[:first][dots[:first, :, 2] > 0]
        shift = max(shift, np.abs(found[:, :2].mean()))
        check_keys = np.array(label["path"]["keys"])
        assert np.allclose(check_keys[:, 0], r[:, at("time_s")], rtol=1e-4, atol=1e-5)
    check(worst_force < 6 * noise["force_n"], f"forces are the truth's within noise and calibration: {worst_force:.4f} N")
    check(still < 6 * noise["force_n"], f"no force before the contact: {still:.4f} N")
    check(shift < 0.02, f"dots rest before the contact: {shift:.4f} px mean")


def tracked(program, spec, folder):
    """Readings that `track` says of frames at full size: the forces are the truth's within what a sensor as built is off."""
    few = small_spec(spec, folder / "tracked.json", 6)
    text = json.loads(few.read_text())
    text["readings"]["kind"] = "tracked"
    text["sensors"].update(train=1, val=1, test=1)
    few.write_text(json.dumps(text))
    run(program, "dataset", few, "--out", folder / "tracked")
    index, videos = read_set(folder / "tracked")
    columns = index["readings"]["columns"]
    share, still, found = [], 0.0, []
    for video in videos.values():
        r, label = video["readings.npy"].astype(float), video["json"]
        force, truth = np.linalg.norm(r[:, 1:4], axis=1), np.array(label["truth"]["force_n"])
        share += [force[k] / truth[k] for k in range(len(truth)) if truth[k] > 0.2]
        still = max(still, np.abs(r[:label["first_contact_frame"], 1:4]).max())
        found.append(video["dots.npy"][..., 2].mean())
    # wires, coils and modulus of the springs as built: two deviations of each at most
    check(0.8 < min(share) <= max(share) < 1.25, f"tracked forces are {min(share):.3f} to {max(share):.3f} of the truth (sensors as built)")
    check(still < 0.02, f"no tracked force before the contact: {still:.4f} N")
    check(min(found) > 0.97, f"dots tracked: {min(found):.3f} at least")
    check(not np.isnan(np.concatenate([video["readings.npy"] for video in videos.values()])).any(), "all readings are tracked")
    at = columns.index("contact_radius_mm")
    pairs = np.array([(video["readings.npy"][k, at], true) for video in videos.values()
                      for k, (true, force) in enumerate(zip(video["json"]["truth"]["contact_radius_mm"], video["json"]["truth"]["force_n"])) if force > 0.3])
    ratio = pairs[:, 0] / pairs[:, 1]
    near = np.mean((ratio > 0.7) & (ratio < 1.5))
    check(0.85 < np.median(ratio) < 1.25 and near > 0.75,
          f"tracked radii of contacts are in the median {np.median(ratio):.2f} of the truth, {100 * near:.0f} of 100 from 0.7 to 1.5 of it")


def pooled(frames, rest):
    """Difference to the rest frame, coarse."""
    d = frames.astype(float) - rest.astype(float)
    h, w = d.shape[-3] // 8 * 8, d.shape[-2] // 8 * 8
    return d[..., :h, :w, :].reshape(*d.shape[:-3], h // 8, 8, w // 8, 8, 3).mean((-4, -2)).reshape(*d.shape[:-3], -1)


def leaks(index, videos):
    if not index["classes"]:
        return
    keys = sorted(videos)
    labels = [videos[k]["json"] for k in keys]
    y = np.array([l["label"] for l in labels], float)
    groups = np.array([l["twin"] for l in labels])
    columns = index["readings"]["columns"]
    before, after, read = [], [], []
    for k in keys:
        v, first = videos[k], videos[k]["json"]["first_contact_frame"]
        d = pooled(v["frames.npy"], v["rest.npy"])
        before.append(np.r_[d[:first].mean(0), v["frames.npy"][:first].mean((0, 1, 2)), v["rest.npy"].mean((0, 1)),
                            np.nan_to_num(v["readings.npy"][:first, 1:].mean(0)), v["dots.npy"][:first].mean((0, 1))])
        after.append(np.r_[d[-1], v["dots.npy"][-1, :, :2].ravel()])
        read.append(np.nan_to_num(v["readings.npy"][-1, 1:]))
    seed = [int(l["seed"]) for l in labels]
    plain = [[l["peak_force_n"], l["duration_s"], l["path"]["approach_mm_s"], l["first_contact_frame"], l["friction"],
              l["light_power"], l["path"]["polar_deg"], int(k), int(k) % 2, s % 2 ** 32, s >> 32,
              bin(s).count("1"), *videos[k]["sizes"], *videos[k]["readings.npy"][[-1, 1], 0]]
             for k, l, s in zip(keys, labels, seed)]
    rng = np.random.default_rng(3)
    shuffled = y.copy()
    for group in np.unique(groups):
        if rng.random() < 0.5:
            shuffled[groups == group] = 1 - shuffled[groups == group]
    half = 2.576 * math.sqrt(0.25 / len(y))
    for what, x, of in (("frames before the contact", before, y), ("force, speed, times, sizes, seed, key", plain, y),
                        ("everything, labels shuffled", np.c_[after, read], shuffled)):
        right, count = accuracy(x, of, groups)
        low, high = binomial_interval(right, count)
        check(low <= 0.5 <= high, f"{what}: {right / count:.3f} right of {count} (99 % interval {low:.3f} to {high:.3f}; "
                                  f"0.5 within {half:.3f})")
    right, count = accuracy(np.c_[after, read], y, groups)
    if len(y) < 40:
        return
    check(right / count > 0.5 + half, f"frames and readings in contact: {right / count:.3f} right: the test has teeth")


def reproducible(program, spec, folder):
    """Same bytes whatever the threads and the machine; killed and resumed; a shard alone."""
    one, two, three = (folder / name for name in ("one", "two", "three"))
    run(program, "dataset", spec, "--out", one, "--shards", 3, "--threads", 1)
    # tasks of many threads once waited for each other for ever
    run(program, "dataset", spec, "--out", two, "--shards", 3, "--shard", 2, "--threads", 16, timeout=600)
    run(program, "dataset", spec, "--out", two, "--shards", 3, "--shard", 0, "--threads", 2)
    wanted = shard_bytes(one)
    found = shard_bytes(two)
    check(len(found) == 2 and all(wanted[name] == found[name] for name in found), "shards made alone, on 2 and 16 threads, have the same bytes")
    listed = json.loads(run(program, "dataset", spec, "--out", two, "--shards", 3, "--list", "--json").stdout)
    check([job["done"] for job in listed["jobs"]] == [True, False, True], "the list says which are done")
    kills = 0
    for wait in (0.3, 1.0, 2.0, 3.5):
        job = subprocess.Popen([program, "dataset", str(spec), "--out", str(three), "--shards", "3", "-q"])
        time.sleep(wait)
        if job.poll() is None:
            os.kill(job.pid, signal.SIGKILL)
            kills += 1
        job.wait()
        check(all(wanted[name] == got for name, got in shard_bytes(three).items()), f"killed after {wait} s: what is there is whole")
    run(program, "dataset", spec, "--out", three, "--shards", 3)
    check(shard_bytes(three) == wanted and kills > 0, f"killed {kills} times and resumed: the same set")
    index = [json.loads((place / "dataset.json").read_text()) for place in (one, three)]
    check(index[0] == index[1] and all(s["sha256"] for s in index[0]["shards"]), "and the same index with all hashes")
    stray = [p.name for p in three.iterdir() if p.name.startswith(".domecast-")]
    check(not stray, f"nothing half-made is left: {stray}")
    refused = subprocess.run([program, "dataset", str(spec), "--out", str(folder)], capture_output=True, text=True)
    check(refused.returncode == 1 and "--out" in refused.stderr, "a folder that holds something else is refused")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", nargs="?", default=str(ROOT / "target/release/domecast"))
    parser.add_argument("--spec", type=Path, default=ROOT / "designs/datasets/tiny.json")
    parser.add_argument("--videos", type=int, default=200)
    parser.add_argument("--set", type=Path, help="judge this set, which is there, instead of making one")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        place = Path(place)
        if arguments.set is None:
            reproducible(arguments.program, small_spec(arguments.spec, place / "few.json", 16), place)
            tracked(arguments.program, arguments.spec, place)
            spec = small_spec(arguments.spec, place / "more.json", arguments.videos)
            began = time.perf_counter()
            run(arguments.program, "dataset", spec, "--out", place / "more")
            print(f"      {arguments.videos} videos in {time.perf_counter() - began:.1f} s")
        index, videos = read_set(arguments.set or place / "more")
        structure(index, videos)
        physics(index, videos)
        leaks(index, videos)
    sys.exit(1 if check.faults else 0)


if __name__ == "__main__":
    main()
