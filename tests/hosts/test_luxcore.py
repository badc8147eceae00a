"""LuxCore as a host. BUILD names the build folder."""
import math
import os
import statistics
import sys
import tempfile
from pathlib import Path

import numpy as np

import lull
import lull.luxcore
import tap
from lull import outputs
from tap import raises

lux = lull.luxcore.start()
BUILD = os.environ.get("BUILD", "build")
os.environ["LULL_PLUGIN_PATH"] = f"{BUILD}/lib/lull"
LUMINANCE = np.array([.2126729, .7151522, .0721750])
FALSE_ALARM = 1e-4  # of a whole test, by Šidák's correction over the blocks


def room(**changes):
    """The scene and its settings: 72x48 pixels. changes: further settings, dots as double underscores."""
    scene, settings = lux.Scene(), lux.Properties()
    scene.Parse(lux.Properties("tests/hosts/scenes/room.scn"))
    for name, value in {"film__width": 72, "film__height": 48, **changes}.items():
        settings.Set(lux.Property(name.replace("__", "."), value if isinstance(value, list) else [value]))
    return scene, settings


def whole(settings=None, spp=64, seed=1):
    """LuxCore's own render of the film, [height, width, 3] from the top, as people write it."""
    scene, own = room(**{"renderengine__type": "PATHCPU", "film__filter__type": "NONE", "batch__haltspp": spp,
                         "renderengine__seed": seed, "film__outputs__0__type": "RGB", "film__outputs__0__filename": "a.exr",
                         **(settings or {})})
    session = lux.RenderSession(lux.RenderConfig(own, scene))
    session.Start()
    while not session.HasDone():
        session.UpdateStats()
    session.Stop()
    image = np.zeros((48, 72, 3), np.float32)
    session.GetFilm().GetOutputFloat(lux.FilmOutputType.RGB, image, 0, False)
    return image[::-1]


def block_means(image, blocks):
    y = np.asarray(image, float) @ LUMINANCE
    return np.array([y[b.rect.y0:b.rect.y1, b.rect.x0:b.rect.x1].mean() for b in blocks])


def test_unbiased():
    """over seeds each block has the mean of whole renders, wherever it was stopped"""
    seeds, own, stops = 8, [], set()
    for seed in range(seeds):
        p = lull.luxcore.render(*room(), "halfbuf", threshold=.05, block=24, spp_max=64, seed=seed, tell=None)
        blocks = p.driver.frame.blocks
        assert p.result.outcome == "done", p.result
        stops |= {b.spp for b in blocks}
        own.append(block_means(p.image, blocks))
    assert len(stops) > 1, stops  # of all seeds: LuxCore's samples are not the same in each run
    others = [block_means(whole(seed=1000 + k), blocks) for k in range(seeds)]
    error = np.sqrt((np.var(own, 0, ddof=1) + np.var(others, 0, ddof=1)) / seeds)
    z = (np.mean(own, 0) - np.mean(others, 0)) / error
    # Student's t with some 14 degrees of freedom
    limit = 1.6 * statistics.NormalDist().inv_cdf(1 - (1 - (1 - FALSE_ALARM) ** (1 / z.size)) / 2)
    assert abs(z).max() < limit and abs(z.mean()) < 1.5 and (z ** 2).mean() < 3, z
    upside_down = np.mean([block_means(p.image[::-1], blocks)], 0) - np.mean(others, 0)
    assert (abs(upside_down) > limit * error).any(), "rows from the bottom would not be seen"


def test_halves():
    """waves of other seeds are independent: the noise of one pair of seeds is not that of another; so are the halves"""
    pictures = [lull.luxcore.render(*room(), "fixed", spp=16, spp_max=16, block=24, seed=k, tell=None).image for k in range(4)]
    a, b, c, d = (np.minimum(image, 1) for image in pictures)
    assert abs(np.corrcoef((a - b).ravel(), (c - d).ravel())[0, 1]) < .15 and (a - b).std() > .005
    frame = lull.luxcore.render(*room(), "halfbuf", threshold=1e-6, spp_max=32, block=24, seed=4, tell=None).driver.frame
    half, rest = (np.minimum(i, 1) for i in (frame.mean("half"), 2 * frame.mean() - frame.mean("half")))
    assert abs(np.corrcoef((half - rest).ravel(), (a - b).ravel())[0, 1]) < .15 and (half - rest).std() > .005
    assert abs(half.mean() / rest.mean() - 1) < .03


def test_layers():
    """alpha, albedo and normals are those of the pixels; the film's subregion is kept to; an EXR has the layer"""
    scene, settings = room(film__subregion=[0, 71, 0, 35])  # the lower rows
    p = lull.luxcore.render(scene, settings, "fixed", spp=16, spp_max=16, block=24, tell=None)
    assert p.image.shape == (36, 72, 3) and set(p.layers) == {"A"} and 0 < p.layers["A"].mean() <= 1
    full = whole()[12:]
    assert abs(p.image[-12:].mean() / full[-12:].mean() - 1) < .05 and abs(p.image.mean() / full.mean() - 1) < .05
    with lull.luxcore.Film(*room()) as film:
        r = lull.Rect(30, 18, 42, 24)  # the back wall
        sample = next(film.render([r], 0, 16, False))
    albedo, normal = (sample[name].mean((0, 1)) / sample["weight"].mean() for name in ("albedo", "normal"))
    assert np.allclose(albedo, (.72, .72, .7), atol=.02) and np.allclose(normal, (0, -1, 0), atol=.02), (albedo, normal)
    with tempfile.TemporaryDirectory() as folder:
        outputs.write_exr(os.path.join(folder, "a.exr"), p.driver)
        assert b"A\0" in Path(folder, "a.exr").read_bytes()[:2000]


def test_one_call():
    """checkpoint, resume and mask in the one call: an interrupted picture goes on, another is refused"""
    def go(given=None, **more):
        settings = {"threshold": .003, "block": 24, "spp_max": 64, "tell": None, **more}
        return lull.luxcore.render(*(given or room()), "halfbuf", **settings)
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "c.npz")
        first = go(checkpoint=file, after_call=lambda d: d.totals.samples > 72 * 48 * 20 and d.interrupt())
        assert first.result.outcome == "interrupt" and first.unsaved is None and first.spp.min() < 64
        second = go(checkpoint=file, resume=True)
        assert second.result.outcome == "done" and second.spp.max() == 64
        assert second.driver.totals.samples == 72 * 48 * 64  # none was lost, none taken twice
        raises(lull.LullError, "made with settings=", go, room(path__pathdepth__total=3), checkpoint=file, resume=True)
        raises(lull.LullError, "made with seed=0, but this render has seed=3", go, seed=3, checkpoint=file, resume=True)
        other = room()
        other[0].Parse(white(.1))
        raises(lull.LullError, "made with scene=", go, other, checkpoint=file, resume=True)
    unguarded = {"threshold": .016, "tail-share": 1.0}  # else single bright samples decide
    counts = [go(mask=m, spp_max=256, **unguarded).spp.mean() for m in (np.ones((48, 72)), None)]
    assert counts[0] > 1.3 * counts[1], counts
    raises(ValueError, "mask of shape", go, mask=np.zeros((2, 2)))


def white(grey):
    """Properties that paint the room's white so grey."""
    made = lux.Properties()
    made.SetFromString(f"scene.materials.white.type = matte\nscene.materials.white.kd = {grey} {grey} {grey}\n")
    return made


def test_quote():
    """a quote tells what quality parameters cost and stops after its pilot, from which a render goes on"""
    with tempfile.TemporaryDirectory() as folder:
        settings = {"block": 24, "spp_max": 192, "checkpoint": os.path.join(folder, "c.npz"), "visible": .35}
        table = lull.luxcore.quote(*room(), "observer", **settings)
        assert "spp min / mean / max" in table and table.count("<- chosen") == 1, table
        lines = []
        p = lull.luxcore.render(*room(), "observer", **settings, resume=True, tell=lines.append)
        assert p.result.outcome == "done" and p.spp.max() <= 192 and len(lines) == 1, (p.result, lines)


def test_denoise():
    """denoise keeps the blend, by LuxCore's albedo and normals"""
    with tap.denoiser("auxiliary", BUILD):
        p = lull.luxcore.render(*room(), "fixed", spp=16, block=24, spp_max=16, denoise="full", tell=None)
        f = p.driver.frame
        assert p.undenoised is None and f.planes == ("color", "half", "albedo", "normal")
        assert np.allclose(p.image, f.mean("albedo") + f.mean("normal"), atol=1e-5) and f.mean("albedo").max() > .65
    with tap.denoiser("box", BUILD):
        p = lull.luxcore.render(*room(), block=24, spp_max=32, denoise="blend", tell=None)
        assert p.driver.frame.criterion.info.id == "denoised" and (p.image == p.denoised.picture).all()
    raises(ValueError, "expected one of blend, full", lull.luxcore.render, *room(), denoise="much")


def test_bad_input():
    """what cannot be rendered is named; an exception while rendering keeps what there is"""
    def refused(text, **changes):
        raises(ValueError, text, lull.luxcore.render, *room(**changes), "halfbuf")
    refused("renderengine.type BIDIRCPU", renderengine__type="BIDIRCPU")
    refused("sampler.type METROPOLIS", sampler__type="METROPOLIS")
    refused("path.photongi.caustic.enabled", path__photongi__caustic__enabled=1)
    refused("path.clamping.variance.maxvalue", path__clamping__variance__maxvalue=5.0)
    raises(lull.LullError, "no criterion nobody", lull.luxcore.render, *room(), "nobody")
    raises(ValueError, "give an array", lull.luxcore.render, *room(), "halfbuf", mask="mask.png")
    raises(ValueError, "wave 0", lull.luxcore.render, *room(), "halfbuf", wave=0)
    raises(ValueError, "time_budget_s nan", lull.luxcore.render, *room(), "halfbuf", time_budget_s=math.nan)

    def fails(driver):
        if driver.totals.samples > 72 * 48 * 10:
            raise RuntimeError("out of paint")
    picture = lull.luxcore.render(*room(), "halfbuf", block=24, after_call=fails, tell=None)
    assert picture.result.outcome == "failed" and "out of paint" in str(picture.result.exception)
    assert picture.image.shape == (48, 72, 3) and picture.spp.max() >= 16


if __name__ == "__main__":
    sys.stdout.reconfigure(line_buffering=True)
    tap.main(dict(globals()))
