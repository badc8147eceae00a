"""What the Python package writes: the same verdicts and words as the path tracer's, and files that are whole or as
before."""
import os
import resource
import signal
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import lull  # noqa: F401
import tap
from lull.files import Output, check_outputs, replaced, write_each
from tap import Skip, raises

RENDER = os.path.abspath(f"{os.environ.get('BUILD', 'build')}/bin/lull-render")
ROOM = os.path.abspath("tests/cli/room.pbrt")
TMP = tempfile.TemporaryDirectory()
os.chdir(TMP.name)
ENDINGS = {"--output": (".exr",), "--preview": (".png",), "--report": (".json",), "--stop-map": (".png", ".csv"),
           "--checkpoint": ()}


def write(path, text="new"):
    with replaced(path) as file:
        file.write(text.encode())


def verdict_of_lull_render(options):
    """Its line without the program's name, or "" when it renders."""
    done = subprocess.run([RENDER, "room.pbrt", "-q", "--size", "8x8", "--spp", "1", *(t for o in options for t in o)],
                          capture_output=True, text=True)
    assert done.returncode in (0, 2), done.stderr
    return done.stderr.strip().removeprefix("lull-render: ")


def verdict_of_package(options):
    try:
        check_outputs([Output(option, path, ENDINGS[option]) for option, path in options], ["room.pbrt"])
    except (OSError, ValueError) as error:
        return str(error)
    return ""


def test_same_verdicts_as_lull_render():
    """the path tracer refuses the same outputs in the same words"""
    Path("room.pbrt").write_bytes(Path(ROOM).read_bytes())
    for name in ("folder", "folder.exr", "folder.png"):
        os.mkdir(name)
    os.mkfifo("pipe.exr")
    os.symlink("/dev/null", "null.exr")
    os.symlink("room.pbrt", "room.ckp")
    os.link("room.pbrt", "other.ckp")
    os.symlink("loop.exr", "loop.exr")
    os.symlink("folder", "way")
    os.symlink("folder/new.png", "far.png")
    Path("there.png").write_text("old")
    os.symlink("there.png", "here.png")
    long = "n" * 260
    for options in ([("--output", "a.jpg")], [("--output", ".exr")], [("--output", "exr")], [("--output", "A.EXR")],
                    [("--preview", "a.exr")], [("--report", "a.txt")], [("--stop-map", "a.jpg")], [("--stop-map", "a.CSV")],
                    [("--output", "folder.exr")], [("--output", "nowhere/a.exr")], [("--output", "room.pbrt/a.exr")],
                    [("--output", f"{long}.exr")], [("--output", "pipe.exr")], [("--output", "null.exr")],
                    [("--output", "loop.exr")], [("--checkpoint", "folder/")], [("--checkpoint", "folder")],
                    [("--checkpoint", "room.pbrt")], [("--checkpoint", "room.ckp")], [("--checkpoint", "other.ckp")],
                    [("--preview", "x.png"), ("--stop-map", "y.png")],
                    [("--preview", "folder/x.png"), ("--stop-map", "x3.png")]):
        own, wanted = verdict_of_package(options), verdict_of_lull_render(options)
        assert own == wanted, (options, own, wanted)
        assert "\n" not in own
    assert Path("room.pbrt").read_bytes() == Path(ROOM).read_bytes()


def test_one_file_twice():
    """one file for two outputs is refused, by whatever names, also where no file is yet"""
    os.makedirs("two/folder")
    os.symlink("folder", "two/way")
    os.symlink("folder/new.png", "two/far.png")
    Path("two/there.png").write_text("old")
    os.symlink("there.png", "two/here.png")
    for first, second in (("x.png", "x.png"), ("x1.png", "./x1.png"), ("x2.png", f"{os.getcwd()}/x2.png"),
                          ("two/folder/x.png", "two/way/x.png"), ("two/folder/new.png", "two/far.png"),
                          ("two/there.png", "two/here.png")):
        options = [("--preview", first), ("--stop-map", second)]
        text = "{} {}: the same file as {} {}, one of the two would be lost"  # the path tracer meets the other one last
        assert verdict_of_package(options) == text.format("--stop-map", second, "--preview", first), options
        assert verdict_of_lull_render(options) == text.format("--preview", first, "--stop-map", second), options


def test_replaced():
    """a file is replaced as a whole, through links, with its mode, a new one with that which the umask leaves; a failure leaves what was there"""
    os.mkdir("r")
    Path("r/old").write_text("old")
    os.chmod("r/old", 0o604)
    os.symlink("old", "r/link")
    os.symlink("made", "r/dangling")
    before = os.umask(0o027)
    try:
        write("r/link")
        write("r/dangling")
    finally:
        os.umask(before)
    assert os.path.islink("r/link") and Path("r/old").read_text() == Path("r/made").read_text() == "new"
    assert stat.S_IMODE(os.stat("r/old").st_mode) == 0o604 and stat.S_IMODE(os.stat("r/made").st_mode) == 0o640
    try:
        with replaced("r/old") as file:
            file.write(b"half")
            raise KeyError
    except KeyError:
        pass
    assert Path("r/old").read_text() == "new" and sorted(os.listdir("r")) == ["dangling", "link", "made", "old"]
    write("r/" + "n" * 250)


def test_full_disk():
    """a write that fails names the file, keeps the old one and leaves no temporary"""
    os.mkdir("full")
    write("full/a", "old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        raises(OSError, "full/a: write failed: File too large", write, "full/a", "x" * 100000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, before)
    assert os.listdir("full") == ["a"] and Path("full/a").read_text() == "old"


def test_each():
    """the first output that fails does not keep the others from being written, and is kept elsewhere itself"""
    os.environ["TMPDIR"] = tempfile.tempdir = os.path.join(TMP.name, "spare")
    os.mkdir("spare")
    try:
        written, failed = write_each([("gone/a.exr", write), ("", write), ("b.png", write), ("gone/c.json", write)])
    finally:
        tempfile.tempdir = None
        del os.environ["TMPDIR"]
    assert written == ["b.png"] and Path("b.png").read_text() == "new"
    kept = [f"{TMP.name}/spare/lull-{os.getpid()}-{name}" for name in ("a.exr", "c.json")]
    assert [line.split("; kept as ")[1] for line in failed] == kept and all(map(os.path.isfile, kept)), failed
    assert "gone/a.exr: cannot write there" in failed[0]


def test_leftovers():
    """what a killed process left is removed by the next one that writes there; what is in use stays"""
    code = ("import sys, os, signal; from lull.files import replaced\n"
            "with replaced('k/a') as f:\n f.write(b'half'); f.flush(); os.kill(os.getpid(), signal.SIGKILL)")
    os.mkdir("k")
    path = os.pathsep.join([str(Path(lull.__file__).parents[1])])
    done = subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": path})
    assert done.returncode == -signal.SIGKILL and len(os.listdir("k")) == 1
    Path(f"k/.tmp-lull{os.getppid()}-0.b").write_text("in use")
    Path("k/.tmp-lull.c").write_text("not ours")
    check_outputs([Output("-o", "k/a")])
    assert sorted(os.listdir("k")) == [".tmp-lull.c", f".tmp-lull{os.getppid()}-0.b"], os.listdir("k")


def test_read_only():
    """a folder without write permission is refused before the work"""
    if os.getuid() == 0:
        raise Skip("root writes everywhere")
    os.mkdir("shut", 0o500)
    raises(OSError, "shut/a: cannot write there: Permission denied", check_outputs, [Output("-o", "shut/a")])


HOST = '''
import sys
import numpy as np
import lull
from lull import checkpoint, exr, files, outputs
name = eval(sys.argv[1])
with lull.load("fixed", spp=32) as c:
    f = lull.Frame(c, 32, 16, block=16)
    d = lull.Driver(f, lambda rects, *_: [np.full((r.height, r.width, 3), .5) for r in rects], identity={"scene": name})
    keeper = checkpoint.Keeper(name + ".npz", d)
    files.check_outputs([files.Output("report", name + ".json"), files.Output("page", name + ".html")], [name + ".npz"])
    progress = outputs.Progress()
    progress.live, progress._next_s = True, 0
    d.after_call = progress.show
    d.warn("\u2265 é")
    assert d.run().outcome == "done"
    progress.clear()
    done, failed = files.write_each([
        (name + ".json", lambda p: outputs.write_report(p, d, name)), (name + ".html", lambda p: outputs.write_page(p, d, name)),
        (name + ".exr", lambda p: outputs.write_exr(p, d, name)), (name + ".png", lambda p: outputs.write_preview(p, d)),
        (name + ".csv", lambda p: outputs.write_stop_map(p, f, name)), ("", print)])
    assert not failed and not keeper.unsaved, (failed, keeper.unsaved)
    assert outputs.is_ours(name + ".exr") and checkpoint.is_one(name + ".npz") and exr.texts(name + ".exr")["lull:scene"]
    fresh = lull.Driver(lull.Frame(c, 32, 16, block=16), None, identity={"scene": name})
    checkpoint.load(name + ".npz", fresh)
'''


def test_host():
    """a host in a locale of ASCII, with streams that are closed or full: its files have their names, and nothing is lost"""
    Path("host.py").write_text(HOST, encoding="utf-8")
    wanted = [f"\u00e9 \u2265{end}" for end in (".csv", ".exr", ".html", ".json", ".npz", ".png")]
    ascii_only = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    # as text of the program, and as Python has it from the command line
    names = {ascii("\u00e9 \u2265"), ascii("\u00e9 \u2265".encode().decode("ascii", "surrogateescape"))}
    for env, given in [(ascii_only, name) for name in sorted(names)] + [({"LC_ALL": "C.UTF-8"}, ascii("\u00e9 \u2265"))]:
        for streams in ("", ">&-", "2>&-", ">&- 2>&- <&-", ">/dev/full 2>/dev/full"):
            for name in wanted:
                Path(name).unlink(missing_ok=True)
            done = subprocess.run(["sh", "-c", f'"$0" host.py "$1" {streams}', sys.executable, given], capture_output=True,
                                  env={**os.environ, **env, "PYTHONPATH": str(Path(lull.__file__).parents[1])})
            assert done.returncode == 0 and b"Traceback" not in done.stderr, (env, given, streams, done)
            assert sorted(name for name in os.listdir(".") if name.startswith("\u00e9")) == wanted, (env, given, streams, os.listdir("."))


tap.main(dict(globals()))
