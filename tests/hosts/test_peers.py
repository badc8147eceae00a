"""What scripts/lab peers makes of figures; and one tiny scene exported, rendered by both and compared. BUILD names the build folder."""
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
from lablib import peers  # noqa: E402


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


def test_one_scene():
    """a scene with coats, metal, a checkerboard and a lamp is exported, both renderers agree on it, and all ways are measured"""
    if not os.path.exists(peers.BPY):
        raise tap.Skip("no bpy in build/hosts: run make test-hosts")
    if not shutil.which("oiiotool"):
        raise tap.Skip("no oiiotool: package openimageio-tools")
    with tempfile.TemporaryDirectory() as work:
        command = [str(ROOT / "scripts/lab"), "peers", "--scenes", "test", "--size", "24", "--block", "12", "--seeds", "1",
                   "--reference-spp", "256", "--work", work]
        shutil.copytree(ROOT / "scenes" / "meshes", Path(work) / "meshes")
        (Path(work) / "test.pbrt").write_text(SCENE)
        command[3] = str(Path(work) / "test.pbrt")
        said = subprocess.run(command, capture_output=True, text=True)
        assert said.returncode == 0, said.stderr
        kept = json.loads(next(Path(work).glob("*.json")).read_text())
        assert kept["differ"] <= peers.AGREE, kept["differ"]
        text = next(Path(work).glob("*-256.pbrt")).read_text()
        assert "coated" not in text and "portal" not in text and "reflectance" in text
        for name in ("ours", "host", "cycles 0.1", "cycles n=64", "ours denoised", "host denoised", "cycles 0.1 denoised"):
            assert kept["ways"]["1 " + name]["s"] > 0 and len(kept["ways"]["1 " + name]["errors"]) == 4, name
        again = subprocess.run(command, capture_output=True, text=True)
        assert again.returncode == 0 and "| test | 1 |" in again.stdout and " s, worst " not in again.stdout


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
