"""The Python package lull: the ABI's layout, finding criteria, the driver with a renderer in numpy, the path tracer's stops,
files, and bad input. BUILD names the build folder."""
import base64
import contextlib
import copy
import ctypes
import io
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import sysconfig
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

import lull
import tap
from lull import abi, checkpoint, denoising, exr, files, outputs, quote
from renderer import Noise, Playback
from tap import raises

BUILD = os.environ.get("BUILD", "build")
LIB, PLUGINS, RENDER = f"{BUILD}/lib/lull", f"{BUILD}/tests/abi/plugins", f"{BUILD}/bin/lull-render"
os.environ["LULL_PLUGIN_PATH"] = LIB
LUMINANCE = np.array([.2126729, .7151522, .0721750])
SIGMAS = [[.01, .2], [.5, 1.]]
WHOLE = {"wave": 1 << 30, "whole_waves": False}  # a call from check to check, checks where the criterion says
TMP = tempfile.TemporaryDirectory()


def tmp(name):
    return os.path.join(TMP.name, name)


def run(criterion="halfbuf", sigmas=SIGMAS, parameters=None, host=None, driver=None, **frame):
    """A finished small render: (result, frame, driver)."""
    host = host or Noise(sigmas)
    size = {"width": 16 * len(sigmas[0]), "height": 16 * len(sigmas), "block": 16, "spp_max": 512, **frame}
    c = lull.load(criterion, **(parameters if parameters is not None else {"threshold": .02}))
    f = lull.Frame(c, **size)
    d = lull.Driver(f, host, **(driver or {}))
    return d.run(), f, d


def grey_levels(path):
    """[height, width] of a PNG, the mean of its codes."""
    subprocess.run(["oiiotool", path, "--ch", "R,G,B", "-d", "float", "--compression", "none", "-o", tmp("grey.exr")], check=True)
    return 255 * np.mean([exr.read(tmp("grey.exr"))[0][c] for c in "RGB"], 0)


def uncompressed(path):
    """An EXR's channels, [h, w] float32."""
    subprocess.run(["oiiotool", path, "--compression", "none", "-o", tmp("plain.exr")], check=True)
    return exr.read(tmp("plain.exr"))[0]


def test_layout():
    """every struct lies as layout-1.txt and host-layout-1.txt say"""
    seen = {}
    for name, size, body in re.findall(r"^struct lull_(\w+) (\d+)\n((?:  .*\n?)*)",
                                       "".join(Path(f"plugin-api/{f}layout-1.txt").read_text() for f in ("", "host-")), re.M):
        struct = getattr(abi, "".join(part.capitalize() for part in name.split("_")), None)
        if struct is None:
            continue  # the library's and the criteria's own matter
        fields = re.findall(r"  (\d+) (\d+) (\w+)", body)
        assert (ctypes.sizeof(struct), len(struct._fields_)) == (int(size), len(fields)), name
        for offset, length, field in fields:
            at = getattr(struct, field)
            assert (at.offset, at.size) == (int(offset), int(length)), (name, field)
        seen[name] = len(fields)
    structs = {value for value in vars(abi).values() if isinstance(value, type) and issubclass(value, ctypes.Structure)}
    assert len(seen) == len(structs - {abi.Search, abi.Found}) and sum(seen.values()) > 180, seen


def test_numbers():
    """every constant is the headers'"""
    headers = "".join(Path(f"plugin-api/include/lull/{name}.h").read_text() for name in ("criterion", "loader", "host", "host_draft"))
    found = dict(re.findall(r"#define LULL_(\w+) \(?(?:UINT32_C\()?(-?(?:0x)?[0-9a-f]+)\)?", headers))
    plane = {n[6:]: v for n, v in found.items() if n.startswith("PLANE_") and n != "PLANE_COUNT"}
    names = {n: v for n, v in {**found, **plane}.items() if hasattr(abi, n)}
    assert len(plane) == 8 and {n for n, v in vars(abi).items() if n.isupper() and isinstance(v, int)} <= {*names, "OK"}
    for name, value in names.items():
        assert getattr(abi, name) == int(value, 0), name


def test_described():
    """every public name has a docstring, every parameter and result a type"""
    assert not list(tap.undescribed(lull)), list(tap.undescribed(lull))


def test_criteria():
    """criteria() lists what is installed, with parameters"""
    found = {c.id: c for c in lull.criteria()}
    assert {"fixed", "halfbuf", "null", "variance", "ggn", "observer"} <= set(found)
    threshold = found["halfbuf"].parameter("threshold")
    assert threshold.type == "float" and threshold.min <= float(threshold.default) <= threshold.max and threshold.help


def test_no_library():
    """without the library there is one line that says what is missing, where it was looked for and what to do"""
    code = "from lull import library; library.search_path, library.NAME = lambda: ['/nowhere'], 'liblull-none.so'; library.find('null')"
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True)
    wanted = "no liblull-none.so in /nowhere: install Lull, or set LULL_PLUGIN_PATH"
    assert done.returncode == 1 and wanted in done.stderr.splitlines()[-1], done.stderr


def test_find():
    """load() takes NAME, PATH and PATH:ID"""
    assert lull.load("fixed", spp=100).parameters == {"spp": "100"}
    assert lull.load(f"{LIB}/fixed.so").info.id == "fixed"
    assert lull.load(f"{PLUGINS}/faulty.so:faulty").info.id == "faulty"
    assert lull.find(f"{PLUGINS}/pair.so:second-of-pair").id == "second-of-pair"


def test_refused_libraries():
    """libraries that are none, are broken or of another version are refused in one line"""
    Path(tmp("text.so")).write_text("no library")
    for name, text in ((tmp("none.so"), "no such file"), (tmp("text.so"), "not a shared object"),
                       (f"{PLUGINS}/no_entry.so", "not a criterion of ABI 1"), (f"{PLUGINS}/short_table.so", "version 1.0"),
                       (f"{PLUGINS}/unresolved.so", "cannot"), (f"{PLUGINS}/empty.so", "holds no criterion"),
                       (f"{PLUGINS}/twin_ids.so", "two criteria"), (f"{PLUGINS}/endless.so", "never ends"),
                       (f"{LIB}/fixed.so:other", "holds no criterion with the id other"), ("nobody", "no criterion nobody")):
        raises(lull.LullError, text, lull.load, name)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ids = [c.id for c in lull.criteria([PLUGINS.replace("plugins", "none"), TMP.name])]
    assert ids == [] and any("text.so" in str(w.message) for w in caught)


def test_refused_parameters():
    """unknown parameters and values out of range are named"""
    raises(lull.LullError, "spp: 'x'", lull.load, "fixed", spp="x")
    raises(lull.LullError, "no-such", lull.load, "fixed", no_such=1)
    raises(lull.LullError, "threshold", lull.load, "halfbuf", threshold=-1.)
    for name in ("observer", "denoised"):
        raises(lull.LullError, "error and visible each say when a block stops: leave out one", lull.load, name, visible=.2, error=2)
    try:
        lull.load("fixed", no_such=1)
    except lull.LullError as error:
        assert error.name == "E_KEY"


def test_closed():
    """a closed criterion is told so, and closing twice is fine"""
    c = lull.load("fixed")
    c.close()
    c.close()
    raises(lull.LullError, "closed", lull.Frame, c, 8, 8)


def test_noisier_blocks():
    """noisier blocks get more samples, whoever judges"""
    for name, parameters in (("halfbuf", {"threshold": .02}), ("ggn", {"visible": .9, "passes": 1})):
        result, f, _ = run(name, parameters=parameters)
        spp = [b.spp for b in f.blocks]
        assert result.outcome == "done" and spp[0] < spp[-1] and sorted(spp) == spp, (name, spp)
    assert all(b.reason in ("criterion", "spp-max") for b in f.blocks)


def test_moment2():
    """a host that supplies second moments can use variance, one that does not is told"""
    noise = Noise(SIGMAS)

    def host(rects, first, count, half):
        for r in rects:
            samples = np.array([noise.sample(r, s) for s in range(first, first + count)])
            yield {"color": samples.mean(0), "moment2": (samples @ LUMINANCE).__pow__(2).mean(0)}
    _, f, _ = run("variance", parameters={"threshold": .01}, host=host, supplies=["moment2"])
    spp = [b.spp for b in f.blocks]
    assert spp[0] < spp[1] < spp[2] <= spp[3], spp
    raises(lull.LullError, "reads moment2, which this host does not supply: choose another criterion", run, "variance")
    raises(lull.LullError, "with a display mapping", run, "variance", supplies=["moment2"], display=lambda x: x.clip(0, 1))


def wave_variance(f):
    """What a frame's plane moment2 says of the variance of its mean."""
    n, y = f.spp()[0, 0], f.mean() @ LUMINANCE
    return (f.planes_now()["moment2"].array - y * y) / (n - 1)


def test_moments_of_waves():
    """a host without second moments has those of its waves: of unequal ones, weighted ones, put ones and dropped samples"""
    rng, counts = np.random.default_rng(3), (16, 16, 4, 28)
    means = [rng.uniform(.1, .9, (16, 16, 3)) for _ in counts]
    y, n = np.array([m @ LUMINANCE for m in means]), np.array(counts, float)[:, None, None]
    mean = (n * y).sum(0) / n.sum()
    wanted = (n * (y - mean) ** 2).sum(0) / ((len(counts) - 1) * n.sum())  # the variance of a weighted mean, without bias
    f, put, weighted = (lull.Frame(lull.load("observer"), 16, 16, block=16, wave=16, whole_waves=False, weighted=w) for w in (False, False, True))
    total, spp = 0, 0
    for k, (m, count) in enumerate(zip(means, counts)):
        f.add(f.blocks[0], m, count, k % 2 == 0)
        weighted.add(weighted.blocks[0], {"color": 1.5 * m, "weight": np.full((16, 16), 1.5)}, count, k % 2 == 0)
        total, spp = total + count * m, spp + count
        put.put(put.blocks[0], total / spp, spp, means[0], 16)
        assert k or np.abs(wave_variance(f)).max() < 1e-15  # one wave says nothing
    for other in (f, put, weighted):
        assert np.allclose(wave_variance(other), wanted, rtol=1e-9, atol=0), np.abs(wave_variance(other) / wanted - 1).max()
    bad = means[0].copy()
    bad[3, 5] = np.nan
    f.add(f.blocks[0], bad, 16, True)
    assert f.waves[3, 5] == 4 and (np.delete(f.waves.ravel(), 3 * 16 + 5) == 5).all() and np.isfinite(f.planes_now()["moment2"].array).all()
    assert {"waves", "sum-moment2"} <= set(f.arrays())
    for spp in (100, 16):  # begun anew, with fewer samples
        put.put(put.blocks[0], means[0] if spp == 16 else means[1], spp, means[0], 16)
    assert (put.waves == 1).all() and np.abs(wave_variance(put)).max() < 1e-15
    both = lull.Frame(lull.load("observer"), 16, 16, supplies=["moment2"], display=lambda x: x)
    both.add(both.blocks[0], {"color": means[0], "moment2": np.full((16, 16), 9.)}, 16, True)
    assert (both.waves == 1).all()  # with a display mapping those of the host are of other values
    raises(ValueError, "no plane moment2", lambda: (g := lull.Frame(lull.load("observer"), 16, 16, supplies=["moment2"])).add(g.blocks[0], means[0], 16, True))
    assert lull.Frame(lull.load("halfbuf"), 16, 16).waves is None  # nobody asks


def test_moments_of_skewed_waves():
    """of independent samples the waves know the noise: also where it is skewed, and as a display shows it"""
    rng, count, waves = np.random.default_rng(4), 16, 12
    for display in (None, lambda rgb: .5 * rgb):
        f = lull.Frame(lull.load("observer"), 200, 200, block=200, wave=count, display=display)
        for k in range(waves):
            sample = rng.lognormal(0, 1, (count, 200, 200)).mean(0)
            f.add(f.blocks[0], np.repeat(sample[..., None], 3, -1), count, k % 2 == 0)
        v = f.planes_now()["moment2"].array
        shown = f.mean() if display is None else display(f.mean())
        found = ((v - (shown @ LUMINANCE) ** 2) / (count * waves - 1)).mean()
        true = (np.exp(2) - np.exp(1)) / (count * waves) * (1 if display is None else .25)  # of a log-normal, by its formula
        assert abs(found / true - 1) < .05, (found, true)


def test_halves_that_agree_by_luck():
    """two halves that agree by luck stop no block whose waves differ"""
    rng = np.random.default_rng(5)
    noise = rng.normal(0, .2, (200, 200, 1))

    def host(rects, first, count, half):
        for r in rects:  # both waves of a pair have the same noise, and the next pair takes it back
            own = rng.normal(0, .001, (200, 200, 1))
            yield np.broadcast_to(.5 + own + (noise if first // 32 % 2 else -noise), (200, 200, 3)).copy()
    frames = {}
    for waves in (True, False):
        f = lull.Frame(lull.load("observer"), 200, 200, block=200, spp_min=64, spp_max=128, wave=16)
        if not waves:  # what it would do without them
            f._moments = lambda display: (f.mean() @ LUMINANCE) ** 2
        lull.Driver(f, host).run()
        frames[waves] = f.blocks[0].reason
    assert frames == {True: "spp-max", False: "criterion"}, frames


def test_sums():
    """the picture is the mean of exactly the samples that were asked for, and half A is a fixed half of them"""
    noise = Noise(SIGMAS)
    _, f, d = run(host=noise)
    for b in f.blocks:
        asked = sorted((first, count, half) for rects, first, count, half in noise.calls if b.rect in rects)
        assert [a[0] for a in asked] == [sum(c[1] for c in asked[:i]) for i in range(len(asked))]  # no gap, no overlap
        mean = np.mean([noise.sample(b.rect, s) for s in range(b.spp)], 0)
        part = np.s_[b.rect.y0:b.rect.y1, b.rect.x0:b.rect.x1]
        assert abs(f.mean()[part] - mean).max() < 1e-12 and (f.spp()[part] == b.spp).all()
        half = [s for first, count, h in asked if h for s in range(first, first + count)]
        assert len(half) == b.half_spp and abs(b.half_spp - b.spp / 2) <= f.wave
        assert abs(f.sums["half"][part] / b.half_spp - np.mean([noise.sample(b.rect, s) for s in half], 0)).max() < 1e-12


def test_halves_of_lull_render():
    """with waves of four the halves are the path tracer's"""
    from lull.driver import in_half
    for sample in list(range(0, 600)) + [10007, 1 << 20, (1 << 31) - 1]:
        assert in_half(sample // 4) == (bin(sample & 0x7D29F06C).count("1") % 2 == 0)


def test_independence():
    """crop, threads and slices change no decision"""
    _, whole, _ = run()
    _, part, _ = run(crop=lull.Rect(20, 3, 31, 9))
    assert [b.id for b in part.blocks] == [1] and part.blocks[0].spp == whole.blocks[1].spp
    assert part.mean().shape == (16, 16, 3) and part.cropped(part.mean()).shape == (6, 11, 3)
    answers = []
    for threads in (1, 3):
        f = lull.Frame(lull.load("ggn", threads=threads, visible=.9, passes=1), 32, 32, block=16, spp_max=200)
        lull.Driver(f, Noise(SIGMAS)).run()
        answers.append([(b.spp, b.p_noisy, b.error) for b in f.blocks])
    assert repr(answers[0]) == repr(answers[1])


def test_same_stops_as_lull_render():
    """on the path tracer's recorded sequences the driver stops every block where the path tracer does"""
    for criterion, parameters in (("halfbuf", {"threshold": .01}), ("ggn", {}), ("null", {})):  # observer has second moments in the path tracer
        options = ["--spp-min", "20", "--spp-max", "700"]
        seed, scene = 7, "scenes/cornell-box.pbrt"
        pairs = [a for k, v in parameters.items() for a in ("-p", f"{k}={v}")]
        subprocess.run([RENDER, scene, "-q", "--size", "96x80", "--block", "48", "--seed", str(seed), "-c", criterion,
                        *pairs, *options, "--report", tmp("pt.json"), "--stop-map", tmp("pt.csv"), "--stop-map", tmp("pt.png")], check=True)
        wanted = json.loads(Path(tmp("pt.json")).read_text())
        f = lull.Frame(lull.load(criterion, **parameters), 96, 80, block=48, seed=seed, spp_min=20, spp_max=700, **WHOLE)
        d = Playback(f, RENDER, scene, [])
        assert d.run().outcome == "done"
        stops = [(b["spp"], b["reason"], b["checks"]) for b in wanted["blocks"]]
        mine = [(b.spp, b.reason, b.checks) for b in f.blocks]
        assert mine == stops, (criterion, stops)
        for b, w in zip(f.blocks, wanted["blocks"]):
            near = 2e-3 if b.spp == w["spp"] else 2e-2
            assert criterion == "null" or abs(b.error - w["error"]) <= near * w["error"], (b.error, w["error"])
        if criterion == "null":
            continue  # it names no next check: the geometric schedule was compared
        assert len({s[0] for s in stops}) > 1, stops
        outputs.write_report(tmp("own.json"), d, scene=scene)
        own = json.loads(Path(tmp("own.json")).read_text())
        assert own.keys() == wanted.keys() and own["blocks"][0].keys() == wanted["blocks"][0].keys()
        assert own["totals"]["criterion_thread_s"] > 0 and own["totals"].keys() == wanted["totals"].keys() and own["criterion"] == wanted["criterion"]
        for name in ("csv", "png"):
            outputs.write_stop_map(tmp(f"own.{name}"), f, scene)
            assert criterion == "observer" or Path(tmp(f"own.{name}")).read_bytes() == Path(tmp(f"pt.{name}")).read_bytes()


def test_mask_of_lull_render():
    """a mask does in the driver what --mask does in the path tracer, and both reports say so alike"""
    mask = np.zeros((80, 96))
    mask[7, 50], mask[60, 3] = 1, .4
    files.write_png(tmp("mask.png"), np.dstack([(255 * mask).round().astype(np.uint8)] * 3))
    for criterion, name, value in (("halfbuf", "threshold", .03), ("ggn", "visible", .9)):
        subprocess.run([RENDER, "scenes/cornell-box.pbrt", "-q", "--size", "96x80", "--block", "48", "-c", criterion, "-p",
                        f"{name}={value}", "--spp-max", "1500", "--mask", tmp("mask.png"), "--report", tmp("mask.json")],
                       check=True)
        wanted = json.loads(Path(tmp("mask.json")).read_text())
        f = lull.Frame(lull.load(criterion, **{name: value}), 96, 80, block=48, spp_max=1500, mask=mask, **WHOLE)
        d = Playback(f, RENDER, "scenes/cornell-box.pbrt", [])
        assert d.run().outcome == "done"
        outputs.write_report(tmp("own.json"), d, mask=tmp("mask.png"))
        own = json.loads(Path(tmp("own.json")).read_text())
        seen = [[(b["spp"], b["dial"]) for b in r["blocks"]] for r in (own, wanted)]
        assert seen[0] == seen[1] and seen[0][1][0] > 1.5 * seen[0][0][0], (criterion, seen)
        assert own["mask"] == wanted["mask"] == tmp("mask.png") and [b[1] for b in seen[0]] == [1, .25, .25 ** .375, 1]


def test_limits():
    """the first limit wins: samples, time, minimum"""
    _, f, _ = run(sigmas=[[5.]], spp_max=100)
    assert [(b.spp, b.reason) for b in f.blocks] == [(100, "spp-max")]
    after = []  # seconds after each call: the first one that is past the budget is the last, at the latest
    result, f, d = run(sigmas=[[5.]], spp_max=2 ** 31 - 1, time_budget_s=.3,
                       driver={"after_call": lambda d: after.append(d.totals.elapsed_s)})
    assert result.outcome == "time" and f.blocks[0].reason == "time" and d.totals.elapsed_s >= .3
    assert all(s < .3 for s in after[:-1]), len(after)
    _, f, _ = run(sigmas=[[.001]], spp_min=128)
    assert f.blocks[0].spp == 128
    assert run(sigmas=[[.001]], spp_min=1)[1].blocks[0].spp == 32  # two waves: one of each half
    _, f, _ = run(sigmas=[[.5]], spp_max=64, uniform=True)
    assert (f.blocks[0].spp, f.blocks[0].reason, f.blocks[0].checks) == (64, "uniform", 1)


def test_seam():
    """a block beside one with many more samples is re-opened, up to that ratio, where the halves are equal"""
    plain = run(sigmas=[[.01, .5]])[1]
    for ratio in (2., 3.):
        even = run(sigmas=[[.01, .5]], max_seam=ratio)[1]
        spp = [b.spp for b in even.blocks]
        assert plain.blocks[1].spp > 3.5 * plain.blocks[0].spp and spp[1] == plain.blocks[1].spp
        assert spp[0] == -(-spp[1] // int(ratio) // 32) * 32, (ratio, spp)
        assert even.blocks[0].half_spp == spp[0] / 2


def test_first_spp():
    """a criterion is asked first where it says that asking has a use, never before"""
    for parameters, options, first in (({"first-spp": "100"}, {}, 128), ({"first-spp": "100"}, {"spp_min": 200}, 224),
                                       ({"first-spp": "1000"}, {}, 512)):
        c = lull.load("halfbuf", **parameters)
        f = lull.Frame(c, 32, 32, **{"block": 16, "spp_max": 512, **options})
        asked, check = [], f.check
        f.check = lambda: asked.append([b.spp for b in f.blocks]) or check()
        lull.Driver(f, Noise([[.5] * 2] * 2)).run()
        assert f.first_spp == max(options.get("spp_min", 16), int(parameters["first-spp"]))
        assert asked[0] == [first] * 4, asked


def test_failing_criterion():
    """a criterion that fails costs time, never quality, and is told once"""
    said = []
    f = lull.Frame(lull.load("halfbuf", threshold=1.), 16, 16, block=16, spp_max=64)
    f.planes_now = lambda: {"color": lull.Plane(f.sums["color"], "spp")}  # and no half, which it asked for
    d = lull.Driver(f, Noise([[.1]]), warn=said.append)
    assert d.run().outcome == "done" and f.blocks[0].spp == 64 and d.totals.failed_checks > 1, said
    assert len(said) == 1 and said[0].startswith("criterion halfbuf: "), said


def test_exception():
    """an exception in the render function ends the run and keeps the picture"""
    for kind, outcome in ((RuntimeError, "failed"), (MemoryError, "failed"), (KeyboardInterrupt, "interrupt")):
        noise = Noise([[.5, .6], [.7, .8]])

        def host(rects, first, count, half):
            for n, sample in enumerate(noise(rects, first, count, half)):
                if first == 64 and n == 1:
                    raise kind("out of paint")
                yield sample
        result, f, d = run(host=host, parameters={"threshold": .001})
        assert result.outcome == outcome and (outcome == "interrupt" or str(result.exception) == "out of paint")
        assert [b.spp for b in f.blocks] == [80, 64, 64, 64] and {b.reason for b in f.blocks} == {"interrupt"}
        assert np.isfinite(f.mean()).all() and f.blocks[0].checks > 0 and d.totals.samples == 256 * (80 + 3 * 64)


def test_interrupt():
    """Ctrl-C ends after the current call, the handler is put back"""
    before = signal.getsignal(signal.SIGINT)
    result, f, _ = run(driver={"after_call": lambda d: os.kill(os.getpid(), signal.SIGINT)})
    assert result.outcome == "interrupt" and f.blocks[0].spp == 16 and signal.getsignal(signal.SIGINT) == before


def test_bad_pictures():
    """pictures of the wrong shape, type or number are named, and nothing of them is kept"""
    good = np.zeros((16, 16, 3))
    for value, text in ((np.zeros((16, 15, 3)), "shape (16, 15, 3), expected [16, 16, 3]"), (np.zeros((16, 16)), "shape"),
                        (np.zeros((16, 16, 3), int), "floating-point"), ([[0.]], "not list"), (None, "0 pictures"),
                        ({"moment2": good}, "no plane color"), (np.zeros((16, 16, 3), object), "floating-point")):
        result, f, _ = run(sigmas=[[.1]], host=lambda *_: [value])
        assert result.outcome == "failed" and text in str(result.exception), result.exception
        assert f.blocks[0].spp == 0 and not f.sums["color"].any()
    result, f, _ = run(host=lambda rects, *_: [good.astype(np.float32)] * (len(rects) - 1))
    assert "3 pictures for 4 rectangles" in str(result.exception) and [b.spp for b in f.blocks] == [16, 16, 16, 0]
    five = lambda rects, *_: [good.astype(np.float32)] * (len(rects) + 1)  # noqa: E731
    for host, text, spp in ((five, "5 pictures for 4 rectangles", 0), (lambda *a: iter(five(*a)), "more than 4 pictures for 4 rectangles", 16)):
        result, f, _ = run(host=host)
        assert result.outcome == "failed" and text in str(result.exception) and [b.spp for b in f.blocks] == [spp] * 4, result


def test_strides():
    """arrays of any stride and type are read as they lie: RGBA, rows from below, half floats, cut from larger ones"""
    rng = np.random.default_rng(2)
    rgb = rng.random((40, 50, 3)).astype(np.float32)
    half = (rgb + .01 * rng.standard_normal(rgb.shape)).astype(np.float32)
    rgba = np.dstack([rgb, np.ones((40, 50, 1), np.float32)])

    def ask(color, other):
        with lull.load("halfbuf") as c:
            f = lull.HostFrame(c, 50, 40, ["color", "half"], layout=[lull.Rect(0, 0, 50, 40)])
            f.blocks[0].spp, f.blocks[0].half_spp = 64, 32
            planes = {name: p if isinstance(p, lull.Plane) else lull.Plane(p) for name, p in (("color", color), ("half", other))}
            return f.evaluate([0], planes)[0].error
    plain = ask(rgb, half)
    assert plain > 0
    flipped = np.ascontiguousarray(half[::-1])[::-1]
    wide = np.zeros((40, 100, 6), np.float64)
    wide[:, ::2, ::2] = rgb
    assert not flipped.flags.c_contiguous and flipped.strides[0] < 0
    assert ask(rgba, flipped) == plain and ask(wide[:, ::2, ::2], half.astype(float)) == plain
    assert ask(np.asfortranarray(rgb), half) == plain
    halves = ask(rgb.astype(np.float16), half.astype(np.float16))
    assert abs(halves / plain - 1) < .05
    sums = ask(lull.Plane(64 * rgb.astype(float), "spp"), lull.Plane(32 * half.astype(float), "half_spp"))
    assert abs(sums / plain - 1) < 1e-6


def test_own_film():
    """a renderer that keeps its own film is driven by HostFrame: no array is copied, other blocks than a grid's are fine"""
    color, half = np.zeros((40, 50, 3), np.float32), np.zeros((40, 50, 3), np.float32)
    f = lull.HostFrame(lull.load("halfbuf", threshold=.02), 50, 40, ["color", "half"], spp_max=4096, check_step=16,
                       layout=[lull.Rect(0, 0, 20, 40), lull.Rect(20, 0, 50, 40)], spp_min=1)
    rng, planes = np.random.default_rng(7), {"color": lull.Plane(color, "spp"), "half": lull.Plane(half, "half_spp")}
    while f.active:
        for b in (f.blocks[i] for i in f.active):
            at = np.s_[b.y0:b.y1, b.x0:b.x1]
            for n in range(b.spp, b.next_spp):
                sample = .4 + (.01 if b.x0 else .3) * rng.standard_normal((*color[at].shape[:2], 1))
                color[at] += sample
                half[at] += sample * (n % 2)
            b.spp, b.half_spp = b.next_spp, b.next_spp // 2
        f.check(planes)
    assert [b.reason for b in f.blocks] == ["criterion"] * 2 and f.blocks[0].spp > f.blocks[1].spp, [b.spp for b in f.blocks]
    raises(ValueError, "give the planes", f.check)


def test_bad_planes():
    """planes that the ABI cannot describe are refused in Python"""
    good = np.zeros((8, 8, 3), np.float32)
    odd = np.zeros(8 * 8 * 3 * 4 + 1, np.uint8)[1:].view(np.float32).reshape(8, 8, 3)
    for value, kind, text in (([1.], TypeError, "numpy array"), (good.astype(int), TypeError, "float32"),
                              (good.astype(">f4"), TypeError, "byte order"), (good[0, 0], ValueError, "shape"),
                              (odd, ValueError, "aligned")):
        raises(kind, text, lull.Plane, value)
    raises(ValueError, "normaliser", lull.Plane, good, "mean")
    raises(ValueError, "scale", lull.Plane, good, "one", 0.)
    f = lull.HostFrame(lull.load("halfbuf"), 8, 8, ["color", "half"])
    for half in (good[:4], good[..., 0]):
        raises(ValueError, "expected [8, 8, 3]", f.check, {"color": lull.Plane(good), "half": lull.Plane(half)})
    raises(ValueError, "color", f.check, {"half": lull.Plane(good)})
    raises(lull.LullError, "HALF", f.evaluate, [0], {"color": lull.Plane(good)})


def test_bad_frames():
    """sizes, crops and limits that make no sense are named"""
    c, nan, inf = lull.load("halfbuf"), float("nan"), float("inf")
    for width, height, text in ((0, 8, "width 0"), (8, -1, "height -1"), (10 ** 9, 10 ** 6, "from 1 to 32768"),
                                (30000, 30000, "2^28 pixels")):
        raises(ValueError, text, lull.Frame, c, width, height)
    raises(ValueError, "2^20 blocks", lull.Frame, c, 16384, 16384, block=1)
    for name, values in (("exposure", (nan, inf, 0, -1)), ("gamma", (nan, 0)), ("sample_clamp", (nan, -1)),
                         ("block", (0, 5000)), ("time_budget_s", (nan, inf, -1)), ("spp_max", (0, 1 << 31)),
                         ("spp_min", (0,)), ("seed", (-1, 1 << 64))):
        for value in values:
            raises(ValueError, f"{name} {value}: expected", lull.Frame, c, 8, 8, **{name: value})
    for name, value in (("exposure", "1 stop"), ("block", 8.), ("spp_max", 100.), ("spp_min", nan), ("time_budget_s", None),
                        ("seed", "a"), ("crop", (0, 0, 8, 8.5))):
        raises(TypeError, name, lull.Frame, c, 8, 8, **{name: value})
    raises(TypeError, "width 8.0: expected a whole number", lull.Frame, c, 8., 8)
    raises(ValueError, "one number or (width, height)", lull.Frame, c, 8, 8, block=(8, 8, 8))
    assert lull.Frame(c, np.int64(8), np.int32(8), block=np.uint8(8)).blocks
    for name, value in (("max_check_overhead", nan), ("max_check_overhead", 2), ("max_seam", nan), ("max_seam", inf)):
        raises(ValueError, f"{name} {value}: expected", lull.Frame, c, 8, 8, **{name: value})
    for crop in ((3, 3, 3, 9), (0, 0, 0, 0)):
        raises(ValueError, "it is empty", lull.Frame, c, 8, 8, crop=crop)
    for crop in ((-1, 0, 4, 4), (0, 0, 9, 4), (5, 0, 2, 4)):
        raises(lull.LullError, "it must lie inside 8x8 pixels and not be empty", lull.Frame, c, 8, 8, crop=crop)
    raises(lull.LullError, "spp_min 10, spp_max 5", lull.Frame, c, 8, 8, spp_min=10, spp_max=5)
    raises(ValueError, "supplies", lull.Frame, c, 8, 8, supplies=["colour"])
    raises(ValueError, "wave", lull.Frame, c, 8, 8, wave=0)


def test_not_finite():
    """pixels that are not finite leave their samples out; such a block is not called converged"""
    noise = Noise([[.1]])

    def host(rects, first, count, half):
        for sample in noise(rects, first, count, half):
            if first == 16:
                sample[3, 5, 1] = np.nan
            if first == 32:
                sample[7, 7] = np.inf
            yield sample
    _, f, _ = run(host=host, sigmas=[[.1]])
    b = f.blocks[0]
    assert b.reason == "dropped" and b.dropped == 32 and f.spp()[3, 5] == b.spp - 16 and f.spp()[0, 0] == b.spp
    kept = [s for s in range(b.spp) if not 16 <= s < 32]
    assert abs(f.mean()[3, 5] - np.mean([noise.sample(b.rect, s)[3, 5] for s in kept], 0)).max() < 1e-12


def test_put_and_weights_not_finite():
    """a host's own means that are not finite are no samples until they are put again, and no weight spoils a pixel for good"""
    f = lull.Frame(lull.load("observer"), 16, 16, block=16, supplies=["albedo"])
    b, mean = f.blocks[0], np.random.default_rng(7).uniform(.1, .9, (16, 16, 3))
    holes, half = mean.copy(), 1.001 * mean
    holes[3, 5, 1], holes[7, 7], half[9, 2, 0] = np.nan, np.inf, -np.inf
    wrong = np.zeros((16, 16), bool)
    wrong[[3, 7, 9], [5, 7, 2]] = True
    for spp in (16, 32):
        f.put(b, {"color": holes, "albedo": holes}, spp, half, spp // 2)
        assert (f.spp() == np.where(wrong, 0, spp)).all() and b.dropped == f.totals.dropped == 3 * spp
        assert np.allclose(f.mean(), np.where(wrong[..., None], 0, mean)) and all(np.isfinite(s).all() for s in f.sums.values())
        f.check()
        assert b.reason != "criterion" and b.error < 1, (b.reason, b.error)
    f.put(b, {"color": mean, "albedo": mean}, 48, mean, 24)
    assert (f.spp() == 48).all() and np.allclose(f.mean(), mean, rtol=1e-12) and b.dropped == f.totals.dropped == 0
    assert (f.waves == np.where(wrong, 0, 3)).all(), f.waves  # what came after a hole cannot be told from what is in it
    was, other = copy.deepcopy(f.arrays()), lull.Frame(lull.load("observer"), 16, 16, block=16).blocks[0]
    for error, text, call in ((ValueError, "another frame's", lambda: f.add(other, {"color": mean, "albedo": mean}, 16, True)),
                              (ValueError, "another frame's", lambda: f.put(other, {"color": mean, "albedo": mean}, 16, mean, 8)),
                              (TypeError, "reason 'time'", lambda: f.stop("time")),
                              (lull.LullError, "reason 99", lambda: f.stop(99)),
                              (ValueError, "count -1", lambda: f.add(b, {"color": mean, "albedo": mean}, -1, True)),
                              (TypeError, "count 1.5", lambda: f.add(b, {"color": mean, "albedo": mean}, 1.5, True)),
                              (ValueError, "count -1", lambda: f.put(b, {"color": mean, "albedo": mean}, -1, mean, 0)),
                              (TypeError, "count 8.0", lambda: f.put(b, {"color": mean, "albedo": mean}, 64, mean, 8.)),
                              (ValueError, "half_spp 9", lambda: f.put(b, {"color": mean, "albedo": mean}, 8, mean, 9))):
        raises(error, text, call)
        assert b.spp == 48 and all((now == was[name]).all() for name, now in f.arrays().items()), text
    raises(TypeError, "threads 'all'", f.forecast, "all")
    raises(TypeError, "threads 'all'", f.quote, "all")
    for value in (np.nan, np.inf):
        f, weight = lull.Frame(lull.load("observer"), 16, 16, block=16, weighted=True), np.ones((16, 16))
        f.add(f.blocks[0], {"color": mean, "weight": weight}, 16, True)
        weight[3, 5] = value
        f.add(f.blocks[0], {"color": mean, "weight": weight}, 16, False)
        assert np.allclose(f.mean(), mean, rtol=1e-12, atol=0) and f.blocks[0].dropped == 16 and f.spp()[3, 5] == 16


def test_state():
    """a criterion's saved history goes on as if there had been no break; broken bytes are refused"""
    def frames():
        return lull.Frame(lull.load("ggn", threads=1, visible=.7, passes=1), 32, 32, block=16, spp_max=256)
    f = frames()
    d = lull.Driver(f, Noise(SIGMAS))
    while d.totals.checks < 12:
        assert d.step() is None
    saved, other = f.save_state(), frames()
    other.load_state(saved)
    assert len(saved) > 1000 and other.save_state() == saved and [b.spp for b in other.blocks] == [b.spp for b in f.blocks]
    untouched = frames()
    for broken in (saved[:-1], saved + b"x", b"", b"x" * len(saved)):
        raises(lull.LullError, "here.npz: ", untouched.load_state, broken, "here.npz")
    assert [b.spp for b in untouched.blocks] == [0] * 4


def test_resume():
    """an interrupted run goes on from a checkpoint to the same picture; a finished one can be given more samples"""
    def start(spp_max=400):
        f = lull.Frame(lull.load("ggn", threads=1, visible=.7, passes=1), 32, 32, block=16, spp_max=spp_max)
        return lull.Driver(f, Noise(SIGMAS))
    whole, first, second = start(), start(), start()
    whole.run()
    first.after_call = lambda d: d.totals.samples > 256 * 300 and d.interrupt()
    first.suspend = lambda d: checkpoint.save(tmp("run.npz"), d)
    assert first.run().outcome == "interrupt" and first.frame.blocks[3].checks > 1
    checkpoint.load(tmp("run.npz"), second)
    assert second.run().outcome == "done" and (second.frame.mean() == whole.frame.mean()).all()
    assert [(b.spp, b.reason) for b in second.frame.blocks] == [(b.spp, b.reason) for b in whole.frame.blocks]
    checkpoint.save(tmp("short.npz"), whole)
    more = start(800)
    checkpoint.load(tmp("short.npz"), more)
    more.run()
    assert max(b.spp for b in more.frame.blocks) > 400
    other = lull.Driver(lull.Frame(lull.load("ggn", threads=1, visible=.9, passes=1), 32, 16, block=16), None)
    raises(lull.LullError, "run.npz: made with picture=32x32, but this render has picture=32x16", checkpoint.load, tmp("run.npz"), other)
    np.save(tmp("array.npy"), np.zeros(3))
    saved, npy = (Path(tmp(name)).read_bytes() for name in ("run.npz", "array.npy"))
    for at, damage in ((0, b"junk"), (saved.rindex(b"PK\1\2") + 6, b"\x82"), (saved.rindex(b"PK\1\2") + 10, b"\x63"), (0, npy)):  # a newer zip, packed otherwise
        Path(tmp("junk.npz")).write_bytes(damage if at == 0 else saved[:at] + damage + saved[at + len(damage):])
        raises(ValueError, "junk.npz: not a checkpoint", checkpoint.load, tmp("junk.npz"), start())


def test_identity():
    """a checkpoint is refused by name wherever the picture or the stops would be others, whatever the host's words for it"""
    def driver(identity=None, criterion=None, **frame):
        f = lull.Frame(criterion or lull.load("halfbuf", threshold=.02), 32, 32, **{"block": 16, **frame})
        return lull.Driver(f, None, identity={"scene": "a.blend", "camera": "left"} if identity is None else identity)
    checkpoint.save(tmp("a.npz"), driver())
    checkpoint.load(tmp("a.npz"), driver(spp_max=20000, time_budget_s=9.))  # limits may change
    own_plugin = tmp("halfbuf.so")
    Path(own_plugin).write_bytes(Path(f"{LIB}/halfbuf.so").read_bytes() + b"0")  # a plugin built anew under the same version
    for name, theirs, own, other in (
            ("scene", "a.blend", "b.blend", {"identity": {"scene": "b.blend", "camera": "left"}}),
            ("camera", "left", None, {"identity": {"scene": "a.blend"}}),
            ("view", None, "x", {"identity": {"scene": "a.blend", "camera": "left", "view": "x"}}),
            ("exposure", "1.0", "2.0", {"exposure": 2}), ("transfer", "srgb", "linear", {"transfer": "linear"}),
            ("gamma", "2.2", "2.0", {"gamma": 2.}), ("sample-clamp", "0.0", "3.0", {"sample_clamp": 3}),
            ("independent", "False", "True", {"independent": True}), ("shared", "False", "True", {"shared": True}),
            ("seed", "0", "1", {"seed": 1}), ("spp-min", "16", "17", {"spp_min": 17}), ("wave", "16", "8", {"wave": 8, "max_seam": 0.}),
            ("block", "16x16", "8x16", {"block": (8, 16)}), ("max-seam", "0.0", "2.0", {"max_seam": 2}),
            ("uniform", "False", "True", {"uniform": True}), ("check-step", "32", "1", {"whole_waves": False}),
            ("display", "none", "crc ", {"display": lambda x: x.clip(0, 1)}),
            ("mask", "none", "crc ", {"mask": np.ones((32, 32))}),
            ("crop", "0,0,32,32", "0,0,32,9", {"crop": (0, 0, 32, 9)}),
            ("criterion", "halfbuf 1.0 threshold=0.02", "halfbuf 1.0 threshold=0.03",
             {"criterion": lull.load("halfbuf", threshold=.03)}),
            ("criterion-files", "crc ", "crc ", {"criterion": lull.load(own_plugin, threshold=.02)})):
        d = driver(**other)
        before = {**d.identity}
        said = f"made {'without' if theirs is None else 'with'} {name}" + (f"={theirs}" if theirs else "")
        raises(lull.LullError, said, checkpoint.load, tmp("a.npz"), d)
        raises(lull.LullError, f"this render has {'no ' * (own is None)}{name}" + (f"={own}" if own else ""), checkpoint.load,
               tmp("a.npz"), d)
        assert d.identity == before and d.frame.blocks[0].spp == 0
    curves = [lull.Frame(lull.load("halfbuf"), 8, 8, display=lambda x, k=k: (k * x).clip(0, 1)).identity()
              for k in (1, 1, 1.01)]
    assert curves[0] == curves[1] != curves[2]
    raises(TypeError, "text for text", driver, identity={"frame": 3})
    raises(ValueError, "'seed' is the package's own", driver, identity={"seed": "3"})
    np.savez(tmp("theirs.npz"), states=np.zeros(3), samples=np.zeros(3))
    Path(tmp("text.npz")).write_text("my notes")
    kinds = [checkpoint.is_one(tmp(name)) for name in ("a.npz", "theirs.npz", "text.npz", "no-such.npz")]
    assert kinds == [True, False, False, False], kinds


def test_display():
    """a host's own view decides: what it shows as white needs no samples"""
    _, seen, _ = run(sigmas=[[.5]])
    _, hidden, _ = run(sigmas=[[.5]], display=lambda x: np.ones_like(x))
    assert hidden.blocks[0].spp < seen.blocks[0].spp


def test_mask():
    """painted blocks get more samples, the others the same as without a mask"""
    mask = np.zeros((32, 32))
    mask[2, 17] = 1
    plain, painted = run(sigmas=[[.2, .2], [.2, .2]])[1], run(sigmas=[[.2, .2], [.2, .2]], mask=mask)[1]
    spp = [b.spp for b in painted.blocks]
    assert spp[1] > 3 * plain.blocks[1].spp and [spp[i] for i in (0, 2, 3)] == [plain.blocks[i].spp for i in (0, 2, 3)]
    raises(lull.LullError, "no quality parameter", run, "fixed", parameters={}, mask=mask)
    raises(lull.LullError, "'visible', which has no value", run, "ggn", parameters={}, mask=mask)
    raises(lull.LullError, "a mask has no effect", run, mask=mask, uniform=True)
    saved, other = (lull.Driver(lull.Frame(lull.load("halfbuf"), 32, 32, block=16, mask=m), None) for m in (mask, mask * 0))
    checkpoint.save(tmp("masked.npz"), saved)
    raises(lull.LullError, "made with mask=crc ", checkpoint.load, tmp("masked.npz"), other)
    raises(ValueError, "shape", run, mask=mask[:3])
    raises(ValueError, "[0, 1]", run, mask=mask + 1)


def test_exr():
    """EXR files are read by others as written; uncompressed ones and those by ZIP, of floats and halves, are read"""
    rng = np.random.default_rng(3)
    channels = {name: rng.random((37, 23)).astype(np.float32) for name in ("R", "G", "B", "lull.spp.V")}
    channels["lull.spp.V"][:] = 64
    exr.write(tmp("a.exr"), channels, (100, 90), (5, 6), {"lull:block": "16x16", "lull:samples": 3.})
    exr.write(tmp("n.exr"), channels, (23, 37), attributes={"lull:scene": os.fsdecode(b"caf\xe9.blend")})  # a name that is not UTF-8
    assert b"caf\xe9.blend" in Path(tmp("n.exr")).read_bytes()
    info = subprocess.run(["oiiotool", "--info", "-v", tmp("a.exr")], text=True, capture_output=True, check=True).stdout
    assert "100 x 90" in info and "pixel data origin: x=5, y=6" in info and "lull:block" in info and "lull.spp" in info, info
    subprocess.run(["oiiotool", tmp("a.exr"), "--compression", "none", "-d", "float", "-o", tmp("b.exr")], check=True)
    stored, origin = exr.read(tmp("b.exr"))
    assert origin == (5, 6) and all((stored[name] == plane).all() for name, plane in channels.items())
    subprocess.run(["oiiotool", tmp("b.exr"), "-d", "half", "-o", tmp("h.exr")], check=True)
    assert (exr.read(tmp("h.exr"))[0]["G"] == channels["G"].astype(np.float16)).all()
    assert all((exr.read(tmp("a.exr"))[0][name] == plane).all() for name, plane in channels.items())
    for by in ("zip", "zips"):
        subprocess.run(["oiiotool", tmp("h.exr"), "--compression", by, "-d", "half", "-o", tmp("z.exr")], check=True)
        stored, origin = exr.read(tmp("z.exr"))
        assert origin == (5, 6) and all((stored[n] == plane.astype(np.float16)).all() for n, plane in channels.items())
    subprocess.run(["oiiotool", tmp("a.exr"), "--compression", "piz", "-o", tmp("p.exr")], check=True)
    raises(ValueError, "another compression", exr.read, tmp("p.exr"))
    for whole in ("b.exr", "z.exr"):
        data = Path(tmp(whole)).read_bytes()
        for cut in (0, 3, 9, 100, 700, len(data) - 1):
            Path(tmp("c.exr")).write_bytes(data[:cut])
            raises(ValueError, "c.exr", exr.read, tmp("c.exr"))


def test_outputs():
    """picture, preview and report of a run; nothing is half written"""
    _, f, d = run(sigmas=[[.01, .5]], crop=lull.Rect(4, 0, 30, 16))
    outputs.write_exr(tmp("o.exr"), d, "scene")
    info = subprocess.run(["oiiotool", "--info", "-v", tmp("o.exr")], text=True, capture_output=True, check=True).stdout
    assert "26 x   16" in info and "lull.reason.V" in info and "halfbuf 1.0 threshold=0.02" in info, info
    outputs.write_preview(tmp("o.png"), d)
    shown = files.srgb(f.cropped(f.mean())).mean(axis=-1)
    assert shown.shape == (16, 26) and abs(grey_levels(tmp("o.png")) - shown).max() < 1e-4
    assert files.srgb(np.array([np.nan, -1, -np.inf, 0, .18, 1, 7, np.inf])).tolist() == [0, 0, 0, 0, 118, 255, 255, 255]
    outputs.write_report(tmp("o.json"), d)
    raises(OSError, "no-folder", outputs.write_report, tmp("no-folder/o.json"), d)
    f.close()
    f.criterion.close()
    outputs.write_report(tmp("o.json"), d)  # tells of a criterion that was closed too
    assert json.loads(Path(tmp("o.json")).read_text())["criterion"]["params"]["threshold"] == "0.02"


def test_names_in_locale_c():
    """names that are not ASCII are UTF-8 where the locale has none: a renderer's own Python in the locale C"""
    script = """if True:
        import sys
        import lull
        from lull import checkpoint, outputs
        from renderer import Noise
        assert sys.getfilesystemencoding() == "ascii"
        frame = lull.Frame(lull.load("halfbuf"), width=32, height=16, block=16, spp_max=64)
        d = lull.Driver(frame, Noise([[.01, .5]]))
        name, scene = sys.argv[1] + "/b\\u00fcro", "zimmer-\\u00fc.blend"  # bytes that ASCII has not, and a name from Unicode
        lull.files.check_outputs([lull.files.Output("-o", name + ".exr", (".exr",))], [scene])
        d.run()
        written, failed = lull.files.write_each([
            (name + ".exr", lambda p: outputs.write_exr(p, d, scene)), (name + ".json", lambda p: outputs.write_report(p, d, scene, scene)),
            (name + ".html", lambda p: outputs.write_page(p, d, scene)), (name + ".csv", lambda p: outputs.write_stop_map(p, frame, scene)),
            (name + ".npz", lambda p: checkpoint.save(p, d))])
        assert len(written) == 5 and not failed, failed
        assert outputs.is_ours(name + ".exr") and checkpoint.is_one(name + ".npz")
    """
    folder = tmp("b\u00fc")
    os.mkdir(folder)
    env = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run([sys.executable, "-c", script, folder], env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert sorted(os.listdir(folder)) == [f"b\u00fcro.{e}" for e in ("csv", "exr", "html", "json", "npz")]
    assert json.loads(Path(folder, "b\u00fcro.json").read_text())["scene"] == "zimmer-\u00fc.blend"


def pictures_of(page):
    """The PNG files of a page of lull-report, written to the temporary folder, by layer."""
    found = re.findall(r'data-layer="([^"]*)" src="data:image/png;base64,([^"]*)"', Path(page).read_text())
    for name, data in found:
        Path(tmp(f"page-{name}.png")).write_bytes(base64.b64decode(data))
    return {name: tmp(f"page-{name}.png") for name, _ in found}


def test_every_setting():
    """every setting of a frame and its driver takes what it is for, and names itself in one line otherwise"""
    wrong = [np.nan, np.inf, -np.inf, -1, 1 << 64, -1 << 63, "x", " 8", b"x", {"a": 1}, np.int8(-3), np.array([1, 2]), object()]
    numbers = ("width", "height", "block", "spp_min", "spp_max", "time_budget_s", "max_check_overhead", "max_seam", "check_step",
               "seed", "exposure", "gamma", "sample_clamp")
    others = ("crop", "layout", "uniform", "mask", "transfer", "independent", "shared", "deterministic")
    c = lull.load("halfbuf")
    for name in (*numbers, *others, "wave"):
        for value in wrong:
            if name in ("exposure", "gamma", "sample_clamp") and type(value) is int and value > 0:
                continue  # large, and a number
            settings = {"width": 32, "height": 32, "spp_max": 64, name: value}
            size = settings.pop("width"), settings.pop("height")
            for kind, planes in ((lull.Frame, ()), *(((lull.HostFrame, (["color", "half"],)),) if name != "wave" else ())):
                if kind is lull.Frame and name == "check_step":
                    continue  # it has one of its own
                try:
                    kind(c, *size, *planes, **settings)
                    raise AssertionError(f"{name} {value!r} was taken")
                except (ValueError, TypeError) as error:
                    assert name in str(error) and "\n" not in str(error), (name, value, error)
    frame = lull.Frame(c, 32, 32, spp_max=64)
    for value in wrong:
        raises((ValueError, TypeError), "threads", lull.Driver, frame, None, threads=value)
    raises(lull.LullError, "blocks 0 (0,0,9,9) and 1 (8,8,16,16) overlap", lull.Frame, c, 32, 32,
           layout=[lull.Rect(0, 0, 9, 9), (8, 8, 16, 16)])


def test_views():
    """lull-report shows an EXR as its frame does, by exposure, transfer or any mapping, and says the quality parameter"""
    views = ({}, {"exposure": .25}, {"transfer": "linear"}, {"transfer": "gamma", "gamma": 1.8, "exposure": 2.},
             {"display": lambda v: np.clip(v / (v + .2), 0, 1)}, {"display": lambda v: .05 + .9 * np.clip(v, 0, 1)})
    shown = []
    for settings in views:
        f = lull.Frame(lull.load("observer"), 32, 32, block=16, spp_max=32, **settings)
        d = lull.Driver(f, Noise(SIGMAS))
        d.run()
        f.sums["color"][:, :, :] = 32 * np.exp2(np.linspace(-18, 10, 32 * 32 * 3)).reshape(32, 32, 3)  # and beyond the ramp
        outputs.write_exr(tmp("v.exr"), d, "scene")
        outputs.write_preview(tmp("v.png"), d)
        subprocess.run([f"{BUILD}/bin/lull-report", tmp("v.exr"), "-o", tmp("v.html")], check=True)
        page, own = grey_levels(pictures_of(tmp("v.html"))["picture"]), grey_levels(tmp("v.png"))
        assert abs(page - own).max() <= 1.001, (settings, np.argwhere(abs(page-own)>1.001)[:5], page[abs(page-own)>1.001][:5], own[abs(page-own)>1.001][:5])  # straight lines between 16 greys an octave: a code at most
        shown.append(own)
        report = re.search(r'"params":(\{[^}]*\})', Path(tmp("v.html")).read_text())
        assert json.loads(report[1])["visible"] == lull.load("observer").info.parameter("visible").default
    assert all(abs(a - shown[0]).max() > 20 for a in shown[1:])
    data = Path(tmp("v.exr")).read_bytes()  # the last one's ramp, damaged
    at = data.index(b"lull:view\0string\0") + len(b"lull:view\0string\0") + 4
    for damage in (b"-99", b"nan", b"-14 16 9 x", b"-14 0 "):
        Path(tmp("w.exr")).write_bytes(data[:at] + damage + data[at + len(damage):])
        done = subprocess.run([f"{BUILD}/bin/lull-report", tmp("w.exr"), "-o", tmp("w.html")], text=True, capture_output=True)
        assert done.returncode == 2 and "w.exr: its lull:view makes no sense" in done.stderr and not os.path.exists(tmp("w.html"))


def test_modules_by_name():
    """import lull is enough for lull.outputs and every other module, as the pages write it; others are no attribute of it"""
    code = ("import lull; lull.outputs.write_exr, lull.quote.table, lull.blender, lull.checkpoint.save, lull.exr.read\n"
            "try: lull.nothing\nexcept AttributeError as e: print(e)")
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True)
    assert done.stdout == "module 'lull' has no attribute 'nothing'\n", done


def test_numbers_of_a_command_line():
    """numbers on the Blender host's command line have no blanks and no underscores, as those of the programs"""
    from lull.blender import cli
    assert cli.parser().parse_args(["--spp-max", "8", "--time-budget", "2.5e1", "--block=+16"]).time_budget == 25
    for option, value in (("--spp-max", " 8"), ("--spp-min", "8 "), ("--block", "1_6"), ("--time-budget", "\t2"), ("--spp-max", "8.0"),
                          ("--checkpoint-every", "nan"), ("--time-budget", "1_0"), ("--checkpoint-every", " 60")):
        said = io.StringIO()
        with contextlib.redirect_stderr(said):
            try:
                cli.parser().parse_args([f"{option}={value}"])
                raise AssertionError(f"{option}={value!r} was taken")
            except SystemExit as end:
                assert end.code == 2 and option in said.getvalue() and said.getvalue().count("\n") == 1, said.getvalue()


def test_progress():
    """the progress line has the path tracer's form"""
    f = lull.Frame(lull.load("halfbuf", threshold=.001), 32, 32, block=16, spp_max=512)
    d = lull.Driver(f, Noise(SIGMAS))
    assert "ETA unknown" in outputs.progress_text(d)
    for _ in range(12):
        d.step()
    form = r"(>=)?\s*\d+%  \d+ of \d+ blocks active  spp \d+\.\.\d+  \d+\.\d\d Mpaths/s  ETA (at most )?(\d+:\d\d|unknown)"
    assert re.fullmatch(form, outputs.progress_text(d)), outputs.progress_text(d)
    d.percent_shown = 99.
    assert outputs.progress_text(d).startswith(" 99%")  # it never falls


def test_two_frames():
    """two frames on one criterion are each judged by its own view, in whatever order; a frame that was dropped says so"""
    def frame(c, exposure):
        return lull.Frame(c, 32, 32, block=16, spp_max=4000, exposure=exposure)
    alone = []
    for exposure in (1, .1):
        f = frame(lull.load("halfbuf", threshold=.02), exposure)
        lull.Driver(f, Noise(SIGMAS)).run()
        alone.append([b.spp for b in f.blocks])
    c = lull.load("halfbuf", threshold=.02)
    frames = [frame(c, 1), frame(c, .1)]
    drivers = [lull.Driver(f, Noise(SIGMAS)) for f in frames]
    while any([d.step() is None for d in drivers]):
        pass
    assert [[b.spp for b in f.blocks] for f in frames] == alone and alone[0] != alone[1], (alone, frames)
    frames[0].close()
    assert frames[1].evaluate([0])[0].error > 0  # closing one leaves the other
    raises(lull.LullError, "make a new Frame", frames[0].check)
    raises(lull.LullError, "make a new Frame", frames[0].evaluate, [0])
    assert frame(c, 1).judge is c  # which is free again


def test_no_numpy():
    """without numpy there is one line that says what to do"""
    os.makedirs(tmp("bare/numpy"))
    Path(tmp("bare/numpy/__init__.py")).write_text("raise ImportError('none here')\n")
    environment = {**os.environ, "PYTHONPATH": f"{tmp('bare')}:plugin-api/python"}
    program = subprocess.run([sys.executable, "-m", "lull.blender", "x.blend"], env=environment, text=True, capture_output=True)
    assert program.returncode == 2 and program.stdout == "", program
    refuses_pip = sys.prefix == sys.base_prefix and os.path.exists(f"{sysconfig.get_path('stdlib')}/EXTERNALLY-MANAGED")  # Debian's own
    what = "sudo apt install python3-numpy" if refuses_pip else "python3 -m pip install numpy"
    assert re.fullmatch(rf"lull needs numpy, [^:]*: {re.escape(what)}\n", program.stderr), program.stderr
    for module in ("lull", "lull.mitsuba", "lull.luxcore"):
        script = subprocess.run([sys.executable, "-c", f"import {module}"], env=environment, text=True, capture_output=True)
        assert script.stderr.splitlines()[-1].startswith("ImportError: lull needs numpy"), script.stderr
        assert "During handling" not in script.stderr, script.stderr


def test_copies():
    """an instance cannot be copied, and a call while another one is under way is refused"""
    c = lull.load("halfbuf")
    for make in (copy.copy, copy.deepcopy, pickle.dumps):
        raises(TypeError, "with_parameters()", make, c)
    raises(TypeError, "with_parameters()", copy.deepcopy, lull.Frame(c, 8, 8))
    other = c.with_parameters(threshold=.5)
    c.close()
    assert other.parameters["threshold"] == "0.5" and lull.Frame(other, 8, 8).blocks

    seen = []

    def log(_level, _text):  # while observer is shown a frame without halves
        for call in (told.close, lambda: lull.Frame(told, 8, 8)):
            raises(lull.LullError, "another call is under way", call)
            seen.append(call)
    told = lull.load("observer", log=log)
    lull.HostFrame(told, 32, 32, ["color"])
    assert len(seen) == 2
    told.close()


def test_types():
    """half floats and single ones are summed in double: nothing overflows, nothing is rounded on the way"""
    def host(dtype, value):
        return lambda rects, *_: [np.full((16, 16, 3), value, dtype) for _ in rects]
    for dtype, value in ((np.float16, 60000.), (np.float32, 3e38), (np.float64, 1e300)):
        _, f, _ = run("fixed", sigmas=[[0.]], parameters={"spp": 64}, host=host(dtype, value))
        assert f.blocks[0].spp == 64 and f.blocks[0].dropped == 0 and (f.mean() == float(dtype(value))).all(), dtype
        f.put(f.blocks[0], np.full((16, 16, 3), value, dtype), 64, np.full((16, 16, 3), value, dtype), 32)
        assert (f.mean() == float(dtype(value))).all(), dtype
    holes = np.ma.masked_array(np.ones((16, 16, 3)), np.zeros((16, 16, 3), bool))
    result, f, _ = run(host=lambda rects, *_: [holes], sigmas=[[.1]])
    assert "fill its holes first" in str(result.exception) and not f.sums["color"].any(), result
    raises(TypeError, "fill its holes first", lull.Plane, holes)
    raises(TypeError, "fill its holes first", run, mask=np.ma.masked_array(np.zeros((32, 32))))


def test_weights():
    """samples that come with weights are averaged by them, whole, by halves and as the criterion sees them"""
    rng = np.random.default_rng(6)
    seen = []

    def host(rects, first, count, half):
        for r in rects:
            w = rng.uniform(.1, 2, (r.height, r.width))
            w[2, 3] = 0  # nothing has met this pixel
            v = rng.uniform(0, 1, (r.height, r.width, 3))
            seen.append((count, half, w, v))
            yield {"color": w[..., None] * v, "weight": w, "alpha": w * v[..., 0]}
    _, f, d = run(sigmas=[[0.]], host=host, weighted=True, layers=["alpha"], spp_max=64)
    for name, chosen in (("color", seen), ("half", [s for s in seen if s[1]])):
        w, v = (np.array([s[0] * s[k] if k == 2 else s[k] for s in chosen]) for k in (2, 3))
        wanted = (w[..., None] * v).sum(0) / np.maximum(w.sum(0), 1e-30)[..., None]
        assert abs(f.mean(name) - wanted).max() < 1e-12
        assert abs(f.planes_now()[name].array - wanted).max() < 1e-12
        assert name == "half" or abs(f.mean("alpha") - wanted[..., 0]).max() < 1e-12
    checkpoint.save(tmp("w.npz"), d)
    other = lull.Frame(lull.load("halfbuf", threshold=.02), 16, 16, block=16, spp_max=64, weighted=True, layers=["alpha"])
    checkpoint.load(tmp("w.npz"), lull.Driver(other, host))
    assert (other.mean() == f.mean()).all() and (other.mean("alpha") == f.mean("alpha")).all()
    outputs.write_exr(tmp("w.exr"), d)
    info = subprocess.run(["oiiotool", "--info", "-v", tmp("w.exr")], text=True, capture_output=True, check=True).stdout
    assert re.search(r"channel list: .*\balpha\b", info), info
    raises(ValueError, "alpha", lull.Frame, lull.load("halfbuf"), 8, 8, layers=["alpha", "alpha"])
    for name in ("R", "color", "", "lull.spp"):
        raises(ValueError, "layer", lull.Frame, lull.load("halfbuf"), 8, 8, layers=[name])
    for name in ("a\0b", "é" * 128, "caf\udce9"):  # which would make an EXR that nobody can read
        raises(ValueError, "expected a name of 1 to 255 bytes", lull.Frame, lull.load("halfbuf"), 8, 8, layers=[name])
        raises(ValueError, "expected a name of 1 to 255 bytes", exr.write, tmp("name.exr"), {name: np.zeros((8, 8))}, (8, 8))
    result = run(host=lambda rects, *_: [np.zeros((16, 16, 3))], sigmas=[[0.]], weighted=True)[0]
    assert "no plane weight" in str(result.exception)


def test_quote():
    """what the quality parameter costs is told from the first checks: about what the render then takes, coarser less, and it changes nothing"""
    sigmas = [[.05, .2, .5, 1], [.3] * 4, [.1, .2, .3, .4]]
    size = {"criterion": "observer", "sigmas": sigmas, "parameters": {}, "spp_max": 4096}
    _, plain, _ = run(**size)
    f = lull.Frame(lull.load("observer"), 64, 48, block=16, spp_max=4096)
    d = lull.Driver(f, Noise(sigmas))
    while not quote.pilot_done(d):
        d.step()
    rows = quote.rows(d)
    assert [(r.parameter, r.value) for r in rows] == [("error", 8), ("error", 4), ("error", 2), ("visible", .35), ("visible", .05)]
    assert [r.chosen for r in rows] == [False, False, False, True, False]
    assert all(a.spp[1] <= b.spp[1] and a.time_s <= b.time_s for a, b in zip(rows, rows[1:])), rows
    assert rows[1].spp[1] < rows[2].spp[1] < rows[3].spp[1] / 3, rows
    assert d.run().outcome == "done" and [b.spp for b in f.blocks] == [b.spp for b in plain.blocks]
    taken = d.totals.samples / f.view.pixels
    assert .7 < rows[3].spp[1] / taken < 1.4, (rows[3], taken)
    assert quote.line(d).startswith("visible 0.35 takes about ") and "; error 2 would take about " in quote.line(d)
    f.close()
    f.criterion.close()
    assert len(quote.rows(d)) == 5  # of a render that is over, too
    own = quote.chosen(d)
    twice = own._replace(spp=tuple(2 * n for n in own.spp), time_s=own.time_s + 100)
    assert quote.pilots(24) == [0, 8, 16, 23] and quote.pilots(1) == [0] and quote.pilots(9) == [0, 8]
    told = quote.shot([(0, own), (2, twice), (4, own._replace(at_most=True))], 5)  # 1, 1.5, 2, 1.5 and 1 times as much
    times = [quote.time_text(5 * s) for s in (own.low[1], own.high[1])]
    wanted = f"at most {quote.time_text(5 * own.time_s + 200)} ({times[0]} to {times[1]}), {own.spp[1] * 1.4:,.0f} spp on average"
    assert told == f"5 frames, by 3 pilots: {wanted}", told
    assert quote.shot([(0, own), (2, own._replace(told=False))], 3) == "3 frames, by 2 pilots: not known, they have met too little"
    assert quote.shot([(0, own), (1, None)], 2) == "" == quote.shot([], 0)
    _, _, d = run("fixed", parameters={})
    assert quote.rows(d) == [] and quote.line(d) == "" and "no quality parameter" in quote.table(d)


def test_quote_says_what_it_does_not_know():
    """a quote has an interval, names what has not met its light, and gives no number where that is too much"""
    sigmas = [[.05, .2, .5, 1], [.3] * 4, [.1, .2, .3, .4]]

    class Rare(Noise):
        """One pixel in a hundred of the first `rare` blocks is struck once in a hundred samples."""
        def sample(self, r, index):
            plain, at = super().sample(r, index), r.y0 // 16 * 4 + r.x0 // 16
            struck = np.random.default_rng((r.x0, r.y0, index, 7)).random((16, 16, 1)) < 1e-4
            return plain + (struck * 500. if at < self.rare else 0.)

    def piloted(rare, **parameters):
        noise = Rare(sigmas)
        noise.rare = rare
        d = lull.Driver(lull.Frame(lull.load("observer", **parameters), 64, 48, block=16, spp_max=1 << 20), noise)
        while not quote.pilot_done(d, 48):
            d.step()
        return d
    d = piloted(0)
    own = quote.chosen(d)
    assert own.told and own.unmet == 0 and own.low[0] < own.spp[1] < own.high[0] and own.low[1] <= own.time_s <= own.high[1], own
    assert re.search(r"<- chosen", quote.table(d)) and quote.table(d).count(" to ") == 5 and "light" not in quote.table(d), quote.table(d)
    d = piloted(12)
    own = quote.chosen(d)
    assert not own.told and own.unmet > 6, own
    chosen, last = [t for t in quote.table(d).splitlines() if "<- chosen" in t][0], quote.table(d).splitlines()[-1]
    assert "not known: the pilot has met too little" in chosen and "/" not in chosen, chosen
    assert last == f"{own.unmet} of 12 blocks have not met their light yet: a longer pilot says more", last
    assert quote.line(d).startswith("visible 0.35 takes more than can be told yet: too little was met"), quote.line(d)


def test_quote_of_any_criterion():
    """parameters without a default, or of another type, take nothing from a quote; what is set has its row"""
    def rows(name, **parameters):
        d = lull.Driver(lull.Frame(lull.load(name, **parameters), 32, 32, block=16, spp_max=512), Noise([[.1] * 2] * 2))
        while not quote.pilot_done(d, 48):
            d.step()
        return [(r.parameter, r.value, r.name) if r.parameter else r.name for r in quote.rows(d)]
    shares = [("visible", .25, "normal"), ("visible", .05, "strict")]
    coarser = [("error", 8, "rough"), ("error", 4, "draft"), ("error", 2, "good")]
    assert rows("ggn") == ["as asked", ("visible", .5, "draft"), *shares]
    assert rows(f"{PLUGINS}/unset.so") == ["as asked", *coarser, *shares]
    assert rows(f"{PLUGINS}/unset.so", visible=.1) == [*coarser, shares[0], ("visible", .1, "as asked"), shares[1]]
    assert rows(f"{PLUGINS}/unset.so", threshold=3) == [("threshold", 12, "rough"), ("threshold", 6, "draft"), ("threshold", 3, "as asked")]
    assert rows(f"{PLUGINS}/unset.so:odd", visible="low", error="x", threshold=3) == [("threshold", 3, "as asked")]
    assert rows(f"{PLUGINS}/unset.so:odd", visible="low", error="x") == []


def test_display_server():
    """a viewer has the last picture, and nobody in its place changes nothing"""
    viewer = subprocess.Popen([sys.executable, "tests/cli/viewer.py", tmp("port"), tmp("seen.json")])
    while not os.path.exists(tmp("port")):
        assert viewer.poll() is None
        time.sleep(.02)
    address = "127.0.0.1:" + Path(tmp("port")).read_text()
    _, f, d = run(driver={"display_server": address})
    assert viewer.wait() == 0 and not d.display.close()
    seen = json.loads(Path(tmp("seen.json")).read_text())
    assert (seen["width"], seen["height"]) == (f.width, f.height)
    assert np.array_equal(np.reshape(seen["pixels"][0], (f.height, f.width)), f.mean()[..., 0].astype(np.float32))
    assert np.array_equal(np.reshape(seen["pixels"][3], (f.height, f.width)), f.spp())
    _, alone, _ = run(driver={"display_server": "localhost:1"})
    assert np.array_equal(alone.mean(), f.mean())
    raises(lull.LullError, "nosuch.invalid: no such host", lambda: run(driver={"display_server": "nosuch.invalid"}))


def painted(criterion="fixed", parameters=None, **settings):
    """A finished frame with the planes of a denoiser: albedo x / width, normal .25, noise around .5."""
    rng = np.random.default_rng(7)

    def render(rects, first, count, half):
        for r in rects:
            shape = (r.height, r.width, 3)
            albedo = np.broadcast_to(np.arange(r.x0, r.x1)[:, None] / 32, shape).astype(float)
            yield {"color": .5 + .1 * rng.standard_normal(shape), "albedo": albedo, "normal": np.full(shape, .25)}
    parameters = {"spp": 64} if criterion == "fixed" else parameters or {}
    f = lull.Frame(lull.load(criterion, **parameters), 32, 32, block=16, supplies=["albedo", "normal"], denoised=True,
                   **{"spp_max": 64, **settings})
    return f, lull.Driver(f, render)


def box5(picture):
    """Means of 5x5 pixels of a picture that is mirrored on."""
    h, w = picture.shape[:2]
    wide = np.pad(picture, ((2, 2), (2, 2), (0, 0)), "reflect")
    return np.array([[wide[y:y + 5, x:x + 5].mean((0, 1)) for x in range(w)] for y in range(h)])


def test_denoise():
    """denoise() gives the blend, the denoised picture, the weight and both errors; planes reach the denoiser, as linear radiance"""
    f, d = painted()
    assert f.planes == ("color", "half", "albedo", "normal") and d.run().outcome == "done"
    with tap.denoiser("auxiliary", BUILD):
        made = lull.denoise(f, full=True)
        assert np.allclose(made.denoised, f.mean("albedo") + f.mean("normal"), atol=1e-6), made.denoised[0]
    with tap.denoiser("box", BUILD):
        made, full = lull.denoise(f), lull.denoise(f, full=True, threads=1)
    assert [a.shape for a in made] == [(32, 32, 3), (32, 32, 3), (32, 32), (4,), (4,)]
    assert {a.dtype.name for a in made[:3]} == {"float32"} and np.isfinite([made.error, made.noisy_error]).all()
    smooth = box5(f.mean())  # of which specks of one half are brought down
    assert np.isclose(made.denoised, smooth, atol=1e-5).mean() > .9 and (made.denoised <= smooth + 1e-5).all()
    assert (full.picture == full.denoised).all() and not full.weight.any()
    weight = made.weight[..., None]
    assert 0 <= weight.min() < .2 and weight.max() <= 1
    assert np.allclose(made.picture, weight * f.mean() + (1 - weight) * made.denoised, atol=1e-5)
    assert (made.error < made.noisy_error).all()  # nothing but noise: a mean of pixels is nearer to the truth
    outputs.write_exr(tmp("d.exr"), d, denoised=made)
    stored = uncompressed(tmp("d.exr"))
    assert (stored["G"] == made.picture[..., 1]).all() and np.allclose(stored["noisy.B"], f.mean()[..., 2])
    assert (stored["denoised.R"] == made.denoised[..., 0]).all() and (stored["lull.weight.V"] == made.weight).all()
    assert (stored["lull.noisy_error.V"][:16, 16:] == np.float32(made.noisy_error[1])).all()
    assert (stored["lull.error.V"][16:, :16] == np.float32(made.error[2])).all()
    outputs.write_report(tmp("d.json"), d, denoised=made)
    report = json.loads(Path(tmp("d.json")).read_text())
    assert abs(report["noisy_weight"] - made.weight.mean()) < 1e-6 and report["blocks"][3]["noisy_error"] == made.noisy_error[3]
    outputs.write_preview(tmp("d.png"), d, made)
    assert abs(grey_levels(tmp("d.png")) - files.srgb(made.picture).mean(-1)).max() < 1e-3
    f, d = painted(display=lambda linear: .1 * linear)
    d.run()
    with tap.denoiser("identity", BUILD):
        assert np.allclose(lull.denoise(f, full=True).picture, f.mean(), atol=1e-6)


def test_denoised_stops():
    """the criterion denoised stops blocks by what is seen of the blend; its own error is the one that is told, its quote has both prices"""
    with tap.denoiser("box", BUILD):
        f, d = painted("denoised", spp_max=2048)
        assert d.run().outcome == "done" and "criterion" in {b.reason for b in f.blocks}, [b.reason for b in f.blocks]
        assert (lull.denoise(f).error == [b.error for b in f.blocks]).all()
        rows = quote.rows(d)
        assert [(r.name, r.value, r.chosen) for r in rows] == [("rough", 8, False), ("draft", 4, False), ("good", 2, False),
                                                               ("denoised", .35, True), ("noisy", .35, False)], rows
        assert all(a.spp[1] <= b.spp[1] for a, b in zip(rows, rows[1:])) and quote.line(d) == ""
        f.close()
        assert lull.denoise(f).weight.shape == (32, 32)  # of a frame that is over, too


def test_no_denoiser():
    """a denoiser that is not there, or fails, is told in one line"""
    f, d = painted()
    d.run()
    with tap.denoiser("/nowhere", BUILD):
        raises(lull.LullError, "/nowhere", lull.denoise, f)
        raises(lull.LullError, "/nowhere", denoising.check)
    for kind in ("crash", "no-device", "commit", "memory"):
        with tap.denoiser(kind, BUILD):
            raises(lull.LullError, "Open Image Denoise", lull.denoise, f)
    raises(ValueError, "expected one of blend, full", denoising.criterion_of, "much")
    with tap.denoiser("identity", BUILD):
        plain = lull.HostFrame(lull.load("fixed", spp=8), 8, 8, ["color"])
        raises(lull.LullError, "a blend HALF besides", lull.denoise, plain, {"color": lull.Plane(np.zeros((8, 8, 3)))})


tap.main(dict(globals()))
