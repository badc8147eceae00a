"""Programs of Python with bad streams and in bad locales."""
import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import tempfile

import tap

BIN = os.path.abspath(os.path.join(os.environ.get("BUILD", "build"), "bin"))
RECORDED = os.path.abspath("tests/data/recorded/train/one-view0")
os.environ.update(PYTHONPATH=os.path.abspath("plugin-api/python"), LULL_PLUGIN_PATH=os.path.abspath(f"{BIN}/../lib/lull"))
TMP = tempfile.TemporaryDirectory()
os.chdir(TMP.name)
MODULE = [sys.executable, "-m"]
C_LOCALE = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
NAME = "bild é≥"  # a letter of Latin-1, and one of no set of 8 bits
with open("stops.csv", "w", encoding="utf-8") as file:
    file.write("view;block;threshold;censored;stop;score\na;0;100;0;110;0.4\na;1;200;0;150;\n")
with open("thresholds.csv", "w", encoding="utf-8") as file:
    file.write("a;1;2;3;\n")
open("scene.blend", "w").close()

ANSWERS = ([*MODULE, "lull"], [*MODULE, "lull", "watch", "--help"], [*MODULE, "lull", "plot", "--help"], [*MODULE, "lull.blender", "--help"],
           [f"{BIN}/lull-plot", "--help"], [f"{BIN}/lull-study", "--help"], [f"{BIN}/lull-study", "report", "--help"],
           [f"{BIN}/ggn", "evaluate", "--help"], [f"{BIN}/ggn", "cost", "--version"], [f"{BIN}/ggn", "compare", "thresholds.csv", "thresholds.csv"])
REFUSALS = ([*MODULE, "lull", "watch"], [*MODULE, "lull", "plot"], [*MODULE, "lull.blender", "none.blend"], [*MODULE, "lull.blender", "--nonsense"],
            [f"{BIN}/lull-plot"], [f"{BIN}/lull-study", "init"], [f"{BIN}/ggn", "evaluate"], [f"{BIN}/ggn", "compare", "none.csv", "none.csv"])
WORK = [f"{BIN}/lull-plot", "stops.csv", "-o", "picture.png"]


def run(command, closed=(), stdout=None, stderr=None, env=None):
    """(status, standard output, standard error) with these descriptors closed."""
    def close():
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        for descriptor in closed:
            os.close(descriptor)
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        status = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=stdout or out, stderr=stderr or err, preexec_fn=close,
                                env={**os.environ, **(env or {})}, check=False, timeout=600).returncode
        said = []
        for file in (out, err):
            file.seek(0)
            said.append(file.read().decode())
    return (status, *said)


def lost(command, said, status, **how):
    """The answer to this command got lost, which is one line on standard error if that is there."""
    got, _, err = run(command, **how)
    assert got == status and err.count("\n") == (1 if said else 0) and said in err, (command, how, got, err)


def test_closed():
    """closed streams: what is to be said on standard output and cannot be is one line, status 2"""
    for command in ANSWERS:
        assert run(command)[0] == 0 == run(command, closed=[2])[0] == run(command, closed=[0])[0], command
        lost(command, "cannot write standard output", 2, closed=[1])
        lost(command, "", 2, closed=[0, 1, 2])


def test_full():
    """a full disk is told as well, on standard output; of standard error only its words are lost"""
    if not os.path.exists("/dev/full"):
        raise tap.Skip("no /dev/full")
    with open("/dev/full", "w", encoding="utf-8") as full:
        for command in ANSWERS:
            lost(command, "cannot write standard output", 2, stdout=full)
            assert run(command, stderr=full)[0] == 0, command
        for command in REFUSALS:
            assert run(command, stderr=full)[0] == 2, command


def test_unread():
    """whoever reads standard output may stop, as head does: no word, the status of SIGPIPE"""
    for command in ANSWERS:
        reader, writer = os.pipe()
        os.close(reader)
        lost(command, "", 141, stdout=writer)
        os.close(writer)


def test_refused():
    """what is refused is one line and status 2, whatever is closed"""
    for command in REFUSALS:
        status, out, err = run(command)
        assert status == 2 and not out and err.count("\n") == 1, (command, status, out, err)
        for closed in ([0], [1], [0, 1]):
            assert run(command, closed=closed) == (2, "", err), (command, closed)
        for closed in ([2], [0, 1, 2]):
            assert run(command, closed=closed) == (2, "", ""), (command, closed)


def test_work():
    """files do not get the numbers of closed streams, and nothing that is said"""
    pictures = set()
    for closed in ([], [0], [1], [2], [1, 2], [0, 1, 2]):
        assert run(WORK, closed=closed) == (0, "", ""), closed
        with open("picture.png", "rb") as file:
            pictures.add(file.read())
    assert len(pictures) == 1


def test_variables():
    """what is set for other Pythons, as programs that bring their own do, is no matter of the programs'"""
    os.mkdir("other")
    for name in ("numpy", "matplotlib", "lull", "json"):
        with open(f"other/{name}.py", "w", encoding="utf-8") as file:
            file.write("raise SystemExit(9)\n")
    for command in (WORK, [f"{BIN}/lull-study", "--help"], [f"{BIN}/ggn", "compare", "thresholds.csv", "thresholds.csv"]):
        want = run(command)
        assert want[0] == 0 and not want[2], (command, want)
        for name, value in (("HOME", "/none"), ("INSPECT", "1"), ("IOENCODING", "x"), ("PATH", os.path.abspath("other")), ("HASHSEED", "x"), ("VERBOSE", "1")):
            assert run(command, env={f"PYTHON{name}": value}) == want, (command, name)


def test_gone():
    """a current folder that is no more is what is said, where a name needs it"""
    gone = 'mkdir gone && cd gone && rmdir ../gone && exec "$@"'
    for command in ([*WORK[:1], f"{TMP.name}/stops.csv", *WORK[2:]], [*MODULE, "lull", "watch", "none"],
                    [f"{BIN}/lull-study", "export", RECORDED, "-o", "all.json"], [f"{BIN}/ggn", "compare", *2 * [f"{TMP.name}/thresholds.csv"], "-o", "out"]):
        status, out, err = run(["sh", "-c", gone, "-", *command])
        assert status == 2 and not out and err.count("\n") == 1 and "the current folder: No such file or directory" in err, (command, status, out, err)


def test_blender():
    """Blender is started with three streams, and by its name"""
    if importlib.util.find_spec("bpy"):
        raise tap.Skip("bpy is here, and is used")
    with open(NAME, "w", encoding="utf-8") as file:
        file.write('#!/bin/sh\nfor fd in 0 1 2; do [ -e /proc/$$/fd/$fd ] || exit 9; done\nexit 7\n')
    os.chmod(NAME, 0o755)
    for closed in ([], [0], [1], [2], [0, 1, 2]):
        for env in ({}, C_LOCALE):
            assert run([*MODULE, "lull.blender", "scene.blend", "--blender", f"./{NAME}"], closed=closed, env=env)[0] == 7, (closed, env)


def test_locale():
    """a locale without letters: names are what they are, in files and in what is said"""
    for name in ("stops.csv", "thresholds.csv", "scene.blend"):
        shutil.copy(name, NAME + name)
    shutil.copytree(RECORDED, f"recorded {NAME}/one")
    for command, status, said in ((["lull-plot", f"{NAME}stops.csv", "-o", f"{NAME}.png"], 0, ""), (["lull-plot", NAME + "none", "-o", "x.png"], 2, NAME),
                                  (["ggn", "compare", f"{NAME}thresholds.csv", f"{NAME}thresholds.csv"], 0, ""),
                                  (["ggn", "compare", NAME + "none", NAME + "none"], 2, NAME), (["lull-study", "status", NAME + "none"], 2, NAME),
                                  (["lull-study", "init", NAME + "study", "--task", "thresholds", "--asked-by", NAME, "--contact", "a@b", "--views", f"recorded {NAME}/one"], 0, ""),
                                  (["lull-study", "status", NAME + "study"], 2, NAME)):
        got, out, err = run([f"{BIN}/{command[0]}", *command[1:]], env=C_LOCALE)
        assert got == status and (said in err and err.count("\n") == 1 if status else not err), (command, got, out, err)
    for command in ([*MODULE, "lull.blender", NAME + ".none"], [*MODULE, "lull", "watch", NAME + "none"]):
        got, _, err = run(command, env=C_LOCALE)
        assert got == 2 and NAME in err and err.count("\n") == 1, (command, got, err)


if __name__ == "__main__":
    tap.main(dict(globals()))
