"""Mitsuba 3 as a host: test_mitsuba.py VARIANT. BUILD names the build folder."""
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant(sys.argv[1])

import lull  # noqa: E402
import lull.mitsuba  # noqa: E402
import tap  # noqa: E402
from tap import raises  # noqa: E402

BUILD = os.environ.get("BUILD", "build")
os.environ["LULL_PLUGIN_PATH"] = f"{BUILD}/lib/lull"
LUMINANCE = np.array([.2126729, .7151522, .0721750])
TILE = 12  # pixels; their mean is near enough to normal for a z-test
FALSE_ALARM = 1e-4  # of a whole test, by Šidák's correction over the tiles


def scene(name):
    return mi.load_file(f"tests/hosts/scenes/{name}.xml")


def tiles(image):
    y = image @ LUMINANCE
    return y.reshape(y.shape[0] // TILE, TILE, y.shape[1] // TILE, TILE).mean((1, 3))


def z_scores(name, picture, renders=32, spp=16):
    """Of the picture's tiles against one long render, made of independent parts that tell its variance."""
    parts = np.array([tiles(np.array(mi.render(scene(name), spp=spp, seed=1000 + k))[..., :3]) for k in range(renders)])
    variance = parts.var(0, ddof=1) * spp  # of a tile's mean at one sample per pixel
    own = tiles(np.dstack([picture.spp] * 3).astype(float)) / LUMINANCE.sum()
    return (tiles(picture.image) - parts.mean(0)) / np.sqrt(variance / own + variance / (renders * spp))


def test_unbiased():
    """the picture is that of one long render: every tile within chance, the mean of all of them too"""
    for name in ("box", "balls"):
        picture = lull.mitsuba.render(scene(name), "halfbuf", threshold=.015, block=24, spp_max=256)
        spp = {b.spp for b in picture.driver.frame.blocks}
        assert picture.result.outcome == "done" and (len(spp) > 2 or name != "box"), spp
        z = z_scores(name, picture)
        # Student's t with 31 degrees of freedom is wider than the normal distribution: by 1.4 at this depth
        limit = 1.4 * statistics.NormalDist().inv_cdf(1 - (1 - (1 - FALSE_ALARM) ** (1 / z.size)) / 2)
        assert abs(z).max() < limit and abs(z.mean()) < 4 / math.sqrt(z.size) and .5 < (z ** 2).mean() < 2, (name, z)
        wrong = abs(z_scores(name, lull.mitsuba.Picture(picture.image * 1.05, picture.spp, None, None))).max()
        assert wrong > limit, (name, wrong)  # a bias of a twentieth would be seen


def test_stops():
    """stops within a wave of 16 of the path tracer's on the same box (its median of three seeds)"""
    # many checks and large blocks: what is left is the scatter of the error itself, 215 to 263 spp in the first block
    parameters = {"threshold": .01, "growth": 1.05}
    picture = lull.mitsuba.render(scene("box"), "halfbuf", block=48, spp_max=1024, **parameters)
    pairs = [a for k, v in parameters.items() for a in ("-p", f"{k}={v}")]
    stops = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(3):
            report = os.path.join(folder, "r.json")
            subprocess.run([f"{BUILD}/bin/pathtracer", "tests/hosts/scenes/box.pbrt", "-q", "--block", "48", "-c", "halfbuf",
                            *pairs, "--spp-max", "1024", "--seed", str(seed), "--report", report], check=True)
            stops.append([b["spp"] for b in json.loads(Path(report).read_text())["blocks"]])
    wanted = [statistics.median(s) for s in zip(*stops)]
    own = [b.spp for b in picture.driver.frame.blocks]
    assert all(abs(a - b) <= 16 for a, b in zip(own, wanted)) and max(wanted) > min(wanted) + 16, (own, wanted)


def test_crop():
    """the film's own crop is kept to and put back"""
    s = scene("box")
    parameters = mi.traverse(s.sensors()[0])
    parameters["film.crop_offset"], parameters["film.crop_size"] = [30, 10], [20, 40]
    parameters.update()
    picture = lull.mitsuba.render(s, "fixed", spp=16, block=24, spp_max=64)
    film = s.sensors()[0].film()
    assert picture.image.shape == (40, 20, 3) and picture.spp.min() == 16
    assert list(film.crop_size()) == [20, 40] and list(film.crop_offset()) == [30, 10]
    whole = np.array(mi.render(scene("box"), spp=512, seed=9))[10:50, 30:50, :3]
    assert abs(picture.image.mean() / whole.mean() - 1) < .03


def test_seeds():
    """the same seed gives the same picture, another one another"""
    rendered = [lull.mitsuba.render(scene("balls"), "fixed", spp=32, block=24, spp_max=32, seed=k) for k in (1, 1, 2)]
    assert all(p.result.outcome == "done" for p in rendered), [p.result for p in rendered]
    pictures = [p.image for p in rendered]
    same, other = (abs(pictures[0] - p).max() for p in pictures[1:])
    assert same < 1e-5 and other > .01, (same, other)  # what order threads add in is worth 1e-8


def test_bad_input():
    """what cannot be rendered is named; an exception while rendering keeps what there is"""
    raises(lull.LullError, "no criterion 'nobody'", lull.mitsuba.render, scene("box"), "nobody")
    raises(ValueError, "sensor 3", lull.mitsuba.render, scene("box"), "halfbuf", sensor=3)
    raises(ValueError, "mask of shape", lull.mitsuba.render, scene("box"), "halfbuf", mask=np.zeros((2, 2)))
    text = Path("tests/hosts/scenes/box.xml").read_text()
    raises(ValueError, "'independent'", lull.mitsuba.render, mi.load_string(text.replace("independent", "stratified")),
           "halfbuf", wave=15)
    picture = lull.mitsuba.render(mi.load_string(text.replace('value="rgb"', 'value="luminance"')), "halfbuf", block=24)
    assert picture.result.outcome == "failed" and "expected RGB" in str(picture.result.exception)
    assert picture.image.shape == (96, 96, 3) and not picture.spp.any()


tap.main(dict(globals()))
