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


tap.main(dict(globals()))
