"""Recordings: whole frames with references, as scripts/recordings.plan names them; and copies of views whose blocks are links, which jobs may
label without writing where the recordings lie."""
import json
import os
import shutil
from typing import NamedTuple

from lablib.tool import RENDER, ROOT, ggn, load, run

PLANES, STEP = "color,half,moment2,albedo,normal", 1.19  # a look's samples over those of the last


class Wanted(NamedTuple):
    """A frame to be recorded. reference_spp: of each of two references; 0: none. options: more words for lull-render."""
    set: str
    kind: str
    scene: str
    film: str
    block: int
    seed: int
    spp: int
    reference_spp: int
    options: tuple = ()

    @property
    def file(self):
        return os.path.join(ROOT, self.scene if self.scene.endswith(".pbrt") else "scenes/%s.pbrt" % self.scene)

    @property
    def name(self):
        """The scene's; of a file by another hand its folder's and its own."""
        stem = os.path.splitext(self.scene)[0].split("/")
        return stem[-1] if not self.scene.endswith(".pbrt") else "%s--%s" % (stem[-2], stem[-1])

    @property
    def folder(self):
        return "%s/%s/%d" % (self.set, self.name, self.seed)

    @property
    def samples(self):
        width, height = map(int, self.film.split("x"))
        return width * height * (self.spp + 2 * self.reference_spp)


def read(root, wanted):
    """The recording, or None: it is not there or not whole."""
    import lull.recording
    folder = os.path.join(root, wanted.folder)
    if not os.path.exists(os.path.join(folder, "manifest.json")):
        return None
    recording = lull.recording.read(folder)
    return recording if recording.finished and len(recording.references) == (2 if wanted.reference_spp else 0) else None


def whole(root, wanted):
    return read(root, wanted) is not None


def record(root, wanted, threads):
    """Records it, or goes on with it."""
    folder = os.path.join(root, wanted.folder)
    os.makedirs(folder, exist_ok=True)
    run(RENDER, "-q", wanted.file, "--size", wanted.film, "--block", wanted.block, "-t", threads, "--seed", wanted.seed, "--planes", PLANES,
        "--levels", "geometric:16:%d:%g" % (wanted.spp, STEP), "--sequence", folder,
        *(["--reference-spp", wanted.reference_spp] if wanted.reference_spp else []), *wanted.options)


def manifest_of(view):
    return load(view, "manifest.json")


def link_views(source, target, wanted=None, blocks=None):
    """Copies the views of the folder `source` into `target`, which is made anew, and returns the copies. `wanted`: names of those to
    copy, None for all. `blocks`: of each view the ids of the blocks to keep, None for all."""
    shutil.rmtree(target, ignore_errors=True)
    copies = []
    for name in sorted(os.listdir(source)):
        there, here = os.path.join(source, name), os.path.join(target, name)
        if not os.path.exists(os.path.join(there, "manifest.json")) or (wanted is not None and name not in wanted):
            continue
        os.makedirs(here)
        manifest = manifest_of(there)
        if blocks:
            manifest["blocks"] = [b for b in manifest["blocks"] if b["id"] in blocks[name]]
        with open(os.path.join(here, "manifest.json"), "w", encoding="utf-8") as file:
            json.dump(manifest, file)
        for block in manifest["blocks"]:
            os.symlink(os.path.abspath(os.path.join(there, block["file"])), os.path.join(here, block["file"]))
        copies.append(here)
    return copies


def people_views(human, source, target, blocks=None):
    """The same for views that people judged, labelled with their thresholds of `human`/human-thresholds.csv."""
    views = link_views(source, target, blocks, blocks)
    for view in views:
        ggn("label", "--human", os.path.join(human, "human-thresholds.csv"), "--view", os.path.basename(view) + "_part6", view)
    return views
