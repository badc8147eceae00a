"""Holds --quote and the progress line against real renders: a table and a picture for docs/results/quote.md.

Every scene is quoted from a pilot and then rendered to its end, at most 2,000 spp. Times are thread seconds, so that other programs do
not count; of another size than 64 wall seconds too, with the threads that were at work. With --pilots the same scenes are quoted from
shorter pilots, and only samples count."""
import json
import math
import os
import pty
import re
import statistics
import subprocess
import sys

from lablib import plots, tables, tool
from lablib.sources import OBSERVER, PICTURES

SOURCES = PICTURES + OBSERVER + ("plugin-api/host/quote.c", "plugin-api/host/forecast.c", "pathtracer/render/quote.[ch]")
SIZE, BLOCK, MOST = 64, 32, 2000
PILOTS = ("pilot, spp", "scenes", "told", "interval holds, of those", "worst factor off, of those", "interval would hold, of those not told", "worst, of those")
HEAD = ("scene", "seen in tuning", "real: spp, thread s", "quoted: spp, thread s (interval)", "time quoted / real", "blocks inside",
        "light not met", "ETA at 10, 25, 50 %")
WALLS = ("scene", "spp", "thread s, quoted / real", "wall s, quoted / real", "threads at work", "wall at free processors, quoted / real",
         "blocks inside")


def options(parser):
    parser.add_argument("--scenes", metavar="FILE", help='the plan, one "ROLE PATH" a line (scripts/quote.plan)')
    parser.add_argument("--size", type=int, default=SIZE, help="pixels of a side (64); of another size only the cheap scenes of the plan")
    parser.add_argument("--block", type=int, default=BLOCK, help="(32)")
    parser.add_argument("--denoise", action="store_true", help="of pictures that are denoised")
    parser.add_argument("--pilots", metavar="N,N,...", type=lambda text: [int(n) for n in text.split(",")],
                        help="quote from pilots of so many samples, too, and tell how far those are off")
    parser.add_argument("--work", metavar="DIR", help="one file per scene, what is there is not made again (build/quote or build/quote-SIZE)")
    parser.add_argument("--program", default=tool.RENDER)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--tell", action="store_true", help="measure nothing: the table of what is there already")
    tool.writes(parser, ", draw DIR/results/quote.png")


def base(o, scene):
    return [o.program, scene, "--size", "%dx%d" % (o.size, o.size), "--block", str(o.block), "--spp-max", str(MOST),
            "--threads", str(o.threads), *(["--denoise"] if o.denoise else [])]


def cpu_s(pid):
    with open("/proc/%d/stat" % pid) as f:
        fields = f.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def startup_s(o, scene):
    """CPU seconds before the first sample, and of writing a picture."""
    child = subprocess.Popen(base(o, scene) + ["-q", "--spp-min", "1", "--spp-max", "1", "--preview",
                                                  os.path.join(o.work, "startup.png")])
    used = os.wait4(child.pid, 0)[2]
    return used.ru_utime + used.ru_stime


def render(o, scene, report):
    """A whole render on a terminal of ours: [[CPU seconds, percent, every block predicted], ...] as its live line told."""
    master, slave = pty.openpty()
    child = subprocess.Popen(base(o, scene) + ["--report", report, "--preview", report[:-12] + ".png"], stderr=slave,
                             stdout=subprocess.DEVNULL, preexec_fn=lambda: os.nice(10)) # so that we are never late to look
    os.close(slave)
    line_states = []
    while True:
        try:
            text = os.read(master, 65536).decode(errors="replace")
        except OSError:
            break
        percent = re.findall(r"(>=)? *(\d+)%", text)
        if percent:
            line_states.append([cpu_s(child.pid), int(percent[-1][1]), percent[-1][0] == ""])
    if child.wait() != 0:
        raise tool.Refused("%s: the render failed" % scene)
    return line_states


def measure(o, role, scene, path):
    quote = subprocess.run(base(o, scene) + ["--quote", "--json", "-q"], stdout=subprocess.PIPE, check=True,
                           preexec_fn=lambda: os.nice(10)).stdout
    report = path[:-5] + ".report.json"
    states = render(o, scene, report)
    report = tool.load(report)
    result = {"role": role, "scene": scene, "quote": json.loads(quote), "told": states, "startup_s": startup_s(o, scene),
              "wall_s": report["totals"]["render_s"], "threads": o.threads,
              "real": [{"spp": b["spp"], "thread_s": b["thread_s"], "reason": b["reason"]} for b in report["blocks"]]}
    tool.save(result, path, indent=None)


def quoted(o, scene, spp):
    """The row as asked, from a pilot of so many samples."""
    text = subprocess.run([*base(o, scene), "--quote", "--json", "-q", "--quote-pilot", "%d:1e9" % spp], stdout=subprocess.PIPE, check=True,
                          preexec_fn=lambda: os.nice(10)).stdout
    return [r for r in json.loads(text)["rows"] if r["as_asked"]][0]


def short(o, results):
    """One row of PILOTS for each pilot; an untold row's numbers are those of its blocks."""
    for pilot in o.pilots:
        said = []
        for result in results:
            row, real = quoted(o, result["scene"], pilot), result["real"]
            expected, low, high = (sum(b["spp"][k] for b in row["blocks"]) for k in ("expected", "low", "high"))
            seen = sum(b["spp"] for b in real)
            said.append((row["told"], low * 0.999 <= seen <= high * 1.001, math.exp(abs(math.log(expected / seen)))))
        parts = [[s for s in said if s[0] == told] for told in (True, False)]
        yield {"pilot": pilot, "scenes": len(said), "told": len(parts[0]), "holds": sum(s[1] for s in parts[0]),
               "worst": max((s[2] for s in parts[0]), default=None), "untold_holds": sum(s[1] for s in parts[1]),
               "untold_worst": max((s[2] for s in parts[1]), default=None)}


def pilots(results):
    kept = results["pilots"]
    rows = [[str(r["pilot"]), str(r["scenes"]), str(r["told"]), "%d of %d" % (r["holds"], r["told"]), tables.figure(r["worst"]),
             "%d of %d" % (r["untold_holds"], r["scenes"] - r["told"]), tables.figure(r["untold_worst"])] for r in kept["rows"]]
    return "%s.\n\n%s" % (tables.provenance(kept["measured"]), tables.table(PILOTS, rows))


def figures(result):
    row = [r for r in result["quote"]["rows"] if r["as_asked"]][0]
    real = result["real"]
    seconds = sum(b["thread_s"] for b in real)
    expected, told = row["thread_s"]["expected"], row.get("told", True)
    inside = [q["spp"]["low"] * 0.999 <= b["spp"] <= q["spp"]["high"] * 1.001 for q, b in zip(row["blocks"], real)]
    pilot = [b["pilot_spp"] for b in result["quote"]["blocks"]]
    open_ = [i for i in range(len(real)) if real[i]["spp"] > pilot[i]]
    eta = []
    for share in (0.10, 0.25, 0.50): # the total that the line's per cent imply, over the real one
        near = [(cpu - result["startup_s"], percent) for cpu, percent, known in result["told"]
                if cpu - result["startup_s"] >= share * seconds and percent > 0 and known]
        late = seconds < 2.0 or not near or near[0][0] > (share + 0.1) * seconds
        eta.append(None if late else near[0][0] / (near[0][1] / 100.0) / seconds)
    return {"scene": os.path.basename(result["scene"])[:-5], "role": result["role"],
            "spp": sum(b["spp"] for b in real) / len(real), "said_spp": row["spp_mean"]["expected"],
            "s": seconds, "said_s": expected, "low_s": row["thread_s"]["low"], "high_s": row["thread_s"]["high"],
            "ratio": expected / seconds if told else None, "told": told,
            "holds": told and row["thread_s"]["low"] <= seconds <= row["thread_s"]["high"],
            "spp_holds": told and row["spp_mean"]["low"] * 0.999 <= sum(b["spp"] for b in real) / len(real) <= row["spp_mean"]["high"] * 1.001,
            "inside": sum(inside), "blocks": len(inside),
            "open_inside": sum(inside[i] for i in open_), "open": len(open_),
            "unmet": sum(not q.get("met_light", True) for q in row["blocks"]), "eta": eta}


def cells(r):
    return [r["scene"], "yes" if r["role"] == "tuned" else "no", "%.0f, %.1f" % (r["spp"], r["s"]),
            "%.0f, %.1f (%.1f to %.1f)" % (r["said_spp"], r["said_s"], r["low_s"], r["high_s"]) if r.get("told", True) else "not told",
            "**%s**" % tables.figure(r["ratio"]),
            "%d of %d" % (r["inside"], r["blocks"]), str(r["unmet"] or ""), ", ".join(tables.figure(e) for e in r["eta"])]


def summary(rows):
    """Figures of some rows together; of the ETA at 10, 25, 50 %: median and worst factor off, and of how many scenes."""
    off = lambda values: sorted(math.exp(abs(math.log(v))) for v in values)
    ratios, etas = off(r["ratio"] for r in rows if r["told"]), [off(r["eta"][k] for r in rows if r["eta"][k] is not None) for k in range(3)]
    return {"scenes": len(rows), "told": len(ratios), "near": sum(x <= 1.35 for x in ratios), "median": statistics.median(ratios), "worst": ratios[-1],
            **{key: sum(r[key] for r in rows) for key in ("holds", "spp_holds", "inside", "blocks", "open_inside", "open")},
            "eta": [[statistics.median(x), x[-1], len(x)] if x else None for x in etas]}


def accuracy(s, name):
    share = lambda part, whole: "%d of %d (%.0f %%)" % (s[part], s[whole], 100 * s[part] / max(1, s[whole]))
    eta = ["at %d %% of the time %.2f (worst %.2f; %d scenes)" % (at, *e) for at, e in zip((10, 25, 50), s["eta"]) if e]
    lines = ["time within 35 %% in %s, median factor off %.2f, worst %.2f" % (share("near", "scenes"), s["median"], s["worst"]),
             "interval of the time holds in %d" % s["holds"] + ("" if "told" not in s else
             ", that of the samples in %d, of %d that were told a number" % (s["spp_holds"], s["told"])),
             "blocks inside their interval: " + share("inside", "blocks")]
    if "open" in s:
        lines.append("of those that the pilot left open: " + share("open_inside", "open"))
    lines.append("\n  - ".join(["total that the progress line's share implies, median factor off:", *eta]))
    return "**%s** (%d scenes):\n\n%s\n" % (name, s["scenes"], "\n".join("- " + line for line in lines))


def kept(rows, large):
    """What is shown of a run: its rows, and what they come to."""
    roles = {"Together": ("held", "tuned")} if large else {"Not seen in tuning": ("held",), "Seen in tuning": ("tuned",)}
    chosen = {name: [r for r in rows if r["role"] in of] for name, of in roles.items()}
    return {"rows": rows, "summary": {name: summary(some) for name, some in chosen.items() if some}}


def text(run):
    shown = walls(run["rows"]) if "Together" in run["summary"] else tables.table(HEAD, [cells(r) for r in sorted(run["rows"], key=lambda r: r["role"])])
    return "\n".join([shown, *[accuracy(s, name) for name, s in run["summary"].items()]])


def draw(rows, folder):
    charts = plots.charts()
    ends = [f(r[k] for r in rows if r["told"] for k in ("s", "low_s", "high_s")) for f in (min, max)]
    series = [charts.Series(ends, [e * off for e in ends], title, "#888888", line)
              for off, title, line in ((1, "exact", "-"), (1.35, "35 %", "--"), (1 / 1.35, "", "--"))]
    for role, title, colour in (("held", "not seen in tuning", "#1f77b4"), ("tuned", "seen in tuning", "#d62728")):
        mine = [r for r in rows if r["role"] == role]
        mine = [r for r in mine if r["told"]]
        series.append(charts.Series([r["s"] for r in mine], [r["said_s"] for r in mine], title, colour, "", "o", filled=role == "held",
                                    spans=[(r["low_s"], r["high_s"]) for r in mine]))
    plots.draw(folder, "quote.png", (720, 560), [charts.Chart(series, "", "real thread seconds", "quoted thread seconds", 10, 10, key="upper left")])


def with_walls(result):
    """Wall seconds, quoted for free processors, and how many of the threads were at work meanwhile."""
    f, row = figures(result), [r for r in result["quote"]["rows"] if r["as_asked"]][0]
    expected, wall, busy = row["wall_s"]["expected"], result["wall_s"], f["s"] / result["wall_s"]
    if expected is None:
        return f
    return {**f, "said_wall_s": expected, "wall_s": wall, "wall_ratio": expected / wall, "busy": busy, "threads": result["threads"],
            "free_ratio": expected / (wall * min(busy, result["threads"]) / result["threads"])}


def walls(rows):
    rows = [r for r in rows if r.get("told", True)]
    return tables.table(WALLS, [[r["scene"], "%.0f" % r["spp"], "%.1f / %.1f = %.2f" % (r["said_s"], r["s"], r["ratio"]),
                                 "%.1f / %.1f = %.2f" % (r["said_wall_s"], r["wall_s"], r["wall_ratio"]),
                                 "%.2f of %d" % (r["busy"], r["threads"]), tables.figure(r.get("free_ratio")),
                                 "%d of %d" % (r["inside"], r["blocks"])] for r in rows])


def page(results, kind):
    """One of the runs (small, large), and who measured it."""
    return "%s.\n\n%s" % (tables.provenance(results[kind]["measured"]), text(results[kind]))


def main(o):
    small = o.size == SIZE
    plan = [words for _, words in tool.plan_lines(o.scenes or os.path.join(tool.ROOT, "scripts", "quote.plan"))]
    name = "denoised" if o.denoise else "small" if small else "large"
    o.work = o.work or os.path.join(tool.BUILD, {"small": "quote", "denoised": "quote-denoised"}.get(name, "quote-%d" % o.size))
    os.makedirs(o.work, exist_ok=True)
    rows, results = [], []
    for role, scene, *cheap in plan:
        if not (small or cheap or o.scenes):
            continue
        path = os.path.join(o.work, os.path.basename(scene)[:-5] + ".json")
        if not os.path.exists(path):
            if o.tell:
                continue
            if not os.path.exists(scene):
                print("lab quote-accuracy: %s is not here, left out" % scene, file=sys.stderr)
                continue
            measure(o, role, scene, path)
        results.append(tool.load(path))
        rows.append(with_walls(results[-1]))
        print("| %s |" % " | ".join(cells(rows[-1])), flush=True)
    run = kept(rows, not small)
    print(text(run))
    found = {name: {"measured": tool.measured(), **run}}
    if o.pilots:
        found["pilots"] = {"measured": tool.measured(), "rows": list(short(o, results))}
        print(pilots(found))
    if o.write:
        tool.store(o.write, "quote", {**tool.results(o.write, "quote"), **found})
        if name == "small":
            draw(rows, os.path.join(o.write, "results"))
