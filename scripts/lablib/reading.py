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
    charts = plots.charts()
    every = [b for points in kinds.values() for b, _ in points]
    ends = min(every), max(every)
    series = [charts.Series(*zip(*points), "%s: %.2f" % (kind, exponent(points)), COLOURS.get(kind.split(":")[0], OTHERS), marker="os^vD*Xp<>hdP8H"[i % 15])
              for i, (kind, points) in enumerate(kinds.items())]
    series.append(charts.Series(ends, [b * 1e-8 for b in ends], "slope 1 (100 MB/s)", "#000000", "--"))
    plots.draw(folder, name, (1000, 640), [charts.Chart(series, "", "size, bytes", "processor time of reading, seconds", 10, 10, key="outside",
                                                        key_title="kind, exponent")])
