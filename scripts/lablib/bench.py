"""Speed and noise as ratios, interleaved in one run, held against peers, limits and what is wanted.

Peers are used when they are installed: Blender's Cycles (package blender), Embree's sample path tracer (embree-tools), PyTorch. Rates
are per processor second and a ratio is the median of the ratios within the rounds, so that a busy machine disturbs them less; seconds
of starting are wall time and want a quiet one. Scenes of ../shared are measured when that folder is there. Parts that are not measured
keep their figures."""
import array
import json
import math
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

from lablib import reading, tables, tool
from lablib.sources import PICTURES
from lablib.tool import BUILD, RENDER, ROOT, THREADS

SOURCES = PICTURES + ("ggn/nn/*.[ch]", "pathtracer/render/*.[ch]")
RAYS = os.path.join(BUILD, "bench", "pt_rays")
NOISE = os.path.join(BUILD, "bench", "pt_noise")
NETWORKS = os.path.join(BUILD, "bench", "ggn_networks")
BOX = os.path.join(ROOT, "scenes", "cornell-box.pbrt")
SHARED = os.path.join(tool.SHARED, "scenes")


def options(parser):
    parser.add_argument("--rounds", type=int, default=3, help="figures are medians over so many (3)")
    parser.add_argument("--quick", action="store_true", help="fewer samples: rougher figures")
    parser.add_argument("--only", metavar="PARTS", help="some of " + ",".join(NEEDS))
    tool.writes(parser, "; the part reading draws DIR/results/reading-time.png, too")


def cpu_seconds(command, **how):
    """Processor seconds (all threads) of a command, and what it printed."""
    before = os.times()
    text = answer(command, **how)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system, text


def answer(command, **how):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, **how)
    if done.returncode != 0:
        raise tool.Refused("failed: " + " ".join(command))
    return done.stdout


def ours(scratch, *options):
    """Totals of the report of one render of the box, and its processor seconds, loading and writing included."""
    report = os.path.join(scratch, "report.json")
    seconds, _ = cpu_seconds([RENDER, "-q", "--size", "400x400", "--max-depth", "8", "--report", report, "-o",
                              os.path.join(scratch, "ours.exr"), *options, BOX])
    with open(report) as f:
        totals = json.load(f)["totals"]
    totals["cpu_s"] = seconds
    return totals


def cycles(scratch, spp):
    """Paths per processor second of Blender's Cycles on the same box."""
    blender, hosts = ["blender", "-b", "--factory-startup"], os.path.join(ROOT, "scripts", "hosts")
    box = os.path.join(scratch, "box.blend")
    if not os.path.exists(box):
        cpu_seconds([*blender, "--python", os.path.join(hosts, "pbrt_to_blend.py"), "--", BOX, box])
    _, text = cpu_seconds([*blender, box, "--python", os.path.join(hosts, "cycles_seconds.py"), "--", str(spp), str(THREADS), "8",
                           os.path.join(scratch, "cycles.png")])
    return 400 * 400 * spp / float(re.search(r"CYCLES_CPU_SECONDS ([0-9.]+)", text)[1])


def embree(frames):
    """Rays per processor second of Embree's sample on its own Cornell box: the difference of a long run and a short one."""
    models = "/usr/share/doc/embree3/models"
    seconds, per_frame = [], 0.0
    for n in (1, 1 + frames):
        s, text = cpu_seconds([embree_tool(), "-c", os.path.join(models, "cornell_box.ecs"), "--threads", str(THREADS), "--size", "400", "400",
                               "--benchmark", "0", str(n)], cwd=models)
        seconds.append(s)
        per_frame = 1e6 * float(re.search(r"MRAYPS_AVG ([0-9.]+)", text)[1]) / float(re.search(r"RENDER_AVG ([0-9.]+)", text)[1])
    return per_frame * frames / (seconds[1] - seconds[0])


def embree_tool():
    """Embree's sample path tracer, of the package embree-tools."""
    found = shutil.which("pathtracer")
    return found if found and os.path.exists("/usr/share/doc/embree3/models/cornell_box.ecs") else None


def rays(scene, size, depth, passes):
    """Kernel against the ray-only loop, one thread."""
    return json.loads(answer([RAYS, scene, size, str(passes), str(depth)]))


def median(values):
    return statistics.median(values) if values else float("nan")


ROWS = []  # of the part that is being measured


def row(name, value, want=None, unit="", limit=None, most=False):
    """A figure, what it is held against (`limit`, same unit), what is wanted (at most, with `most`)."""
    row = {"name": name, "value": value, "unit": unit, "limit": limit, "want": want, "most": most}
    ROWS.append({k: v for k, v in row.items() if v or k == "value"})
    print("bench: %s: %.3f%s" % (name, value, unit), file=sys.stderr, flush=True)


def missing(what, why):
    ROWS.append({"name": what, "missing": why})


def cells(r):
    if "missing" in r:
        return [r["name"], "not measured: " + r["missing"], "", "", "", ""]
    unit, limit, want = r.get("unit", ""), r.get("limit"), r.get("want")
    reached = "" if want is None else ("yes" if (r["value"] <= want if r.get("most") else r["value"] >= want) else "**no**")
    return [r["name"], "%.3g%s" % (r["value"], unit), "" if limit is None else "%.3g%s" % (limit, unit),
            "" if limit is None else "%.0f %%" % (100 * r["value"] / limit),
            "" if want is None else "%s %g" % ("<=" if r.get("most") else ">=", want), reached]


def machine(parts, part):
    m = parts[part]["measured"]
    return "%s, load before %.2f" % (tables.provenance(m), m["load"])


def page(parts):
    """Machine and table; a part that was measured in another run than the first says what is other from there on, in its first row."""
    first, before, rows = machine(parts, next(iter(parts))), "", []
    for name, part in parts.items():
        other = ", ".join(word for word in machine(parts, name).split(", ") if word not in first.split(", "))
        names = [r["name"] for r in part["rows"]]
        if other != before:
            names[0] += " (from here: %s)" % (other or "as at first")
        before = other
        rows += [[n, *cells(r)[1:]] for n, r in zip(names, part["rows"])]
    return "%s.\n\n%s" % (first, tables.table(("what", "ours", "peer or limit", "share of it", "wanted", "reached"), rows))


def value(parts, name, below="", has="", form="%.2f"):
    """A figure of the table by the beginning of its row's name (and words of it, `has`); `below`: of the next row with these words."""
    rows = [r for part in parts.values() for r in part["rows"]]
    at = next(i for i, r in enumerate(rows) if r["name"].startswith(name) and has in r["name"])
    return form % next(r for r in rows[at:] if below in r["name"])["value"]


def bench_peers(rounds, quick, below=""):
    """below: before the names of the rows."""
    have_cycles, have_embree = shutil.which("blender") is not None, embree_tool() is not None
    figures = {"paths": [], "rays": [], "cycles": [], "embree": [], "vs cycles": [], "vs embree": [], "all": []}
    spp = 32 if quick else 128
    with tempfile.TemporaryDirectory() as scratch:
        for _ in range(rounds):
            t = ours(scratch, "--spp", str(spp))
            general = ours(scratch, "--spp", str(spp), "--effects", "all")
            figures["paths"].append(t["paths"] / t["cpu_s"])
            figures["rays"].append(t["rays"] / t["cpu_s"])
            figures["all"].append(general["cpu_s"] / t["cpu_s"])
            if have_embree:
                figures["embree"].append(embree(4 if quick else 16))
                figures["vs embree"].append(figures["rays"][-1] / figures["embree"][-1])
            if have_cycles:
                figures["cycles"].append(cycles(scratch, spp // 4))
                figures["vs cycles"].append(figures["paths"][-1] / figures["cycles"][-1])
    box = below + "Cornell box, whole renders: "
    row(box + "specialised against general kernel", median(figures["all"]), 1.15, " x")
    for name, what, key, want, package in (("Cycles", "paths", "cycles", 3.5, "blender"), ("Embree's sample", "rays", "embree", 1.05, "embree-tools")):
        if figures[key]:
            row(box + "%s against %s" % (what, name), median(figures[what]) / 1e6, unit=" M%s/s" % what, limit=median(figures[key]) / 1e6)
            row(box + "ratio to %s" % name, median(figures["vs " + key]), want, " x")
        else:
            missing(box + "%s against %s" % (what, name), package + " is not installed")


HOSTED = {"halfbuf": ["-p", "threshold=1e-9"], "observer": ["--visible", "0.001"]}


def bench_host(rounds, quick):
    """What the film's planes and the criterion cost: criteria that stop no block against none, the same samples. Each round
    goes there and back, because the machine's speed drifts by as much as is measured."""
    spp = "64" if quick else "256"
    ratios, shares = {c: [] for c in HOSTED}, {c: [] for c in HOSTED}
    with tempfile.TemporaryDirectory() as scratch:
        for _ in range(rounds):
            seconds = dict.fromkeys([None, *HOSTED], 0.0)
            for criterion in [None, *HOSTED, *reversed(HOSTED), None]:
                chosen = ["--spp-max", spp, "-c", criterion, *HOSTED[criterion]] if criterion else ["--spp", spp]
                totals = ours(scratch, *chosen)
                seconds[criterion] += totals["cpu_s"] / totals["samples"]
                if criterion:
                    shares[criterion].append(totals["criterion_s"] / totals["render_s"])
            for criterion in HOSTED:
                ratios[criterion].append(seconds[None] / seconds[criterion])
    for criterion in HOSTED:
        row("hosting %s, whole renders: speed with against without" % criterion, median(ratios[criterion]), 0.99, " x")
        row("  time in the criterion, of that of rendering", 100 * median(shares[criterion]), unit=" %")


def bench_rays(rounds, quick, below=""):
    scenes = [("Cornell box, the scene's Sobol' sampler", BOX, "400x400", 8, 0.85),
              ("Cornell box in C, independent sampler", "cornell", "400x400", 8, 0.85)]
    for name, file in (("staircase2", "staircase2-v4/staircase2.pbrt"), ("living-room", "living-room-v4/living-room.pbrt")):
        if os.path.exists(os.path.join(SHARED, file)):
            scenes.append((name, os.path.join(SHARED, file), "400x400" if name == "staircase2" else "400x225", 0, 0.55))
    with tempfile.TemporaryDirectory() as scratch:
        scenes.append(("terrain of 3.5 M triangles", write_terrain(scratch, 1323), "400x400", 0, 0.70))
        compare_rays([(below + name, *how) for name, *how in scenes], rounds, 1 if quick else 5)


def compare_rays(scenes, rounds, passes):
    for name, scene, size, depth, want in scenes:
        results = [rays(scene, size, depth, passes) for _ in range(rounds)]
        row("%s (kernel %s): rays against tracing alone" % (name, results[0]["kernel"]), median([r["rays_per_s"] for r in results]) / 1e6,
            unit=" Mrays/s", limit=median([r["ray_only_per_s"] for r in results]) / 1e6)
        row("  share, median of the rounds", median([r["share"] for r in results]), want)
        row("  paths", median([r["paths_per_s"] for r in results]) / 1e6, unit=" Mpaths/s")


def embree_of(program):
    """The major version of Embree that a program calls."""
    found = re.search(r"libembree([0-9]+)", answer(["ldd", program]))
    if not found:
        raise tool.Refused(program + " calls no Embree")
    return found[1]


def bench_embree(rounds, quick):
    """Rays by Embree 4 against 3, of which each build has one: tests/distributions/embree3 makes the second."""
    second = os.path.join(BUILD, "embree3", "bench", "pt_rays")
    if not os.path.exists(second):
        return missing("Embree 4 against 3", "no second build (tests/distributions/embree3, on Debian 13)")
    programs = {embree_of(program): program for program in (RAYS, second)}
    if set(programs) != {"3", "4"}:
        raise tool.Refused("both builds call Embree %s" % ", ".join(programs))
    with tempfile.TemporaryDirectory() as scratch:
        for name, scene, depth in (("Cornell box", BOX, "8"), ("terrain of 3.5 M triangles", write_terrain(scratch, 1323), "0")):
            found = {version: [] for version in programs}
            for _ in range(rounds):
                for version, program in programs.items():
                    found[version].append(json.loads(answer([program, scene, "400x400", "1" if quick else "5", depth])))
            for what, key in (("whole paths", "rays_per_s"), ("tracing alone", "ray_only_per_s")):
                rates = {version: [r[key] / 1e6 for r in found[version]] for version in ("4", "3")}
                row("%s, %s: rays by Embree 4 against 3" % (name, what), median(rates["4"]), unit=" Mrays/s", limit=median(rates["3"]))
                row("  ratio, median of the rounds", median([a / b for a, b in zip(rates["4"], rates["3"])]), unit=" x")


# Scenes with several lights; the first three with many.
NOISE_SCENES = ("many-lights corridor garage office candles night-street night-lamps paper-lamps library gallery bathroom crockery "
                "still-life gems delta-lights museum glossy-row window").split()
NOISE_SHARED = ("veach-mis-v4/veach-mis.pbrt", "staircase2-v4/staircase2.pbrt")


def bench_noise(quick):
    """Variance x time of light selection by the hierarchy against power (tests/bench/pt_noise.c)."""
    gains = []
    scenes = [(name, os.path.join(ROOT, "scenes", name + ".pbrt")) for name in NOISE_SCENES]
    scenes += [(os.path.basename(name)[:-5], os.path.join(SHARED, name)) for name in NOISE_SHARED if os.path.exists(os.path.join(SHARED, name))]
    for name, scene in scenes:
        found = json.loads(answer([NOISE, scene, "64x64", "2" if quick else "32", "4"]))
        if not found["two_ways"]:
            gains.append(1.0)  # rendered as before
            continue
        gains.append(found["gain"])
        row("%s (%d emitters): noise for time, %s" % (name, found["emitters"], "portal against none" if name == "window" else "hierarchy against power"),
            found["gain"], 2.0 if name in NOISE_SCENES[:3] else 0.97, " x")
    row("  median of these and those selected by power, %d scenes" % len(gains), median(gains), 1.25, " x")


def write_terrain(folder, side):
    """A binary PLY of 2·side² triangles with normals, hills and valleys, and a scene that shows it."""
    vertices, faces = array.array("f"), bytearray()
    height = [0.3 * math.sin(40 * i / side) for i in range(side + 1)]
    for y in range(side + 1):
        for x in range(side + 1):
            vertices.extend((x / side - 0.5, height[x] * height[y], y / side - 0.5, 0.0, 1.0, 0.0))
    for y in range(side):
        at, line = y * (side + 1), array.array("I")
        for x in range(side):
            a = at + x
            line.extend((a, a + 1, a + side + 2, a, a + side + 2, a + side + 1))
        raw = line.tobytes()
        faces += b"".join(b"\x03" + raw[i:i + 12] for i in range(0, len(raw), 12))
    with open(os.path.join(folder, "terrain.ply"), "wb") as f:
        f.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % ((side + 1) ** 2)).encode())
        f.write("".join("property float %s\n" % n for n in "x y z nx ny nz".split()).encode())
        f.write(("element face %d\nproperty list uchar uint vertex_indices\nend_header\n" % (2 * side * side)).encode())
        f.write(vertices.tobytes() + faces)
    scene = os.path.join(folder, "terrain.pbrt")
    with open(scene, "w") as f:
        f.write('Film "rgb" "integer xresolution" 16 "integer yresolution" 16\nLookAt 0 1 1  0 0 0  0 1 0\nCamera "perspective"\n'
                'WorldBegin\nLightSource "infinite" "rgb L" [1 1 1]\nShape "plymesh" "string filename" "terrain.ply"\n')
    return scene


def seconds_of(command):
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - start


def seconds_until_file(command, path):
    """Wall seconds until a command has written a file; it is stopped then."""
    if os.path.exists(path):
        os.remove(path)
    start = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while not os.path.exists(path) and process.poll() is None:
        time.sleep(0.002)
    seconds = time.perf_counter() - start
    process.kill()
    process.wait()
    return seconds


def bench_start(rounds):
    helps = [seconds_of([RENDER, "--help"]) for _ in range(20 * rounds)]
    row("start: lull-render --help, wall", 1000 * median(helps), 5, " ms", most=True)
    with tempfile.TemporaryDirectory() as scratch:
        scene, preview = write_terrain(scratch, 1323), os.path.join(scratch, "preview.png")
        wall = [seconds_of([RENDER, "-q", scene, "--spp", "1", "--preview", preview]) for _ in range(rounds)]
        row("start: 3.5 M triangles from a binary PLY to an image, wall", median(wall), 1.0, " s", most=True)
        staircase = os.path.join(SHARED, "staircase2-v4", "staircase2.pbrt")
        if os.path.exists(staircase):
            wall = [seconds_until_file([RENDER, "-q", staircase, "--preview", preview], preview) for _ in range(rounds)]
            row("start: staircase2 to the first pixels in the preview file, wall", median(wall), 0.5, " s", most=True)


def bench_networks(rounds, isa=None):
    """`lab networks` compares with PyTorch; its lines become rows. isa: what both sides are held to."""
    model = os.path.join(ROOT, "ggn", "models", "lull-3.ggn")
    for widths, options in (("published widths", []), ("narrow widths", ["--model", model])):
        text = answer([os.path.join(ROOT, "scripts", "lab"), "networks", "--json", "--rounds", str(rounds), "--threads", "2",
                       *(["--isa", isa] if isa else []), *options])
        if not text.startswith("{"):
            return missing("networks against PyTorch", text.strip())
        found = json.loads(text)
        times = {name: (ours_ms, torch_ms) for name, ours_ms, torch_ms in found["times"]}
        where = "networks, %s, %s against PyTorch's %s" % (widths, *found["isa"])
        for name, want in (("decision", 0.25 if isa else 0.15), ("train_sample", 0.25 if isa else 0.20)):
            ours_ms, torch_ms = times[name + "_ms"]
            row("%s: %s, two threads" % (where, name.replace("train_sample", "training step, one sample")), ours_ms, unit=" ms",
                limit=torch_ms)
            row("  ratio to PyTorch's time", ours_ms / torch_ms, want, " x", most=True)
        if not isa:
            row("networks, %s: 16 blocks at once on two threads, efficiency" % widths,
                times["blocks_16_alone_ms"][0] / (2 * times["blocks_16_ms"][0]), 0.80, " x")


def bench_avx2(rounds, quick):
    """Our code held to AVX2, and PyTorch. Embree traces on all sides with what the processor has; Cycles' own code is AVX2 at most."""
    os.environ["LULL_ISA"] = "avx2"
    try:
        bench_peers(rounds, quick, "AVX2: ")
        bench_rays(rounds, quick, "AVX2: ")
    finally:
        del os.environ["LULL_ISA"]
    bench_networks(rounds, "avx2")


def bench_study(rounds):
    """How long 50 participants of a study wait for an answer (tests/study/load.mjs): wall time, wants a quiet machine."""
    waits = []
    for _ in range(rounds):
        done = subprocess.run(["sh", os.path.join(ROOT, "tests", "study", "load.sh")], stdout=subprocess.PIPE, text=True)
        found = re.search(r"median ([0-9.]+) ms, 99th percentile ([0-9.]+) ms", done.stdout)
        if done.returncode != 0 or not found:
            return missing("study: 50 participants at once", done.stdout.strip().splitlines()[-1])
        waits.append([float(x) for x in found.groups()])
    row("study: 50 participants at once, a trial until it is acknowledged, wall, median", median([w[0] for w in waits]), unit=" ms")
    row("  99th percentile", median([w[1] for w in waits]), 100, " ms", most=True)


def bench_reading(docs):
    """How processor time grows with what is read: 1 is linear, 2 quadratic."""
    kinds = reading.measured(0.3 if docs else 0.1)
    for name, points in kinds.items():
        row("reading %s: time grows with the size to the power" % name, reading.exponent(points), 1.45, most=True)
    if docs:
        reading.draw(kinds, os.path.join(docs, "results"), "reading-time.png")


def bench_limits():
    """Limits of time that a user gives, and the figures of build/bench/ggn_networks against each other."""
    with tempfile.TemporaryDirectory() as scratch:
        report = os.path.join(scratch, "report.json")
        common = [RENDER, BOX, "-q", "-c", "null", "--spp-max", "100000000"]
        subprocess.run([*common, "--time-budget", "1", "--report", report, "-o", os.path.join(scratch, "a.exr")], check=True)
        with open(report) as f:
            row("--time-budget 1: rendering, wall", json.load(f)["totals"]["render_s"], 4.0, " s", most=True)
    pilot = json.loads(answer([RENDER, BOX, "-q", "--quote", "--json", "--quote-pilot", "100000:0.3"]))["pilot"]
    row("--quote-pilot 100000:0.3: the pilot, wall", pilot["elapsed_s"], 5.0, " s", most=True)
    text = answer([NETWORKS, "--rounds=3", "--batch=2", "--threads=1"])
    ms = {name: float(value) for name, value in re.findall(r"^(\w+)_ms +([0-9.]+)$", text, re.M)}
    row("networks: sgemm", float(re.search(r"^sgemm_gflops +([0-9.]+)$", text, re.M)[1]), 0.5, " GFLOP/s")
    for name, parts in (("decision", {"denoiser_forward": 1, "generator_forward": 2, "discriminator_forward": 1}),
                        ("blocks_16", {"decision": 16}), ("blocks_16_alone", {"decision": 16}),
                        ("denoiser_train", {"denoiser_forward": 3}), ("generator_train", {"generator_forward": 3}),
                        ("train_sample", {"denoiser_train": 6, "generator_train": 2})):
        ratio = ms[name] / sum(n * ms[part] for part, n in parts.items())
        row("networks: %s against %s" % (name, " + ".join("%d %s" % (n, part) for part, n in parts.items())),
            max(ratio, 1 / ratio), 3.0, " x", most=True)


# What a part runs, below BUILD.
NEEDS = {"peers": ["bin/lull-render"], "host": ["bin/lull-render"], "rays": ["bench/pt_rays"], "embree": ["bench/pt_rays"], "noise": ["bench/pt_noise"],
         "start": ["bin/lull-render"], "networks": ["bench/ggn_networks"], "avx2": ["bench/ggn_networks", "bin/lull-render", "bench/pt_rays"], "study": ["bin/lull-study"],
         "reading": ["bench/pt_readings", "bench/ggn_readings"], "limits": ["bin/lull-render", "bench/ggn_networks"]}


def build(parts):
    """Makes what the parts run, or says why it cannot be."""
    targets = sorted({"%s/%s" % (os.environ.get("BUILD", "build"), n) for part in parts for n in NEEDS[part]})
    done = subprocess.run(["make", "-C", ROOT, "--no-print-directory", *targets], stdout=sys.stderr)
    if done.returncode != 0:
        raise tool.Refused("%s cannot be made (make %s)" % (", ".join(parts), " ".join(targets)))


def main(o):
    parts = {"peers": lambda: bench_peers(o.rounds, o.quick), "host": lambda: bench_host(o.rounds, o.quick),
             "rays": lambda: bench_rays(o.rounds, o.quick), "embree": lambda: bench_embree(o.rounds, o.quick), "noise": lambda: bench_noise(o.quick),
             "start": lambda: bench_start(o.rounds), "networks": lambda: bench_networks(o.rounds),
             "avx2": lambda: bench_avx2(o.rounds, o.quick), "study": lambda: bench_study(o.rounds),
             "reading": lambda: bench_reading(o.write), "limits": bench_limits}
    chosen = o.only.split(",") if o.only else list(parts)
    for name in chosen:
        if name not in parts:
            raise tool.Refused("--only %s: expected some of %s" % (name, ",".join(parts)))
    measured, found, failed = tool.measured(load=os.getloadavg()[0]), {}, 0
    build(chosen)
    for name in chosen:
        ROWS.clear()
        try:
            parts[name]()
        except (tool.Refused, subprocess.CalledProcessError, OSError, ValueError, TypeError) as e:
            missing(name, str(e))  # the rest of the table is worth having
            failed = 1
        found[name] = {"measured": measured, "rows": list(ROWS)}
    print(page(found))
    if o.write:
        before = tool.results(o.write, "bench")
        tool.store(o.write, "bench", {name: found.get(name) or before[name] for name in parts if name in found or name in before})
    return failed
