"""Recorded frames: lull-render and lull.recording write and read the same, and a replay gives what a render was told."""
import glob
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

import lull
import numpy as np
import tap
from lull import exr, recording, replay
from lull.recording import Look, Record
from tap import raises

ROOT = os.getcwd()
BUILD = os.path.abspath(os.environ.get("BUILD", "build"))
SCENE = os.path.abspath("scenes/cornell-box.pbrt")
TMP = tempfile.TemporaryDirectory()
os.environ["PYTHONPATH"] = os.pathsep.join(map(os.path.abspath, os.environ["PYTHONPATH"].split(os.pathsep)))
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


def test_python():
    """a criterion in Python: likewise"""
    records_itself(f"{ROOT}/plugin-api/examples/dammertz.py")




# --- recorded frames --------------------------------------------------------------------------------------------------


def once(name, *options):
    """A folder that several tests read."""
    if not os.path.exists(name):
        render(name, *options)
    return recording.read(name)


def ladder():
    return once("ladder", "--levels", "geometric:8:64:1.3", "--planes", "half,moment2,albedo,normal", "--reference-spp", 16)


def of_folder(folder):
    return {os.path.basename(f): open(f, "rb").read() for f in glob.glob(f"{folder}/*")}


def test_a_look_is_the_picture():
    """a look holds the picture that a render of so many samples writes; references are others"""
    frame = ladder()
    for spp in (8, 64):
        subprocess.run([f"{BUILD}/bin/lull-render", SCENE, "-q", "--size", SIZE, "--spp", str(spp), "--aov", "normal", "-o", "one.exr"], check=True)
        look = recording.from_exr("one.exr", spp, {"color": "", "normal": "normal"})
        for k, r in enumerate(frame.blocks):
            for name, planes in frame.planes(k, spp, ["color", "normal"]).items():
                error = np.abs(planes - look.planes[name][r.y0:r.y1, r.x0:r.x1])
                assert (error <= 2.0 ** -23 * np.abs(planes) + 1e-30).all(), (name, spp, error.max())  # one rounding to a float
    assert frame.in_step and frame.finished and frame.levels(0)[-1] == 64 and len(frame.references) == 2
    first, second = frame.references
    assert np.isfinite(first).all() and (first != second).mean() > 0.5
    refused = render("ladder", "--levels", "geometric:8:32:1.3", "--planes", "half,moment2,albedo,normal", "--reference-spp", 16, status=2)
    assert "use another folder" in refused and len(refused.splitlines()) == 1


def test_python_writes_it_too():
    """what lull.recording writes it reads again, and a render's own pictures make the render's answers"""
    frame = ladder()
    looks, whole = [], lull.Rect(0, 0, frame.width, frame.height)
    for spp in frame.levels(0):
        planes = {n: np.zeros((whole.height, whole.width, recording.channels(n))) for n in ("color", "half", "moment2")}
        for k, r in enumerate(frame.blocks):
            for name, values in frame.planes(k, spp, planes).items():
                planes[name][r.y0:r.y1, r.x0:r.x1] = values
        looks.append(Look(spp, {**planes, "moment2": planes["moment2"][..., 0]}, half_spp=frame.half_spp(0, spp)))
    recording.write("mine", looks, scene="s", block=int(BLOCK), references=frame.references, reference_spp=16)
    again = recording.read("mine")
    assert again.in_step and again.levels(1) == frame.levels(1) and again.reference_spp == 16
    assert all((a == b).all() for a, b in zip(again.references, frame.references))
    for k in range(len(frame.blocks)):
        for spp in frame.levels(k):
            theirs, ours = frame.planes(k, spp), again.planes(k, spp)
            assert all(np.abs(ours[n] - theirs[n]).max() <= 2.0 ** -40 * np.abs(theirs[n]).max() for n in ("color", "half", "moment2"))
    same(*(replay.Replay(f, lull.load("observer"), spp_max=64).run().answers for f in (frame, again)))
    raises(ValueError, "it holds a recording", recording.write, "mine", looks, scene="s")
    raises(ValueError, "expected rising ones", recording.write, "new", looks[::-1], scene="s")
    raises(ValueError, "expected none or two", recording.write, "new", looks, scene="s", references=frame.references[:1])
    raises(ValueError, "no looks with a plane color", recording.write, "new", [Look(4, {"half": looks[0].planes["half"]})], scene="s")
    raises(ValueError, "plane half of shape", recording.write, "new", [Look(4, {**looks[0].planes, "half": np.zeros((3, 3, 3))})], scene="s")
    raises(ValueError, "the first look has", recording.write, "new", [looks[0], Look(99, {"color": looks[0].planes["color"]})], scene="s")
    assert not os.path.exists("new")


def test_exr_layers():
    """EXR files of a renderer become looks: layers by their names or as they are told, by ZIP or uncompressed"""
    random = np.random.default_rng(1)
    color, half = (random.random((21, 9, 3)).astype(np.float32) for _ in range(2))
    moment = random.random((21, 9)).astype(np.float32)
    channels = {c: color[..., i] for i, c in enumerate("RGB")} | {f"half.{c}": half[..., i] for i, c in enumerate("RGB")}
    exr.write("layers.exr", {**channels, "moment2.Y": moment, "sq": moment}, (9, 21))
    look = recording.from_exr("layers.exr", 10)
    assert sorted(look.planes) == ["color", "half", "moment2"] and (look.planes["half"] == half).all() and (look.planes["color"] == color).all()
    assert (recording.from_exr("layers.exr", 10, {"color": "half", "moment2": "sq"}).planes["moment2"][..., 0] == moment).all()
    raises(ValueError, "no layer albedo for albedo", recording.from_exr, "layers.exr", 10, {"color": "", "albedo": "albedo"})
    data = bytearray(open("layers.exr", "rb").read())
    for n in range(len(data) - 60, len(data), 7):
        open("bad.exr", "wb").write(data[:n])
        raises(ValueError, "bad.exr: not a scan-line EXR", exr.read, "bad.exr")


def test_damage():
    """any byte that is another one, and any file that is cut short, is refused in one line; versions by their names"""
    render("small", "--levels", "linear:2:3:1", "--planes", "half", "--size", "8x8")
    files = of_folder("small")
    for name, data in files.items():
        for at in range(0, len(data), 1 if name != "manifest.json" else 5):
            for cut in (True, False):
                bad = data[:at] if cut else data[:at] + bytes([data[at] ^ 1 << at % 8]) + data[at + 1:]
                open(f"small/{name}", "wb").write(bad)
                try:
                    frame = recording.read("small")
                    for k in range(len(frame.blocks)):
                        for spp in frame.levels(k):
                            frame.planes(k, spp)
                    assert name == "manifest.json", (name, at, cut)  # a name of a scene may be another one
                except (ValueError, OSError) as error:
                    assert "\n" not in str(error), error
        open(f"small/{name}", "wb").write(data)
    recording.read("small")
    os.remove("small/look-00001.lseq")
    raises(OSError, "look-00001.lseq", recording.read, "small")
    render("old", "--levels", "linear:2:3:1")
    raises(ValueError, "old/manifest.json: blocks alone (version 1 of the format), expected looks at a whole frame (version 2)", recording.read, "old")
    done = subprocess.run([f"{BUILD}/bin/ggn", "label", "ladder"], capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "looks at a whole frame (version 2 of the format), expected blocks alone (version 1)" in done.stderr
    refused = render("old", "--levels", "linear:2:3:1", "--planes", "half", status=2)
    assert "blocks alone (version 1 of the format), expected looks at a whole frame (version 2)" in refused
    for options, words in ((["--planes", "half,what"], "expected a list of color, half"), (["--planes", ""], "expected a list of color, half"),
                           (["--planes", "color", "--time-budget", 3], "--planes goes with neither"),
                           (["--planes", "color", "--blocks", 1], "leave out --blocks"), (["--past-stops"], "--past-stops belongs to --planes"),
                           (["--planes", "color", "--levels", "linear:1:2:1", "--past-stops"], "--past-stops belongs to --planes")):
        said = render("none", *options, status=2)
        assert words in said and said.count("\n") == 1 and not os.path.exists("none"), said


# --- replays ----------------------------------------------------------------------------------------------------------


def test_levels_are_rounded_up():
    """looks fall on recorded levels, rounded up; blocks of other sizes are cut from blocks in step"""
    frame, asked = ladder(), lull.load("fixed", spp=33)
    levels = frame.levels(0)
    first = min(n for n in levels if n >= 33)
    for block, count in ((None, len(frame.blocks)), (16, 20), (64, 2)):
        found = replay.Replay(frame, asked, block=block).run()
        assert found.stops == [first] * count and set(found.reasons) == {"criterion"}, found
        assert all(a.spp in levels and not a.simulated and not a.after_stop for a in found.answers)
    ended = replay.Replay(frame, lull.load("null")).run()
    assert set(ended.stops) == {0} and set(ended.reasons) == {"interrupt"} and max(a.spp for a in ended.answers) == levels[-1]
    capped = replay.Replay(frame, lull.load("null"), spp_max=levels[3]).run()
    assert set(capped.reasons) == {"spp-max"} and max(a.spp for a in capped.answers) == levels[3]
    own = once("own-observer", "-c", "observer", "--planes", "color")
    raises(ValueError, "its blocks are not in step", replay.Replay, own, asked, block=16)
    only = once("color-only", "--levels", "linear:8:8:1", "--planes", "color")
    raises(ValueError, "criterion halfbuf reads half, which color-only has not recorded", replay.Replay, only, lull.load("halfbuf"))


def test_pixels_of_other_blocks():
    """blocks that are cut from others are shown the pixels of the picture"""
    frame = ladder()
    asked = replay.Replay(frame, lull.load("fixed", spp=64), block=17)
    asked.run()
    for k, r in enumerate(frame.blocks):
        for name, values in frame.planes(k, 64).items():
            assert (asked.shown[name][r.y0:r.y1, r.x0:r.x1] == values).all(), name


def test_going_on():
    """after all stops the criterion is asked on, at every further level; a render that went on is replayed so"""
    frame, levels = ladder(), ladder().levels(0)
    found = replay.Replay(frame, lull.load("fixed", spp=20), go_on=True).run()
    first = min(n for n in levels if n >= 20)
    assert found.stops == [first] * len(frame.blocks)
    for k in range(len(frame.blocks)):
        after = [a.spp for a in found.answers if a.block == k and a.after_stop]
        assert after == [n for n in levels if n > first]
        assert all(not a.after_stop for a in found.answers if a.block == k and a.spp <= first)
    render("past", "-c", "halfbuf", "-p", "threshold=0.02", "--planes", "half", "--past-stops", "--spp-max", 200)
    past = recording.read("past")
    found = replay.Replay(past, lull.load("halfbuf", threshold=0.02), go_on=True).run()
    same(past.answers, found.answers)
    assert [a.after_stop for a in past.answers] == [a.after_stop for a in found.answers] and any(a.after_stop for a in found.answers)
    assert all(past.levels(k)[-1] == 200 for k in range(len(past.blocks)))


def test_simulated_levels():
    """levels beyond a recording have the noise of so many samples, and are marked; never for denoised"""
    frame, last = ladder(), ladder().levels(0)[-1]
    asked = replay.Replay(frame, lull.load("fixed", spp=256), simulate_to=256)
    kept = {n: a.copy() for n, a in replay.Replay(frame, lull.load("fixed", spp=last)).shown.items()}
    for k, r in enumerate(frame.blocks):
        for name, values in frame.planes(k, last).items():
            kept[name][r.y0:r.y1, r.x0:r.x1] = values
    found = asked.run()
    assert set(found.stops) == {256} and all(a.simulated == (a.spp > last) for a in found.answers) and any(a.simulated for a in found.answers)
    assert (asked.shown["color"] == kept["color"]).all()
    noise, before = asked.shown["half"] - kept["color"], kept["half"] - kept["color"]
    assert np.allclose(noise, before * math.sqrt(last / 256), rtol=1e-4, atol=1e-6)  # equal halves
    y = kept["color"] @ np.array(frame.frame["rgb_to_xyz"][3:6])
    variance, spread = (kept["moment2"][..., 0] - y * y) * last / (last - 1), asked.shown["moment2"][..., 0] - y * y
    assert np.allclose(spread * 256 / 255, variance, rtol=1e-3, atol=1e-6 * (1 + y.max() ** 2))
    halves = replay.Replay(frame, lull.load("halfbuf"), simulate_to=1 << 14).run()
    errors = {a.spp: a.error for a in halves.answers if a.block == 0}
    first, end = min(s for s in errors if s >= last), max(errors)
    assert end > 2 * last and abs(errors[end] / errors[first] / math.sqrt(first / end) - 1) < 0.02  # as 1/sqrt(samples)
    with tap.denoiser("box", BUILD):
        raises(ValueError, "criterion denoised: no levels can be simulated for it", replay.Replay, frame, lull.load("denoised"), simulate_to=999)


def test_denoised_planes():
    """denoised planes are added look by look, once, and nothing else changes"""
    shutil.copytree("ladder" if ladder() else "", "denoised")
    before = {n: d for n, d in of_folder("denoised").items() if n != "manifest.json"}
    frame, calls = recording.read("denoised"), []

    def by(shown):
        calls.append(shown["color"].mean())
        return {"denoised": shown["color"] * 2, "denoised_half": shown["half"] + 1}
    replay.denoise(frame, "twice 1.0", by)
    replay.denoise(recording.read("denoised"), "twice 1.0", by)
    assert len(calls) == len(frame.looks) == len(set(calls)) and frame.layers == ["twice 1.0"]
    again = recording.read("denoised")
    for k, spp in ((0, 8), (3, 64)):
        planes, made = again.planes(k, spp), again.planes(k, spp, layer="twice 1.0")
        assert sorted(made) == ["denoised", "denoised_half"] and np.allclose(made["denoised"], 2 * planes["color"], rtol=1e-6)
    assert all(of_folder("denoised")[n] == d for n, d in before.items()) and again.answers == frame.answers
    same(*(replay.Replay(f, lull.load("fixed", spp=20)).run().answers for f in (ladder(), again)))
    with tap.denoiser("box", BUILD):
        replay.denoise(again, "stub")
    assert again.planes(0, 64, layer="stub")["denoised"].std() < again.planes(0, 64)["color"].std()
    raises(ValueError, "expected a text of 1 to 63 characters", again.add, "", 1, [])
    raises(ValueError, "has no look at 9 spp", again.add, "x", 1, [Record(1, 9, 4, 0, again.blocks[0])])


def command(*arguments, status=0):
    done = subprocess.run([sys.executable, "-m", "lull", "replay", *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == status, (done.stdout, done.stderr)
    return done.stdout if status == 0 else done.stderr


def test_command():
    """python3 -m lull replay says where blocks stop, writes every answer, and refuses what makes no sense in one line"""
    ladder()
    assert "--simulate-to" in command("--help")
    said = command("ladder", "-c", "fixed", "-p", "spp=20", "-o", "answers.json")
    with open("answers.json") as file:
        found = json.load(file)
    first = min(n for n in ladder().levels(0) if n >= 20)
    assert said == f"fixed: 4 of 4 blocks stopped, at {first} to {first} samples; {len(found['answers'])} answers\n"
    assert found["stops"] == [first] * 4 and found["criterion"]["parameters"] == {"spp": "20"} and found["columns"][:6] == ["block", "spp", "action", "error", "p", "next"]
    assert found["answers"][-1][:4] == [3, first, 1, None] and found["scene"] == "cornell-box"
    shutil.copytree("ladder", "caf\u00e9")
    ascii_only = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    subprocess.run([sys.executable, "-c", r"from lull import recording; recording.read('caf\u00e9').planes(0, 8)"], env=ascii_only, check=True)
    once("own-observer", "-c", "observer", "--planes", "color")
    own = recording.read("own-observer")
    command("own-observer", "-q", "-o", "own.json")
    with open("own.json") as file:
        assert [a[:2] for a in json.load(file)["answers"]] == [[a.block, a.spp] for a in own.answers]
    for arguments, words in ((["nothing", "-c", "fixed"], "nothing"), (["ladder"], "nobody was asked while recording"), (["ladder", "-c", "nobody"], "nobody"),
                             (["ladder", "-c", "fixed", "-p", "x=1"], "x"), (["ladder", "-c", "fixed", "--block", 0], "block"),
                             (["ladder", "-c", "fixed", "-o", "a.txt"], "--output"), (["ladder", "-c", "fixed", "--spp-max", 0], "spp_max"),
                             (["ladder", "-c", "fixed", "--simulate-to", -1], "simulate_to"), (["ladder", "-c", "fixed", "-p", "x"], "KEY=VALUE")):
        line = command(*arguments, status=2)
        assert words in line.splitlines()[-1] and "Traceback" not in line, line


tap.main(globals())
