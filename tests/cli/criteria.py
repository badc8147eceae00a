"""Every criterion with every action of lull-render on a picture of six blocks (criteria.sh), and on pictures with nothing to estimate
(criteria_nothing.sh). Status and outcome of each pair stand in criteria.txt and criteria_nothing.txt; RECORD=1 writes them anew: read the
difference. Whatever the outcome: JSON is finite and has no negative number, a failure is one line that leaves nothing behind, and every
option of the program is in an action here or in a list with the reason why not.

usage: criteria.py WORK MODEL actions|nothing, with an empty folder and a model of svd-entropy"""
import collections
import concurrent.futures
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = (ROOT / os.environ.get("BUILD", "build")).resolve()
RENDER, SCENE, PLUGINS = BUILD / "bin/lull-render", ROOT / "tests/cli/room.pbrt", BUILD / "tests/abi/plugins"
STUB = {"LULL_OIDN": str(BUILD / "tests/oidn-stub"), "OIDN_STUB": "box"}
MPI = ["mpirun", "--oversubscribe", "-n", "2"]
MPI_ENV = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_plm": "isolated",
           "OMPI_MCA_btl_vader_single_copy_mechanism": "none"}
WORK, MODEL = Path(sys.argv[1]), sys.argv[2]

# Of criteria in Python: one with numpy; without one there are none.
PYTHON = next((python for python in (sys.executable, "/usr/bin/python3")
               if subprocess.run([python, "-c", "import numpy"], stderr=subprocess.DEVNULL).returncode == 0), "")

# name: its arguments, its environment
CRITERIA = {**{name: (["-c", name], STUB) for name in ("observer", "denoised", "ggn", "halfbuf", "variance", "null", "attributes",
                                                       "noise-mask")},
            "fixed": (["-c", "fixed", "-p", "spp=16"], STUB),
            "svd-entropy": (["-c", "svd-entropy", "-p", f"model={MODEL}"], STUB),
            "denoised, no denoiser": (["-c", "denoised"], {"LULL_OIDN": "/nowhere"}),
            "dammertz": (["-c", str(ROOT / "plugin-api/examples/dammertz.py")], {**STUB, "LULL_PYTHON": PYTHON}),
            "unset": (["-c", f"{PLUGINS}/unset.so"], STUB), "odd": (["-c", f"{PLUGINS}/unset.so:odd"], STUB)}

# name: the steps of the action, what each adds to the command line
RUNS = ["--spp-min", "8", "--spp-max", "24"]
ACTIONS = {
    "render": [[*RUNS, "-o", "a.exr", "--reproducible"]],
    "report": [[*RUNS, "--report", "a.json"]],
    "page": [[*RUNS, "--html", "a.html"]],
    "preview": [[*RUNS, "--preview", "a.png"]],
    "stop map": [[*RUNS, "--stop-map", "a.png", "--stop-map", "a.csv"]],
    "live files": [[*RUNS, "--live", "--report", "a.json", "--stop-map", "a.csv"]],
    "layers": [[*RUNS, "--aov", "albedo,normal,depth", "--report", "a.json"]],
    "quote": [[*RUNS, "--quote"]],
    "quote as JSON": [[*RUNS, "--quote", "--json"]],
    "quote of a short pilot": [[*RUNS, "--quote", "--quote-pilot", "2:5", "--json"]],
    "quote map": [[*RUNS, "--quote", "--quote-map", "a.png"]],
    "quote with a mask": [[*RUNS, "--quote", "--json", "--mask", "../mask.png"]],
    "quote with --denoise": [[*RUNS, "--quote", "--json", "--denoise"]],
    "quote and outcome": [[*RUNS, "--quote", "--json"], [*RUNS, "--quoted", "q.json", "--html", "a.html"]],
    "plan": [[*RUNS, "--frames", "1-2", "--plan-shot", "a.csv", "--plan-every", "1"]],
    "plan and table": [[*RUNS, "--frames", "1-2", "--plan-shot", "a.csv"],
                       ["TABLE", "--frames", "1-2", "--shot-table", "a.csv", "-o", "f_%d.exr"]],
    "frames": [[*RUNS, "--frames", "1-2", "--frame-seed", "fresh", "-o", "f_%d.exr", "--report", "f_%d.json"]],
    "camera path": [[*RUNS, "--camera-path", "../path.csv", "-o", "f_%d.exr", "--report", "f_%d.json"]],
    "mask": [[*RUNS, "--mask", "../mask.png", "--report", "a.json"]],
    "checkpoint, then more": [["--spp-min", "8", "--spp-max", "12", "--checkpoint", "c", "--checkpoint-every", "0"],
                              [*RUNS, "--checkpoint", "c", "--resume", "--report", "a.json"]],
    "sequence": [["--sequence", "s", "--levels", "linear:4:8:4", "--blocks", "0,1", "--reference-spp", "4", "--name", "a/b"]],
    "recording": [["--sequence", "s", "--planes", "half,moment2", "--past-stops", "--spp-max", "24", "--reference-spp", "4"]],
    "denoise": [[*RUNS, "--denoise", "-o", "a.exr", "--report", "a.json"]],
    "time budget": [[*RUNS, "--time-budget", "0.02", "--report", "a.json"]],
    "error": [[*RUNS, "--error", "100", "--report", "a.json"]],
    "visible": [[*RUNS, "--visible", "0.25", "--report", "a.json"]],
    "error and visible": [[*RUNS, "--error", "2", "--visible", "0.25", "--report", "a.json"]],
    "same samples": [["--spp", "8", "--report", "a.json"]],
    "crop": [[*RUNS, "--crop", "3,3,20,18", "--report", "a.json", "--html", "a.html"]],
    "seam": [[*RUNS, "--max-seam", "2", "--report", "a.json"]],
    "bound of checks": [[*RUNS, "--max-check-overhead", "0.5", "--report", "a.json"]],
    "two processes": [["MPI", *RUNS, "--rank-timeout", "60", "--report", "a.json"]],
    "quote by two processes": [["MPI", *RUNS, "--quote", "--json"]],
}
CLOCKED = {"time budget", "bound of checks"}  # the clock decides why blocks stop

# Options that no action has: what they change, no criterion is asked about
EXEMPT = {
    "look-at": "what is seen", "fov": "what is seen", "light-selection": "how paths are made", "sampler": "how paths are made",
    "integrator": "how paths are made", "max-depth": "how paths are made", "filter": "how paths are made", "seed": "how paths are made",
    "effects": "how paths are made", "order-seed": "how threads take turns", "strict": "how scenes are read",
    "display-server": "display_server.sh: an image viewer", "no-progress": "what the terminal shows: terminal.sh",
    "list-criteria": "asks no criterion", "explain": "asks no criterion", "debug-path": "asks no criterion",
}
USED = {"size", "block", "threads", "quiet", "criterion", "param"}  # by every run
SHORT = {"-o": "output", "-c": "criterion", "-p": "param", "-t": "threads", "-q": "quiet"}


def faults_of(value, path=""):
    """What no JSON of ours may have: numbers that are negative (infinite ones do not parse)."""
    if isinstance(value, dict):
        return [f for k, v in value.items() for f in faults_of(v, f"{path}.{k}")]
    if isinstance(value, list):
        return [f for i, v in enumerate(value) for f in faults_of(v, f"{path}[{i}]")]
    return [f"{path} is {value}"] if isinstance(value, (int, float)) and value < 0 and "look_at" not in path else []


def parsed(text):
    def refuse(constant):
        raise ValueError(f"JSON has {constant}")
    value = json.loads(text, parse_constant=refuse)
    if faults := faults_of(value):
        raise ValueError(f"JSON: {', '.join(faults[:3])}")
    return value


def stops(report):
    """Why blocks stopped, and at how many samples."""
    blocks = report["blocks"]
    assert all(b["reason"] != "none" for b in blocks), "a block has no reason"
    spp = sorted({b["spp"] for b in blocks})
    return f"{', '.join(sorted({b['reason'] for b in blocks}))} at {spp[0]}" + (f" to {spp[-1]}" if spp[-1] > spp[0] else "")


def outcome_of(folder, action, out):
    """What a run that succeeded left: where blocks stopped, the rows of a quote."""
    said = []
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        assert path.stat().st_size > 0 or path.name in ("out", "err"), f"{path.name} is empty"
        if path.suffix == ".json":
            value = parsed(path.read_text())
            said += [] if action in CLOCKED or "totals" not in value else [stops(value)]
        elif path.suffix == ".html":
            data = parsed(re.search(r'id="data">(.*?)</script>', path.read_text(), re.S)[1])
            said += [stops(data["report"])]
    if out.startswith("{"):
        rows = parsed(out)["rows"]
        assert sum(r["as_asked"] for r in rows) == 1
        said += [", ".join(r["name"] for r in rows) + ("" if any(r["told"] for r in rows) else ": not told")]
    elif "spp min / mean / max" in out:
        said += [f"{len(re.findall(' x$|not known: ', out, re.M))} rows"]
    return " ".join(["0", *dict.fromkeys(said)])


def run(folder, name, step, options=("--size", "40x30", "--block", "16")):
    """One command in the folder: status, stdout, stderr, and what is wrong with a failure. Words in capitals say how it is run."""
    arguments, env = CRITERIA[name]
    given = [] if "TABLE" in step else arguments
    command = [RENDER, "-q", "-t", "1", *options, *given, *(w for w in step if not w.isupper())]
    before = {p.name for p in folder.rglob("*")} | {"out", "err"}
    with open(folder / "out", "w") as out, open(folder / "err", "w") as err:
        status = subprocess.run([*(MPI if "MPI" in step else []), *command], cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                                timeout=600, env={**os.environ, **MPI_ENV, **env}).returncode
    out, err = ((folder / n).read_text().replace("\0", "") for n in ("out", "err"))
    ours, wrong = [line for line in err.splitlines() if line.startswith("lull-render: ")], []
    if status == 2:
        left = {p.name for p in folder.rglob("*")} - before
        wrong += [f"left {left}"] if left else []
        wrong += [err] if len(ours) != 1 or ("MPI" not in step and len(err.splitlines()) != 1) else []
        wrong += ["something on stdout"] if out else []
        err = ours[0][len("lull-render: "):] if ours else err
    elif status != 0:
        wrong += ["it crashed or hung"]
    return status, out, err.strip().replace(str(PLUGINS), "PLUGINS"), wrong


def cell(name, action):
    """(status and outcome, what is wrong whatever is expected)"""
    folder = WORK / f"{name}-{action}".replace(" ", "_")
    folder.mkdir()
    try:
        for step in ACTIONS[action]:
            if "--quoted" in step:
                (folder / "out").rename(folder / "q.json")
            status, out, err, wrong = run(folder, name, [str(SCENE), *step])
            if status != 0:
                return f"{status} {err[-200:]}", wrong
        return outcome_of(folder, action, out), [f"on stderr: {err}"] if err and "MPI" not in step else []
    except (AssertionError, ValueError, KeyError, OSError, subprocess.TimeoutExpired) as error:
        return "0", [str(error)]
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def options():
    """Those of the program's table."""
    table = (ROOT / "pathtracer/app/cli.c").read_text().split("pt_cli_options[] = {")[1].split("{0}};")[0]
    return set(re.findall(r'^    \{"([a-z-]+)", ', table, re.M))


def check_options():
    tried = USED | {SHORT.get(w, w[2:]) for steps in ACTIONS.values() for step in steps for w in step if re.match(r"--?[a-z]", w)}
    known = options()
    yield "every option has an action, or a reason to have none", [
        *(f"--{o}: neither" for o in sorted(known - tried - set(EXEMPT))), *(f"--{o}: exempt, but tried" for o in sorted(tried & set(EXEMPT))),
        *(f"--{o}: no such option" for o in sorted((tried | set(EXEMPT)) - known))]
    yield "the program has more than fifty", [] if len(known) > 50 else [f"{len(known)}"]


HEAD = ('LookAt 0 0 5 0 0 0 0 1 0 Camera "perspective" "float fov" 40 Film "rgb" "integer xresolution" 48 "integer yresolution" 32 '
        'Sampler "independent" WorldBegin ')
LIT, LAMP = 'LightSource "infinite" "rgb L" [.3 .3 .3] ', 'AreaLightSource "diffuse" "rgb L" [{0} {0} {0}] Shape {1}'
PICTURES = {
    "empty": HEAD, "black": HEAD + 'Material "diffuse" Shape "sphere"', "of one colour": HEAD + LIT,
    "a lamp of 1e30": HEAD + LAMP.format("1e30", '"sphere" "float radius" .5'),
    "half lit": HEAD + LAMP.format(".5", '"trianglemesh" "point3 P" [-9 -9 -1 0 -9 -1 0 9 -1 -9 9 -1] "integer indices" [0 1 2 0 2 3]'),
    "no bounces": 'Integrator "path" "integer maxdepth" 0 ' + HEAD + LIT + 'Shape "sphere"',
    "every path dropped": HEAD + 2 * 'LightSource "infinite" "rgb L" [3e38 3e38 3e38] ',
}
SIZES = {"": ["--size", "48x32", "--block", "16"], ", of one pixel": ["--size", "1x1", "--block", "16"]}
# Criteria that look at noise, in pictures that have none: they soon see it.
SOON, QUIET = {"observer", "denoised", "halfbuf", "dammertz", "variance", "unset"}, {"empty", "black", "of one colour"}


def nothing(name, picture):
    """As cell(): a picture rendered, quoted and planned, and its report compared with itself."""
    folder = WORK / f"{name}-{picture}".replace(" ", "_")
    folder.mkdir()
    scene, _, one = picture.partition(",")
    (folder / "s.pbrt").write_text(PICTURES[scene])
    size = SIZES[one and f",{one}"]
    try:
        said = []
        for step in (["--report", "r.json", "--stop-map", "m.csv", "--html", "p.html", "-o", "o.exr"], ["--quote", "--json"],
                     ["--frames", "1-2", "--plan-shot", "plan.csv"]):
            status, out, err, wrong = run(folder, name, ["s.pbrt", "--spp-max", "300", *step], size)
            if status != 0 or (err and "not finite and were dropped" not in err):
                return f"{status} {err[-200:]}", wrong or [f"on stderr: {err}"]
            if "--quote" in step:
                said += [f"{len(parsed(out)['rows'])} rows"]
                assert all(b["spp"]["expected"] >= 1 for r in parsed(out)["rows"] for b in r["blocks"])
            elif "--report" in step:
                report = parsed((folder / "r.json").read_text())
                page = parsed(re.search(r'id="data">(.*?)</script>', (folder / "p.html").read_text(), re.S)[1])
                assert page["report"] == report, "the page has another report"
                where = stops(report)
                said += [where] if scene in QUIET or "dropped" in scene else []  # edges have noise, and luck
                most = max(b["spp"] for b in report["blocks"])
                assert most < 200 or name not in SOON or scene not in QUIET, f"{most} samples for what has no noise"
                assert (folder / "m.csv").read_text().split(";")[1:-1] == [str(b["spp"]) for b in report["blocks"]]
        for command in (["compare", "r.json", "r.json", "--json"], ["thresholds", "r.json"]) if name == "observer" else ():
            done = subprocess.run([BUILD / "bin/ggn", *command], cwd=folder, capture_output=True, text=True, timeout=600)
            assert done.returncode == 0, done.stderr
            assert parsed(done.stdout.replace("-0.000000", "0")) and ("compare" not in command or
                                                                      json.loads(done.stdout)["median_abs_log2"] in (0, None)), done.stdout
        return "0 " + ", ".join(said), []
    except (AssertionError, ValueError, KeyError, OSError, subprocess.TimeoutExpired) as error:
        return "0", [str(error)]
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def record(path, rows, cells):
    """rows: what stands in a section's head."""
    with open(path, "w", encoding="utf-8") as file:
        file.write("# What lull-render answers (tests/cli/criteria.py): the action or picture, then status, outcome and the criteria that have it.\n"
                   "# After 0: why blocks stopped and at which samples, the rows of a quote; after 2: the line.\n")
        for row in rows:
            by = collections.defaultdict(list)
            for name in CRITERIA:
                if (name, row) in cells:
                    by[re.sub(rf"criterion {re.escape(name)}\b", "criterion ID", cells[name, row][0])].append(name)
            file.write(f"\n{row}\n" + "".join(f"    {outcome}\n        {'; '.join(names)}\n" for outcome, names in by.items()))


def recorded(path):
    expected, row, outcome = {}, "", ""
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("        "):
            expected |= {(name, row): outcome.replace("criterion ID", f"criterion {name}") for name in line.strip().split("; ")}
        elif line.startswith("    "):
            outcome = line.strip()
        elif line and line[0] != "#":
            row = line
    return expected


def main():
    acts, report = sys.argv[3] == "actions", []
    if acts:
        report += check_options()
        subprocess.run(["oiiotool", "--pattern", "constant:color=0", "40x30", "1", "--box:color=1:fill=1", "0,0,15,15", "-d", "uint8", "-o",
                        WORK / "mask.png"], check=True)
        (WORK / "path.csv").write_text("frame;eye;at;up;fov\n1;0 1 3.4;0 1 0;0 1 0;45\n2;0 1 3.3;0 1 0;0 1 0;45\n")
    rows, look = (list(ACTIONS), cell) if acts else ([p + size for p in PICTURES for size in SIZES], nothing)
    has_mpi = shutil.which("mpirun") and (BUILD / "lib/lull/modules/lull-mpi.so").exists()
    names = [name for name in CRITERIA if (acts or name != "denoised, no denoiser") and (PYTHON or name != "dammertz")]
    pairs = [(name, row) for row in rows for name in names if has_mpi or "processes" not in row]
    with concurrent.futures.ThreadPoolExecutor(max_workers=3) as pool:
        cells = dict(zip(pairs, pool.map(lambda pair: look(*pair), pairs)))
    path = Path(__file__).with_name("criteria.txt" if acts else "criteria_nothing.txt")
    if os.environ.get("RECORD"):
        record(path, rows, cells)
    expected = recorded(path)
    for pair in pairs:
        (got, wrong), wanted = cells[pair], expected.get(pair)
        report.append((f"{pair[1]}, {pair[0]}: {got[:60]}", wrong if got == wanted else [*wrong, f"expected: {wanted}", f"got:      {got}"]))
    report.append(("what is expected is tried", [f"{pair}" for pair in expected if pair not in cells and has_mpi and PYTHON]))
    for n, (what, wrong) in enumerate(report, 2):
        print(f"{'not ok' if wrong else 'ok'} {n} - {what}", *(f"# {w}" for w in wrong), sep="\n")
    if not has_mpi:
        print(f"ok {len(report) + 2} - two processes # SKIP there is no MPI")
    if not PYTHON:
        print(f"ok {len(report) + 3} - a criterion in Python # SKIP there is no python3 with numpy")
    return any(wrong for _, wrong in report)


if __name__ == "__main__":
    sys.exit(main())
