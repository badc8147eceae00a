"""Criteria that are Python files in a host that is Python: the stops of the same criterion in C and of the path tracer, and what is
wrong with them. BUILD names the build folder."""
import json
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np

import lull
import tap
from lull import abi, checkpoint, script
from renderer import Noise, Playback
from tap import raises

BUILD = os.environ.get("BUILD", "build")
RENDER, EXAMPLE = f"{BUILD}/bin/lull-render", "plugin-api/examples/dammertz.py"
os.environ.update(LULL_PLUGIN_PATH=f"{BUILD}/lib/lull", LULL_PYTHON=sys.executable)
TMP = tempfile.TemporaryDirectory()


def tmp(name):
    return os.path.join(TMP.name, name)


def written(text, name="mine.py"):
    """The path of a script with this text."""
    Path(tmp(name)).write_text(text)
    return tmp(name)


def checked(body, before="", requires=("color", "half"), name="mine.py"):
    """The path of a script whose check has this body."""
    return written(f"requires = {list(requires)}\n{before}\ndef check(block):\n    {body}\n", name)


def rendered(path, size=32, block=16, **settings):
    """The frame of a small render, done; the first line that was told."""
    told = []
    frame = lull.Frame(lull.load(path, **settings.pop("parameters", {})), size, size, block=block, **{"spp_max": 64, **settings})
    result = lull.Driver(frame, Noise([[.1, .2], [.3, .4]]), warn=told.append).run()
    assert result.outcome == "done", result
    return frame, (told or [""])[0]


def children():
    return Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()


def test_same_stops():
    """on a scene the example stops every block where halfbuf does, in the path tracer and in a host that is Python, at as many checks"""
    scene, seen = "scenes/cornell-box.pbrt", []
    for criterion in ("halfbuf", EXAMPLE):
        subprocess.run([RENDER, scene, "-q", "--size", "96x80", "--block", "32", "--seed", "7", "-c", criterion, "-p", "threshold=0.01", "--spp-min", "20",
                        "--spp-max", "700", "-o", tmp("pt.exr"), "--report", tmp("pt.json")], check=True)
        seen.append([(b["spp"], b["reason"], b["checks"]) for b in json.loads(Path(tmp("pt.json")).read_text())["blocks"]])
        f = lull.Frame(lull.load(criterion, threshold=.01), 96, 80, block=32, seed=7, spp_min=20, spp_max=700, wave=1 << 30, whole_waves=False)
        assert Playback(f, RENDER, scene, []).run().outcome == "done"
        seen.append([(b.spp, b.reason, b.checks) for b in f.blocks])
    assert seen[0] == seen[1] == seen[2] == seen[3], seen
    assert len({s[0] for s in seen[0]}) > 2 and "criterion" in {s[1] for s in seen[0]}, seen[0]


def test_here():
    """it runs in the process of the host, without another one"""
    assert {b.reason for b in rendered(checked(f"return os.getpid() == {os.getpid()}", "import os"))[0].blocks} == {"criterion"}
    assert not children()


def test_block():
    """check gets what a criterion in C gets: planes of the block as estimates, counts, the frame, parameters of this instance"""
    path = checked("seen.append(block); return block.spp >= 32, 0.5, 40", "seen = []\nuses = ['moment2', 'albedo']\nparameters = {'a_b': 3, 'c': True, 'd': .5, 'e': 'x'}")
    c = lull.load(path, a_b=7, c=False, e="ü y")
    assert [(p.name, p.type, p.default) for p in c.info.parameters] == [("a-b", "int", "3"), ("c", "bool", "1"), ("d", "float", "0.5"), ("e", "text", "x")]
    f = lull.Frame(c, 48, 32, block=32, spp_max=64, seed=11, exposure=2., supplies=["albedo"])

    def render(rects, first, count, half):
        for r in rects:
            yield {"color": np.full((r.height, r.width, 3), 1. + first % 3) + np.arange(3), "albedo": np.full((r.height, r.width, 3), .25)}
    assert lull.Driver(f, render).run().outcome == "done"
    module = script.scripts[max(script.scripts)].module
    assert module.parameters == {"a_b": 7, "c": False, "d": .5, "e": "ü y"}
    b = next(b for b in module.seen if b.id == 1 and b.spp >= 32)
    assert b.rect == (32, 0, 48, 32) and b.color.shape == (32, 16, 3) and b.moment2.shape == (32, 16) and b.depth is None and b.samples is None
    assert b.color.dtype == np.float64 and np.array_equal(b.color[0, 0], f.mean()[0, 40]) and (b.albedo == .25).all()
    assert b.spp == f.blocks[1].spp and 0 < b.half_spp < b.spp and b.thread_s >= 0 and not b.final
    assert (b.frame.width, b.frame.height, b.frame.seed, b.frame.exposure, b.frame.spp_max) == (48, 32, 11, 2, 64)
    assert b.frame.rgb_to_xyz.shape == (3, 3) and abs(b.frame.rgb_to_xyz[1].sum() - 1) < 1e-3
    assert (f.blocks[1].error, f.blocks[1].predicted_spp) == (.5, 40)


def test_two_instances():
    """instances of one file do not know of each other, also in threads and with several blocks"""
    path = checked("global count; count += 1; return block.spp >= parameters['at']", "count = 0\nparameters = {'at': 20}")
    criteria, frames = [lull.load(path, at=at) for at in (17, 40, 64)], {}

    def render(c):
        frames[c] = lull.Frame(c, 64, 64, block=16, spp_max=100)
        lull.Driver(frames[c], lambda rects, first, count, half: [np.full((r.height, r.width, 3), .5) for r in rects]).run()
    threads = [threading.Thread(target=render, args=(c,)) for c in criteria]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    for c, at in zip(criteria, (17, 40, 64)):
        assert all(b.reason == "criterion" and b.spp >= at for b in frames[c].blocks), at
    counts = [s.module.count for s in script.scripts.values() if getattr(s.module, "parameters", {}).get("at") in (17, 40, 64)]
    assert [n for n in counts if n] == [sum(b.checks for b in frames[c].blocks) for c in criteria], counts
    before = len(script.scripts)
    for c in criteria:
        frames.pop(c).close()
        c.close()
    assert len(script.scripts) == before - 3


def test_failing():
    """a check that fails costs time and nothing else: told once, with its line; the blocks go on"""
    for body, text in (("return 1 / 0", "mine.py:4: ZeroDivisionError: division by zero in 'return 1 / 0'"), ("pass", "mine.py:3: check returned None"),
                       ("raise SystemExit(3)", "mine.py:4: SystemExit: 3"), ("raise KeyboardInterrupt", "mine.py:4: KeyboardInterrupt"),
                       ("return block.color", "mine.py:3: check returned array"), ("return float('nan')", "check returned nan"),
                       ("return True, -1", "check returned (True, -1)"), ("return check(block)", "RecursionError")):
        frame, told = rendered(checked(body))
        assert told.startswith("criterion mine: ") and text in told and "\n" not in told, told
        assert {b.reason for b in frame.blocks} == {"spp-max"} and frame.totals.failed_checks > 1
    written("x = 1", "beside.py")
    for body in ("import beside; return beside.x == 1, .5", "return np.bool_(block.spp > 20), np.float32(.5), None", "return (np.int64(block.spp + 9) if block.spp < 20 else True), np.array(.5)",
                 "block.color[:] = np.nan; return True, .5"):
        frame, told = rendered(checked(body, "import numpy as np"))
        assert not told and {b.reason for b in frame.blocks} == {"criterion"} and frame.blocks[0].error == .5, (body, told)


def test_unusable():
    """what is no number anywhere is not asked about"""
    path = checked("assert np.isfinite(block.color).any(); return False", "import numpy as np")
    f = lull.Frame(lull.load(path), 16, 16, block=16, spp_max=64)
    with np.errstate(all="ignore"):
        lull.Driver(f, lambda rects, first, count, half: [np.full((16, 16, 3), np.nan) for _ in rects], warn=lambda text: raises(AssertionError, "", print)).run()
    assert f.totals.failed_checks == 0


def test_refused():
    """a file that is no criterion is refused in one line, and which"""
    for text, why in (("def check(block:\n", "mine.py:1: SyntaxError"), ("", "mine.py: it has no check(block)"), ("import no_such", "mine.py:1: ModuleNotFoundError"),
                      ("requires = ['red']\ncheck = print", "mine.py: requires is ['red']"), ("raise SystemExit", "mine.py:1: SystemExit"),
                      ("check = print\nparameters = {'a': []}", "mine.py: the parameter 'a' is []")):
        raises(lull.LullError, why, lull.load, written(text))
    path = checked("return True", "parameters = {'k': 1.5, 'n': 2, 't': ''}")
    raises(lull.LullError, "no parameter 'x'", lull.load, path, x=1)
    raises(lull.LullError, "n: '1.5' is not an integer", lull.load, path, n=1.5)
    raises(lull.LullError, "no such file", lull.load, tmp("none.py"))
    raises(ValueError, "has a NUL", lull.load, path, t="a\0b")
    raises(ValueError, "has a NUL", lull.load, path + "\0")
    raises(lull.LullError, "holds no criterion with the id other", lull.load, f"{path}:other")
    assert lull.load(f"{path}:mine").info.id == "mine"


def test_changed():
    """an edited file is another criterion, as often as one likes; a checkpoint of the old one is refused"""
    versions = set()
    for i in range(80):
        with lull.load(checked(f"return block.spp >= {17 + i % 40}  # {i}")) as c:
            versions.add(c.info.version)
            frame = lull.Frame(c, 16, 16, block=16, spp_max=100)
            driver = lull.Driver(frame, Noise([[.1]]))
            driver.run()
            assert frame.blocks[0].spp >= 17 + i % 40
            if i == 0:
                checkpoint.save(tmp("c.npz"), driver)
    assert len(versions) == 80
    driver = lull.Driver(lull.Frame(lull.load(checked("return False")), 16, 16, block=16, spp_max=100), Noise([[.1]]))
    raises(Exception, "criterion", checkpoint.load, tmp("c.npz"), driver)
    assert abi.COLOR == list(script.PLANES).index("color") and {name: abi.__dict__[name.upper()] for name in script.PLANES} == \
        {name: i for i, name in enumerate(script.PLANES)}


tap.main(globals())
