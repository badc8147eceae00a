#!/usr/bin/env python3
"""The same film by two builds, as a rule with Embree 3 and 4: embree_pictures.py BUILD BUILD, speaks TAP.

The same paths are drawn, and only rounding differs. By the rules of tests/golden/pt_images.c a pixel is off if a channel differs by more
than a share of itself and of the picture's mean; few are, in all and in one picture. Their differences have no sign: of each channel the
mean difference over the pixels is held against its standard error, all scenes sharing one error rate (Šidák)."""
import math
import os
import re
import subprocess
import sys
import tempfile
from statistics import NormalDist

import numpy as np

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
sys.path.insert(0, os.path.join(ROOT, "plugin-api", "python"))
from lull import exr  # noqa: E402

# Meshes, quadrics, instances, motion, cut-outs, lenses, media, many lights, scenes that are hard on rays.
SCENES = ("cornell-box quadrics instances motion alpha defocus glass fog many-lights kitchen plaza street hard-degenerate "
          "hard-grazing hard-scale-large hard-scale-small").split()
SIZE, SPP = (64, 48), 32
ERROR_RATE = 1e-3  # of the whole: once in a thousand changes that are only rounding


def picture(build, scene, folder):
    """[height, width, 3]"""
    made, plain = os.path.join(folder, "made.exr"), os.path.join(folder, "plain.exr")
    subprocess.run([os.path.join(build, "bin", "lull-render"), "-q", "--size", "%dx%d" % SIZE, "--spp", str(SPP), "--seed", "1", "-o", made,
                    "scenes/%s.pbrt" % scene], check=True)
    subprocess.run(["oiiotool", made, "--ch", "R,G,B", "--compression", "none", "-o", plain], check=True)
    channels, _ = exr.read(plain)
    return np.stack([channels[name] for name in "RGB"], -1).astype(np.float64)


def rules():
    """Shares of the first line of the record: of a value, of all pixels, of the pixels of a scene."""
    with open("tests/golden/pt_images.txt") as file:
        found = re.match(r"# tolerance (\S+) of a value; .*differs: (\S+) % in all, (\S+) % of a scene", file.readline())
    return float(found[1]), float(found[2]) / 100, float(found[3]) / 100


def embree(build):
    """Which one the build calls."""
    return re.search(r"libembree(\d)", subprocess.check_output(["ldd", os.path.join(build, "bin", "lull-render")], text=True))[1]


def z_of_mean(differences):
    """[pixels, 3]: the largest of the three."""
    mean, error = differences.mean(0), differences.std(0, ddof=1) / math.sqrt(len(differences))
    return float(np.max(np.abs(mean) / np.where(error > 0, error, np.inf)))


def main(builds):
    value, in_all, in_one = rules()
    z_limit = NormalDist().inv_cdf(1 - (1 - (1 - ERROR_RATE) ** (1 / (3 * len(SCENES)))) / 2)
    shares, bad = [], 0
    print("# Embree %s and %s" % tuple(map(embree, builds)))
    with tempfile.TemporaryDirectory() as folder:
        for number, scene in enumerate(SCENES, 1):
            a, b = (picture(build, scene, folder) for build in builds)
            off = np.abs(b - a) > value * (np.abs(a) + np.abs(a).mean())
            shares.append(off.any(-1).mean())
            z = z_of_mean((b - a).reshape(-1, 3))
            good = shares[-1] <= in_one and z <= z_limit
            bad += not good
            print("%sok %d - %s: %.2f %% of the pixels are off, the mean difference is %.2f standard errors (at most %.2f)" % (
                "" if good else "not ", number, scene, 100 * shares[-1], z, z_limit), flush=True)
    good = np.mean(shares) <= in_all
    print("%sok %d - in all: %.2f %% of the pixels are off" % ("" if good else "not ", len(SCENES) + 1, 100 * np.mean(shares)))
    print("1..%d" % (len(SCENES) + 1))
    return 1 if bad or not good else 0


if len(sys.argv) != 3:
    sys.exit("usage: embree_pictures.py BUILD BUILD")
os.chdir(ROOT)
sys.exit(main(sys.argv[1:]))
