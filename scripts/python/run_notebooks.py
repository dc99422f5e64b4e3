"""Runs the code of the notebooks, cell by cell, and asks the last value of each cell for its picture, as a notebook does.

    run_notebooks.py REPOSITORY FOLDER

Stored notebooks hold no output and no number of an execution. FOLDER is where they write.
"""

import ast
import json
import os
import sys
import time
from pathlib import Path

SHOWN = ("_repr_png_", "_repr_html_")


def run_cell(source, name, scope):
    """Runs a cell; returns how many pictures its last value has."""
    tree = ast.parse(source, name)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, name, "exec"), scope)
    if last is None:
        return 0
    value = eval(compile(ast.Expression(last.value), name, "eval"), scope)
    repr(value)
    return sum(bool(getattr(value, shown)()) for shown in SHOWN if hasattr(value, shown))


def main():
    repository, folder = Path(sys.argv[1]), Path(sys.argv[2])
    notebooks = sorted((repository / "scripts/notebooks").glob("*.ipynb"))
    assert notebooks, "no notebooks"
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / "designs").exists():
        (folder / "designs").symlink_to(repository / "designs")
    os.chdir(folder)
    for notebook in notebooks:
        began = time.monotonic()
        cells = [cell for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
        assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells), f"{notebook.name} is stored with outputs"
        scope, pictures = {"__name__": "__main__"}, 0
        for number, cell in enumerate(cells):
            pictures += run_cell("".join(cell["source"]), f"{notebook.name}, cell {number}", scope)
        assert pictures, f"{notebook.name} shows no picture"
        print(f"{notebook.name}: {len(cells)} cells, {pictures} pictures, {time.monotonic() - began:.1f} s")
    for example in sorted((repository / "scripts/python/examples").glob("*.py")):
        began = time.monotonic()
        scope = {"__name__": "__main__"}
        exec(compile(example.read_text(), example.name, "exec"), scope)
        print(f"{example.name}: {time.monotonic() - began:.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
