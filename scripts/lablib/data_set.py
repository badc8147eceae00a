"""Renders the block sequences that the models are trained, validated and tested on, as scripts/dataset.plan says.

The splits advance evenly. Of each, the faster half of its views comes first, and a half in four rounds, each a quarter of
every view: whenever it is stopped, what there is covers many scenes.
Resumable: stop it whenever you like (the block in hand is lost, all before it are safe) and run it again; finished blocks
are skipped. After each step it tells the time to go for the whole plan, measured from what was rendered in this run. Scenes
that are not here (../shared) are left out.

A line of the plan, fields apart by blanks, # begins a comment:
  SPLIT SCENE[/VIEW] FILE MINUTES LEVELS REFERENCE-SPP BLOCKS [EX EY EZ AX AY AZ UX UY UZ FOV]
MINUTES are those of two idle cores; the last ten numbers replace the file's camera (lull-render --look-at, --fov).
A line `film WIDTHxHEIGHT BLOCK` is for the lines after it; before it views are 800x800 pixels in blocks of 200.
docs/results/data-set.csv is the --csv of scripts/dataset.plan, ggn/models/*.data.csv of what a model was trained on; the data
themselves are not kept. Exit status: 0 all done, 2 bad plan or a scene that cannot be rendered, 130 interrupted."""
import csv
import os
import re
import shlex
import signal
import subprocess
import sys
import time

from lablib import tool
from lablib.tool import Refused

FILM = ("800x800", "200")
SPLITS = ("train", "validation", "test", "people")
EDGES = [20 * 2 ** k for k in range(9)]  # spp; the last column of the histogram ends at the cap


def options(parser):
    parser.add_argument("dir", nargs="?", type=tool.path, default=os.path.join(tool.ROOT, "data"), help="where they are (data)")
    parser.add_argument("--plan", default=os.path.join(tool.ROOT, "scripts", "dataset.plan"), help="scripts/dataset.plan")
    parser.add_argument("--only", metavar="SPLIT", help="only one of " + ", ".join(SPLITS))
    parser.add_argument("--threads", help="of the renderer (all processors)")
    parser.add_argument("--launcher", metavar="COMMAND", help='starts the renderer\'s processes, e.g. "mpirun -n 8 --hostfile HOSTS"')
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument("--list", action="store_true", help="print what would be rendered, in order, with planned minutes")
    shown.add_argument("--csv", action="store_true", help="print what is there: what was rendered, its checksums, the thresholds")
    shown.add_argument("--histogram", action="store_true", help="print how many blocks of each split have their threshold in which octave")


def parse_blocks(text):
    ids = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        ids += range(int(first), min(int(last or first), 9999) + 1)
    if not ids or len(set(ids)) != len(ids):
        raise ValueError
    return ids


def parse_entry(where, fields):
    if len(fields) not in (7, 17):
        raise Refused(f"{where}: {len(fields)} fields (expected 7, or 17 with a camera)")
    entry = dict(zip("split name file minutes levels reference blocks".split(), fields), camera=fields[7:])
    if entry["split"] not in SPLITS:
        raise Refused(f"{where}: split '{fields[0]}' (expected one of {', '.join(SPLITS)})")
    try:
        entry["ids"] = parse_blocks(entry["blocks"])
    except ValueError:
        raise Refused(f"{where}: blocks '{fields[6]}' (expected a list like 0,3,8-11)")
    for key, least in (("minutes", 0.001), ("reference", 0)):
        try:
            entry[key] = (float if key == "minutes" else int)(entry[key])
            if not least <= entry[key] < 1e9:
                raise ValueError
        except ValueError:
            raise Refused(f"{where}: {key} '{fields[3 if key == 'minutes' else 5]}' (expected a number)")
    return entry


def parse_film(where, fields):
    if len(fields) != 3 or not re.fullmatch(r"[1-9]\d{0,4}x[1-9]\d{0,4}", fields[1]) or not re.fullmatch(r"[1-9]\d{0,3}", fields[2]):
        raise Refused(f"{where}: '{' '.join(fields)}' (expected film WIDTHxHEIGHT BLOCK)")
    return tuple(fields[1:])


def read_plan(path):
    entries, folders, split_of, film = [], {}, {}, FILM
    for where, fields in tool.plan_lines(path):
        if fields[0] == "film":
            film = parse_film(where, fields)
            continue
        entry = {**parse_entry(where, fields), "film": film}
        scene = entry["name"].split("/")[0]
        if split_of.setdefault(scene, entry["split"]) != entry["split"]:
            raise Refused(f"{where}: scene '{scene}' is in {split_of[scene]} already (the split is by scene)")
        if entry["name"] in folders:
            raise Refused(f"{where}: {entry['name']} is on line {folders[entry['name']]} already")
        folders[entry["name"]] = where.rsplit(":", 1)[1]
        entries.append(entry)
    return entries


def steps_of(entries):
    """(entry, blocks, minutes) of one split: the faster half of the entries in rounds, then the slower half."""
    by_time = sorted(entries, key=lambda e: e["minutes"])
    middle = (len(by_time) + 1) // 2
    for half in (by_time[:middle], by_time[middle:]):
        for quarter in range(4):
            for e in half:
                # Of a view of 4 x 4 blocks each quarter has one in every row and every column.
                count = len(e["ids"])
                ids = sorted(e["ids"], key=lambda b: 5 * b % 16)[quarter * count // 4:(quarter + 1) * count // 4]
                if ids:
                    yield e, ids, e["minutes"] * len(ids) / count


def in_order(entries):
    """The steps of all splits: always the next of the split with the smallest share of its minutes behind it."""
    queues = {s: list(steps_of([e for e in entries if e["split"] == s])) for s in SPLITS}
    total = {s: sum(minutes for _, _, minutes in q) for s, q in queues.items()}
    spent = dict.fromkeys(SPLITS, 0.0)
    ordered = []
    while any(queues.values()):
        split = min((s for s in SPLITS if queues[s]), key=lambda s: (spent[s] + queues[s][0][2]) / total[s])
        ordered.append(queues[split].pop(0))
        spent[split] += ordered[-1][2]
    return ordered


def folder_of(root, entry):
    return os.path.join(root, entry["split"], entry["name"].replace("/", "-"))


def listed(ids):
    return ",".join(map(str, ids))


def missing(root, entry, ids):
    """Those of the blocks that the manifest does not list; lull-render itself checks that the others are whole."""
    try:
        there = {b["id"] for b in tool.load(folder_of(root, entry), "manifest.json")["blocks"]}
    except (OSError, Refused, KeyError, TypeError):
        there = set()
    return [b for b in ids if b not in there]


def command_of(root, entry, ids, threads, launcher):
    command = launcher + [tool.RENDER, "-q", entry["file"], "--size", entry["film"][0], "--block", entry["film"][1], "--sampler", "independent", "--light-selection", "power", "--name", entry["name"],
               "--levels", entry["levels"], "--reference-spp", str(entry["reference"]), "--blocks", listed(ids),
               "--sequence", folder_of(root, entry)]
    if entry["camera"]:
        command += ["--look-at", " ".join(entry["camera"][:9]), "--fov", entry["camera"][9]]
    return command + (["--threads", threads] if threads else [])


def hours(minutes):
    return f"{int(minutes) // 60}:{int(minutes) % 60:02d} h"


def say(text):
    print("lab data-set: " + text, flush=True)


def minutes_to_go(root, steps):
    return sum(minutes * len(missing(root, e, ids)) / len(ids) for e, ids, minutes in steps)


def render(root, steps, threads, launcher, interrupted):
    """The renderer's exit status, of the first that is not 0; ends early once `interrupted` is not empty."""
    planned = wall = 0.0
    for index, (entry, ids, minutes) in enumerate(steps):
        before, start = minutes_to_go(root, [(entry, ids, minutes)]), time.monotonic()
        status = subprocess.run(command_of(root, entry, ids, threads, launcher), stdin=subprocess.DEVNULL, cwd=tool.ROOT).returncode
        if status != 0 or interrupted:
            return status
        if before > 0:
            planned += before
            wall += (time.monotonic() - start) / 60
        speed = planned / wall if planned > 0 else 1.0
        left = minutes_to_go(root, steps[index + 1:])
        say(f"{index + 1} of {len(steps)} ({entry['split']} {entry['name']} {listed(ids)}); "
            f"to go: {hours(left / speed)} ({hours(left)} of two idle cores; so far at {speed:.2f} of their speed)")
    return 0


def views(root):
    for split in SPLITS[:3]:
        folder = os.path.join(root, split)
        for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else ():
            if os.path.exists(os.path.join(folder, name, "manifest.json")):
                yield split, os.path.join(folder, name)


def read(path):
    """The manifest, labels by block, and who says so."""
    manifest = tool.load(path, "manifest.json")
    if not os.path.exists(os.path.join(path, "labels.json")):
        return manifest, {}, "none"
    data = tool.load(path, "labels.json")
    return manifest, {b["id"]: b for b in data["blocks"]}, data["source"]


def list_blocks(root):
    out = csv.writer(sys.stdout, delimiter=";", lineterminator="\n")
    out.writerow("split scene view scene_crc32 block levels last_spp reference_spp sequence_crc32 label threshold "
                 "censored".split())
    for split, path in views(root):
        manifest, labels, source = read(path)
        for b in sorted(manifest["blocks"], key=lambda b: b["id"]):
            label = labels.get(b["id"])
            out.writerow([split, manifest["scene"], manifest["camera"], manifest["source_crc32"], b["id"],
                          len(manifest["levels"]), manifest["levels"][-1], manifest["reference_spp"], b["crc32"],
                          source if label else "none", round(label["threshold"], 1) if label else "",
                          int(label["censored"]) if label else ""])


def octave(label):
    """Index of the histogram's column."""
    return len(EDGES) + 1 if label["censored"] else sum(label["threshold"] >= e for e in EDGES)


def histogram(root):
    columns = ["<20"] + [f"-{e}" for e in EDGES[1:]] + ["-10000", "beyond"]
    counts = {s: [0] * len(columns) for s in SPLITS[:3]}
    scenes = {s: set() for s in SPLITS[:3]}
    for split, path in views(root):
        manifest, labels, _ = read(path)
        for b in manifest["blocks"]:
            if b["id"] in labels:
                counts[split][octave(labels[b["id"]])] += 1
                scenes[split].add(manifest["scene"])
    print(f"{'threshold, spp':<16}" + "".join(f"{c:>8}" for c in columns) + "  blocks scenes")
    for s in SPLITS[:3]:
        print(f"{s:<16}" + "".join(f"{n:8}" for n in counts[s]) + f"{sum(counts[s]):8}{len(scenes[s]):7}")


def main(o):
    if o.csv or o.histogram:
        if not os.path.isdir(o.dir):
            raise Refused(f"{o.dir} is not a folder")
        return (histogram if o.histogram else list_blocks)(o.dir)
    if o.only and o.only not in SPLITS:
        raise Refused(f"--only {o.only}: expected one of {', '.join(SPLITS)}")
    try:
        entries = [e for e in read_plan(o.plan) if o.only in (None, e["split"])]
    except (OSError, UnicodeDecodeError) as e:
        raise Refused(f"cannot read {o.plan}: {e}") from e
    here = [e for e in entries if os.access(os.path.join(tool.ROOT, e["file"]), os.R_OK)]
    for e in entries:
        if e not in here:
            say(f"{e['file']} is not here, {e['name']} is left out")
    steps = in_order(here)
    if o.list:
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        for e, ids, minutes in steps:
            left = len(missing(o.dir, e, ids))
            print(f"{e['split']:<10} {minutes:6.2f} min {left:2d} of {len(ids)} blocks missing  {e['name']} {listed(ids)}")
        print(f"to go: {hours(minutes_to_go(o.dir, steps))} of two idle cores")
        return 0
    for split in {e["split"] for e in here}:
        os.makedirs(os.path.join(o.dir, split), exist_ok=True)
    interrupted = []
    signal.signal(signal.SIGINT, lambda *_: interrupted.append(1))  # a terminal sends it to the renderer, too
    status = render(o.dir, steps, o.threads, shlex.split(o.launcher or ""), interrupted)
    if interrupted or status == 130:
        say("interrupted; run it again to go on")
        return 130
    return 0 if status == 0 else 2
