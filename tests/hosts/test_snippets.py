"""The snippets of README.md, docs/*.md and the pages of plugin-api and ggn: Python, C and C++ are compiled and run as they are
written; shell lines are run where RUN says so, with small pictures, and all of them name programs, options and files that are
there. A snippet that no table lists fails, so that a new one is thought of."""
import contextlib
import functools
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import lull
import tap
from tap import Skip

BUILD = Path(os.environ.get("BUILD", "build")).resolve()
ROOT = Path.cwd()
os.environ["LULL_PLUGIN_PATH"] = f"{BUILD}/lib/lull"
PAGES = ["README.md", *map(str, sorted(Path("docs").rglob("*.md"))), "plugin-api/README.md", "plugin-api/python/README.md", "ggn/README.md"]

# Shell snippets, by page and place: what is run of them. A regular expression: lines that are not, and why.
NOT_HERE = r"tev|scripts/setup|lull-denoiser-setup|python3 -m lull\.blender"  # a viewer with a window; from the network; tests/hosts/test_blender_command.py
RUN = {("docs/denoised.md", 1): NOT_HERE, ("docs/python-criterion.md", 1): "lull-check", ("docs/quote.md", 1): None, ("docs/shots.md", 1): None, ("docs/watching.md", 1): NOT_HERE,
       ("docs/watching.md", 3): NOT_HERE, ("plugin-api/README.md", 1): None}
# Those of which only the words are checked, and where they are run, or why not.
CHECKED = {("README.md", 1): "tests/packages/readme.sh", ("docs/hosts.md", 1): "tests/hosts/test_blender_command.py, tests/packages/wheel.sh",
           ("docs/results/denoised.md", 1): "49 renders; tests/cli/lull_study.sh", ("docs/shots.md", 2): "days of samples; tests/cli/lull_study_views.sh",
           ("docs/results/decisions.md", 1): "needs the recorded data set, hours", ("docs/scale.md", 1): "tests/cli/mpi.sh",
           ("docs/results/scale.md", 1): "a measurement, minutes", ("docs/results/scale.md", 2): "a measurement, minutes",
           ("docs/results/scale.md", 3): "a measurement, hours", ("docs/study.md", 1): "a server, a training; tests/cli/lull_study.sh, ggn_train.sh",
           ("docs/recording.md", 1): "a scene of the reader's; tests/hosts/test_replay.py",
           ("docs/watching.md", 2): "a server; tests/cli/watch.sh",
           ("plugin-api/python/README.md", 1): "tests/packages/wheel.sh"}
CODE = {("docs/denoised.md", "python", 1), ("docs/hosts.md", "python", 1), ("docs/hosts.md", "python", 2), ("docs/hosting.md", "cpp", 1), ("docs/python-criterion.md", "python", 1), ("docs/recording.md", "python", 1), ("plugin-api/README.md", "c", 1),
        ("plugin-api/README.md", "c", 2), ("plugin-api/README.md", "c", 3), ("plugin-api/README.md", "cpp", 1), ("plugin-api/README.md", "rust", 1), ("plugin-api/python/README.md", "python", 1), ("plugin-api/python/README.md", "python", 2)}


def snippets():
    """(page, language, place among those of its language): text."""
    found = {}
    for page in PAGES:
        for language, text in re.findall(r"^```(\w+)\n(.*?)^```", Path(page).read_text(), re.M | re.S):
            place = 1 + sum(p == page and name == language for p, name, _ in found)
            found[page, language, place] = text
    return found


FOUND = snippets()


@contextlib.contextmanager
def elsewhere():
    """A folder with what the pages take for granted: scenes, and programs that render small."""
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield Path(folder)
        finally:
            os.chdir(before)


def small(text):
    """The same with a picture that takes no time."""
    return text.replace("1920, 1080", "96, 64").replace("spp_max=4096", "spp_max=256").replace("1-24", "7-8")


# --- code ----------------------------------------------------------------------------------------------------------------


class Renderer:
    """my_renderer of the pages: noise about a grey."""

    def __init__(self):
        self.sums, self.half_sums, self.calls = np.zeros((64, 96, 3)), np.zeros((64, 96, 3)), 0

    def __call__(self, x0, y0, x1, y1, seed, spp):
        self.calls += 1
        return .5 + np.random.default_rng(seed).normal(0, .05, (y1 - y0, x1 - x0, 3)) / np.sqrt(spp)

    def sample(self, block):
        r, n, has = block.rect, block.next_spp - block.spp, block.spp
        for sums, count in ((self.sums, n), (self.half_sums, n // 2)):
            sums[r.y0:r.y1, r.x0:r.x1] += count * self(r.x0, r.y0, r.x1, r.y1, (r.x0, r.y0, has, count), count)
        block.spp, block.half_spp = has + n, block.half_spp + n // 2


def test_python_of_the_package():
    """the package's page: a host that gives samples, and one with a film of its own"""
    with elsewhere() as folder:
        names = {"my_renderer": Renderer()}
        exec(small(FOUND["plugin-api/python/README.md", "python", 1]), names)
        assert names["result"].outcome == "done" and names["picture"].shape == (64, 96, 3) and names["my_renderer"].calls > 1
        assert {p.name for p in folder.iterdir()} == {"picture.exr", "report.json", "stop-map.png"}
        mine = Renderer()
        names = {"my_renderer": mine, "sums": mine.sums, "half_sums": mine.half_sums}
        exec(small(FOUND["plugin-api/python/README.md", "python", 2]), names)
        assert not names["frame"].active and {b.reason for b in names["frame"].blocks} == {"criterion"}


def test_python_criterion():
    """docs/python-criterion.md: the criterion of the page stops blocks"""
    with elsewhere():
        Path("mine.py").write_text(FOUND["docs/python-criterion.md", "python", 1])
        with lull.load("mine.py", threshold=.02) as criterion:
            frame = lull.Frame(criterion, 96, 64, spp_max=256)
            mine = Renderer()
            result = lull.Driver(frame, lambda rects, first, count, half: [mine(*r, (*r[:2], first), count) for r in rects], warn=print).run()
            assert result.outcome == "done" and {b.reason for b in frame.blocks} == {"criterion"}


def test_python_of_recordings():
    """docs/recording.md: another renderer's EXR files become a recording"""
    with elsewhere():
        rng = np.random.default_rng(1)
        for n in (16, 32, 64, 128):
            channels = {c: rng.random((48, 64), np.float32) for c in ("R", "G", "B", "half.R", "half.G", "half.B")}
            lull.exr.write(f"chess-{n:04d}.exr", channels, (64, 48))
        exec(small(FOUND["docs/recording.md", "python", 1]), names := {})
        read = names["recording"].read("rec")
        assert read.levels(0) == [16, 32, 64, 128] and np.allclose(read.planes(0, 128, ["color"])["color"][..., 0], channels["R"][:read.blocks[0].height, :read.blocks[0].width])


def test_python_of_the_denoiser():
    """docs/denoised.md: a host that keeps the denoised picture"""
    def render(rects, first, count, half):
        for r in rects:
            rng = np.random.default_rng((r.x0, r.y0, first))
            grey = np.full((r.height, r.width, 3), .5)
            yield {"color": grey + rng.normal(0, .05, grey.shape) / np.sqrt(count), "albedo": grey, "normal": grey}
    with tap.denoiser("box", BUILD), elsewhere():
        names = {"render": render}
        exec(small(FOUND["docs/denoised.md", "python", 1]), names)
        assert names["made"].picture.shape == (64, 96, 3) and os.path.getsize("picture.exr") > 1000


def host_python(folder, module):
    """The interpreter of a folder that `make test-hosts` fills, when it has the module. pyluxcore wants numpy to be there first."""
    python = ROOT / "build/hosts" / folder / "bin/python3"
    if not python.exists() or subprocess.run([python, "-c", f"import numpy, {module}"], capture_output=True).returncode:
        raise Skip(f"no {module} in build/hosts/{folder}: run make test-hosts")
    return python


def test_python_of_mitsuba():
    """docs/hosts.md: Mitsuba, its price and its picture; import lull is enough"""
    python = host_python("venv", "mitsuba")
    scene = ROOT / "tests/hosts/scenes/box.xml"
    with elsewhere() as folder:
        (folder / "scene.xml").write_text(scene.read_text().replace('value="96"', 'value="24"'))
        text = FOUND["docs/hosts.md", "python", 1].replace("llvm_ad_rgb", "scalar_rgb").replace("spp_max=2048", "spp_max=256")
        done = subprocess.run([python, "-c", text], text=True, capture_output=True, env={**os.environ, "PYTHONPATH": f"{ROOT}/plugin-api/python"})
        assert done.returncode == 0 and "spp min / mean / max" in done.stdout and os.path.getsize("picture.exr") > 1000, done


def test_python_of_luxcore():
    """docs/hosts.md: LuxCore, its price and its picture"""
    python = host_python("luxcore", "pyluxcore")
    with elsewhere() as folder:
        shutil.copy(ROOT / "tests/hosts/scenes/room.scn", folder / "scene.scn")
        (folder / "scene.cfg").write_text("film.width = 24\nfilm.height = 24\n")
        text = FOUND["docs/hosts.md", "python", 2].replace("spp_max=2048", "spp_max=128")
        done = subprocess.run([python, "-c", text], text=True, capture_output=True, env={**os.environ, "PYTHONPATH": f"{ROOT}/plugin-api/python"})
        assert done.returncode == 0 and "spp min / mean / max" in done.stdout and os.path.getsize("picture.exr") > 1000, done


def compiled(*arguments):
    done = subprocess.run(["cc", "-Wall", "-Wextra", "-Werror", f"-I{ROOT}/plugin-api/include", *map(str, arguments)], text=True, capture_output=True)
    assert done.returncode == 0, done.stderr


def test_c_criterion():
    """plugin-api/README.md: the criterion of the page compiles and keeps every rule of lull-check"""
    with elsewhere() as folder:
        (folder / "mine.c").write_text(FOUND["plugin-api/README.md", "c", 1])
        compiled("-shared", "-fPIC", "-fvisibility=hidden", f"-Wl,--version-script={ROOT}/plugin-api/plugin.map", "mine.c", "-o", "mine.so", "-lm")
        done = subprocess.run([BUILD / "bin/lull-check", "./mine.so"], text=True, capture_output=True)
        assert done.returncode == 0, done.stdout + done.stderr


def command_of(page, begin, **changed):
    """The words of the command in a line of text that begins so."""
    text = re.search(rf"`({re.escape(begin)}[^`]*)`", Path(page).read_text())[1]
    return shlex.split(functools.reduce(lambda t, change: t.replace(*change), changed.items(), text))


def keeps_the_contract(build, source, fault):
    """build(): makes mine.so of `source`; with `fault` in the place of the idea that stops no block, and the render is whole."""
    build()
    done = subprocess.run([BUILD / "bin/lull-check", "./mine.so"], text=True, capture_output=True)
    assert done.returncode == 0 and "42 checks, 0 failed" in done.stdout, done.stdout + done.stderr
    exported = subprocess.run(["nm", "-D", "--defined-only", "mine.so"], text=True, capture_output=True, check=True).stdout
    assert [line.split()[2] for line in exported.splitlines() if " A " not in line] == ["lull_criterion_entry_v1"], exported
    render = [BUILD / "bin/lull-render", ROOT / "tests/cli/room.pbrt", "-q", "--size", "24x16", "--block", "8", "--spp-max", "128", "-c", "./mine.so"]
    for spp, reason in ((64, "criterion"), (128, "spp-max")):
        subprocess.run([*render, "-o", "picture.exr", "--report", "report.json"], check=True, capture_output=True)
        blocks = json.loads(Path("report.json").read_text())["blocks"]
        assert {b["reason"] for b in blocks} == {reason} and spp <= min(b["spp"] for b in blocks), (reason, blocks)
        text = Path(source).read_text()
        Path(source).write_text(text.replace("block.spp >= 64", fault))
        build()


def test_cpp_criterion():
    """plugin-api/README.md: the criterion in C++ compiles by its line, keeps every rule, and lets no exception out"""
    with elsewhere() as folder:
        (folder / "mine.cpp").write_text(FOUND["plugin-api/README.md", "cpp", 1])
        words = command_of(ROOT / "plugin-api/README.md", "c++ -std=c++11 -shared",
                           **{"-Iinclude": f"-I{ROOT}/plugin-api/include", "script=plugin.map": f"script={ROOT}/plugin-api/plugin.map"})
        keeps_the_contract(lambda: subprocess.run([*words, "-Wall", "-Wextra", "-Werror"], check=True), "mine.cpp", "block.spp > 2 ? throw 1 : false")


def test_rust_criterion():
    """plugin-api/README.md: the criterion in Rust, the same"""
    if not shutil.which("rustc"):
        raise Skip("no rustc: apt-get install rustc")
    with elsewhere() as folder:
        page = ROOT / "plugin-api/README.md"
        (folder / "mine.rs").write_text(FOUND["plugin-api/README.md", "rust", 1])
        (folder / "kit.c").write_text(FOUND["plugin-api/README.md", "c", 2])
        subprocess.run(command_of(page, "cc -c -fPIC", **{"-Iinclude": f"-I{ROOT}/plugin-api/include"}), check=True)
        words = command_of(page, "rustc -O")
        keeps_the_contract(lambda: subprocess.run(words, check=True, capture_output=True), "mine.rs", 'panic!("{}", block.spp)')


HOST = """
#include <lull/host.h>
#include <stdio.h>
enum { W = 48, H = 32, MINE = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF) };
static double color[3 * W * H], half[3 * W * H];
static void render(struct lull_host_blocks *blocks)
{
    for (uint32_t i = 0; i < blocks->count; i++) {
        struct lull_host_block *b = &blocks->list[i];
        if (b->reason != LULL_REASON_NONE)
            continue;
        b->spp = b->next_spp;
        b->half_spp = b->spp / 2;
        for (int32_t y = b->y0; y < b->y1; y++)
            for (int32_t x = 3 * b->x0; x < 3 * b->x1; x++) {
                color[3 * W * y + x] = 0.5 * (double)b->spp;
                half[3 * W * y + x] = 0.5 * (double)b->half_spp;
            }
    }
}
int main(void)
{
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_host_services services = {.struct_size = sizeof services};
    struct lull_pair pairs[1] = {{"visible", "0.25"}};
    uint32_t pair_count = 1;
    struct lull_host_criterion *criterion = NULL;
    struct lull_host_frame *frame = NULL;
    struct lull_host_config config = {.struct_size = sizeof config, .width = W, .height = H, .spp_min = 16, .spp_max = 256, .check_step = 2};
    struct lull_plane plane = {.data = color, .stride_x = 24, .stride_y = 24 * W, .stride_c = 8, .scale = 1, .type = LULL_TYPE_F64,
                               .normaliser = LULL_NORM_SPP, .channels = 3};
    struct lull_plane planes[LULL_PLANE_COUNT] = {[LULL_PLANE_COLOR] = plane, [LULL_PLANE_HALF] = plane};
    struct lull_host_view view = {.struct_size = sizeof view, .plane_count = LULL_PLANE_COUNT, .x1 = W, .y1 = H, .planes = planes};
    struct lull_host_report report = {.struct_size = sizeof report, .threads = 1, .processes = 1, .film_pixels = W * H};
    planes[LULL_PLANE_HALF].data = half;
    planes[LULL_PLANE_HALF].normaliser = LULL_NORM_HALF_SPP;
"""


def test_c_host():
    """plugin-api/README.md: the host of the page compiles, renders and writes its files"""
    text = FOUND["plugin-api/README.md", "c", 3]
    assert text.count("/* render each block") == 1
    with elsewhere() as folder:
        (folder / "host.c").write_text(HOST + text.replace("/* render each block", "render(blocks); /* render each block") + "return err.code;\n}\n")
        compiled("host.c", "-o", "host", f"-L{BUILD}/lib", "-l:liblull-host.so.1", f"-Wl,-rpath,{BUILD}/lib")
        done = subprocess.run(["./host"], text=True, capture_output=True)
        assert done.returncode == 0 and os.path.getsize("report.json") > 100 and os.path.getsize("stops.png") > 100, done
        assert '"criterion"' in Path("report.json").read_text() and '"reason":\t"criterion"' in Path("report.json").read_text()


def test_cpp_host():
    """docs/hosting.md: the loop of the page is C++11"""
    with elsewhere() as folder:
        (folder / "host.cpp").write_text("""#include <lull/host.h>
struct Film {}; void render(Film &, lull_host_block &);
void loop(Film &film, lull_host_criterion *criterion, lull_host_frame *frame, lull_host_config config, lull_host_view view, lull_error err) {
""" + FOUND["docs/hosting.md", "cpp", 1] + "}\n")
        compiled("-std=c++11", "-xc++", "-fsyntax-only", "host.cpp")


# --- shell ---------------------------------------------------------------------------------------------------------------

SMALL_RENDER = r"""#!/usr/bin/env python3
import os, sys
words, out, limit = sys.argv[1:], [], True
while words:
    word = words.pop(0)
    if word == "--size":
        words.pop(0)
    else:
        out.append(word)
    limit &= word not in ("--spp-max", "--spp", "--shot-table")
os.execv("{program}", ["lull-render", *out, "--size", "48x32", *(["--spp-max", "32"] if limit else [])])
"""


def lines_of(text, left_out):
    """Whole commands, continuation lines joined, without those that are not run here."""
    joined = re.sub(r"\\\n\s*", " ", small(text)).splitlines()
    return "\n".join(line for line in joined if not (left_out and re.match(left_out, line)))


def set_up(folder):
    """Programs that render small, and the files that the pages name."""
    (folder / "bin").mkdir()
    (folder / "bin/lull-render").write_text(SMALL_RENDER.replace("{program}", str(BUILD / "bin/lull-render")))
    (folder / "bin/lull-render").chmod(0o755)
    for name in ("lull-report", "lull-check"):
        os.symlink(BUILD / "bin" / name, folder / "bin" / name)
    for name in ("scenes", "plugin-api"):
        os.symlink(ROOT / name, name)
    for name in ("examples", "include", "plugin.map"):
        os.symlink(ROOT / "plugin-api" / name, name)
    for name in ("scene", "SCENE", "room", "room_0007", "room_0008"):
        shutil.copy(ROOT / "tests/cli/room.pbrt", f"{name}.pbrt")
    os.rename("SCENE.pbrt", "SCENE")
    (folder / "path.csv").write_text(re.search(r"^```\n(frame;eye.*?)^```", (ROOT / "docs/shots.md").read_text(), re.M | re.S)[1])
    env = {**os.environ, "PATH": f"{folder}/bin:{os.environ['PATH']}"}
    subprocess.run(["lull-render", "room.pbrt", "-q", "-o", "old.exr", "--report", "old.json"], env=env, check=True)
    return env


def test_shell_runs():
    """the shell snippets that RUN names do what they say, line by line"""
    with tap.denoiser("box", BUILD):
        for (page, place), left_out in RUN.items():
            with elsewhere() as folder:
                env = set_up(folder)
                script = "set -e\n" + lines_of(FOUND[page, "sh", place], left_out)
                done = subprocess.run(["bash", "-c", script], env=env, text=True, capture_output=True, timeout=500)
                assert done.returncode == 0, (page, place, script, done.stdout[-2000:], done.stderr[-2000:])


def test_shell_is_listed():
    """every snippet is run, or listed with the reason why it is not"""
    shell = {(page, place) for page, language, place in FOUND if language == "sh"}
    assert shell == {*RUN} | {*CHECKED}, (shell - {*RUN} - {*CHECKED}, {*RUN, *CHECKED} - shell)
    assert not {*RUN} & {*CHECKED}
    code = {key for key in FOUND if key[1] not in ("sh", "json")}
    assert code == CODE, (code - CODE, CODE - code)


def test_json():
    """every snippet of JSON is JSON"""
    for key, text in FOUND.items():
        if key[1] == "json":
            json.loads(text)


@functools.lru_cache(None)
def help_of(program, sub):
    if program == "lull.blender":
        from lull.blender import cli
        return cli.parser().format_help()
    if program in ("scripts/setup", "lull-denoiser-setup"):
        return (Path(program) if "/" in program else Path("scripts/packages") / program).read_text()
    if program == "scripts/lab":
        return subprocess.run([program, "--help"], text=True, capture_output=True).stdout + Path("docs/results/decisions.md").read_text()
    return subprocess.run([BUILD / "bin" / program, *([sub] if sub else []), "--help"], text=True, capture_output=True).stdout


def commands(text):
    """(program, its words) of every command that is ours."""
    programs = {p.name for p in (BUILD / "bin").iterdir()} | {"scripts/setup", "scripts/lab", "lull-denoiser-setup"}
    plain = re.sub(r"(?m)(^|\s)#.*$", "", re.sub(r"\\\n\s*", " ", text))
    lexer = shlex.shlex(plain, posix=True, punctuation_chars=";|&()\n")
    lexer.commenters, lexer.whitespace, lexer.whitespace_split, segment = "", " \t", True, []
    for word in [*lexer, ";"]:
        if set(word) <= set(";|&()\n"):
            for i, w in enumerate(segment):
                name = w[len("build/bin/"):] if w.startswith("build/bin/") else w
                if name in programs or name == "lull.blender":
                    yield name, segment[i + 1:]
                    break
            segment = []
        else:
            segment.append(word)


def test_shell_words():
    """every shell snippet is bash; its programs have the options and subcommands that it gives them, its scenes and scripts are there"""
    seen = 0
    for (page, language, place), text in FOUND.items():
        if language != "sh":
            continue
        assert subprocess.run(["bash", "-n"], input=text, text=True, capture_output=True).returncode == 0, (page, place)
        for path in re.findall(r"(?<![\w/])(?:scenes|scripts)/[\w./-]+", text):
            assert Path(path).exists() or "$" in text, (page, place, path)
        for program, words in commands(text):
            sub = words[0] if program in ("ggn", "lull-study", "scripts/lab") and words else ""
            told = help_of(program, "" if program == "scripts/lab" else sub)
            if program == "scripts/lab":
                assert sub in Path("scripts/lab").read_text(), (page, program, sub)
                continue
            assert told, (page, place, program, sub)
            for word in words:
                if option := re.match(r"--[a-z][a-z-]*|-[A-Za-z](?![A-Za-z])", word):
                    assert re.search(rf"(?<![\w-]){option[0]}(?![\w-])", told), (page, place, program, sub, word)
                    seen += 1
    assert seen > 80, seen


if __name__ == "__main__":
    tap.main(globals())
