"""What scripts/lab peers and artists make of figures; and one tiny scene exported, rendered by both and compared. BUILD names the build
folder."""
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "tests" / "hosts")]

import tap  # noqa: E402
from lablib import artists, peers  # noqa: E402


def way(seconds, *errors):
    return {"s": seconds, "errors": errors}


def test_equal_quality():
    """seconds at equal quality: between two settings, at the first, and beyond the last as noise falls"""
    points = [(1, 4.0), (4, 2.0), (16, 1.0)]
    assert peers.at_equal(points, 2.0) == (4, "") and peers.at_equal(points, 5.0) == (1, "<")
    seconds, where = peers.at_equal(points, 2 ** 0.5)
    assert abs(seconds - 8) < 1e-9 and where == ""
    assert peers.at_equal(points, 0.5) == (64, ">")


def test_ratio_by_worst_block():
    """a way is held against Cycles by its worst block; scenes whose references differ do not count"""
    ways = {"1 ours": way(2, .5, 2.0), "1 cycles 0.1": way(1, 4.0, .1), "1 cycles 0.05": way(8, 2.0, .1)}
    found = peers.ratio({"ways": ways}, 1, "ours", peers.RAW)
    assert (found["ratio"], found["worst"], found["where"]) == (.25, 2.0, "")
    scenes = {"same": {"differ": .01, "ways": ways}, "other": {"differ": .2, "ways": ways}}
    assert [name for name, _ in peers.rows(scenes, "ours", peers.RAW)] == ["same"]
    results = {"options": {"size": 9, "block": 3, "reference_spp": 1}, "scenes": scenes, "blender": "0",
               "measured": {"date": "2020-01-02", "processor": "old", "commit": "0ld"}}
    assert "Left out, as the references differ by more than 5 % somewhere: other (20 %)" in peers.raw({"raw": results})


def test_artists_by_worst_block():
    """a multiple of what is just seen is held against the number of samples that is as good in its worst block"""
    ways = {name: {**way(4, 2.0, 1.0), "wall_s": 5} for name in artists.NAMES}
    ways["64 samples"].update(s=1, errors=[4.0, .5])
    ways["256 samples"].update(s=16, errors=[1.0, .5])
    told = {"phases": {"samples_s": 2.5, "looks_s": .5}, "blocks": [[90, "criterion"], [30, "criterion"]]}
    for e, (seconds, worst) in zip(artists.ERRORS, ((8, 2.0), (2, 4.0), (1, 8.0))):
        ways["error %d" % e].update(s=seconds, errors=[worst, .1], **told)
    ways["ours"].update(blocks=[[20, "criterion"]])
    table = artists.scenes_table({"one": ways}).splitlines()[-1]
    assert table == "| one | 60 | 8.0 | 2.00 | 2.00 | 60 | 2.0 | 4.00 | ≥ 2.00 | 60 | 1.0 | 8.00 | ≥ 1.00 | 20 | 4.0 | 2.00 | 1.00 |", table
    assert artists.phases_table({"one": ways}).splitlines()[-1] == "| one | 5.0 | 50 % | 0 % | 0 % | 10 % | 0 % |"
    row = next(line for line in artists.ways_table({"one": ways}).splitlines() if "--error 3" in line)
    assert row == "| `--error 3` | 1 | 5 | 0.25 | 8.00 | 4.05 | 50 % |", row


def need_bpy():
    if not os.path.exists(peers.BPY):
        raise tap.Skip("no bpy in build/hosts: run make test-hosts")
    if not shutil.which("oiiotool"):
        raise tap.Skip("no oiiotool: package openimageio-tools")


def run_on_scene(work, job, *words):
    """The job's command on the scene below, in folder `work`, and what became of it."""
    if not (Path(work) / "test.pbrt").exists():
        shutil.copytree(ROOT / "scenes" / "meshes", Path(work) / "meshes")
        (Path(work) / "test.pbrt").write_text(SCENE)
    command = [str(ROOT / "scripts/lab"), job, "--scenes", str(Path(work) / "test.pbrt"), "--block", "12", "--reference-spp", "256", "--work", work]
    done = subprocess.run([*command, *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_one_scene():
    """a scene with coats, metal, a checkerboard and a lamp is exported, both renderers agree on it, and all ways are measured"""
    need_bpy()
    with tempfile.TemporaryDirectory() as work:
        run_on_scene(work, "peers", "--size", "24", "--seeds", "1")
        kept = json.loads(next(Path(work).glob("*.json")).read_text())
        assert kept["differ"] <= peers.AGREE, kept["differ"]
        text = next(Path(work).glob("*-256.pbrt")).read_text()
        assert "coated" not in text and "portal" not in text and "reflectance" in text
        for name in ("ours", "host", "cycles 0.1", "cycles n=64", "ours denoised", "host denoised", "cycles 0.1 denoised"):
            assert kept["ways"]["1 " + name]["s"] > 0 and len(kept["ways"]["1 " + name]["errors"]) == 4, name
        again = run_on_scene(work, "peers", "--size", "24", "--seeds", "1")
        assert "| test | 1 |" in again and " s, worst " not in again


def test_artists_on_one_scene():
    """all ways of artists are measured, once, with what the host says of its blocks and phases"""
    need_bpy()
    with tempfile.TemporaryDirectory() as work:
        run_on_scene(work, "artists", "--size", "24x24")
        kept = json.loads(next(Path(work).glob("*-12.json")).read_text())
        assert set(kept) == set(artists.NAMES)
        assert all(w["s"] > 0 and w["wall_s"] > 0 and len(w["errors"]) == 4 for w in kept.values())
        assert all(len(kept["error %d" % e]["blocks"]) == 4 and kept["error %d" % e]["phases"]["looks_s"] > 0 for e in artists.ERRORS)
        assert len(kept["ours"]["blocks"]) == 4
        assert max(n for n, _ in kept["error 3"]["blocks"]) <= max(n for n, _ in kept["error 1"]["blocks"])
        assert ", worst block " not in run_on_scene(work, "artists", "--size", "24x24")


SCENE = """
Film "rgb" "integer xresolution" 24 "integer yresolution" 24
PixelFilter "box"
Integrator "path" "integer maxdepth" 4
LookAt 0 1.2 -4  0 .6 0  0 1 0
Camera "perspective" "float fov" 40
WorldBegin
LightSource "infinite" "rgb L" [ .2 .25 .3 ]
AttributeBegin AreaLightSource "diffuse" "rgb L" [ 5 4 3 ]
  Shape "trianglemesh" "integer indices" [ 0 2 1 0 3 2 ] "point3 P" [ -1 3 -1  -1 3 1  1 3 1  1 3 -1 ] AttributeEnd
Texture "board" "spectrum" "checkerboard" "rgb tex1" [ .8 .8 .7 ] "rgb tex2" [ .1 .2 .1 ] "float uscale" 3 "float vscale" 2
Material "coateddiffuse" "texture reflectance" "board" "float roughness" .1
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -3 0 -3  -3 0 3  3 0 3  3 0 -3 ] "point2 uv" [ 0 0  0 1  1 1  1 0 ]
Material "conductor" "spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k" "float roughness" .1
AttributeBegin Translate -.7 .5 0 Shape "sphere" "float radius" .5 AttributeEnd
Material "diffuse" "rgb reflectance" [ .2 .3 .7 ]
AttributeBegin Translate .7 0 .2 Shape "plymesh" "string filename" "meshes/pawn.ply" AttributeEnd
"""

tap.main(globals())
