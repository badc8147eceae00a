"""Draws every kind of picture from small files that are made here."""
import contextlib
import io
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import zlib

import numpy as np
import tap
from lull.plot import kinds
from lull.plot.main import NAMES, main
from lull.plot.sources import Wanted, read
from matplotlib.image import imread

PROGRAM = os.path.abspath(os.path.join(os.environ.get("BUILD", "build"), "bin", "lull-plot"))
PACKAGE = os.path.abspath("plugin-api/python")
ANYTHING = Wanted()
CURVES = """phase,step,loss,accuracy,validation_loss,validation_accuracy,validation_auc,learning_rate,seconds,processor_s
denoiser,10,0.5,,0.6,,,0.001,1,1
denoiser,20,0.4,,0.5,,,0.001,2,2
judge,10,0.7,0.5,0.7,0.6,0.65,0.001,3,3
judge,20,0.5,0.8,0.6,0.7,0.9,0.001,4,4
"""
BLOCKS = """view;block;true_spp;model_spp;log2_error;column;row
a;0;100;100;0;0;0
a;1;200;400;1;1;0
a;2;400;200;-1;0;1
b;0;50;800;4;0;0
"""
STOPS = """view;block;threshold;censored;stop;score
a;0;100;0;110;0.4
a;1;200;0;150;
a;2;400;1;400;0.6
"""
SIZES = (("curves.csv", "curves", 1440, 400), ("blocks.csv", "scatter", 760, 720), ("blocks.csv", "histogram", 760, 480),
         ("blocks.csv", "maps", 780, 276), ("figures.json", "roc", 720, 680), ("figures.json", "scores", 900, 560),
         ("cost.json", "frontier", 1280, 480))


def evaluation():
    """Three blocks, the last one's threshold is no more than a bound."""
    windows = {"spp": [10, 100, 1000], "noisy": [1, 1, 0], "scores": {"-spp": [-10, -100, -1000], "m.ggn": [None, 0.7, 0.2]}}
    stops = [{"scene": "s", "view": "v", "block": n, "threshold": 100 * 2**n, "censored": n == 2, "spp": {"-spp": 90, "m.ggn": 120},
              "split": "validation", "column": n, "row": 0, "windows": windows} for n in range(3)]
    methods = {name: {"auc": 1, "cut": 0.5} for name in ("-spp", "m.ggn")}
    return {"splits": {"validation": methods}, "stops": stops}


def cost():
    """Two scenes: one needs three times the samples and shows no noise."""
    def point(criterion, dial, value, spp):
        return {"criterion": criterion, "dial": dial, "value": value, "stops": [], "scenes": {
            "s": {"blocks": 2, "samples": spp, "noisy": min(1, 50 / spp), "worst": 100 / spp},
            "t": {"blocks": 2, "samples": 3 * spp, "noisy": 0, "worst": 1}}}
    return {"points": [point("limit", "none", 0, 100), *(point("uniform", "spp", n, n) for n in (50, 100, 200)),
                       point("m.ggn", "own", 0.5, 120), *(point("m.ggn", "visible", p, 60 / p) for p in (0.5, 0.9))]}


def png(width, height):
    """A PNG of a few colours."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes((x * 40 + y * 30 + c * 60) % 256 for x in range(width) for c in range(3)) for y in range(height))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(rows)) + \
        chunk(b"IEND", b"")


def write(name, content):
    with open(name, "wb") as file:
        file.write(content if isinstance(content, bytes) else (content if isinstance(content, str) else json.dumps(content)).encode())


def plot(*words):
    """(exit status, standard error)"""
    with contextlib.redirect_stderr(io.StringIO()) as said:
        status = main(words)
    return status, said.getvalue()


def refused(words, *arguments):
    status, said = plot(*arguments)
    assert status == 2 and said.startswith("lull-plot: ") and said.count("\n") == 1 and words in said, (status, said, words)
    assert not os.path.exists("no.png") and not [name for name in os.listdir() if name.startswith(".tmp")]


def test_sizes():
    """every kind is drawn, in its size, and is not blank"""
    assert {kind for _, kind, _, _ in SIZES} == set(NAMES) == set(kinds.KINDS)
    for name, kind, width, height in SIZES:
        assert plot(name, "-k", kind, "-o", kind + ".png") == (0, ""), (name, kind)
        image = imread(kind + ".png")[..., :3]
        assert image.shape[:2] == (height, width), (kind, image.shape)
        assert (abs(image - 1).max(axis=2) > 0.2).sum() > 1000, f"{kind} is nearly white"


def test_evaluated():
    """thresholds of ggn evaluate too, of the method and the split that are named"""
    for kind in ("scatter", "histogram", "maps"):
        assert plot("figures.json", "-k", kind, "-s", "validation", "-m", "m.ggn", "-o", "of.png") == (0, "")
    assert plot("stops.csv", "-o", "of.png") == (0, "")


def test_lines():
    """tables whose lines end in CR, CR LF or LF are one table; one with a byte 0 is none"""
    for end in ("\r", "\r\n", "\n"):
        write("ends.csv", STOPS.replace("\n", end))
        assert plot("ends.csv", "-o", f"ends{len(end)}.png") == (0, "")
        with open(f"ends{len(end)}.png", "rb") as one, open("of.png", "rb") as other:
            assert one.read() == other.read()
    write("wide.csv", STOPS[:-4] + "\0" + STOPS[-4:])
    refused(f"wide.csv:{STOPS.count(chr(10))}: has a byte 0", "wide.csv", "-o", "no.png")


def test_programs():
    """lull-plot and python3 -m lull plot draw the same bytes, into a file of the mode that the umask says"""
    env = {**os.environ, "PYTHONPATH": PACKAGE}
    subprocess.run([PROGRAM, "stops.csv", "-o", "one.png"], check=True, umask=0o022)
    subprocess.run([sys.executable, "-m", "lull", "plot", "stops.csv", "--kind=scatter", "--output", "two.png"], check=True, env=env)
    with open("one.png", "rb") as one, open("two.png", "rb") as two:
        assert one.read() == two.read()
    assert os.stat("one.png").st_mode & 0o777 == 0o644


def test_environment():
    """the same bytes whatever MPLBACKEND and a matplotlibrc say, of the folder or named, good or broken; and nobody else's are changed"""
    subprocess.run([PROGRAM, "stops.csv", "-o", "plain.png"], check=True)
    with open("plain.png", "rb") as file:
        plain = file.read()
    os.makedirs("settings", exist_ok=True)
    for text in ("lines.linewidth: 9\nfont.size: 20\nfigure.facecolor: red\nsavefig.dpi: 30\n", "backend: x\n", "\xff\xfe", "no such thing"):
        with open("settings/matplotlibrc", "w", encoding="latin-1") as file:
            file.write(text)
        for env in ({}, {"MPLBACKEND": "x"}, {"MPLBACKEND": "TkAgg"}, {"MATPLOTLIBRC": "/nowhere"}, {"MATPLOTLIBRC": os.path.abspath("settings")}):
            done = subprocess.run([PROGRAM, "../stops.csv", "-o", "../other.png"], cwd="settings", env={**os.environ, **env}, capture_output=True)
            with open("other.png", "rb") as file:
                assert done.returncode == 0 and not done.stderr and file.read() == plain, (text, env, done)
    code = "import os; before = dict(os.environ), os.getcwd(); import lull.plot.canvas; assert before == (dict(os.environ), os.getcwd())"
    subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": PACKAGE, "MPLBACKEND": "x", "MATPLOTLIBRC": "y"}, check=True)
    found = subprocess.run(["grep", "-rlE", "^ *(from|import) matplotlib", "--include=*.py", os.path.join(PACKAGE, "lull")], capture_output=True, text=True)
    assert [os.path.basename(name) for name in found.stdout.split()] == ["canvas.py"], found.stdout


def test_without():
    """without matplotlib: one line says what to install; --help and the rest of the package do without"""
    os.makedirs("without", exist_ok=True)
    write("without/matplotlib.py", 'raise ImportError("none here", name="matplotlib")')
    env = {**os.environ, "PYTHONPATH": os.path.abspath("without")}
    done = subprocess.run([sys.executable, PROGRAM, "stops.csv", "-o", "no.png"], env=env, capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "apt-get install python3-matplotlib" in done.stderr, done
    assert subprocess.run([sys.executable, PROGRAM, "--help"], env=env, capture_output=True, text=True).stdout.startswith("Usage: lull-plot ")
    subprocess.run([sys.executable, "-c", "import lull"], env={**env, "PYTHONPATH": f"{env['PYTHONPATH']}:{PACKAGE}"}, check=True)


def test_roc():
    """the area below the ROC curve is the share of pairs in the right order, ties half (Mann-Whitney)"""
    score, noisy = [3, 2, 2, 2, 1, 1, 0.5], [1, 1, 0, 1, 0, 1, 0]
    x, y = kinds.roc_curve(score, noisy)
    right = sum((a > b) + (a == b) / 2 for a, n in zip(score, noisy) for b, m in zip(score, noisy) if n == 1 and m == 0)
    assert abs(((x[1:] - x[:-1]) * (y[1:] + y[:-1])).sum() / 2 - right / 12) < 1e-12
    assert len(x) == 5 and (x[0], y[0], x[-1], y[-1]) == (0, 0, 1, 1)  # equal scores are one step
    assert len(kinds.roc_curve([0.3, 0.1 + 0.2], [1, 0])[0]) == 2  # nor are they two when they were rounded otherwise
    x, y = kinds.roc_curve([2, 1], [1, 1])
    assert not x.any() and y[-1] == 1  # nothing is converged


def test_regression():
    """the regression is least squares, by hand"""
    a, b, r = kinds.regression(np.array([1., 2, 3, 4]), np.array([2., 4, 6, 9]))
    assert max(abs(b - 2.3), abs(a - (5.25 - 2.3 * 2.5)), abs(r - 11.5 / math.sqrt(5 * 26.75))) < 1e-12
    for same in ([1., 1], [0.3, 0.1 + 0.2]):
        assert math.isnan(kinds.regression(np.array(same), np.array([2., 3]))[1])


def test_blocks():
    """bars, maps and points are the blocks'; of those at the cap there is no point"""
    blocks = read("blocks.csv")
    write("marked.csv", "\ufeff" + BLOCKS)  # by a spreadsheet of Windows
    assert read("marked.csv").rows == blocks.rows
    bars = {round(4 * (p.get_x() + p.get_width() / 2)): p.get_height() for p in kinds.histogram(blocks, ANYTHING).axes[0].patches}
    assert bars == {0: 1, 4: 1, -4: 1, 16: 1}, bars
    shown = [axes.images[0].get_array().filled(-1).tolist() for axes in kinds.maps(blocks, ANYTHING).axes[:2]]
    assert shown == [[[100, 200, -1, 100, 400], [400, -1, -1, 200, -1]], [[50, -1, 800]]], shown
    points = next(line for line in kinds.scatter(read("figures.json"), ANYTHING).axes[0].lines if line.get_label() == "blocks")
    assert np.allclose(points.get_xydata(), [[100, 120], [200, 120]])


def test_curves():
    """learning curves are the rows of their phase"""
    axes = kinds.curves(read("curves.csv"), ANYTHING).axes
    lines = [{line.get_label(): line.get_xydata().tolist() for line in a.lines} for a in axes]
    assert [list(found) for found in lines] == [["training", "validation"], ["training", "validation, calibrated"],
                                                ["training accuracy", "validation accuracy", "validation AUC"]]
    assert lines[0]["validation"] == [[10, 0.6], [20, 0.5]] and lines[2]["validation AUC"] == [[10, 0.65], [20, 0.9]]


def test_scores():
    """scores of each block with its threshold, and the cut; a window that was not judged has no point"""
    lines = kinds.scores(read("figures.json"), ANYTHING).axes[0].lines
    assert len(lines) == 3 + 3 + 1 and np.isnan(lines[0].get_ydata()[0]) and lines[0].get_ydata()[1] == 0.7
    assert [line.get_xdata()[0] for line in lines[3:6]] == [100, 200, 400] and list(lines[6].get_ydata()) == [0.5, 0.5]


def test_frontier():
    """cost is the median over scenes of the ratio to the limit, quality their mean or median"""
    noisy, worst = kinds.frontier(read("cost.json"), ANYTHING).axes
    assert np.allclose(noisy.lines[0].get_xydata(), [[0.5, 0.5], [1, 0.25], [2, 0.125]])
    assert np.allclose(worst.lines[0].get_xydata()[:, 1], [1.5, 1, 0.75])


def test_usage():
    """wrong use is one line, status 2"""
    refused("expected FILE -o PICTURE.png", "-o", "no.png")
    refused("--output PICTURE.png is needed", "curves.csv")
    refused("none.csv: No such file or directory", "none.csv", "-o", "no.png")
    refused("no.jpg: expected a name that ends in .png", "curves.csv", "-o", "no.jpg")
    refused("nowhere/no.png: cannot write there", "curves.csv", "-o", "nowhere/no.png")
    refused("this is an input", "picture.png", "-o", "./picture.png")
    refused("--kind pie: expected curves, roc, ", "curves.csv", "-k", "pie", "-o", "no.png")
    refused("--kind roc: blocks.csv is good for scatter, histogram, maps", "blocks.csv", "-k", "roc", "-o", "no.png")
    refused("--split test: expected validation", "figures.json", "-s", "test", "-o", "no.png")
    refused("--method x.ggn: expected -spp, m.ggn", "figures.json", "-k", "scatter", "-m", "x.ggn", "-o", "no.png")


def test_bad_files():
    """files that are broken or something else are one line, status 2"""
    expected = "nothing to draw: expected the CSV of a training"
    for content, words in (('{"splits": {', "bad: "), ({"splits": {"test": {}}, "stops": []}, "bad: its figures are not whole"),
                           ({"blocks": []}, expected), ({"points": []}, "bad: it has no criterion 'limit'"), ("a;b\n1;2\n", expected), ("", expected),
                           ("[1, 2]", expected), (png(2, 2), "bad: "), (BLOCKS.replace(";400;200;", ";many;200;"), "bad: its figures are not whole"),
                           (STOPS.replace(";0;", ";1;"), "bad: no block with a threshold below the cap"),
                           (CURVES.replace("denoiser", "other").replace("judge", "other"), "bad: no rows of a phase")):
        write("bad", content)
        refused(words, "bad", "-o", "no.png")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for name, content in (("curves.csv", CURVES), ("blocks.csv", BLOCKS), ("stops.csv", STOPS), ("figures.json", evaluation()),
                              ("cost.json", cost()), ("picture.png", png(12, 8))):
            write(name, content)
        tap.main(globals())
        os.chdir("/")
