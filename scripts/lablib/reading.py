"""Processor time of reading against size: BUILD/bench/pt_readings and ggn_readings read inputs of doubling size."""
import math
import os
import subprocess

from lablib import plots
from lablib.tool import BUILD

COLOURS = {"pbrt": "#1f77b4", "PLY": "#2ca02c", "texture": "#ff7f0e", "checkpoint": "#000000", "sequence": "#9467bd"}
OTHERS = "#d62728"  # what ggn reads


def measured(seconds):
    """{kind: [(bytes, seconds)]}, up to inputs that take about so long"""
    kinds = {}
    for program in ("pt_readings", "ggn_readings"):
        text = subprocess.run([os.path.join(BUILD, "bench", program), str(seconds)], check=True, stdout=subprocess.PIPE, text=True).stdout
        for line in text.splitlines():
            name, _, size, took = line.split(";")
            kinds.setdefault(name, []).append((int(size), float(took)))
    return kinds


def exponent(points):
    """The slope of log time against log bytes by least squares."""
    logs = [(math.log(b), math.log(s)) for b, s in points]
    x, y = (sum(v[i] for v in logs) / len(logs) for i in (0, 1))
    return sum((a - x) * (b - y) for a, b in logs) / sum((a - x) ** 2 for a, _ in logs)


def draw(kinds, folder, name):
    every = [b for points in kinds.values() for b, _ in points]
    blocks = "".join(plots.data("d%d" % i, points) for i, points in enumerate(kinds.values()))
    blocks += plots.data("slope", [(b, b * 1e-8) for b in (min(every), max(every))])
    clauses = ["$d%d with linespoints pointsize 0.6 linecolor '%s' pointtype %d title '%s: %.2f'"
               % (i, COLOURS.get(kind.split(":")[0], OTHERS), i % 15 + 1, kind, exponent(points)) for i, (kind, points) in enumerate(kinds.items())]
    plots.plot(folder, name, (1000, 640), blocks + "set logscale xy\nset xlabel 'size, bytes'\nset ylabel 'processor time of reading, seconds'\n"
               "set format x '10^%L'\nset format y '10^%L'\nset key outside right center title 'kind, exponent' samplen 2\nplot " + ", ".join(
                   clauses + ["$slope with lines dashtype 2 linewidth 2 linecolor 'black' title 'slope 1 (100 MB/s)'"]) + "\n", "sans,10")
