"""Recorded frames: lull-render and lull.recording write and read the same, and a replay gives what a render was told."""
import math
import os
import subprocess
import tempfile

import lull
import numpy as np
import tap
from lull import exr, recording, replay
from lull.recording import Look, Record
from tap import raises

BUILD = os.path.abspath(os.environ.get("BUILD", "build"))
SCENE = os.path.abspath("scenes/cornell-box.pbrt")
TMP = tempfile.TemporaryDirectory()
os.chdir(TMP.name)
ROUNDING = 1e-6  # of errors: what is left when planes are floats of 32 bits, and the sums of the render doubles
SIZE, BLOCK = "80x64", "40"


def render(folder, *options, status=0, scene=SCENE):
    done = subprocess.run([f"{BUILD}/bin/lull-render", scene, "-q", "--size", SIZE, "--block", BLOCK, "--sequence", folder, *map(str, options)],
                          capture_output=True, text=True)
    assert done.returncode == status, done.stderr
    return done.stderr


def near(a, b):
    return a == b or (math.isnan(a) and math.isnan(b)) or abs(a - b) <= ROUNDING * max(1, abs(a))


def same(rendered, replayed):
    """Each answer of the render again, and no others; says which differ."""
    assert len(rendered) == len(replayed), (len(rendered), len(replayed))
    for a, b in zip(rendered, replayed):
        assert (a.block, a.spp, a.action, a.next) == (b.block, b.spp, b.action, b.next) and near(a.error, b.error) and near(a.p, b.p), (a, b)


def records_itself(criterion, *options):
    """A render at default settings, recorded at its own looks with what the criterion reads, stops each block where the replay does."""
    folder = f"own-{os.path.basename(criterion)}"
    render(folder, "-c", criterion, "--planes", "color", *options)
    frame = recording.read(folder)
    found = replay.Replay(frame, lull.load(frame.criterion["spec"], **frame.criterion["parameters"])).run()
    stops = {a.block: a.spp for a in frame.answers if a.action == 1}
    assert stops and found.stops == [stops.get(i, 0) for i in range(len(frame.blocks))], (stops, found.stops)
    print("#", criterion, max([abs(a.error - b.error) for a, b in zip(frame.answers, found.answers)]), max([abs(a.p - b.p) for a, b in zip(frame.answers, found.answers)]))
    same(frame.answers, found.answers)
    assert [frame.levels(b)[-1] for b in stops] == list(stops.values())


def test_observer():
    """observer: a render that records itself is replayed to the sample"""
    records_itself("observer")


def test_ggn():
    """ggn: likewise"""
    records_itself("ggn")


def test_denoised():
    """denoised: likewise, with a denoiser in its place"""
    with tap.denoiser("box", BUILD):
        records_itself("denoised")


def test_halfbuf():
    """halfbuf: likewise"""
    records_itself("halfbuf")


def test_variance():
    """variance: likewise"""
    records_itself("variance")


def test_plugin():
    """somebody's own library, a plug-in of tests/abi: likewise"""
    records_itself(f"{BUILD}/tests/abi/plugins/puppet.so")


tap.main(globals())
