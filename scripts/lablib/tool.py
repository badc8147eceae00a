"""What the jobs share: where things are, options, running programs, files of results."""
import argparse
import datetime
import json
import os
import re
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.path.join(ROOT, os.environ.get("BUILD", "build"))
GGN = os.path.join(BUILD, "bin", "ggn")
RENDER = os.path.join(BUILD, "bin", "lull-render")
SHARED = os.path.join(ROOT, "..", "shared")
DOCS = os.path.join(ROOT, "docs")
THREADS = len(os.sched_getaffinity(0))
sys.path.append(os.path.join(ROOT, "plugin-api", "python"))  # the package lull, of this tree


class Refused(Exception):
    """One line that says what is wrong."""


def options(job, module, words):
    """What module.options(parser) declares. Values of type `path` do not depend on the folder."""
    parser = argparse.ArgumentParser(prog="scripts/lab " + job, description=module.__doc__, allow_abbrev=False,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    module.options(parser)

    def refuse(text):
        raise Refused("%s (see --help)" % text)

    parser.error = refuse
    return parser.parse_args(words)


path = os.path.abspath


def writes(parser, more=""):
    """--write [DIR]: where results and pages go; None: nowhere."""
    parser.add_argument("--write", metavar="DIR", nargs="?", const=DOCS, type=path,
                        help="keep the figures in DIR/results/ and fill the pages of DIR (docs)" + more)


def run(*command, env=None, **how):
    """The standard output of a command, run in the root of the tree."""
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT,
                          env={**os.environ, **(env or {})}, **how)
    if done.returncode:
        last = done.stderr.strip().splitlines()[-1:] or ["exit status %d" % done.returncode]
        raise Refused("%s: %s" % (" ".join(map(str, command)), last[0]))
    return done.stdout


def ggn(*words, **how):
    return run(GGN, *words, **how)


def bench(name, *words, **how):
    """What a measuring program of tests/bench/ prints; `make build/bench/NAME` builds it."""
    return run(os.path.join(BUILD, "bench", name), *words, **how)


def plan_lines(path):
    """(place, words) of each line of a plan that has words in front of its #."""
    found = []
    with open(path, encoding="utf-8-sig") as file:
        for number, line in enumerate(file, 1):
            words = line.split("#", 1)[0].split()
            if words:
                found.append((f"{path}:{number}", words))
    if not found:
        raise Refused(f"{path}: a plan with nothing in it")
    return found


def load(*names):
    try:
        with open(os.path.join(*names), encoding="utf-8") as file:
            return json.load(file)
    except ValueError as why:
        raise Refused("%s: %s" % (os.path.join(*names), why)) from why


def save(data, *names, **layout):
    """Whole or not at all."""
    name = os.path.join(*names)
    with open(name + ".tmp", "w", encoding="utf-8") as file:
        json.dump(data, file, ensure_ascii=False, **(layout or {"indent": 1}))
        file.write("\n")
    os.replace(name + ".tmp", name)


def commit(*of):
    if not shutil.which("git"):  # as where there is no repository: a release has neither
        return ""
    done = subprocess.run(["git", "-C", ROOT, "log", "-1", "--format=%h", *of], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return done.stdout.strip()


def default(criterion, parameter):
    """The default of a criterion's parameter, as the program tells it."""
    found = re.search(r"^%s .*?^    -p %s=(\S+)" % (criterion, parameter), run(RENDER, "--list-criteria"), re.M | re.S)
    if not found:
        raise Refused("%s has no parameter %s" % (criterion, parameter))
    return float(found[1])


def observer():
    """The parameters of the model observer that ships: its level and spread."""
    return load(ROOT, "ggn", "sight", "observer.json")


def measured(**more):
    """Who says so: stands beside all figures that are kept."""
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        model = re.search(r"model name\s*: (.*)", file.read())
    return {"command": " ".join(["scripts/lab", *sys.argv[1:]]), "date": datetime.date.today().isoformat(),
            "processor": "%s, %d processors" % (model[1] if model else "processor unknown", THREADS), "commit": commit() or "unknown", **more}


def results(docs, job):
    """What was measured so far; {} if nothing was."""
    return load(docs, "results", job + ".json") if os.path.exists(os.path.join(docs, "results", job + ".json")) else {}


def store(docs, job, data, **layout):
    """Keeps the figures of a job and fills the pages that show them."""
    from lablib import pages, sources
    os.makedirs(os.path.join(docs, "results"), exist_ok=True)
    save(data, docs, "results", job + ".json", **layout)
    sources.keep(docs, job, data, pages.FIGURES[job].SOURCES)
    pages.fill(docs)
