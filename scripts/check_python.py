#!/usr/bin/env python3
"""Builds the wheel and judges it from outside.

    check_python.py DOMECAST [--profile release] [--all] [--wheel FILE] [--keep FOLDER] [--inputs N] [--frames N] [--accuracy FOLDER]

The wheel is built by maturin with the cargo profile that DOMECAST was built with, at most 10 MB, and installed with numpy and
nothing else into a fresh virtual environment. There

- its command line builds a sensor, where no other program can be found and no variable is set;
- every call gives what DOMECAST writes, bit for bit; two threads at once; flat memory (`python/same_as_cli.py`).

Then, beside the test's own packages,

- random wrong inputs end in exceptions, never in a panic (`python/wrong_inputs.py`);
- stubs and examples are clean under `pyright` and `mypy --strict`, and the examples and notebooks run;
- the simulators' side is judged by MuJoCo and gymnasium (`python/simulators.py`), the ROS 2 node beside a stub of rclpy (`python/ros_node.py`).

Times are printed and judged nowhere. --all: more frames, more wrong inputs.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

from check_hardness import RIGID, SIZE, network, with_metadata

REPOSITORY = Path(__file__).resolve().parent.parent
HERE = REPOSITORY / "scripts/python"
MAX_WHEEL_BYTES = 10_000_000


def run(*words, **options):
    began = time.monotonic()
    done = subprocess.run([str(word) for word in words], **options)
    if done.returncode != 0:
        sys.exit(f"failed with {done.returncode}: {' '.join(map(str, words))}")
    return time.monotonic() - began


def build_wheel(profile, folder):
    """Builds it among the files of the program's own build."""
    words = ["-m", "maturin", "build", "--profile", profile, "--strip", "--out", folder, "--locked", "--quiet"]
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    took = run(sys.executable, *words, "--manifest-path", REPOSITORY / "src/python/Cargo.toml", env=environment)
    [wheel] = folder.glob("domecast-*.whl")
    print(f"wheel built in {took:.0f} s")
    return wheel


def check_wheel(wheel):
    version = re.search(r'^version = "(.+)"', (REPOSITORY / "Cargo.toml").read_text(), re.M)[1]
    names = zipfile.ZipFile(wheel).namelist()
    size = wheel.stat().st_size
    print(f"{wheel.name}: {size / 1e6:.1f} MB, {len(names)} files")
    assert size <= MAX_WHEEL_BYTES, f"the wheel has {size} bytes, at most {MAX_WHEEL_BYTES} are wanted"
    assert wheel.name.startswith(f"domecast-{version}-cp310-abi3-"), wheel.name
    for wanted in ("domecast/py.typed", "domecast/_native.pyi", "domecast/__init__.py", "domecast/_native.abi3.so"):
        assert wanted in names, f"the wheel lacks {wanted}"


def bare_environment(folder, wheel):
    """A virtual environment with the wheel and what it asks for; its Python. As in a container that has Python only: no other program can
    be found, no variable says anything, and the design stands alone in a folder."""
    made = run(sys.executable, "-m", "venv", folder)
    python = folder / "bin/python"
    home = folder / "home"
    home.mkdir(exist_ok=True)
    nothing = {"PATH": str(folder / "bin"), "HOME": str(home)}
    assert not any(shutil.which(name, path=nothing["PATH"]) for name in ("cargo", "rustc", "maturin", "cc", "git"))
    numpy = next(line for line in (REPOSITORY / "scripts/requirements.txt").read_text().splitlines() if line.startswith("numpy=="))
    # where the packages come from is the machine's own affair
    index = {name: value for name, value in os.environ.items() if name.startswith("PIP_") or name.lower().endswith("_proxy")}
    installed = run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", numpy, wheel, env={**nothing, **index}, cwd=home)
    shutil.copy(REPOSITORY / "designs/thumb24.json", home)
    took = run(folder / "bin/domecast", "build", "thumb24.json", "--out", "thumb24", "--quiet", env=nothing, cwd=home)
    assert (home / "thumb24/report/index.html").exists()
    print(f"nothing but Python: virtual environment in {made:.1f} s; pip install of the wheel in {installed:.1f} s, domecast build in "
          f"{took:.1f} s")
    return python


def check_program(domecast, program, folder):
    """The wheel's command line answers as the program does: text, streams, exit codes."""
    design = REPOSITORY / "designs/thumb24.json"
    (folder / "broken.json").write_text('{"version": 1,')
    for words in (["--version"], ["--help"], ["explain", "leds.tilt_deg"], ["list", "cameras", "--json"], [], ["nonsense"], ["build"],
                  ["build", "no-such.json"], ["build", "broken.json", "--json"], ["trace", design, "--pixels", "no-such.csv"]):
        told = [subprocess.run([one, *map(str, words)], cwd=folder, capture_output=True) for one in (domecast, program)]
        same = {(one.returncode, one.stdout, one.stderr) for one in told}
        assert len(same) == 1, f"{words}: {told}"
    print("the wheel's command line answers as the program does, exit codes included")


def check_interrupt(program, folder):
    """Ctrl-C ends a command of the wheel at once, and leaves nothing behind."""
    import signal
    scene = REPOSITORY / "designs/scenes/ball.json"
    child = subprocess.Popen([program, "simulate", scene, "--frames", "400", "--out", "stopped", "--quiet"], cwd=folder)
    until = time.monotonic() + 60
    while not any(one.name.startswith(".domecast") for one in folder.iterdir()) and time.monotonic() < until:
        time.sleep(0.05)
    child.send_signal(signal.SIGINT)
    code = child.wait(timeout=60)
    left = [one.name for one in folder.iterdir() if "stopped" in one.name or one.name.startswith(".domecast")]
    assert code == -signal.SIGINT and not left, (code, left)
    print("Ctrl-C ends the wheel's command line and leaves nothing behind")


def check_types(site):
    """Stubs and examples under the two strict checkers."""
    examples = sorted((HERE / "examples").glob("*.py"))
    environment = {**os.environ, "PYTHONPATH": str(site), "MYPYPATH": ""}
    run(sys.executable, "-m", "mypy", "--strict", "--no-error-summary", "--cache-dir", site.parent / "mypy", *examples,
        site / "domecast", env=environment, cwd=site.parent)
    shutil.copytree(HERE / "examples", site.parent / "examples", dirs_exist_ok=True)
    settings = {"include": ["site/domecast", "examples"], "typeCheckingMode": "strict", "extraPaths": ["site"],
                "reportMissingTypeStubs": False, "reportPrivateUsage": False,
                "reportMissingModuleSource": False, "pythonVersion": "3.11"}
    (site.parent / "pyrightconfig.json").write_text(json.dumps(settings))
    run(sys.executable, "-m", "pyright", "--pythonpath", sys.executable, "-p", site.parent / "pyrightconfig.json", env=environment)
    print("stubs and examples: clean under mypy --strict and pyright strict")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("domecast")
    parser.add_argument("--profile", default="release")
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--wheel", type=Path)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--accuracy", type=Path, help="what `domecast accuracy --quick` made of thumb24 [default: it is made]")
    parser.add_argument("--inputs", type=int, help="random wrong inputs [default: 3,000; with --all 100,000]")
    parser.add_argument("--frames", type=int, help="frames that must leave the memory as it was, as often in two threads, a twentieth of them for shapes [default: 800; with --all 10,000]")
    asked = parser.parse_args()
    domecast = Path(asked.domecast).resolve()
    with tempfile.TemporaryDirectory() as base:
        base = asked.keep.resolve() if asked.keep else Path(base)
        base.mkdir(exist_ok=True, parents=True)
        wheel = asked.wheel or build_wheel(asked.profile, base / "dist")
        check_wheel(wheel)
        python = bare_environment(base / "bare", wheel)
        (base / "work").mkdir(exist_ok=True)
        check_program(domecast, python.parent / "domecast", base / "work")
        check_interrupt(python.parent / "domecast", base / "work")
        frames = asked.frames or (10_000 if asked.all else 800)
        measured = [asked.accuracy.resolve()] if asked.accuracy else []
        # of random weights, for every light
        model = base / "hardness.onnx"
        model.write_bytes(with_metadata(network(8, SIZE, len(RIGID), [8, 16]), [[0, 255]] + [[0, 100]] * 12))
        run(python, HERE / "same_as_cli.py", domecast, REPOSITORY, base / "work", model, frames, *measured, cwd=base)
        # beside the packages of the tests: the installed files alone
        site = base / "site"
        shutil.rmtree(site, ignore_errors=True)
        zipfile.ZipFile(wheel).extractall(site)
        shutil.rmtree(next(site.glob("*.dist-info")))
        beside = {**os.environ, "PYTHONPATH": str(site), "PYTHONDONTWRITEBYTECODE": "1"}
        check_types(site)
        constants = base / "work/by-cli/constants/constants.json"
        inputs = asked.inputs or (100_000 if asked.all else 3_000)
        run(sys.executable, HERE / "wrong_inputs.py", constants, REPOSITORY, model, inputs, env=beside, cwd=base)
        run(sys.executable, HERE / "run_notebooks.py", REPOSITORY, base / "notebooks", env=beside)
        run(sys.executable, HERE / "ros_node.py", constants, base / "work/simulated-push", env=beside, cwd=base)
        if (HERE / "simulators.py").exists():
            run(sys.executable, HERE / "simulators.py", REPOSITORY, env=beside, cwd=base)
    print("python: 0 faults")
    return 0


if __name__ == "__main__":
    sys.exit(main())
