"""What `cargo deny check` looks at, without it and without a network: licences, versions, sources, known faults.

Reads deny.toml, tests/advisories.toml and `cargo metadata`. A rule of deny.toml that serves nothing any more is a fault
too.
"""

import json
import re
import subprocess
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parent.parent
REGISTRY = "registry+https://github.com/rust-lang/crates.io-index"


def version_of(text):
    return tuple(int(part) for part in re.split(r"[-+]", text)[0].split("."))


def is_in(version, ranges):
    """Whether a version is in one of some ranges, each a list of comparisons."""
    compare = {">=": lambda a, b: a >= b, "<": lambda a, b: a < b, ">": lambda a, b: a > b, "=": lambda a, b: a == b}
    for one in ranges:
        parts = [re.match(r"\s*(>=|<|>|=)\s*([\d.]+)\s*$", part).groups() for part in one.split(",")]
        if all(compare[sign](version, version_of(bound)) for sign, bound in parts):
            return True
    return False


def allows(expression, allowed):
    """Whether a licence expression can be met by what is allowed; `/` is an old way to write OR."""
    tokens = re.findall(r"\(|\)|[^\s()]+", expression.replace("/", " OR "))
    at = 0

    def either():
        nonlocal at
        found = both()
        while at < len(tokens) and tokens[at] == "OR":
            at += 1
            found = both() or found
        return found

    def both():
        nonlocal at
        found = one()
        while at < len(tokens) and tokens[at] == "AND":
            at += 1
            found = one() and found
        return found

    def one():
        nonlocal at
        if tokens[at] == "(":
            at += 1
            found = either()
            at += 1
            return found
        name = tokens[at]
        at += 1
        if at < len(tokens) and tokens[at] == "WITH":
            name += " WITH " + tokens[at + 1]
            at += 2
        return name in allowed

    return either()


def main():
    rules = tomllib.loads((ROOT / "deny.toml").read_text())
    advisories = tomllib.loads((ROOT / "tests/advisories.toml").read_text())["advisory"]
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    packages = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout)["packages"]
    faults, versions = [], defaultdict(list)
    for package in packages:
        name = f"{package['name']} {package['version']}"
        versions[package["name"]].append(package["version"])
        if not allows(package["license"] or "none", rules["licenses"]["allow"]):
            faults.append(f"{name}: licence {package['license']} is not allowed")
        if package["source"] not in (None, REGISTRY):
            faults.append(f"{name}: comes from {package['source']}")

    skipped = {rule["crate"] for rule in rules["bans"]["skip"]}
    for name, found in sorted(versions.items()):
        *others, _ = sorted(found, key=version_of)
        for version in others:
            if f"{name}@{version}" not in skipped:
                faults.append(f"{name}: {version} is linked beside {', '.join(sorted(found))}")
            skipped.discard(f"{name}@{version}")
    faults += [f"deny.toml skips {crate}, which stands beside no newer one" for crate in sorted(skipped)]

    ignored = {rule["id"] for rule in rules["advisories"]["ignore"]}
    for advisory in advisories:
        good = advisory["patched"] + advisory["unaffected"]
        for version in versions.get(advisory["package"], []):
            if is_in(version_of(version), good):
                continue
            if advisory["id"] not in ignored:
                faults.append(f"{advisory['package']} {version}: {advisory['id']}, {advisory['title']}")
            ignored.discard(advisory["id"])
    faults += [f"deny.toml ignores {name}, which concerns no crate" for name in sorted(ignored)]

    for fault in faults:
        print(f"FAIL {fault}")
    print(f"dependencies: {len(packages)} crates, {len(faults)} failed")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
