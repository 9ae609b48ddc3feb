"""Runs the tutorial notebook and compares what its cells show with what is kept in it:
notebook_test.py BUILD NOTEBOOK [--write]

--write keeps what the cells show now. Jupyter is not needed: cells run one after another in one namespace, and the last
expression of a cell is shown as Jupyter would. Cells with the tag "varies" are run, but their outputs are
neither kept nor compared. Pictures are
compared by their size only.
"""

import ast
import base64
import contextlib
import io
import json
import os
import struct
import sys
from pathlib import Path

BUILD, NOTEBOOK = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
sys.path.insert(0, str(BUILD / "python"))
os.environ["INTERVALE_PROGRAM"] = str(BUILD / "bin" / "intervale")


def run(source, names):
    """The outputs of a cell, in the form of a notebook."""
    body = ast.parse(source).body
    last = body.pop() if body and isinstance(body[-1], ast.Expr) else None
    printed = io.StringIO()
    value = None
    with contextlib.redirect_stdout(printed):
        exec(compile(ast.Module(body, []), "cell", "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    outputs = []
    if printed.getvalue():
        outputs.append({"name": "stdout", "output_type": "stream", "text": printed.getvalue().splitlines(keepends=True)})
    if value is not None:
        data = {"text/plain": repr(value).splitlines(keepends=True)}
        if hasattr(value, "_repr_png_"):
            data = {"image/png": base64.b64encode(value._repr_png_()).decode(), "text/plain": ["<picture>"]}
        elif hasattr(value, "_repr_html_"):
            data = {"text/html": value._repr_html_().splitlines(keepends=True), "text/plain": ["<frame>"]}
        outputs.append({"data": data, "execution_count": None, "metadata": {}, "output_type": "execute_result"})
    return outputs


def comparable(outputs):
    """What must be as it was kept: texts, and the sizes of pictures (in a PNG's header)."""
    kept = []
    for output in outputs:
        data = output.get("data", {})
        if "image/png" in data:
            png = base64.b64decode(data["image/png"])
            assert len(png) > 2000, "an empty picture"
            kept.append(struct.unpack(">II", png[16:24]))
        else:
            kept.append("".join(output.get("text", data.get("text/plain", []))))
    return kept


def main():
    """0 if all cells show what is kept."""
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    names, count, wrong = {"__name__": "__main__"}, 0, 0
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            continue
        source = "".join(cell["source"])
        outputs = run(source, names)
        count += 1
        if "varies" in cell["metadata"].get("tags", []):
            continue
        for output in outputs:
            if "execution_count" in output:
                output["execution_count"] = count
        if "--write" in sys.argv:
            cell["outputs"], cell["execution_count"] = outputs, count
        elif comparable(outputs) != comparable(cell["outputs"]):
            wrong += 1
            print(f"cell {count} shows {comparable(outputs)}, not {comparable(cell['outputs'])}:\n{source}\n")
    if "--write" in sys.argv:
        NOTEBOOK.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    print(f"{count} cells, {wrong} differ")
    return wrong != 0


if __name__ == "__main__":
    sys.exit(main())
