#!/usr/bin/env python3
"""Jumps of the skin by about the pattern's spacing between two frames, in frames that domecast did not draw.

    python3 scripts/check_jumps.py target/release/domecast output/thumb24 [...] [--cases N] [--seed S] [--only KIND]

A regular pattern that is moved by its spacing lies on itself but for its edges. Each case is a frame at rest, two of the skin as it
jumped, one at rest again. Counted are dots called `ok` that carry another's number, in frames called `ok` (silent) and in
others, and what was withheld. Beside them stand motions that silicone makes, slow and fast: there nothing should be withheld for
its number.
"""
import sys

import numpy as np

from check_identities import Build, dent, pull, random_skin, shear, slip

failed = 0


def patch_of(build, random, low, high, share=1 / 3):
    """A patch with a sharp edge, of a share of the dots at most, beside its place by some steps of the pattern."""
    widest = min(5.0, np.sqrt(len(build.sensor.dots) * share / np.pi))
    way = random.integers(4) if random.random() < 0.6 else random.normal(size=3)
    stretch = random.uniform(1, 2) if random.random() < 0.4 else 1.0
    place = build.at(random.uniform(0, 50), random.uniform(0, 360))
    return build.patch(place, way, random.uniform(low, high), random.uniform(0.6, widest), stretch)


def slipped(build, random):
    return slip(build.sensor, unit(random.normal(size=3) * [1, 1, 0.3]), build.pitch_rad() * random.uniform(0.8, 2.0))


def unit(vector):
    return vector / np.linalg.norm(vector)


def pulled(build, random):
    sensor, r = build.sensor, build.sensor.radius
    place = build.at(random.uniform(0, 50), random.uniform(0, 360))
    way = unit(np.cross(place - sensor.center, random.normal(size=3)))
    return pull(sensor, place, way * r * build.pitch_rad() * random.uniform(0.8, 2.0), r * random.uniform(0.2, 0.5))


# what silicone does not do: numbers may be withheld, not wrong
JUMPS = {
    "patch 1": lambda b, r: patch_of(b, r, 1.0, 1.0),
    "patch 0.93-1.07": lambda b, r: patch_of(b, r, 0.93, 1.07),
    "patch 1.3-2": lambda b, r: patch_of(b, r, 1.3, 2.0),
    "patch 0.5-0.9": lambda b, r: patch_of(b, r, 0.5, 0.9),
    "patch 1.07-1.3": lambda b, r: patch_of(b, r, 1.07, 1.3),
    "slip 0.8-2": slipped,
    "pull 0.8-2": pulled,
}


def pressed(build, random):
    """Pressed in slowly, then dragged along."""
    sensor, r = build.sensor, build.sensor.radius
    polar, azimuth = random.uniform(0, 40), random.uniform(0, 360)
    depth, width = r * random.uniform(0.1, 0.25), r * random.uniform(0.22, 0.4)
    for i in range(14):
        down, along = min(i / 7, 1), max(0, i - 7) / 7
        yield dent(sensor, build.at(polar + 10 * along, azimuth + 10 * along), depth * down, width)


def sheared(build, random):
    angle = random.uniform(0, 2 * np.pi)
    way = 0.3 * build.sensor.radius * random.uniform(0.5, 1) * np.array([np.cos(angle), np.sin(angle), 0])
    for i in range(14):
        yield shear(build.sensor, way * i / 13)


def touched(build, random):
    """A touch on and off between two frames."""
    sensor, r = build.sensor, build.sensor.radius
    skin = dent(sensor, build.at(random.uniform(0, 40), random.uniform(0, 360)), 0.2 * r, r * random.uniform(0.2, 0.35))
    yield from (None, skin, skin, None)


def any_skins(build, random):
    for _ in range(4):
        yield random_skin(build, random)


MOTIONS = {"pressed, dragged": pressed, "sheared to 3 mm in 10": sheared, "touched by 2 mm in 10": touched, "any": any_skins}


class Tally:
    def __init__(self):
        self.silent, self.wrong, self.dots, self.withheld, self.frames, self.states, self.said = 0, 0, 0, 0, 0, {}, {}
        self.which = []


def count(build, tally, case, lines, truths):
    silent = wrong = 0
    for line, truth in zip(lines, truths):
        swapped = 0
        for index, dot in enumerate(line["black_dots"]):
            if dot["state"] != "ok":
                tally.withheld += dot["state"] != "hidden"
                tally.states[dot["state"]] = tally.states.get(dot["state"], 0) + 1
                continue
            swapped += np.hypot(*(np.array(dot["centroid_px"]) - truth[index])) > 0.4 * build.spacing[index]
        tally.dots += swapped
        tally.frames += 1
        tally.said[line["status"]] = tally.said.get(line["status"], 0) + 1
        wrong |= swapped > 0
        # a scene that holds still is named, which says nothing of numbers
        silent |= swapped > 0 and line["status"] in ("ok", "frozen")
    tally.silent += silent
    tally.wrong += wrong
    if wrong:
        tally.which.append(case)


def show(kind, cases, tally, may_fail):
    global failed
    bad = may_fail and tally.wrong
    failed += bool(bad)
    states = ", ".join(f"{n} {state}" for state, n in sorted(tally.states.items()) if state != "hidden")
    print(f"{'FAIL' if bad else 'ok  '} {kind:<22} {cases} cases: {tally.silent} silent, {tally.wrong} wrong ({tally.dots} dots) {tally.which[:8]}; "
          f"withheld a frame {tally.withheld / tally.frames:.1f} ({states}); {tally.said}", flush=True)


def noisy(frame, random):
    return np.clip(np.round(frame + random.normal(0, 1.0, frame.shape)), 0, 255).astype(np.uint8)


def jumps(build, kind, cases, seed):
    """Many jumps in one recording, with a rest between."""
    random, tally = np.random.default_rng([seed, list(JUMPS).index(kind)]), Tally()
    rest, at_rest = build.sensor.draw(noise=0)
    frames, truths = [], []
    for _ in range(cases):
        frame, truth = build.sensor.draw(skin=JUMPS[kind](build, random), noise=0)
        frames += [noisy(f, random) for f in (rest, frame, frame, rest)]
        truths += [at_rest, truth, truth, at_rest]
    lines, _ = build.track(frames)
    for case in range(cases):
        part = slice(4 * case, 4 * case + 4)
        count(build, tally, case, lines[part], truths[part])
    show(kind, cases, tally, True)


def motions(build, kind, cases, seed):
    random, tally = np.random.default_rng([seed, 100 + list(MOTIONS).index(kind)]), Tally()
    for case in range(cases):
        drawn = [build.sensor.draw(skin=skin, seed=case * 100 + i) for i, skin in enumerate(MOTIONS[kind](build, random))]
        lines, _ = build.track([frame for frame, _ in drawn])
        count(build, tally, case, lines, [truth for _, truth in drawn])
    show(kind, cases, tally, True)


def main(program, *builds):
    given = {"--cases": 20, "--seed": 1, "--only": ""}
    builds = list(builds)
    for option in given:
        if option in builds:
            at = builds.index(option)
            given[option] = type(given[option])(builds[at + 1])
            del builds[at:at + 2]
    cases, seed, only = given.values()
    for folder in builds:
        print(folder)
        build = Build(program, folder)
        for kinds, run, share in ((JUMPS, jumps, 1), (MOTIONS, motions, 4)):
            for kind in kinds:
                if only in kind:
                    run(build, kind, max(1, cases // share), seed)
    print("no jump swaps numbers" if failed == 0 else f"{failed} faults")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
