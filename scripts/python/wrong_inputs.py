"""Random wrong inputs to every public call: exceptions with words, never a panic, never a crash.

    wrong_inputs.py CONSTANTS REPOSITORY MODEL COUNT [--drawn N] [--only NAME]

Every parameter of every entry (python/entries.py) has a good value and wrong ones. A first part of the calls is drawn by hypothesis,
which shrinks what fails; the rest puts the values that it drew together anew, which costs it nothing: hypothesis' own work is
milliseconds a call. The same numbers give the same calls. At the end what the calls shared must still give what it gave at first.
"""

import argparse
import faulthandler
import importlib
import inspect
import os
import random
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path

import domecast
import domecast.live
from entries import Edits, entries
from hypothesis import HealthCheck, Phase, given, settings, strategies as some

# what a caller's mistake may raise; a panic is a BaseException that is none of them
ALLOWED = (ValueError, TypeError, OverflowError, AttributeError, KeyError, IndexError, RecursionError, StopIteration, UserWarning)
# each call leaves at least so many calls to hypothesis
MIN_DRAWN = 12
# of the calls that are put together anew, the part of parameters that are good beside one that is not
GOOD_PART = 0.6
# files with several faults at once
MAX_EDITS = 3


class Judge:
    def __init__(self):
        self.seen, self.times, self.slowest = Counter(), {}, {}

    def attempt(self, name, call, values):
        began = time.perf_counter()
        try:
            call(*values)
            self.seen["accepted"] += 1
        except domecast.DomecastError as error:
            self.seen["DomecastError"] += 1
            assert str(error) and "panicked" not in str(error), (name, values, error)
        except ALLOWED as error:
            self.seen[type(error).__name__] += 1
            assert str(error) or isinstance(error, StopIteration), (name, values)
        except (RuntimeError, AssertionError) as error:
            # "a fault in domecast itself" is one
            raise AssertionError(f"{name}: {values!r}: {error}") from error
        except BaseException as error:
            raise AssertionError(f"{name}: {values!r}: {type(error).__name__}: {error}") from error
        took = time.perf_counter() - began
        count, whole = self.times.get(name, (0, 0.0))
        self.times[name] = count + 1, whole + took
        if took > self.slowest.get(name, (0.0, ""))[0]:
            self.slowest[name] = took, repr(values)[:200]


def public_calls():
    """Every public class, method and function of the wheel that takes anything from its caller."""
    found = set()
    for module in (domecast, domecast.live, importlib.import_module("domecast.ros")):
        for name, one in vars(module).items():
            own = getattr(one, "__module__", "") in (module.__name__, "domecast", "domecast._commands", "domecast._design", "domecast._scene")
            if name.startswith("_") or not own or inspect.ismodule(one):
                continue
            if not inspect.isclass(one):
                if callable(one) and inspect.signature(one).parameters:
                    found.add(name)
                continue
            if issubclass(one, BaseException):
                continue
            for method, what in vars(one).items():
                what = getattr(one, method) if isinstance(what, (classmethod, staticmethod)) else what
                if method in ("__new__", "__init__"):
                    # where one has neither, it cannot be made by its callers
                    found.add(name)
                elif callable(what) and not method.startswith("_"):
                    if set(inspect.signature(what).parameters) - {"self"}:
                        found.add(f"{name}.{method}")
    return found


def drawn(judge, name, entry, count):
    """Calls that hypothesis draws; the values of each parameter."""
    pools = [[] for _ in entry.columns]
    column = [some.one_of(some.just(good), wrong) for good, wrong in entry.columns]

    @settings(max_examples=count, deadline=None, database=None, derandomize=True, suppress_health_check=list(HealthCheck),
              phases=[Phase.generate, Phase.shrink])
    @given(some.tuples(*column))
    def judged(values):
        for pool, value, (good, _) in zip(pools, values, entry.columns):
            if value is not good:
                pool.append(value)
        judge.attempt(name, entry.call, values)
    judged()
    return [pool or [good] for pool, (good, _) in zip(pools, entry.columns)]


def together(judge, name, entry, pools, count):
    """Calls of the same values, each parameter's taken by itself."""
    chance = random.Random(name)
    goods = [good for good, _ in entry.columns]

    def value(good, pool, is_wrong):
        if isinstance(good, Edits):
            return good.of([one for _ in range(chance.randint(1, MAX_EDITS)) for one in chance.choice(pool)])
        return chance.choice(pool) if is_wrong or chance.random() > GOOD_PART else good
    for _ in range(count):
        # one at least is wrong
        wrong = chance.randrange(len(goods))
        judge.attempt(name, entry.call, tuple(value(good, pool, k == wrong) for k, (good, pool) in enumerate(zip(goods, pools))))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("constants", type=Path)
    parser.add_argument("repository", type=Path)
    parser.add_argument("model", type=Path, help="of hardness")
    parser.add_argument("count", type=int)
    parser.add_argument("--drawn", type=float, default=0.08, help="the part that hypothesis draws")
    parser.add_argument("--only")
    asked = parser.parse_args()
    faulthandler.enable()
    # an input that is taken with a part of it lost is a fault too; that infinite numbers stay what they are is none
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", RuntimeWarning)
    with tempfile.TemporaryDirectory() as folder:
        home = os.getcwd()
        constants, repository, model = asked.constants.resolve(), asked.repository.resolve(), asked.model.resolve()
        # whatever writes by a name alone writes there
        os.chdir(folder)
        calls, same = entries(constants, repository, model, Path(folder))
        missing = public_calls() - set(calls)
        assert not missing, f"no wrong inputs for {sorted(missing)}"
        judge, whole = Judge(), sum(entry.weight for entry in calls.values())
        for name, entry in calls.items():
            if asked.only and asked.only != name:
                continue
            count = max(MIN_DRAWN, round(asked.count * entry.weight / whole))
            first = max(MIN_DRAWN, round(asked.drawn * count))
            began = time.perf_counter()
            pools = drawn(judge, name, entry, first)
            after = time.perf_counter()
            together(judge, name, entry, pools, max(0, count - first))
            number, took = judge.times[name]
            print(f"     {name:28} {number:6} calls, {1e3 * took / number:8.3f} ms each; hypothesis {after - began:5.1f} s, the rest "
                  f"{time.perf_counter() - after:5.1f} s; slowest {judge.slowest[name][0]:.2f} s", flush=True)
        same()
        os.chdir(home)
    for name, (took, what) in judge.slowest.items():
        if took > 5:
            print(f"     slow: {name} took {took:.1f} s: {what}")
    print(f"wrong inputs: {sum(judge.seen.values())} calls of {len(calls)} entries, none panicked: {dict(judge.seen)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
