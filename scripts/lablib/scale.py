"""How long a frame takes on 1 ... 10,000 cores: a discrete-event model of `mpirun lull-render` (docs/scale.md).

The model is fed with what blocks of recorded views cost and where they stop, and with measured costs of messages and of checks."""
import heapq
import json
import math
import os
import struct
import subprocess
import sys
import tempfile

from lablib import plots, tables, tool
from lablib.tool import Refused

SOURCES = ("plugin-api/job/*.[ch]", "plugin-api/mpi/*.c", "pathtracer/render/farm.[ch]")

# As in pathtracer/render/render.c, plugin-api/job/message.h and farm.c.
SLICE_S, SLICE_PER_WORKER_S, LONGEST_SLICE_S, ROWS_PER_THREAD = 0.25, 0.004, 5.0, 128
TASKS, MOST_ROWS, SHARES = 2, 32, 4
BLOCK, SPP_MIN, SPP_MAX = 200, 16, 10000
SLICES_SIMULATED = 6  # of a wave; the others go at their mean speed


def last_level(path):
    """(samples per pixel, thread seconds until then) of a recorded block's last level (plugin-api/sequence/FORMAT.md)."""
    with open(path, "rb") as file:
        data, at, found = file.read(), 64, None
    for _ in range(struct.unpack_from("<I", data, 36)[0]):
        kind, spp, _, statistics, _, payload, _, _ = struct.unpack_from("<8I", data, at)
        for k in range(statistics):
            name, value = struct.unpack_from("<24sd", data, at + 32 + 32 * k)
            if kind == 1 and name.rstrip(b"\0") == b"seconds":
                found = (spp, value)
        at += 32 + payload
    if not found:
        raise Refused(f"{path}: no level with its seconds")
    return found


def read_blocks(folders):
    """[(thread seconds per sample of the whole block, samples at which it stops)]"""
    blocks = []
    for folder in folders:
        try:
            stops = {b["id"]: b["threshold"] for b in tool.load(folder, "labels.json")["blocks"]}
            for b in tool.load(folder, "manifest.json")["blocks"]:
                if b["id"] in stops:
                    spp, seconds = last_level(os.path.join(folder, b["file"]))
                    blocks.append((seconds / spp, min(max(stops[b["id"]], SPP_MIN), SPP_MAX)))
        except (OSError, ValueError, KeyError, struct.error) as why:
            raise Refused(f"{folder}: {why}") from why
    return blocks


class Machine:
    """Processes of `threads` each; rank 0 is the one that serves. Times in seconds."""

    def __init__(self, cores, most_threads, measured):
        self.processes = math.ceil(cores / most_threads)
        self.threads = math.ceil(cores / self.processes)
        self.cores = self.processes * self.threads  # a few more than asked for, if that is no multiple
        self.m = measured
        self.served_s = self.bytes = 0.0

    def serve_s(self, rows):
        """Rank 0's time for a task of so many rows, one way."""
        size = rows * (BLOCK * self.m["bytes_per_pixel"] + 56) + 64
        self.bytes += size
        return self.m["message_s"] + size * self.m["byte_s"]

    def slice_s(self, rows, row_s):
        """Wall seconds until so many rows of the same cost are done. Rank 0's first thread serves and samples in between."""
        if self.processes == 1:
            return math.ceil(rows / self.threads) * row_s
        left, clock = rows, 0.0  # clock: when the serving thread is free
        free = [0.0] * self.processes
        events, end = [], 0.0

        def deal(rank, now):
            nonlocal left, clock
            n = min(max(self.threads, min(left * self.threads // (SHARES * self.cores), self.threads * MOST_ROWS)), left)
            if n == 0:
                return
            left -= n
            cost = self.serve_s(n)
            self.served_s += cost
            clock = max(clock, now) + cost
            start = max(free[rank], clock + self.m["latency_s"])
            free[rank] = start + max(n / self.threads, 1.0) * row_s
            heapq.heappush(events, (free[rank] + self.m["latency_s"], rank, n))

        for _ in range(TASKS):
            for rank in range(1, self.processes):
                deal(rank, 0.0)
        others, here = self.threads - 1, 0.0  # rank 0's threads that never serve take rows all the time
        while events or left > 0:
            now = events[0][0] if events else max(here, clock)
            if left > 0:  # what rank 0 itself has sampled until then
                spare = others + (1.0 if clock < now else 0.0)
                own = min(left, max(0.0, (now - here) * spare / row_s))
                if not events:
                    own = left
                    now = max(here, clock) + own * row_s / max(spare, 1.0)
                left, here = left - int(own), now
                end = max(end, here)
            if events:
                t, rank, n = heapq.heappop(events)
                cost = self.serve_s(n)
                self.served_s += cost
                clock = max(clock, t) + cost
                end = max(end, clock)
                deal(rank, clock)
        return end

    def wave_s(self, work):
        """Wall seconds for a wave: [(thread seconds, rows)] of its blocks, the most expensive first."""
        total = sum(w for w, _ in work)
        rows = sum(r for _, r in work)
        span_s = min(SLICE_S + SLICE_PER_WORKER_S * (self.cores - self.threads), LONGEST_SLICE_S)
        capacity = span_s * self.cores
        slices = max(1, math.ceil(total / capacity))
        in_slice = min(rows, max(ROWS_PER_THREAD * self.cores, BLOCK)) if slices > 1 else rows
        part = min(slices, SLICES_SIMULATED)
        before = self.served_s, self.bytes
        wall = sum(self.slice_s(in_slice, total / slices / in_slice) for _ in range(part))
        self.served_s = before[0] + (self.served_s - before[0]) * slices / part
        self.bytes = before[1] + (self.bytes - before[1]) * slices / part
        return wall * slices / part

    def checks_s(self, count):
        """By the threads of rank 0."""
        return math.ceil(count / self.threads) * self.m["check_s"]


def render(blocks, machine, ratio):
    """(wall seconds, of them checks)"""
    active, spp, next_spp, wall, checks = list(blocks), 0.0, float(SPP_MIN), 0.0, 0.0
    while active:
        wall += machine.wave_s(sorted(((c * (next_spp - spp), BLOCK) for c, _ in active), reverse=True))
        checks += machine.checks_s(len(active))
        active = [b for b in active if b[1] > next_spp]
        spp, next_spp = next_spp, next_spp * ratio
    return wall + checks, checks


def predict(o, recorded, measured):
    rows = []
    for frame in o.frames.split(","):
        width, height = (int(n) for n in frame.split("x"))
        count = math.ceil(width / BLOCK) * math.ceil(height / BLOCK)
        blocks = [(c * o.work, n) for c, n in (recorded[i * 7919 % len(recorded)] for i in range(count))]
        work = None
        for cores in (int(n) for n in o.cores.split(",")):
            machine = Machine(cores, o.threads, measured)
            wall, checks = render(blocks, machine, measured["check_ratio"])
            if work is None:
                alone, one_checks = render(blocks, Machine(1, 1, measured), measured["check_ratio"])
                work = alone
            rows.append({"frame": frame, "blocks": count, "cores": cores, "seconds": wall, "efficiency": work / wall / machine.cores,
                         "criterion": checks / wall, "rank0": machine.served_s / wall, "bytes": machine.bytes})
    return rows


class Shared(Machine):
    """Processes of one thread, more than there are cores: each has its share of them, to compute and to serve."""

    def __init__(self, processes, cores, measured):
        self.slower = max(1.0, processes / cores)
        own = {k: v * (self.slower if k in ("message_s", "byte_s", "check_s") else 1.0) for k, v in measured.items()}
        super().__init__(processes, 1, own)

    def slice_s(self, rows, row_s):
        return super().slice_s(rows, row_s * self.slower)


def run_here(o, processes, folder):
    """The report of a uniform render by so many processes of one thread."""
    report = os.path.join(folder, "report.json")
    command = [o.program, o.here, "-q", "--size", o.size, "--spp", str(o.spp), "-t", "1",
               "-o", os.path.join(folder, "image.exr"), "--report", report]
    if processes > 1:
        command = ["mpirun", "--oversubscribe", "--bind-to", "none", "-n", str(processes)] + command
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise Refused(f"{' '.join(command)}: {done.stderr.strip().splitlines()[0] if done.stderr.strip() else 'failed'}")
    return tool.load(report)


def compare_here(o, measured):
    cores, rows, work = len(os.sched_getaffinity(0)), [], None
    with tempfile.TemporaryDirectory() as folder:
        for processes in (1, 2, 4, 8):
            report = run_here(o, processes, folder)
            seconds = report["totals"]["render_s"]
            # thread seconds and rows of each block, and what one process needs beside sampling
            if work is None:
                work = [(b["thread_s"], b["y1"] - b["y0"]) for b in report["blocks"]]
                beside = seconds - sum(s for s, _ in work)
                measured = dict(measured, bytes_per_pixel=report["memory"]["film_bytes_per_pixel"])
            machine = Shared(processes, cores, measured)
            predicted = beside + machine.wave_s(sorted(work, reverse=True))
            rows.append({"processes": processes, "cores": min(processes, cores), "measured_s": seconds,
                         "predicted_s": predicted, "ratio": predicted / seconds})
    return rows


HERE = ("processes of one thread", "cores", "measured, s", "predicted, s", "predicted / measured")
FRAMES = ("frame", "cores", "time, s", "efficiency", "criterion, of the time", "rank 0 serves, of the time", "GB sent")


def table(rows):
    if "processes" in rows[0]:
        return tables.table(HERE, [[str(r["processes"]), str(r["cores"]), "%.2f" % r["measured_s"], "%.2f" % r["predicted_s"], "%.3f" % r["ratio"]]
                                   for r in rows])
    return tables.table(FRAMES, [[r["frame"], f"{r['cores']:,}", f"{r['seconds']:,.4g}", f"{100 * r['efficiency']:.0f} %",
                                  f"{100 * r['criterion']:.1f} %", f"{100 * r['rank0']:.1f} %", f"{r['bytes'] / 1e9:,.3g}"] for r in rows])


def page(results, name):
    """One of the tables, and who measured it."""
    return "%s.\n\n%s" % (tables.provenance(results[name]["measured"]), table(results[name]["rows"]))


def draw(rows, path):
    charts = plots.charts()
    frames = {f: [r for r in rows if r["frame"] == f] for f in dict.fromkeys(r["frame"] for r in rows)}
    series = [charts.Series([r["cores"] for r in mine], [r["efficiency"] for r in mine], f, marker="o") for f, mine in frames.items()]
    plots.draw(*os.path.split(path), (900, 500), [charts.Chart(series, "", "cores", "efficiency", 10, y_range=(0, 1.05), key="lower left")])


def options(parser):
    parser.add_argument("recordings", nargs="*", metavar="RECORDING", help="a folder of lull-render --sequence that ggn label has labelled")
    parser.add_argument("--measured", metavar="FILE", default=os.path.join(tool.ROOT, "scripts", "scale.json"),
                        help="costs of messages and checks (scripts/scale.json)")
    parser.add_argument("--frames", default="1920x1080,3840x2160,15360x8640", help="WxH, comma separated (%(default)s)")
    parser.add_argument("--cores", default="1,2,4,8,16,64,256,1024,4096,10000", help="(%(default)s)")
    parser.add_argument("--threads", type=int, default=64, help="of each process, at most (64)")
    parser.add_argument("--work", type=float, default=1.0, metavar="FACTOR", help="how many times dearer a sample is than in the recordings")
    parser.add_argument("--png", type=tool.path, metavar="FILE", help="a picture of the efficiency too")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.add_argument("--here", metavar="SCENE", help="no recordings: render SCENE with 1, 2, 4 and 8 processes of this machine and compare "
                        "with the model, which is fed with the blocks of the first; wants a machine with nothing else to do")
    parser.add_argument("--size", default="800x600", help="of --here (%(default)s)")
    parser.add_argument("--spp", type=int, default=256, help="of --here (256)")
    parser.add_argument("--program", default=tool.RENDER)
    tool.writes(parser)


def main(o):
    measured = tool.load(o.measured)
    if not o.here and not o.recordings:
        raise Refused("a recording or --here SCENE is needed (see --help)")
    try:
        rows = compare_here(o, measured) if o.here else predict(o, read_blocks(o.recordings), measured)
    except (ValueError, KeyError) as why:
        raise Refused(str(why)) from why
    if o.json:
        json.dump(rows, sys.stdout, indent=1)
    else:
        print(table(rows), end="")
    if o.png:
        draw(rows, o.png)
    if o.write:
        name = "here" if o.here else "frames" if o.work == 1 else "work"
        tool.store(o.write, "scale", {**tool.results(o.write, "scale"), name: {"measured": tool.measured(), "rows": rows}})
