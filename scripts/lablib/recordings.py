"""Recordings that jobs may label: copies of views whose blocks are links, so that nothing is written where the recordings lie."""
import json
import os
import shutil

from lablib.tool import ggn, load


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
