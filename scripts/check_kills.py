"""Kills the program at every system call of a replacement, fills its disk, and mounts what it should write to.

    check_kills.py DOMECAST [KILLS]

Needs Linux with strace, and user namespaces for the disks; what is missing is named and left out. After each kill, the
next run of another command must leave the old or the new result in its place, whole, what the user had beside it, and
nothing else.
"""

import itertools
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

DESIGN = Path(__file__).parent.parent / "designs/thumb24.json"
# whatever touches the file system; reads are among them, for a kill anywhere must do no harm
CALLS = "%file,%desc,fsync,write,flock"
NO_EXCHANGE = ["-e", "inject=renameat2:error=EINVAL"]


def contents(folder):
    """Everything below a folder: bytes of files, targets of links."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        found[name] = ("link", os.readlink(path)) if path.is_symlink() else path.read_bytes() if path.is_file() else None
    return found


def run(arguments, folder, strace=()):
    environment = dict(os.environ, RAYON_NUM_THREADS="1")
    return subprocess.run([*strace, *arguments], cwd=folder, env=environment, capture_output=True, text=True)


class Scenario:
    """A command that writes a result in a folder in which something stands."""

    def __init__(self, name, old, new, place, traced=(), theirs=None):
        self.name, self.old, self.new, self.place = name, old, new, place
        self.traced, self.theirs = list(traced), theirs

    def prepare(self, folder, inputs):
        for file in inputs.iterdir():
            shutil.copy2(file, folder)
        if self.old is not None:
            done = run(self.old, folder)
            assert done.returncode == 0, done.stderr
        if self.theirs:
            (folder / self.theirs).parent.mkdir(exist_ok=True)
            (folder / self.theirs).write_text("three years of work")


def states(scenario, inputs, work):
    """The folder before the run and after it, and the number of system calls in between."""
    folder = work / "whole"
    folder.mkdir()
    scenario.prepare(folder, inputs)
    before, log = contents(folder), work / "log"
    trace = ["strace", "-f", "-qq", "-o", str(log), "-e", f"trace={CALLS}", *scenario.traced]
    done = run(scenario.new, folder, trace)
    assert done.returncode == 0, (scenario.name, done.stderr)
    lines = log.read_text().splitlines()
    # counted for each thread; the main one comes first
    main = lines[0].split()[0]
    calls = [line for line in lines if line.split()[0] == main and re.match(r"\d+\s+\w+\(", line)]
    first = next(i for i, line in enumerate(calls) if ".domecast-" in line)
    # each call by its name and how often that came before, which is how strace counts
    names = [re.match(r"\d+\s+(\w+)\(", line)[1] for line in calls]
    numbered = [(name, names[: i + 1].count(name)) for i, name in enumerate(names)]
    after = contents(folder)
    shutil.rmtree(folder)
    return before, after, [call for call in numbered[first:] if call[0] != "renameat2" or not scenario.traced]


def killed_at(scenario, inputs, work, call, before, after, picked):
    folder = work / "killed"
    folder.mkdir()
    scenario.prepare(folder, inputs)
    strace = ["strace", "-f", "-qq", "-o", os.devnull, "-e", f"trace={CALLS}"]
    kill = [*strace, "-e", "inject={}:signal=KILL:when={}".format(*call), *scenario.traced]
    ended = run(scenario.new, folder, kill)
    # the run that ends what was begun may be killed too
    name, count = picked.choice(["unlink", "unlinkat", "rmdir", "rename", "openat"]), picked.randint(1, 4)
    count *= 12 if name == "openat" else 1
    again = [*strace, "-e", f"inject={name}:signal=KILL:when={count}", *scenario.traced]
    if picked.random() < 0.5:
        run([scenario.new[0], "check", scenario.place], folder, again)
    # the next run of another command, which fails for a file and must not mind
    recovered = run([scenario.new[0], "check", scenario.place], folder)
    found, problems = contents(folder), []
    if ended.returncode != -signal.SIGKILL:
        problems.append(f"was not killed: exit {ended.returncode} {ended.stderr.strip()}")
    if found not in (before, after):
        names = sorted({*found, *before, *after})
        odd = [name for name in names if found.get(name, 0) not in (before.get(name, 0), after.get(name, 0))]
        problems += odd or ["a mixture of old and new"]
        problems.append(recovered.stderr.strip())
    shutil.rmtree(folder)
    return problems


def check_kills(program, inputs, work, wanted):
    track = lambda frame, *more: [program, "track", frame, "--constants", "constants.json", "--quiet", *more]
    folder = ["--overlay", "o"]
    file = ["--out", "t.jsonl"]
    scenarios = [
        Scenario("a new file", None, track("b.png", *file), "t.jsonl"),
        Scenario("a file replaced", track("a.png", *file), track("b.png", *file), "t.jsonl"),
        Scenario("a file without exchange", track("a.png", *file), track("b.png", *file), "t.jsonl", NO_EXCHANGE),
        Scenario("a file forced", None, track("b.png", *file, "--force"), "t.jsonl", theirs="t.jsonl"),
        Scenario("a new folder", None, track("b.png", *folder), "o"),
        Scenario("a folder replaced", track("a.png", *folder), track("b.png", *folder), "o"),
        Scenario("a folder without exchange", track("a.png", *folder), track("b.png", *folder), "o", NO_EXCHANGE),
        Scenario("a folder forced", track("a.png", *folder), track("b.png", *folder, "--force"), "o", theirs="o/thesis.tex"),
        Scenario("a folder forced without exchange", track("a.png", *folder), track("b.png", *folder, "--force"), "o",
                 NO_EXCHANGE, theirs="o/thesis.tex"),
    ]
    picked, kills, faults = random.Random(24), 0, []
    for scenario in scenarios:
        before, after, calls = states(scenario, inputs, work)
        some = -(-wanted // len(scenarios))
        if len(calls) > some:
            # the replacement itself, which is at the end, in full; of the rest a sample
            early, end = calls[: -some * 2 // 3], calls[-some * 2 // 3 :]
            calls = picked.sample(early, some - len(end)) + end
        for call in calls:
            problems = killed_at(scenario, inputs, work, call, before, after, picked)
            if problems:
                faults.append(f"{scenario.name}, {call[0]} {call[1]}: {'; '.join(problems)}")
        kills += len(calls)
        print(f"  {scenario.name}: {len(calls)} kills")
    return kills, faults


def check_disks(program, inputs, work):
    """A full disk and a mount point, in a namespace of its own."""
    script = """
        set -e
        mount -t tmpfs -o size=300k tmpfs disk
        PROGRAM track a.png --constants constants.json --quiet --overlay disk/o || exit 90
        cp -r disk/o saved
        mkdir mounted && mount -t tmpfs tmpfs mounted
        if PROGRAM track b.png --constants constants.json --quiet --overlay mounted; then exit 91; fi
        if PROGRAM track b.png --constants constants.json --quiet --overlay disk; then exit 92; fi
        head -c 400k /dev/zero > disk/filler || true
        if PROGRAM track b.png --constants constants.json --quiet --overlay disk/o; then exit 93; fi
        diff -r disk/o saved || exit 94
        test "$(ls -A disk | tr '\\n' ' ')" = "filler o " || exit 95
        mount --bind saved disk/o || exit 96
        rm disk/filler
        if PROGRAM track b.png --constants constants.json --quiet --overlay disk/o; then exit 97; fi
    """
    folder = work / "disks"
    folder.mkdir()
    for file in inputs.iterdir():
        shutil.copy2(file, folder)
    (folder / "disk").mkdir()
    done = run(["unshare", "-rm", "sh", "-c", script.replace("PROGRAM", str(program))], folder)
    if "unshare" in done.stderr or "mount:" in done.stderr:
        print("!! SKIPPED: full disks and mounts (they need user namespaces)", file=sys.stderr)
        return []
    return [] if done.returncode == 0 else [f"disks: step {done.returncode}: {done.stderr.strip()}"]


def main():
    program, wanted = str(Path(sys.argv[1]).resolve()), int(sys.argv[2]) if len(sys.argv) > 2 else 300
    traces = shutil.which("strace") and subprocess.run(["strace", "-qq", "-o", os.devnull, "true"]).returncode == 0
    with tempfile.TemporaryDirectory() as place:
        work = Path(place)
        inputs = work / "inputs"
        inputs.mkdir()
        assert run([program, "build", str(DESIGN), "--out", "built", "--quiet"], work).returncode == 0
        shutil.copy(work / "built/constants/constants.json", inputs)
        scene = {"version": 1, "name": "s", "design": str(DESIGN), "frames": {"count": 2, "rate_hz": 1},
                 "tolerance": {"px": 0.5, "grey": 20},
                 "motion": {"wrench": [{"time_s": 0, "force_n": [0, 0, 0], "point_mm": [0, 0, 10]},
                                       {"time_s": 1, "force_n": [0, 0, -2], "point_mm": [0, 0, 10]}]}}
        (work / "scene.json").write_text(json.dumps(scene))
        drawn = run([program, "simulate", "scene.json", "--out", "frames", "--quiet"], work)
        assert drawn.returncode == 0, drawn.stderr
        for name, frame in zip(("a.png", "b.png"), sorted((work / "frames").glob("*.png"))):
            shutil.copy(frame, inputs / name)
        faults = check_disks(program, inputs, work)
        kills = 0
        if traces:
            kills, more = check_kills(program, inputs, work, wanted)
            faults += more
        else:
            print("!! SKIPPED: kills at system calls (they need strace)", file=sys.stderr)
    for fault in itertools.islice(faults, 40):
        print(f"FAIL {fault}")
    print(f"{kills} kills, {len(faults)} failed")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
