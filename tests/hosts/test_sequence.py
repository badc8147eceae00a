"""Recorded sequences: lull.sequence and the programs read and write the same bytes, `ggn import` makes them of pictures."""
import glob
import json
import os
import shutil
import subprocess
import tempfile

import lull  # noqa: F401
import numpy as np
import tap
from lull import exr, sequence
from lull.files import srgb, write_png
from lull.sequence import Level
from tap import Skip, raises

BUILD = os.path.abspath(os.environ.get("BUILD", "build"))
RECORDED = os.path.abspath("tests/data/recorded")
TMP = tempfile.TemporaryDirectory()
os.chdir(TMP.name)
SIDE, SPP = 32, (4, 8, 20, 50, 320, 400)


def ggn(*arguments, status=0):
    done = subprocess.run([f"{BUILD}/bin/ggn", *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == status, done.stderr
    return done.stdout + done.stderr


def pictures(seed=1):
    """Level by level the mean of all samples and of the first half: noise over a ramp that reaches beyond white and below black, as the
    float32 that files hold."""
    random = np.random.default_rng(seed)
    base = np.linspace(-0.01, 1.6, SIDE * 2 * SIDE * 3).reshape(SIDE, 2 * SIDE, 3)
    for n in SPP:
        a, b = (base + random.normal(0, 0.2, base.shape) / np.sqrt(n / 2) for _ in range(2))
        yield n, (0.5 * (a + b)).astype(np.float32), a.astype(np.float32)


def folder(name):
    shutil.rmtree(name, ignore_errors=True)
    os.makedirs(name)
    return name


def blocks(path):
    return {os.path.basename(f): open(f, "rb").read() for f in sorted(glob.glob(f"{path}/*.lseq"))}


def same_planes(one, other):
    """All but the statistics, which importing adds."""
    for a, b in zip(blocks(one).values(), blocks(other).values(), strict=True):
        for r, s in zip(sequence.unpack(a).records, sequence.unpack(b).records, strict=True):
            assert (r.kind, r.spp, r.half_spp) == (s.kind, s.spp, s.half_spp)
            assert r.planes == s.planes, f"{r.spp} spp: planes {[p for p in r.planes if r.planes[p] != s.planes.get(p)]}"


def write_layers(path, **layers):
    channels = {prefix + c: picture[..., i] for prefix, picture in layers.items() for i, c in enumerate("RGB")}
    exr.write(path, {name.replace("half", "half.").replace("all", ""): values for name, values in channels.items()}, (2 * SIDE, SIDE))


def test_recordings_are_packed_to_the_same_bytes():
    """every block of a recording: read, packed again, the same bytes"""
    files = sorted(glob.glob(f"{RECORDED}/*/*/*.lseq"))
    assert len(files) > 8
    for path in files:
        with open(path, "rb") as file:
            data = file.read()
        assert sequence.pack(sequence.unpack(data)) == data, path


def test_codes():
    """PNG files imported, and their codes written: the same block files"""
    view = folder("png/a-view1")
    codes = [(n, srgb(mean)) for n, mean, _ in pictures()]
    for n, rgb in codes:
        write_png(f"{view}/a-view1_{n:05d}.png", rgb)
    ggn("import", view, "-o", "data-png", "-b", SIDE)
    levels = [Level(n, display=rgb) for n, rgb in codes]
    sequence.write("written-png/a-view1", levels, scene="a", block=SIDE)
    raises(ValueError, "a mean, or codes without halves", sequence.write, "x", [Level(4, display=codes[0][1], first_half=codes[0][1])],
           scene="a")
    imported = blocks("data-png/a-view1")
    assert len(imported) == 2 and json.load(open("data-png/a-view1/manifest.json"))["scene"] == "a"
    reference = sequence.unpack(imported["block-00000.lseq"]).records[-1]
    assert reference.kind == sequence.REFERENCE and reference.spp == SPP[-1]
    sequence.write("written-png/a-view1", levels, scene="a", block=SIDE, reference=levels[-1])
    assert blocks("written-png/a-view1") == imported
    ours, theirs = (json.load(open(f"{d}/a-view1/manifest.json")) for d in ("written-png", "data-png"))
    assert ours["blocks"] == theirs["blocks"] and ours["reference_independent"] is theirs["reference_independent"] is False


def test_light():
    """EXR files imported, and their light written: the same block files"""
    view = folder("exr/b")
    for n, mean, _ in pictures():
        write_layers(f"{view}/b.{n:04d}.exr", all=mean)
    ggn("import", "exr", "-o", "data-exr", "-b", SIDE)
    levels = [Level(n, mean) for n, mean, _ in pictures()]
    counts = [Level(np.int64(level.spp), level.mean, level.first_half, level.display) for level in levels]  # as np.geomspace gives them
    sequence.write("written-exr/b", counts, scene="b", block=np.uint16(SIDE), seed=np.uint64(0), reference=counts[-1])
    assert blocks("written-exr/b") == blocks("data-exr/b")


def test_halves():
    """halves as second files, as layers, and written: the same planes; ggn label judges them without a reference"""
    files, layers = folder("halves/files"), folder("halves/layers")
    for n, mean, first in pictures():
        write_layers(f"{files}/c_{n:05d}.exr", all=mean)
        write_layers(f"{files}/c_half_{n:05d}.exr", all=first)
        write_layers(f"{layers}/c_{n:05d}.exr", all=mean, half=first)
    ggn("import", "halves", "-o", "data-halves", "-b", SIDE)
    assert blocks("data-halves/files") == blocks("data-halves/layers")
    sequence.write("written-halves/c", [Level(*level) for level in pictures()], scene="c", block=SIDE)
    same_planes("data-halves/files", "written-halves/c")
    records = sequence.unpack(blocks("data-halves/files")["block-00000.lseq"]).records
    assert [set(r.planes) for r in records] == 4 * [{1, 2, 3}] + [{1, 4, 5}] + [{1, 2, 3}]
    assert [r.half_spp for r in records] == [n // 2 for n in SPP]
    assert [name for name, _ in records[0].stats] == ["dammertz", "half_unsettled", "tail999", "gini"]
    ggn("label", "data-halves", "written-halves")
    one, other = (json.load(open(f"{d}/labels.json")) for d in ("data-halves/files", "written-halves/c"))
    assert one["blocks"] == other["blocks"] and one["source"] == "observer"


def test_halves_of_codes():
    """halves of 8-bit pictures are as good as 8 bits are"""
    view = folder("png-halves/d")
    light = lambda codes: (lambda v: np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4))(codes / 255.0)  # noqa: E731
    for n, mean, first in pictures():
        write_png(f"{view}/d_{n}.png", srgb(mean))
        write_png(f"{view}/d_half_{n}.png", srgb(first))
    ggn("import", "png-halves", "-o", "data-png-halves", "-b", SIDE)
    levels = [Level(n, light(srgb(mean)), light(srgb(first)), srgb(mean)) for n, mean, first in pictures()]
    sequence.write("written-png-halves/d", levels, scene="d", block=SIDE)
    for a, b in zip(blocks("data-png-halves/d").values(), blocks("written-png-halves/d").values(), strict=True):
        for r, s in zip(sequence.unpack(a).records, sequence.unpack(b).records, strict=True):
            assert r.planes[sequence.DISPLAY] == s.planes[sequence.DISPLAY]
            if sequence.HALF_F16 in r.planes:
                theirs, ours = (np.frombuffer(x.planes[sequence.HALF_F16], "<f2").astype(float) for x in (r, s))
                assert np.abs(theirs - ours).max() < 1e-3 and np.abs(theirs).max() > 0.01  # a power's last bit, rounded to half floats


def test_jpeg():
    """JPEG files are imported"""
    if not shutil.which("oiiotool"):
        raise Skip("no oiiotool")
    view = folder("jpg/e")
    for n in (8, 16, 32):
        smooth = srgb(np.broadcast_to(np.linspace(0.1, 0.5 + n / 100, 2 * SIDE)[None, :, None], (SIDE, 2 * SIDE, 3)))
        write_png("e.png", smooth)
        subprocess.run(["oiiotool", "e.png", "--compression", "jpeg:95", "-o", f"{view}/e_{n:05d}.jpg"], check=True)
    ggn("import", view, "-o", "data-jpg", "-b", SIDE)
    record = sequence.unpack(blocks("data-jpg/e")["block-00001.lseq"]).records[2]
    codes = np.frombuffer(record.planes[sequence.DISPLAY], np.uint8).reshape(3, SIDE, SIDE).transpose(1, 2, 0).astype(int)
    assert np.abs(codes - smooth[:, SIDE:]).max() <= 4  # what JPEG does to a ramp


def test_refused():
    """what is no sequence is refused by a line"""
    (n, mean, first), *rest = pictures()
    bad = mean.copy()
    bad[3, 5, 1] = np.nan
    for text, levels in (("0 levels", []), ("8 spp: levels rise", [Level(8, mean), Level(8, mean)]), ("not finite", [Level(4, bad)]),
                         ("another size", [Level(4, mean), Level(8, mean[:8])]), ("half of one sample", [Level(1, mean, first)])):
        raises(ValueError, text, sequence.write, "refused", levels, scene="x")
    levels, big = [Level(8, mean)], 1 << 64
    for error, text, words in ((ValueError, "the scene has no name", {"scene": ""}), (ValueError, "scene 5: expected text", {"scene": 5}),
                               (ValueError, "expected text", {"source": os.fsdecode(b"caf\xe9.exr")}),
                               (ValueError, f"seed {big}", {"seed": big}), (ValueError, "seed -1", {"reference_seed": -1}), (TypeError, "block 8.0", {"block": 8.})):
        raises(error, text, sequence.write, "refused", levels, **{"scene": "x", **words})
    raises(TypeError, "spp 8.0", sequence.write, "refused", [Level(8., mean)], scene="x")
    raises(ValueError, "not [0, ", sequence.write, "refused", [Level(8, mean[:0])], scene="x")
    raises(TypeError, "fill its holes", sequence.write, "refused", [Level(8, np.ma.masked_array(mean, mean > 1))], scene="x")
    assert not os.path.exists("refused")
    data = next(iter(blocks(f"{RECORDED}/train/one-view0").values()))
    for cut in (b"", data[:50], data[:-1], data + b"x", data[:300] + bytes([data[300] ^ 1]) + data[301:]):
        try:
            sequence.unpack(cut)
        except ValueError:
            continue
        raise AssertionError("damaged bytes were believed")
    view = folder("bad/f")
    write_layers(f"{view}/f_4.exr", all=mean)
    write_layers(f"{view}/f_8.exr", all=bad)
    assert "f_8.exr: pixel 5,3 is not finite" in ggn("import", view, "-o", "data-bad", "-b", SIDE, status=2)
    write_layers(f"{view}/f_half_4.exr", all=first)
    assert "1 of 2 levels have a half" in ggn("import", view, "-o", "data-bad", "-b", SIDE, status=2)
    os.remove(f"{view}/f_4.exr")
    assert "f_half_4.exr: a half without the image of all 4 samples" in ggn("import", view, "-o", "data-bad", "-b", SIDE, status=2)
    assert not os.path.exists("data-bad")


if __name__ == "__main__":
    tap.main(globals())
