"""Records the whole frames that truth, cost, the kept picture and its network are measured on, as scripts/recordings.plan says.

Each line of the plan becomes DIR/SET/SCENE/SEED, a recording of format 2 (docs/recording.md) with all planes that a criterion may read; the
first seed has two references. What is whole is skipped, what is half done goes on: stop it whenever you like, and run it again. After each
recording it tells the time to go, by the pixel samples done in this run. Scenes that are not here (../shared) are left out."""
import os
import shlex
import sys
import time

from lablib import recordings, tool

PLAN = os.path.join(tool.ROOT, "scripts", "recordings.plan")


def options(parser):
    parser.add_argument("dir", nargs="?", type=tool.path, default=os.path.join(tool.ROOT, "..", "recordings"), help="where they are (../recordings)")
    parser.add_argument("--plan", type=tool.path, default=PLAN, help="scripts/recordings.plan")
    parser.add_argument("--only", metavar="SET", action="append", help="only this set of the plan; may be repeated")
    parser.add_argument("--threads", type=int, default=tool.THREADS, help="of the renderer (all processors)")
    parser.add_argument("--list", action="store_true", help="record nothing: print each recording, and whether it is whole")


def read_plan(path):
    """[recordings.Wanted], one for each seed of a line."""
    wanted = []
    with open(path, encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            fields = shlex.split(line, comments=True)
            if not fields:
                continue
            try:
                name, kind, scene, film, block, seeds, spp, reference_spp, *more = fields
                wanted += [recordings.Wanted(name, kind, scene, film, int(block), seed, int(spp), int(reference_spp) if seed == 1 else 0, tuple(more))
                           for seed in range(1, int(seeds) + 1)]
            except ValueError as why:
                raise tool.Refused("%s:%d: expected SET KIND SCENE FILM BLOCK SEEDS SPP REFERENCE-SPP [OPTIONS]" % (path, number)) from why
    return wanted


def main(o):
    wanted = [w for w in read_plan(o.plan) if not o.only or w.set in o.only]
    if not wanted:
        raise tool.Refused("%s: nothing to record%s" % (o.plan, " in " + ", ".join(o.only) if o.only else ""))
    here = [w for w in wanted if os.path.exists(w.file)]
    for w in wanted:
        if w not in here and w.seed == 1:
            print("%s is not here: left out" % w.scene, file=sys.stderr)
    if o.list:
        for w in here:
            print("%s %s %s" % ("whole  " if recordings.whole(o.dir, w) else "missing", w.kind, w.folder))
        return
    todo = [w for w in here if not recordings.whole(o.dir, w)]
    start, done, left = time.monotonic(), 0, sum(w.samples for w in todo)
    for i, w in enumerate(todo):
        recordings.record(o.dir, w, o.threads)
        done += w.samples
        to_go = (time.monotonic() - start) / done * (left - done) / 60
        print("%d of %d: %s; to go: %d:%02d h" % (len(here) - len(todo) + i + 1, len(here), w.folder, to_go // 60, to_go % 60), flush=True)
