"""What accuracy costs: every criterion over the range of its parameters, on recorded test blocks and in real renders.

Every step is kept as soon as it is done: interrupted, --only goes on with the others. Times are processor seconds of all threads, so
that a busy machine disturbs them less; prices of checks are measured in this run, in real renders. Networks that are not shipped (of
lab ablation, of the published preset) and baselines that are not (`ggn baseline svd-entropy`) are taken from BUILD/cost/models and
BUILD/cost. Needs matplotlib and oiiotool."""
import glob
import json
import os
import re
import resource
import statistics

from lablib import cost_page, plots, sources, tool
from lablib.cost_figures import bare
from lablib.recordings import link_views, manifest_of, people_views
from lablib.tool import BUILD, GGN, RENDER, ROOT, Refused, ggn, run

WORK = os.path.join(BUILD, "cost")
CADENCES = (1.05, 1.15, 1.2565, 1.5, 2)


def options(parser):
    parser.add_argument("--data", type=tool.path, default=os.path.join(ROOT, "data"),
                        help="recordings of lab data-set (data): test views are replayed")
    parser.add_argument("--render", type=tool.path, metavar="DIR", help="make the test views anew there first (hours)")
    parser.add_argument("--plan", type=tool.path, help="of --render (scripts/dataset.plan)")
    parser.add_argument("--people", type=tool.path, default=os.path.join(tool.SHARED, "human"), help="../shared/human")
    parser.add_argument("--model", type=tool.path, action="append", help="networks, the default first (ggn/models, BUILD/cost/models)")
    parser.add_argument("--baseline", type=tool.path, action="append", help="(ggn/models, BUILD/cost)")
    parser.add_argument("--only", default=",".join((*STEPS, "draw")), metavar="STEPS", help="some of %(default)s; the others' figures are kept")
    parser.add_argument("--threads", type=int, default=tool.THREADS)
    parser.add_argument("--rounds", type=int, default=2, help="of price (2)")
    parser.add_argument("--real-scenes", type=int, default=3, help="of real (3)")
    parser.add_argument("--out", type=tool.path, default=tool.DOCS, help="for results/cost.json, cost.md and cost-*.png of results/ (docs)")


def shipped(o):
    return [x for m in o.model if os.path.dirname(m).endswith("ggn/models") for x in ("-m", m)]


def networks(o):
    return [x for m in o.model for x in ("-m", m)]


def baselines(o):
    return [x for b in o.baseline for x in ("--baseline", b)]


KEYS = ("blocks", "samples", "sampling_s", "checks_full", "noisy", "early", "worst", "uniform_spp", "time_ratio", "samples_ratio",
        "flip", "relmse")


def defaults():
    """{criterion: [parameter, value]}: what a user gets who says nothing else, as the renderer tells it."""
    return {name: [parameter, tool.default(name, parameter)] for name, parameter in
            (("observer", "visible"), ("variance", "threshold"), ("halfbuf", "threshold"))}


def real_points(out):
    return (("observer", "visible", 0.5), ("observer", *out["defaults"]["observer"]), ("variance", "threshold", 0.08))


def slim(data, out):
    """What the page needs: stops of the defaults alone, figures as lists in the order of `keys`, of networks that are not shipped
    few settings."""
    data["keys"] = KEYS
    data["points"] = [p for p in data["points"] if not p["criterion"].startswith(("paper", "window")) or p["dial"] in ("own", "visible")]
    for p in data["points"]:
        if p["dial"] != "own" and p["criterion"] != "limit" and out["defaults"].get(bare(p["criterion"])) != [p["dial"], p["value"]] \
                and (p["criterion"], p["dial"], p["value"]) not in real_points(out):
            del p["stops"]
        p["scenes"] = {s: [f[k] for k in KEYS] for s, f in p["scenes"].items()}
    return data


def inspected(model):
    """Sizes of a network: multiplications of a decision, and the denoiser's share, of which a first window takes several."""
    text = ggn("inspect", model)
    macs = [int(x) for x in re.findall(r"(\d+) MAC$", text, re.M)]
    return {"preset": re.search(r"preset +(\S+)", text).group(1), "window": int(re.search(r"window of (\d+)", text).group(1)),
            "macs": macs[0] + 2 * macs[1] + macs[2], "denoiser": macs[0] / (macs[0] + 2 * macs[1] + macs[2]),
            "picture": "not taken" not in text}


def cost_of(out, folder, *options):
    return slim(json.loads(ggn("cost", "-d", os.path.join(WORK, folder), *options)), out)


def measured_anew(out, name, folder, *options):
    """A set. Thresholds of the blocks' parts stay those of before: what made them, `ggn cost --sizes`, is gone (commit 0a3aff1d)."""
    found, before = cost_of(out, folder, *options), out["sets"].get(name, {})
    out["sets"][name] = {**found, "parts": before["parts"]} if "parts" in before else found


def replay(o, out):
    """The test views, labelled by the observer."""
    views = link_views(os.path.join(o.data, "test"), os.path.join(WORK, "data/test"))
    ggn("label", "--threads", o.threads, *views)
    measured_anew(out, "test", "data", "--threads", o.threads, *baselines(o))
    out["references"], foreign = {}, set()
    for view in views:
        manifest = manifest_of(view)
        spp = str(manifest["reference_spp"])
        out["references"][spp] = out["references"].get(spp, 0) + len(manifest["blocks"])
        if manifest["blocks"] and not manifest["source"].startswith("scenes/"):
            foreign.add(manifest["scene"])
    out["foreign"] = len(foreign)


def recorded(o, out):
    """Nothing simulated: the observer asks the halves that each level really had, and not those that gave the block its threshold."""
    out["sets"]["recorded"] = cost_of(out, "data", "--recorded", "--no-quality", "--threads", o.threads, *baselines(o))


def judged(o, out, name, *options, folder="data"):
    """Adds what networks do to a set that is there without them."""
    of_network = lambda p: ".ggn" in p["criterion"]
    points = cost_of(out, folder, "--threads", o.threads, *options)["points"]
    new = {p["criterion"] for p in points if of_network(p)}
    out["sets"][name]["points"] = [p for p in out["sets"][name]["points"] if p["criterion"] not in new] + [p for p in points if of_network(p)]


def introduce(o, out):
    """What the page says of a network besides its figures; of every one that a step has measured."""
    out.setdefault("networks", {}).update({os.path.basename(m): inspected(m) for m in o.model})
    out.setdefault("commits", {}).update({os.path.basename(m): tool.commit("--", m) for m in o.model})


def judge(o, out):
    """The networks on the blocks of `replay` and `recorded`."""
    introduce(o, out)
    judged(o, out, "test", "-m", o.model[0])
    judged(o, out, "recorded", "--recorded", "--no-quality", *shipped(o))
    judged(o, out, "recorded", "--recorded", "--no-quality", "--no-pictures", *shipped(o))


def pictured(block, spp, panel):
    """One recorded block as it was at spp; returns its pixels."""
    view = os.path.join(WORK, "data", "test", block["view"])
    manifest = manifest_of(view)
    where = next(b for b in manifest["blocks"] if b["id"] == block["id"])
    table, whole = os.path.join(WORK, "stops.csv"), os.path.join(WORK, "whole.png")
    with open(table, "w") as stops:
        stops.write("view;" + "%d;" % spp * (manifest["width"] // 200 * (manifest["height"] // 200)) + "\n")
    ggn("reconstruct", view, "-s", table, "-v", "view", "-o", whole)
    run("oiiotool", whole, "--cut", "200x200+%d+%d" % (where["x0"], where["y0"]), "--ch", "R,G,B", "-d", "uint8", "-o", panel)
    with open(panel, "rb") as f:
        return f.read()[-3 * 200 * 200:]


def noisiest(early, last):
    """Corner of the 50x50 pixels of a block that differ most."""
    def difference(x, y):
        rows = [slice(3 * (200 * (y + k) + x), 3 * (200 * (y + k) + x + 50)) for k in range(0, 50, 2)]
        return sum((a - b)**2 for r in rows for a, b in zip(early[r], last[r]))
    return max(((x, y) for y in range(0, 151, 25) for x in range(0, 151, 25)), key=lambda at: difference(*at))


def failures(points, blocks, defaults):
    """(criterion, stops, block): a caustic without the guard against rare bright paths; of each default the block, another each
    time, that it leaves noisiest, if it stops that early."""
    rows = []
    for p in points:
        name = bare(p["criterion"])
        own = defaults.get(name, ["own", p["value"]]) == [p["dial"], p["value"]]
        if "stops" not in p or not own or name.startswith(("limit", "window", "paper")):
            continue
        caustic = [b for b in blocks if b["scene"] == "caustic-glass"]
        if p["criterion"] == "halfbuf, no guard" and caustic:
            rows.insert(0, (p["criterion"], p["stops"], max(caustic, key=lambda b: b["threshold"] / p["stops"][b["place"]])))
        elif p["criterion"] == name:
            others = [b for b in blocks if all(b is not r[2] for r in rows)]
            worst = max(others, key=lambda b: b["threshold"] / p["stops"][b["place"]], default=None)
            if worst and p["stops"][worst["place"]] < 0.8 * worst["threshold"]:
                rows.append((p["criterion"], p["stops"], worst))
    return rows[:6]


def early(o, out):
    """Recorded blocks as they were when a criterion stopped them, beside the observer's stop and the last level."""
    data, panels = out["sets"]["recorded"], []
    blocks = [dict(b, scene=scene) for scene, s in data["scenes"].items() for b in s["blocks"]]
    observer = next(p for p in data["points"] if (p["criterion"], p["dial"], p["value"]) == ("observer", *out["defaults"]["observer"]))["stops"]
    out["early"] = []
    for criterion, stops, block in failures(data["points"], blocks, out["defaults"]):
        place, last = block["place"], block["cap"]
        files = [os.path.join(WORK, "panel%d.ppm" % (len(panels) + k)) for k in range(3)]
        pixels = [pictured(block, min(spp, last), file) for spp, file in zip((stops[place], observer[place], last), files)]
        x, y = noisiest(pixels[0], pixels[2])
        for file in files:
            panels.append(file[:-4] + ".png")
            run("oiiotool", file, "--cut", "50x50+%d+%d" % (x, y), "--resize:filter=box", "200x200", "-o", panels[-1])
        out["early"].append({"scene": block["scene"], "view": block["view"], "block": block["id"], "criterion": criterion,
                             "threshold": block["threshold"], "stop": stops[place], "observer": observer[place], "last": last, "at": [x, y]})
    if panels:
        run("oiiotool", *panels, "--mosaic:pad=4", "3x%d" % (len(panels) // 3), "-o", os.path.join(o.out, "results", "cost-early.png"))


def few_views(o):
    """A view of every test scene, linked and labelled apart: mostly one block."""
    taken, count = set(), set()
    test = os.path.join(o.data, "test")
    for name in sorted(os.listdir(test)):
        if os.path.exists(os.path.join(test, name, "manifest.json")):
            manifest = manifest_of(os.path.join(test, name))
            if manifest["scene"] not in count and manifest["blocks"]:
                count.add(manifest["scene"])
                taken.add(name)
    views = link_views(test, os.path.join(WORK, "few/test"), taken)
    ggn("label", "--threads", o.threads, *views)


def cadence(o, out):
    """Some blocks of every scene: all networks, and levels made anew from the halves, at every ratio alike, everybody asked as often."""
    few_views(o)
    introduce(o, out)
    out["sets"]["few"] = cost_of(out, "few", "--recorded", "--no-quality", "--threads", o.threads, *networks(o))
    out["cadence"] = {}
    for ratio in CADENCES:
        asked = baselines(o) if ratio > 1.2 else []  # an answer of `attributes` takes longer than the network's
        out["cadence"]["%g" % ratio] = cost_of(out, "few", "--cadence", ratio, "--no-quality", "--threads", o.threads, "-m", o.model[0], *asked)


def people(o, out):
    """The views that people judged, every one by an observer fitted to the others; two baselines also by their published thresholds."""
    views = os.path.join(o.people, "views")
    if not os.path.isdir(views):
        return
    people_views(o.people, views, os.path.join(WORK, "people/people"))
    published = [x for k in ("SVD-Entropy", "26-attributes") for x in ("--thresholds", os.path.join(o.people, k + "-thresholds.csv"))]
    options = ("--split", "people", "--no-quality", "-O", "ggn/sight/observer.json")
    measured_anew(out, "people", "people", *options, "--threads", o.threads, *shipped(o), *baselines(o), *published)
    judged(o, out, "people", *options, "--no-pictures", *shipped(o), folder="people")


def report_of(*arguments):
    path = os.path.join(WORK, "report.json")
    run(RENDER, "-q", "--report", path, "-o", os.path.join(WORK, "out.exr"), *arguments)
    report = tool.load(path)
    totals = report["totals"]
    totals["sampling_thread_s"] = sum(b["thread_s"] for b in report["blocks"])
    totals["checks"] = sum(b["checks"] for b in report["blocks"])
    totals["stops"] = {b["id"]: b["spp"] for b in report["blocks"]}
    return totals


def criteria_of(o):
    """Name in the replay: criterion of the renderer, and parameters with which it never stops. null: cheap checks only."""
    never = {"uniform": ("null", ()), "variance": ("variance", ("threshold=0",)), "halfbuf": ("halfbuf", ("threshold=0",)),
             "observer": ("observer", ("visible=0.0001", "growth=1.05"))}
    for m in o.model:
        never[os.path.basename(m)] = ("ggn", ("model=" + os.path.abspath(os.path.join(ROOT, m)), "visible=0", "first-spp=4"))
    for b in o.baseline:
        name = os.path.basename(b)[:-len(".ggn")]
        never[name] = (name, ("model=" + os.path.abspath(os.path.join(ROOT, b)), "visible=0", "first-spp=4"))
    return never


def check_price(criterion, params, side, most, long):
    """Thread seconds of one check of one block: by difference of a long and a short render of the same picture of `most` pixels'
    side, so that what a window or a frame costs once is not in it."""
    common = ["scenes/cornell-box.pbrt", "--size", "%dx%d" % (most, most), "--block", side, "--threads", 1, "-c", criterion, "--spp-min", 4,
              "--max-depth", 1, *[x for p in params for x in ("-p", p)]]
    a, b = report_of(*common, "--spp-max", 16), report_of(*common, "--spp-max", long)
    checks = b["checks"] - a["checks"]
    return ((b["criterion_thread_s"] - a["criterion_thread_s"]) / checks if checks > 0 else 0.0), checks


def price(o, out):
    """Of blocks of 200x200 pixels, every criterion in turn, the least of the rounds; of the default and the network by block size."""
    found = {name: [] for name in criteria_of(o)}
    for _ in range(o.rounds):
        for name, (criterion, params) in criteria_of(o).items():
            found[name].append(check_price(criterion, params, 200, 200, 40))
    out["prices"] = {name: {"check_s": min(s for s, _ in f), "most_s": max(s for s, _ in f), "checks": f[0][1], "rounds": len(f)}
                     for name, f in found.items()}
    once = report_of("scenes/cornell-box.pbrt", "--size", "200x200", "--block", 200, "--threads", 1, "-c", "fixed", "-p", "spp=8", "--max-depth", 1)
    out["prices"]["fixed"] = {"check_s": once["criterion_thread_s"] / max(1, once["checks"]), "checks": once["checks"], "rounds": 1}
    out["sides"] = []
    for name in ("variance", "halfbuf", "observer", os.path.basename(o.model[0])):
        criterion, params = criteria_of(o)[name]
        for side in (50, 100, 200, 400):
            seconds, checks = check_price(criterion, params, side, 400, 24)
            out["sides"].append({"criterion": name, "side": side, "check_s": seconds, "checks": checks})
    for name, p in out["prices"].items():
        print("%-24s %8.3f ms a check" % (name, 1e3 * p["check_s"]), flush=True)


def camera_of(manifest):
    command = []
    if "look_at" in manifest:
        command = ["--look-at", " ".join("%.17g" % x for x in manifest["look_at"])]
    return command + (["--fov", manifest["fov"]] if manifest.get("fov") else [])


def replayed_stop(out, point, block):
    """From the recorded levels alone; None: the block's threshold lies beyond them."""
    data = out["sets"]["recorded"]
    place = [b["place"] for s in data["scenes"].values() for b in s["blocks"] if (b["view"], b["id"]) == (block["view"], block["id"])]
    for p in data["points"]:
        if place and (p["criterion"], p["dial"], p["value"]) == point:
            return p["stops"][place[0]]
    return None


def real(o, out):
    """Recorded blocks rendered again under a criterion: the same samples, so that stops can be compared one by one."""
    out["real"], out["real_revision"] = [], tool.commit()
    test = os.path.join(o.data, "test")
    # the cheapest blocks that are no trivial ones, one of each scene
    ready = sorted((b["threshold"] * b["us_per_path"], scene, b) for scene, s in out["sets"]["test"]["scenes"].items() for b in s["blocks"]
                   if b["threshold"] >= 25)
    seen = set()
    for _, scene, recorded in ready:
        manifest = manifest_of(os.path.join(test, recorded["view"]))
        if len(seen) == o.real_scenes or scene in seen or not os.path.exists(os.path.join(ROOT, manifest["source"])):
            continue
        seen.add(scene)
        view, block = recorded["view"], next(b for b in manifest["blocks"] if b["id"] == recorded["id"])
        for point in real_points(out):
            totals = report_of(manifest["source"], "--size", "%dx%d" % (manifest["width"], manifest["height"]), "--crop",
                               "%d,%d,%d,%d" % (block["x0"], block["y0"], block["x1"], block["y1"]), "--sampler", "independent",
                               "--light-selection", "power", "--threads", 1, "--spp-max", 4096, "-c", point[0], "-p", "%s=%g" % point[1:], *camera_of(manifest))
            out["real"].append({"scene": manifest["scene"], "view": view, "block": block["id"], "criterion": point[0],
                                "params": "%s=%g" % point[1:], "stop": max(totals["stops"].values()), "threshold": recorded["threshold"],
                                "replayed": replayed_stop(out, point, recorded), "levels": manifest["levels"],
                                "sampling_s": totals["sampling_thread_s"], "criterion_s": totals["criterion_thread_s"],
                                "checks": totals["checks"], "recorded_us": recorded["us_per_path"]})
            print("real: %(scene)s block %(block)d %(criterion)s %(params)s: %(stop)d spp" % out["real"][-1], flush=True)


def grow(o, out):
    """How a render's checks grow with its resolution and with threads (the picture is cheap on purpose)."""
    out["growth"] = []
    network = ("ggn", ("model=" + os.path.abspath(os.path.join(ROOT, o.model[0])), "visible=0", "first-spp=1"), 6)
    observer = ("observer", ("visible=0.0001", "first-spp=4", "growth=1.05"), 5)
    for (criterion, params, spp), plan in ((observer, ((200, 1), (400, 1), (800, 1), (800, 2), (1600, 1), (4000, 2))),
                                           (network, ((200, 1), (400, 1), (800, 1), (800, 2)))):
        for side, threads in plan:
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
            totals = report_of("scenes/cornell-box.pbrt", "--size", "%dx%d" % (side, side), "--block", 200, "--threads", threads, "--spp-min", 1, "--spp-max",
                               spp, "--max-depth", 1, "-c", criterion, *[x for p in params for x in ("-p", p)])
            most = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
            out["growth"].append({"criterion": criterion, "side": side, "threads": threads, "spp": spp, "blocks": len(totals["stops"]),
                                  "checks": totals["checks"], "criterion_s": totals["criterion_thread_s"],
                                  "sampling_s": totals["sampling_thread_s"], "criterion_wall_s": totals["criterion_s"],
                                  "render_wall_s": totals["render_s"], "peak_mb": most / 1024 if most > before else None})


# --- precision and stability ---------------------------------------------------------------------------------------------------


def golden(isa, *options):
    return json.loads(tool.bench("ggn_golden", "--threads", "1", *options, env={"LULL_ISA": isa}))["p"]


def pictures_of(program, *options):
    """Checksums of the pixels of a few small renders, all channels."""
    found = {}
    for scene in ("cornell-box", "glass", "glossy", "fog-room", "many-lights", "defocus", "alpha", "environment"):
        path = os.path.join(ROOT, "scenes", scene + ".pbrt")
        if os.path.exists(path):
            out = os.path.join(WORK, "picture.exr")
            run(program, "-q", path, "--reproducible", "--size", "48x48", "--block", 16, "--spp-max", 64, "-c", "variance", "-p", "threshold=0.2",
                "-o", out, *options)
            found[scene] = [line for line in run("oiiotool", "--info", "--hash", out).splitlines() if "SHA-1" in line]
    return found


def other_builds():
    """The whole product at other -O levels: {name: its folder}. -O3 is the product's own."""
    run("nice", "-n", 8, "make", "-s", "-j2", "MODE=debug", "all")
    run("nice", "-n", 8, "make", "-s", "-j2", "OUT=build/o2", "CFLAGS=-O2", "all")
    return {"-O0": os.path.join(ROOT, "build", "debug"), "-O2": os.path.join(ROOT, "build", "o2")}


def flushing():
    """A library whose loading switches a process to flush-to-zero and denormals-are-zero, as -ffast-math has it."""
    path = os.path.join(WORK, "flush.so")
    run("gcc", "-shared", "-fPIC", "-ffast-math", "-x", "c", "/dev/null", "-o", path)
    return path


def scores(o, folder, model, *options, program=GGN, env=None):
    text = run(program, "cost", "-d", os.path.join(WORK, folder), "--recorded", "--no-quality", "--scores",
               "--threads", o.threads, "-m", model, *options, env=env)
    return json.loads(text)["points"][0]


def changes(name, first, other):
    """What one way of reckoning changes against another: windows that both judged, verdicts, stops."""
    both = [(a, b) for a, b in zip(first["scores"], other["scores"]) if a is not None and b is not None]
    moved = sorted(abs(a - b) for a, b in both)
    return {"name": name, "windows": len(both), "p_most": moved[-1], "p_median": statistics.median(moved),
            "same_bytes": sum(a == b for a, b in both), "verdicts": sum((a < first["cut"]) != (b < other["cut"]) for a, b in both),
            "blocks": len(first["stops"]), "stops": sum(a != b for a, b in zip(first["stops"], other["stops"]))}


def decisions(o, builds):
    """The shipped network on recorded test windows, against itself in float with Winograd's convolution (AVX-512)."""
    model = o.model[0]
    half = os.path.join(WORK, "half.ggn")
    ggn("convert", model, half)
    own = scores(o, "data", model)
    rows = [changes(name, own, scores(o, "data", *a, **k)) for name, a, k in (
        ("double instead of float", (model, "--precision", "f64"), {}),
        ("AVX2: Winograd's algorithm in more layers", (model,), {"env": {"LULL_ISA": "avx2"}}),
        ("weights stored as half floats", (half,), {}),
        ("flush-to-zero, denormals-are-zero", (model,), {"env": {"LD_PRELOAD": flushing()}}),
        ("-O2", (model,), {"program": os.path.join(builds["-O2"], "bin", "ggn")}))]
    few_views(o)  # what is slow
    own = scores(o, "few", model)
    return rows + [changes(name, own, scores(o, "few", model, **k)) for name, k in (
        ("baseline x86-64: direct convolution", {"env": {"LULL_ISA": "base"}}),
        ("-O0", {"program": os.path.join(builds["-O0"], "bin", "ggn")}))]


def precision(o, out):
    """What number formats, instruction sets and compilers change."""
    exact = (.786932669062, .773263945936, .773324065289, .783187939314)  # in double, as tests/golden has them
    out["golden"] = []
    for name, options, isa in (("float, AVX-512: Winograd", ("--float",), "avx512"), ("float, AVX2: Winograd", ("--float",), "avx2"),
                               ("float, baseline x86-64", ("--float",), "base")):
        p = golden(isa, *options)
        out["golden"].append({"name": name, "p_moved": max(abs(a - b) for a, b in zip(p, exact)), "windows": len(p)})
    builds = other_builds()
    out["decisions"] = {"model": os.path.basename(o.model[0]), "rows": decisions(o, builds)}
    render = RENDER
    same = pictures_of(render, "--threads", 1)
    out["images"] = []
    for name, program, options in [("two threads", render, ("--threads", 2)), ("the general kernel (--effects=all)", render, ("--effects=all",)),
                                   *[("%s instead of -O3" % level, os.path.join(folder, "bin", "lull-render"), ("--threads", 1))
                                     for level, folder in builds.items()]]:
        found = pictures_of(program, *options)
        out["images"].append({"name": name, "pictures": len(same), "changed": sum(found[k] != same[k] for k in same)})


def guards(o, out):
    """Hard cases without what guards them (scripts/guards)."""
    path = os.path.join(WORK, "guards.json")
    run(os.path.join(ROOT, "scripts", "guards"), "--json", path)
    out["guards"] = tool.load(path)


STEPS = {"replay": replay, "recorded": recorded, "judge": judge, "early": early, "price": price, "real": real, "grow": grow,
         "cadence": cadence, "people": people, "precision": precision, "guards": guards}


def rounded(value):
    """Four digits: a machine's times are no better, and the file is half as long."""
    if isinstance(value, dict):
        return {k: rounded(v) for k, v in value.items()}
    if isinstance(value, list):
        return [rounded(v) for v in value]
    return float("%.4g" % value) if isinstance(value, float) else value


def main(o):
    steps = o.only.split(",")
    if set(steps) - {*STEPS, "draw"}:
        raise Refused("--only: expected some of " + ",".join((*STEPS, "draw")))
    if o.render:
        o.data = o.render
        run(os.path.join(ROOT, "scripts", "lab"), "data-set", "--only", "test", *(["--plan", o.plan] if o.plan else []), o.data)
    os.makedirs(WORK, exist_ok=True)
    os.makedirs(os.path.join(o.out, "results"), exist_ok=True)
    o.model = o.model or [*sorted((os.path.relpath(m, ROOT) for m in glob.glob(os.path.join(ROOT, "ggn/models/lull-*.ggn"))), reverse=True),
                          *sorted(glob.glob(os.path.join(WORK, "models", "*.ggn")))]
    o.baseline = o.baseline if o.baseline is not None else [
        p for k in ("svd-entropy", "attributes", "noise-mask") for p in (os.path.join("ggn/models", k + ".ggn"), os.path.join(WORK, k + ".ggn"))
        if os.path.exists(os.path.join(ROOT, p))]
    every = set(steps) == {*STEPS, "draw"}
    out = {"sets": {}} if every else tool.results(o.out, "cost") or {"sets": {}}
    if "defaults" not in out:  # one measurement, one set of defaults
        out["defaults"] = defaults()
    for step, function in STEPS.items():
        if step in steps:
            function(o, out)
            print("cost: %s done" % step, flush=True)
            out.setdefault("measured", {})[step] = tool.measured(level=tool.observer()["level"], visible=out["defaults"]["observer"][1])
            tool.save(rounded(out), o.out, "results", "cost.json", separators=(",", ":"))
            sources.keep(o.out, "cost", out, cost_page.SOURCES)
    if "draw" in steps:
        plots.charts()  # which says what is missing
        from lablib import cost_pictures
        cost_pictures.draw(os.path.join(o.out, "results"), out)
        from lablib import pages
        pages.fill(o.out)
