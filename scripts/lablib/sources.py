"""Which files a job's figures depend on, and which of them have changed since it measured.

A job declares SOURCES, patterns below the root. When it stores figures, docs/results/sources.json keeps a hash of each file's tokens under
the commit that the figures name. Comments, blanks, include paths and folders do not count: a file that moves is the same file."""
import ast
import functools
import glob
import hashlib
import os
import re
import subprocess

from lablib import tool

NAME = "sources.json"
SENTENCE = r"\*Measured before [^*\n]* changed[^*\n]*\.\*"  # of stale(), as pages have it
# What decides a picture's samples, what is seen in it, and who stops it.
PICTURES = tuple("pathtracer/%s/*.[ch]" % folder for folder in ("geom", "integ", "pbrt", "sample", "scene", "shade")) + (
    "pathtracer/render/film.[ch]", "pathtracer/render/rows.[ch]")
SIGHT = ("ggn/sight/*.[ch]", "ggn/sight/observer.json")
HOST = ("plugin-api/host/ask.c", "plugin-api/host/schedule.c", "plugin-api/host/view.c")
OBSERVER = SIGHT + HOST + tuple("ggn/plugin/%s.[ch]" % name for name in ("observer", "means", "undersampled"))
NETWORK = ("ggn/nn/*.[ch]", "ggn/model/*.[ch]", "ggn/models/lull-3.ggn") + tuple(
    "ggn/plugin/%s.[ch]" % name for name in ("ggn", "history", "pair", "windowed"))
TRAINING = ("ggn/data/*.[ch]", "ggn/model/*.[ch]", "ggn/nn/*.[ch]", "ggn/train/*.[ch]")
DENOISED = SIGHT + HOST + ("ggn/plugin/denoised/*.[ch]", "plugin-api/denoise/*.[ch]")
EXAMPLES = ("plugin-api/examples/halfbuf.c", "plugin-api/examples/variance.c")
JUDGE = ("plugin-api/python/lull/judge/*.py",)


def tokens(name, data):
    """What of a file's bytes counts."""
    if name.endswith(".py"):
        tree = ast.parse(data)
        for node in ast.walk(tree):  # a docstring is a comment
            body = getattr(node, "body", None)
            if isinstance(body, list) and body and isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
                body[0].value.value = ""
        return ast.dump(tree).encode()
    if name.endswith((".c", ".h", ".cpp")):
        text = re.sub(rb'^#include "[^"]*"', b"", data, flags=re.M)
        words = re.findall(rb'"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|//[^\n]*|/\*.*?\*/|\w+|\S', text, re.S)
        return b" ".join(w for w in words if not w.startswith((b"//", b"/*")))
    return data


def key(name):
    """A file's name in sources.json: its program and its own name, without the folders between."""
    return "%s/%s" % (name.split("/")[0], name.split("/")[-1])


def digest(name, data):
    return hashlib.sha256(tokens(name, data)).hexdigest()[:8]


def files(patterns):
    """{key: path} of what patterns name in this tree."""
    found = sorted({path for p in patterns for path in glob.glob(os.path.join(tool.ROOT, p))})
    return {key(os.path.relpath(path, tool.ROOT)): path for path in found}


@functools.lru_cache(maxsize=None)
def digest_of(path):
    with open(path, "rb") as file:
        return digest(path, file.read())


def hashes(patterns):
    return {name: digest_of(path) for name, path in files(patterns).items()}


def commits(figures):
    """The commits that the figures of a job name, in their order."""
    if isinstance(figures, dict):
        if "commit" in figures and "command" in figures:
            return [figures["commit"]]
        figures = list(figures.values())
    return list(dict.fromkeys(c for f in figures for c in commits(f))) if isinstance(figures, list) else []


def keep(docs, job, figures, patterns):
    """Notes what the figures that were measured now depend on; forgets commits that the job's figures no longer name."""
    kept = tool.results(docs, "sources")
    named, now = commits(figures), tool.commit() or "unknown"
    of = {commit: found for commit, found in kept.get(job, {}).items() if commit in named}
    if now in named:
        of[now] = hashes(patterns)
    tool.save({**kept, job: of}, docs, "results", NAME, indent=0, sort_keys=True)


@functools.lru_cache(maxsize=None)
def days():
    """{path: day of the last commit that touched it}; {} where there is no repository."""
    done = subprocess.run(["git", "-C", tool.ROOT, "log", "--format=%x00%cs", "--name-only"], stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, text=True)
    found = {}
    for commit in done.stdout.split("\0")[1:]:
        day, _, names = commit.partition("\n")
        for name in names.split():
            found.setdefault(name, day)
    return found


def changed(docs, job, patterns):
    """Paths of the files that are not what they were when a job's figures were measured; of several commits each counts."""
    there, now = files(patterns), hashes(patterns)
    before = tool.results(docs, "sources").get(job, {})
    return sorted({there.get(name, name) for then in before.values() for name in {*then, *now} if then.get(name) != now.get(name)})


def stale(docs, job, patterns):
    """One sentence over a table whose figures are older than what they depend on, or ""."""
    paths = [os.path.relpath(path, tool.ROOT) if os.path.isabs(path) else path for path in changed(docs, job, patterns)]
    if not paths:
        return ""
    day, name = max((days().get(path, ""), path) for path in paths)
    more = " and %d other%s" % (len(paths) - 1, "s" if len(paths) > 2 else "") if len(paths) > 1 else ""
    return "*Measured before %s%s changed%s.*" % (name, more, " (%s)" % day if day else "")
