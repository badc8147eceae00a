"""The pictures that people are shown of recordings: which sample counts there are, and that each picture is what shown.py says, recomputed
from the block; and that nothing damaged is shown."""
import json
import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np
import tap
from lull import sequence
from lull.files import srgb
from lull.study import shown
from lull.study.files import Refused
from made import study_of
from tap import raises

SIDE, LEVELS = 20, (20, 40, 80, 160, 320, 640, 1280)
RECORDED = "tests/data/recorded/train/one-view0"
TMP = tempfile.TemporaryDirectory()


def recorded(name, levels, reference_spp=0, is_independent=True):
    """A block of noise around a ramp beyond white, in a folder: the folder, and what is read of it."""
    random, folder = np.random.default_rng(3), os.path.join(TMP.name, name)
    base = np.linspace(0.01, 1.3, SIDE * SIDE * 3).reshape(SIDE, SIDE, 3)

    def level(spp):
        a, b = (base + random.normal(0, 1, base.shape) / np.sqrt(spp / 2) for _ in range(2))
        return sequence.Level(spp, (a + b) / 2, a)
    reference = level(reference_spp) if reference_spp else None
    sequence.write(folder, [level(n) for n in levels], scene=name, block=SIDE, reference=reference, reference_seed=1 if is_independent else None)
    manifest = sequence.read_manifest(folder)
    return folder, sequence.read_block(folder, manifest, manifest["blocks"][0])


def simulated(beyond):
    """20, 23, …, each 1.15 times the one before, beyond a count; and the cap."""
    return [n for n in (int(np.floor(20 * 1.15 ** k + 0.5)) for k in range(60)) if beyond < n < 10000] + [10000]


def same_codes(got, light):
    """A value may lie between two codes."""
    assert got.shape == light.shape and abs(got.astype(int) - srgb(light)).max() <= 1


def test_recorded_then_simulated():
    """levels against a perfect reference, and beyond them the halves"""
    _, block = recorded("both", LEVELS, 2000)
    converged, counts, make = shown.stimuli(block, True)
    assert counts == [*LEVELS, *simulated(1.07 * 1280)] and len(counts) > 17
    assert (converged == sequence.display(block, block.reference)).all()
    base = sequence.mean(block, block.reference).astype(float)
    full = next(r for r in block.levels if sequence.HALF_F16 in r.planes)
    for record in block.levels:
        same_codes(make(record.spp), base + np.sqrt(2000 / (2000 + record.spp)) * (sequence.mean(block, record) - base))
    for spp in counts[7:]:
        same_codes(make(spp), base + np.sqrt(full.spp / spp) * sequence.half(block, full))
    noise = [np.std(srgb(base).astype(int) - make(spp)) for spp in (20, 320, 10000)]
    assert noise[0] > 2 * noise[1] > 4 * noise[2] > 0


def test_a_reference_that_shares_samples():
    """pictures as they are, and none beyond"""
    _, block = recorded("shared", LEVELS, 2000, is_independent=False)
    _, counts, make = shown.stimuli(block, False)
    assert counts == list(LEVELS)
    for record in block.levels:
        assert (make(record.spp) == sequence.display(block, record)).all()


def test_without_a_reference():
    """all are made from the halves; without halves there is nothing to show"""
    _, block = recorded("halves", LEVELS)
    converged, counts, make = shown.stimuli(block, True)
    full = next(r for r in block.levels if sequence.HALF_F16 in r.planes)
    mean = sequence.mean(block, full).astype(float)
    assert counts == simulated(0)
    same_codes(converged, mean)
    for spp in counts:
        same_codes(make(spp), mean + np.sqrt(full.spp / spp) * sequence.half(block, full))
    del full.planes[sequence.HALF_F16]
    raises(Refused, "block 0 has neither a reference nor a full level", shown.stimuli, block, True)


def test_near_the_cap():
    """up to a tenth of an octave below it nothing is added"""
    for last, more in ((9300, [10000]), (9400, [])):
        _, block = recorded(f"cap{last}", (400, last), 20000)
        assert shown.stimuli(block, True)[1] == [400, last, *more]


def test_light_between_codes():
    """what is read of codes and steps is within a step of the light that was written, beyond white within a 16th of an octave"""
    light = np.linspace(0, 4, SIDE * SIDE * 3).reshape(SIDE, SIDE, 3)
    sequence.write(f"{TMP.name}/steps", [sequence.Level(n, light) for n in (4, 8)], scene="s", block=SIDE)
    manifest = sequence.read_manifest(f"{TMP.name}/steps")
    block = sequence.read_block(f"{TMP.name}/steps", manifest, manifest["blocks"][0])
    got, wanted = sequence.mean(block, block.records[0]), light.transpose(2, 0, 1)
    dark = wanted < 0.99
    assert abs(got - wanted)[dark].max() < 0.0006 and abs(np.log2(got[~dark] / wanted[~dark])).max() < 0.04
    del block.records[0].planes[sequence.FINE]
    assert (srgb(sequence.mean(block, block.records[0])) == sequence.display(block, block.records[0])).all()


def test_catch_trials():
    """heavy noise is the same linear congruence for any size"""
    state, wanted = 1, []
    for _ in range(3 * 7 * 5):
        state = (state * 1664525 + 1013904223) % 2**32
        wanted.append(min(255, max(0, 200 + (state >> 16) % 97 - 48)))
    assert shown._heavy(np.full((7, 5, 3), 200, np.uint8)).ravel().tolist() == wanted


def test_blocks_of_a_recording():
    """the pictures that are named, and no other; levels as far apart as asked"""
    study, out = study_of("2ifc", views=[]), os.path.join(TMP.name, "made")
    shown.show(study, [f"{RECORDED}:0-1"], [""], out, {"spacing": 1})
    (view,) = study.views
    assert view.name == "one-view0" and [b.id for b in view.blocks] == [0, 1]
    assert all(b >= 1.99 * a for a, b in zip(view.blocks[0].levels, view.blocks[0].levels[1:])) and len(view.blocks[0].levels) > 3
    assert set(os.listdir(f"{out}/v0")) == {f"b{b.id}-{what}.png" for b in view.blocks for what in ("reference", "heavy", *b.levels)}
    for task, views, why in (("validation", RECORDED, "a validation takes folders of pictures"), ("2ifc", f"{RECORDED}:9", "has no block 9"),
                             ("2ifc", f"{RECORDED}:3-1", "has no block 3"), ("validation", RECORDED + ":0", "whole pictures, not blocks")):
        raises(Refused, why, shown.show, study_of(task, views=[]), [views], [""], out, {})


def test_without_the_library():
    """one line says where it was looked for"""
    code = ("from lull import library; library.search_path, library.NAME = lambda: ['/nowhere'], 'liblull-none.so'; import sys; "
            "from lull.study.main import main; sys.argv[0] = 'lull-study'; sys.exit(main())")
    for views in (recorded("alone", LEVELS)[0], RECORDED, os.path.join(TMP.name, "pictures")):
        os.makedirs(views, exist_ok=True)
        if not os.listdir(views):
            shutil.copy(f"{TMP.name}/made/v0/b0-reference.png", f"{views}/reference.png")
        run = subprocess.run([sys.executable, "-c", code, "init", f"{TMP.name}/none", "--task=thresholds", "--views", views, "--asked-by=Ada",
                              "--contact=here"], capture_output=True, text=True)
        assert run.returncode == 2 and "no liblull-none.so in /nowhere" in run.stderr and run.stderr.count("\n") == 1, run.stderr
        assert not os.path.exists(f"{TMP.name}/none")


def test_damaged_recordings():
    """each is refused with the file's name, before anything of it is shown"""
    data = json.load(open(f"{RECORDED}/manifest.json"))
    first, folder = data["blocks"][0], os.path.join(TMP.name, "damaged")
    changes = [("format", "x"), ("version", 2), ("scene", ""), ("width", 0), ("height", "8"), ("levels", []), ("levels", [8, 8]), ("levels", [8, True]),
               ("levels", [7]), ("blocks", {}), ("blocks", []), ("blocks", [1]), ("blocks", [first, first]), ("reference_spp", -1)]
    changes += [("blocks", [{**first, name: value}]) for name, value in (
        ("id", -1), ("id", 7), ("x1", 0), ("x1", 10**6), ("x1", 1), ("y0", 0.5), ("bytes", 1), ("crc32", "00000000"), ("crc32", 5), ("file", "../x"),
        ("file", ".x"), ("file", "none.lseq"), ("file", "a\0b"))]
    for name, value in changes:
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(RECORDED, folder)
        with open(f"{folder}/manifest.json", "w") as file:
            json.dump({**data, name: value}, file)
        study = study_of("2ifc", views=[])
        try:
            shown.show(study, [folder], [""], os.path.join(TMP.name, "out"), {})
        except (Refused, OSError) as error:
            assert "damaged" in str(error) and "\n" not in str(error), (name, value, str(error))
        else:
            assert name == "reference_spp", (name, value)
    for text in ("", "[]", "[" * 10**5, "{}", "nan", "\udc80"):
        with open(f"{folder}/manifest.json", "wb") as file:
            file.write(text.encode("utf-8", "surrogateescape"))
        raises(ValueError, "damaged/manifest.json: not the manifest of a sequence", sequence.read_manifest, folder)
    os.remove(f"{folder}/manifest.json")
    os.mkfifo(f"{folder}/manifest.json")
    raises(ValueError, "manifest.json: not a regular file", sequence.read_manifest, folder)


tap.main(globals())
