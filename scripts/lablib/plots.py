"""Pictures by gnuplot."""
import os
import subprocess

from lablib.tool import Refused


def plot(folder, name, size, script, font="sans,11"):
    path = os.path.join(folder, name)
    head = ("set encoding utf8\nset terminal pngcairo size %d,%d noenhanced font '%s' background '#ffffff'\nset output '%s'\n"
            "set border lc '#444444'\nset grid lc '#dddddd'\nset key noenhanced\nset datafile missing 'nan'\n" % (*size, font, path + ".tmp"))
    done = subprocess.run(["gnuplot"], input=head + script, text=True, capture_output=True)
    if done.returncode:
        raise Refused("%s: %s" % (name, (done.stderr.strip() or "gnuplot failed").splitlines()[-1]))
    os.replace(path + ".tmp", path)


def data(name, rows):
    """A block of data under $name; a row is a list of numbers."""
    return "$%s << E\n%s\nE\n" % (name, "\n".join(" ".join("%g" % v for v in row) for row in rows))
