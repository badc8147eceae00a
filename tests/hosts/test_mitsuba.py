"""Mitsuba 3 as a host: test_mitsuba.py VARIANT. BUILD names the build folder."""
import contextlib
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
import lull.driver  # noqa: E402
import lull.mitsuba  # noqa: E402
import tap  # noqa: E402
from lull import files, outputs  # noqa: E402
from tap import raises  # noqa: E402

BUILD = os.environ.get("BUILD", "build")
os.environ["LULL_PLUGIN_PATH"] = f"{BUILD}/lib/lull"
LUMINANCE = np.array([.2126729, .7151522, .0721750])
TILE = 12  # pixels; their mean is near enough to normal for a z-test
FALSE_ALARM = 1e-4  # of a whole test, by Šidák's correction over the tiles


BOX = Path("tests/hosts/scenes/box.xml").read_text()
AOVS = """<integrator type="aov"><string name="aovs" value="depth:depth,normal:sh_normal,albedo:albedo,where:position"/>
    <integrator name="img" """


def scene(name):
    return mi.load_file(f"tests/hosts/scenes/{name}.xml")


def box(*changes):
    """The box with parts of its text replaced."""
    text = BOX
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return mi.load_string(text)


def with_filter(name):
    """Mitsuba's default filter if there is no name."""
    return box(('<rfilter type="box"/>', f'<rfilter type="{name}"/>' if name else ""))


def with_aovs():
    return box(("<integrator ", AOVS), ("</integrator>", "</integrator></integrator>"), ('value="rgb"', 'value="rgba"'))


@contextlib.contextmanager
def call_length(seconds):
    """Of a call of the render function: what is rendered together follows the clock otherwise."""
    before, lull.driver.CALL_S = lull.driver.CALL_S, seconds
    try:
        yield
    finally:
        lull.driver.CALL_S = before


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
        wrong = abs(z_scores(name, picture._replace(image=picture.image * 1.05))).max()
        assert wrong > limit, (name, wrong)  # a bias of a twentieth would be seen


def test_stops():
    """stops within a wave of 16 of the path tracer's on the same box (means of nine seeds)"""
    # many checks and large blocks: what is left is the scatter of the error itself, 215 to 263 spp in the first block
    parameters, seeds = {"threshold": .01, "growth": 1.05}, range(9)
    pictures = [lull.mitsuba.render(scene("box"), "halfbuf", block=48, wave=4, spp_max=1024, seed=seed, **parameters)
                for seed in seeds]
    pairs = [a for k, v in parameters.items() for a in ("-p", f"{k}={v}")]
    stops = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            report = os.path.join(folder, "r.json")
            subprocess.run([f"{BUILD}/bin/lull-render", "tests/hosts/scenes/box.pbrt", "-q", "--block", "48", "-c", "halfbuf",
                            *pairs, "--spp-max", "1024", "--seed", str(seed), "--report", report], check=True)
            stops.append([b["spp"] for b in json.loads(Path(report).read_text())["blocks"]])
    wanted, own = (np.mean(s, 0) for s in (stops, [[b.spp for b in p.driver.frame.blocks] for p in pictures]))
    assert (abs(own - wanted) <= 16).all() and max(wanted) > min(wanted) + 16, (own, wanted)


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


def block_means(image, blocks):
    y = np.asarray(image, float) @ LUMINANCE
    return np.array([y[b.rect.y0:b.rect.y1, b.rect.x0:b.rect.x1].mean() for b in blocks])


def test_block_edges():
    """with the default filter and with one of negative weights each block has the mean of whole renders, over seeds"""
    seeds = 12
    for name in ("", "lanczos"):
        s, own = with_filter(name), []
        for seed in range(seeds):
            with call_length(0):  # as where a wave takes long: every block alone
                # block edges lie along those of the lamp, where light from beyond an edge counts most
                p = lull.mitsuba.render(s, "halfbuf", threshold=.03, block=(19, 24), spp_max=128, seed=seed)
            blocks = p.driver.frame.blocks
            assert p.result.outcome == "done" and len({b.spp for b in blocks}) > 1, p.result
            own.append(block_means(p.image, blocks))
        whole = [block_means(np.array(mi.render(s, spp=64, seed=1000 + k))[..., :3], blocks) for k in range(seeds)]
        z = (np.mean(own, 0) - np.mean(whole, 0)) / np.sqrt((np.var(own, 0, ddof=1) + np.var(whole, 0, ddof=1)) / seeds)
        # Student's t with some 16 degrees of freedom
        limit = 1.5 * statistics.NormalDist().inv_cdf(1 - (1 - (1 - FALSE_ALARM) ** (1 / z.size)) / 2)
        assert abs(z).max() < limit and abs(z.mean()) < 1.5 and (z ** 2).mean() < 3, (name, z)


def test_filter_weights():
    """waves of few samples, each with filter weights far from their mean, add up to one long render"""
    s, seeds = with_filter("lanczos"), 6
    at = np.s_[5:20, 33:63]  # around the lamp
    own = [lull.mitsuba.render(s, "fixed", spp=64, block=48, wave=1, spp_max=64, seed=k).image[at] for k in range(seeds)]
    whole = [np.array(mi.render(s, spp=64, seed=1000 + k))[at][..., :3] for k in range(seeds)]
    ratio = np.var(own, 0, ddof=1).sum() / np.var(whole, 0, ddof=1).sum()
    assert .6 < ratio < 1.6, ratio


def test_seeds():
    """the same seed gives the same picture whatever is rendered together, another one another"""
    for name in ("box", "gaussian"):
        rendered = []
        for seed, seconds in ((1, math.inf), (1, 0), (1, .02), (2, 1)):
            with call_length(seconds):
                rendered.append(lull.mitsuba.render(with_filter(name), "halfbuf", threshold=.03, block=24, spp_max=64,
                                                    seed=seed))
        assert all(p.result.outcome == "done" for p in rendered), [p.result for p in rendered]
        same = [abs(rendered[0].image - p.image).max() for p in rendered[1:3]]
        assert max(same) < 1e-5, same  # what order threads add in is worth 1e-8
        assert all((rendered[0].spp == p.spp).all() for p in rendered[1:3]) and rendered[0].spp.min() < rendered[0].spp.max()
        assert abs(rendered[0].image - rendered[3].image).max() > .01


def test_aovs():
    """alpha and AOVs are passed on as one long render has them, and shown to a criterion that reads them"""
    p = lull.mitsuba.render(with_aovs(), "fixed", spp=32, block=48, spp_max=32)
    whole = np.array(mi.render(with_aovs(), spp=64, seed=5))
    # Mitsuba itself leaves out the nested integrator's picture, which is R, G, B, A
    names = ["R", "G", "B", "A", *(n for n in with_aovs().integrator().aov_names() if not n.startswith("img."))]
    assert set(names[3:]) < set(p.layers) and "depth.T" in names and whole.shape[2] == len(names), (list(p.layers), names)
    for k, name in enumerate(names[3:], 3):
        # two renders' noise at edges is in single pixels
        assert abs(p.layers[name] - whole[..., k]).mean() < .03 * (1 + abs(whole[..., k]).mean()), name
        assert abs(p.layers[name].mean() - whole[..., k].mean()) < .01 * (1 + abs(whole[..., k]).mean()), name
    with lull.mitsuba.Film(with_aovs()) as film:
        assert film.supplies == ["albedo", "normal", "depth"]
        r = lull.Rect(24, 24, 48, 40)
        sample = next(film.render([r], 0, 64, False))
        at = np.s_[r.y0:r.y1, r.x0:r.x1]
        for plane, first in (("albedo", "albedo.R"), ("normal", "normal.X"), ("depth", "depth.T")):
            k = names.index(first)
            mean = sample[plane].T / sample["weight"].T
            assert abs(mean.T - np.squeeze(whole[at][..., k:k + (1 if plane == "depth" else 3)])).mean() < .05, plane
    with tempfile.TemporaryDirectory() as folder:
        outputs.write_exr(os.path.join(folder, "a.exr"), p.driver)
        assert b"albedo.G\0" in Path(folder, "a.exr").read_bytes()[:2000]


def test_one_call():
    """checkpoint, resume and mask in the one call: an interrupted picture goes on to the same one, another is refused"""
    def go(s=None, **more):
        settings = {"threshold": .003, "block": 24, "spp_max": 64, **more}
        return lull.mitsuba.render(s or with_filter(""), "halfbuf", **settings)
    with tempfile.TemporaryDirectory() as folder:
        file, painted = os.path.join(folder, "c.npz"), os.path.join(folder, "mask.png")
        whole = go()
        first = go(checkpoint=file, after_call=lambda d: d.totals.samples > 96 * 96 * 20 and d.interrupt())
        assert first.result.outcome == "interrupt" and first.unsaved is None and first.spp.max() < 64
        second = go(checkpoint=file, resume=True)
        assert second.result.outcome == "done" and abs(second.image - whole.image).max() < 1e-5
        assert second.driver.totals.samples == whole.driver.totals.samples
        assert second.spp.max() == 64 and go(checkpoint=file, resume=True, spp_max=96).spp.max() > 64
        default = ('<rfilter type="box"/>', "")
        for name, other in (("scene", box(('value="0.7"', 'value="0.71"'), default)), ("filter", with_filter("mitchell")),
                            ("integrator", box(('name="max_depth" value="6"', 'name="max_depth" value="7"'), default))):
            raises(lull.LullError, f"made with {name}=", go, other, checkpoint=file, resume=True)
        raises(lull.LullError, "made with seed=0, but this render has seed=3", go, seed=3, checkpoint=file, resume=True)
        raises(ValueError, "with checkpoint=", go, resume=True)
        Path(folder, "notes").write_text("my notes")
        raises(ValueError, "this is no checkpoint", go, checkpoint=os.path.join(folder, "notes"))
        raises(OSError, "cannot write there", go, checkpoint=os.path.join(folder, "no", "c.npz"))
        shades = np.zeros((96, 96, 3), np.uint8)
        shades[3, 3] = 255
        files.write_png(painted, shades)
        masked = go(mask=Path(painted), threshold=.02, spp_max=512)
        same = go(mask=shades[..., 0] / 255., threshold=.02, spp_max=512)
        plain = go(threshold=.02, spp_max=512)
        counts = [[b.spp for b in p.driver.frame.blocks] for p in (masked, same, plain)]
        assert counts[0] == counts[1] and counts[0][0] > 1.5 * counts[2][0] and counts[0][1:] == counts[2][1:], counts
        often = []
        go(checkpoint=file, checkpoint_every_s=1e-9, after_call=lambda d: often.append(os.stat(file).st_mtime_ns))
        assert len(set(often)) > 2


def test_quote():
    """a quote tells what quality parameters cost and stops after its pilot, from which a render goes on; a render tells it in one line"""
    with tempfile.TemporaryDirectory() as folder:
        settings = {"block": 48, "spp_max": 2048, "checkpoint": os.path.join(folder, "c.npz"), "visible": .35}
        table = lull.mitsuba.quote(scene("box"), "observer", **settings)
        assert "spp min / mean / max" in table and table.count("\n") >= 3 and table.count("<- chosen") == 1, table
        lines = []
        p = lull.mitsuba.render(scene("box"), "observer", **settings, resume=True, tell=lines.append)
        assert p.result.outcome == "done" and 128 <= p.spp.min() <= p.spp.max() <= 2048
        mean = float(next(t for t in table.splitlines() if "<- chosen" in t).split("/")[1].replace(",", ""))
        assert .5 < mean / p.spp.mean() < 2, (mean, p.spp.mean())  # it predicts, it does not know
        assert len(lines) == 1 and lines[0].startswith("visible 0.35 takes "), lines
        assert "error 2 would take " in lines[0], lines


def test_denoise():
    """denoise keeps the blend, by albedo and shading normals of an AOV integrator; the layers are the film's own"""
    with tap.denoiser("auxiliary", BUILD):
        p = lull.mitsuba.render(scene("box"), "fixed", spp=16, block=48, spp_max=16, denoise="full")
        f = p.driver.frame
        assert f.planes == ("color", "half", "albedo", "normal") and p.layers == {} and p.undenoised is None
        assert np.allclose(p.image, f.mean("albedo") + f.mean("normal"), atol=1e-5) and f.mean("albedo").max() > .65
        own = lull.mitsuba.render(with_aovs(), "fixed", spp=16, block=48, spp_max=16, denoise="full")
        assert {"A", "albedo.R", "normal.X", "where.Y", "depth.T"} <= set(own.layers)
        assert np.allclose(own.driver.frame.mean("albedo"), f.mean("albedo"), atol=1e-5)
    with tap.denoiser("box", BUILD):
        p = lull.mitsuba.render(scene("box"), block=48, spp_max=64, denoise="blend")
        assert p.driver.frame.criterion.info.id == "denoised" and (p.image == p.denoised.picture).all()
        # A mean of 5x5 pixels is a poor denoiser: half of the noisy picture is kept, and the error is told with its margin.
        assert 0 < p.denoised.weight.mean() < 1 and (p.denoised.error < 1.3 * p.denoised.noisy_error).all()
    with tap.denoiser("/nowhere", BUILD):
        raises(lull.LullError, "/nowhere", lull.mitsuba.render, scene("box"), denoise="blend")
    raises(ValueError, "expected one of blend, full", lull.mitsuba.render, scene("box"), denoise="much")
    with tap.denoiser("crash", BUILD):
        p = lull.mitsuba.render(scene("box"), "fixed", spp=16, block=48, spp_max=16, denoise="full")
        assert "Open Image Denoise" in str(p.undenoised) and p.denoised is None and p.image.mean() > 0


def test_really_denoised():
    """with Open Image Denoise itself the blend is nearer to a long render than the noisy picture with the same samples"""
    truth = np.array(mi.render(scene("box"), spp=512, seed=99))[..., :3]
    with tap.denoiser("real", BUILD):
        p = lull.mitsuba.render(scene("box"), "fixed", spp=16, block=48, spp_max=16, denoise="blend")
    noisy, kept = (np.sqrt(((np.minimum(picture, 1) - np.minimum(truth, 1)) ** 2).mean())
                   for picture in (p.driver.frame.mean(), p.image))  # as a display shows them
    assert kept < .7 * noisy, (kept, noisy)


def test_bad_input():
    """what cannot be rendered is named; an exception while rendering keeps what there is"""
    raises(lull.LullError, "no criterion nobody", lull.mitsuba.render, scene("box"), "nobody")
    raises(ValueError, "sensor 3", lull.mitsuba.render, scene("box"), "halfbuf", sensor=3)
    raises(ValueError, "mask of shape", lull.mitsuba.render, scene("box"), "halfbuf", mask=np.zeros((2, 2)))
    stratified = box(("independent", "stratified"))
    raises(ValueError, "'independent'", lull.mitsuba.render, stratified, "halfbuf", wave=15)
    raises(ValueError, "spp_max that is a multiple", lull.mitsuba.render, stratified, "halfbuf", wave=16, spp_max=102)
    for kind, shown in (("luminance", "Y"), ("xyz", "X, Y, Z")):
        other = box(('value="rgb"', f'value="{kind}"'))
        raises(ValueError, f"channels {shown}: expected RGB", lull.mitsuba.render, other, "halfbuf")
    splats = box(('type="path"', 'type="ptracer"'))
    raises(ValueError, "splats light over the whole film", lull.mitsuba.render, splats, "halfbuf")
    film = {"type": "hdrfilm", "width": 8, "height": 8, "pixel_format": "rgb"}
    batch = mi.load_dict({"type": "scene", "integrator": {"type": "path"}, "sensor": {
        "type": "batch", "a": {"type": "perspective"}, "b": {"type": "perspective", "fov": 20}, "film": film}})
    raises(ValueError, "the sensor BatchSensor has other rays", lull.mitsuba.render, batch, "halfbuf")
    raises(lull.LullError, "reads moment2, which this host does not supply", lull.mitsuba.render, scene("box"), "variance")
    raises(ValueError, "wave 0", lull.mitsuba.render, scene("box"), "halfbuf", wave=0)
    raises(ValueError, "time_budget_s nan", lull.mitsuba.render, scene("box"), "halfbuf", time_budget_s=math.nan)

    def fails(driver):
        if driver.totals.samples > 96 * 96 * 10:
            raise RuntimeError("out of paint")
    picture = lull.mitsuba.render(scene("box"), "halfbuf", block=24, after_call=fails)
    assert picture.result.outcome == "failed" and "out of paint" in str(picture.result.exception)
    assert picture.image.shape == (96, 96, 3) and picture.spp.min() >= 8 and picture.image.max() > .5


tap.main(dict(globals()))
