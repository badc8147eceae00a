#!/usr/bin/env python3
"""Random histories of the path tracer against a model of what must be on disk.

usage: host.py [--runs N] [--seed N] [--keep DIR] [--bin PROGRAM]     (`make host-model`: 1,000 runs; tests/cli/host_model.sh: a few)

A history is a folder and some runs in it with the same options: each is let alone, interrupted (SIGINT, SIGTERM), killed or given a
disk that fills up (a bound on the size of files; as root a small tmpfs, too); all go on from where the one before ended, the last is
let alone. After every run the model says what may be there:

- the exit status fits what was done to it, and a status of 2 comes with a line on stderr;
- a file under its final name is whole; nothing temporary stays, but after SIGKILL, and then not beyond the next run;
- a checkpoint, once there, stays, and is one that can be resumed; an interrupted render has one;
- a recorded block, once there, stays and has the bytes of a recording that nothing happened to; the manifest names it, at the latest
  after the next run that ends by itself;
- after the last run image, table, preview and recording have the bytes of the undisturbed ones.

Exit status 1 and the history, as commands, when one fails.
"""
import argparse
import glob
import hashlib
import json
import os
import random
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SCENE = os.path.join(ROOT, "tests", "cli", "room.pbrt")
LIMIT_S = float(os.environ.get("LIMIT_S", 3600))  # of one run that hangs; that of tests/run
TMPFS_K = (16, 32, 64, 128, 192, 256, 320)
FSIZE_K = (0, 1, 4, 8, 16, 24, 64, 100, 128)


class Broken(Exception):
    pass


def expect(condition, text):
    if not condition:
        raise Broken(text)


def read(path):
    with open(path, "rb") as f:
        return f.read()


# --- what a whole file is --------------------------------------------------------------------------------------------------

def check_png(data):
    at = 8
    expect(data[:8] == b"\x89PNG\r\n\x1a\n", "no PNG")
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        expect(zlib.crc32(data[at + 4:at + 8 + size]) == struct.unpack(">I", data[at + 8 + size:at + 12 + size])[0], "a broken PNG chunk")
        at += 12 + size
    expect(kind == b"IEND", "a PNG without its end")


def check_exr(data):
    """Header to its end, then the offsets of its rows: each must have a chunk of its size in the file, the last one up to its end."""
    expect(data[:4] == b"\x76\x2f\x31\x01", "no EXR")
    at, end = 8, 0
    while data[at] != 0:
        kind = data.index(b"\0", data.index(b"\0", at) + 1)
        at = kind + 5 + struct.unpack("<I", data[kind + 1:kind + 5])[0]
    first = struct.unpack("<Q", data[at + 1:at + 9])[0]
    for i in range((first - at - 1) // 8):
        offset = struct.unpack("<Q", data[at + 1 + 8 * i:at + 9 + 8 * i])[0]
        expect(at < offset <= len(data) - 8, "an EXR without all of its rows")
        end = max(end, offset + 8 + struct.unpack("<I", data[offset + 4:offset + 8])[0])
    expect(end == len(data), "an EXR of %d bytes whose rows end at %d" % (len(data), end))


def check_csv(data):
    expect(data.endswith(b"\n") and data.count(b";") == 10, "half a table")


def check_checkpoint(data):
    expect(len(data) > 64, "an empty checkpoint")  # whether it is whole is seen when the next run resumes it


WHOLE = {".png": check_png, ".exr": check_exr, ".csv": check_csv, ".json": json.loads, ".ckp": check_checkpoint}


# --- one history -----------------------------------------------------------------------------------------------------------

class History:
    def __init__(self, program, work, options, rng):
        self.program, self.work, self.options, self.rng = program, work, options, rng
        self.dir, self.kept = os.path.join(work, "dir"), os.path.join(work, "kept")
        self.log, self.killed, self.mounted = [], False, False
        os.makedirs(self.dir)
        os.makedirs(self.kept)

    def close(self):
        if self.mounted:
            subprocess.run(["umount", self.dir], check=True)
        shutil.rmtree(self.work)

    def run(self, event, extra, undisturbed_s):
        """One run; returns its status, negative for a signal."""
        command = [self.program, SCENE, *self.options, *extra]
        limit = self.rng.choice(FSIZE_K) * 1024 if event == "full" else None
        self.log.append("%s   # %s%s" % (" ".join(command), event, "" if limit is None else " beyond %d bytes" % limit))

        def bound():
            if limit is not None:
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

        with open(os.path.join(self.work, "err"), "wb+") as err:
            child = subprocess.Popen(command, cwd=self.dir, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                     env=dict(os.environ, TMPDIR=self.kept), preexec_fn=bound, restore_signals=limit is None)
            number = {"int": signal.SIGINT, "term": signal.SIGTERM, "kill": signal.SIGKILL}.get(event)
            if number:
                time.sleep(self.rng.uniform(0, 1.1) * undisturbed_s)
                child.send_signal(number)
            text = child.communicate(timeout=LIMIT_S)[1].decode(errors="replace")
            err.write(text.encode())
        status = child.returncode
        self.log[-1] += ", status %d%s" % (status, ": " + text.strip() if text.strip() else "")
        allowed = {"int": (0, 130, -signal.SIGINT), "term": (0, 130, -signal.SIGTERM), "kill": (0, -signal.SIGKILL)}.get(event, (0,))
        expect(status in allowed or (status == 2 and (limit is not None or self.mounted)), "exit status %d" % status)
        expect(status != 2 or text.strip(), "exit status 2 without a word")
        left = glob.glob(os.path.join(self.dir, "**", ".tmp*"), recursive=True) + glob.glob(os.path.join(self.dir, "*", ".tmp*"))
        self.killed = status < 0 and status != -signal.SIGXFSZ
        expect(self.killed or not left, "left behind: %s" % left)
        return status

    def mount(self, k):
        if self.mounted:
            subprocess.run(["umount", self.dir], check=True)
        self.mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=%dk" % k, "lull-model", self.dir], stderr=subprocess.DEVNULL).returncode == 0

    def make_room(self):
        if self.mounted:
            subprocess.run(["mount", "-o", "remount,size=8m", self.dir], check=True)

    def files(self):
        return {os.path.relpath(os.path.join(f, n), self.dir) for f, _, names in os.walk(self.dir) for n in names if not n.startswith(".")}

    def check_whole(self):
        for folder in (self.dir, self.kept):
            for name in sorted(glob.glob(folder + "/*.*")):
                try:
                    WHOLE[os.path.splitext(name)[1]](read(name))
                except (Broken, ValueError, IndexError, struct.error) as e:
                    raise Broken("%s: %s" % (name, e))


def content_of_block(data):
    """A recorded block (plugin-api/sequence/FORMAT.md), its checksums verified, without them and without the time it took."""
    expect(zlib.crc32(data[:60]) == struct.unpack("<I", data[60:64])[0], "the checksum of a block's header")
    content, at = data[:60], 64
    for _ in range(struct.unpack("<I", data[36:40])[0]):
        statistics, _, size, crc, own = struct.unpack("<5I", data[at + 12:at + 32])
        payload = bytearray(data[at + 32:at + 32 + size])
        expect(zlib.crc32(data[at:at + 28]) == own and zlib.crc32(payload) == crc and len(payload) == size, "the checksum of a record")
        for i in range(0, 32 * statistics, 32):
            if payload[i:i + 24].rstrip(b"\0") == b"seconds":
                payload[i + 24:i + 32] = bytes(8)
        content += data[at:at + 24] + payload
        at += 32 + size
    expect(at == len(data), "bytes beyond the last record")
    return content


def digest(path):
    data = read(path)
    return hashlib.sha1(content_of_block(data) if path.endswith(".lseq") else data).hexdigest()


OUTPUTS = ("a.exr", "p.png", "s.csv", "r.json")


def image_options(rng):
    return ["-q", "-t", str(rng.choice((1, 2))), "--size", "48x48", "--block", "16", "--reproducible", "-c", rng.choice(("halfbuf", "variance", "null")),
            "--spp-min", "4", "--spp-max", str(rng.choice((16, 64, 128))), "--max-seam", rng.choice(("0", "1.5")),
            "-o", "a.exr", "--preview", "p.png", "--stop-map", "s.csv", "--report", "r.json"]


def image_history(h, events, reference):
    extra = ["--checkpoint", "c.ckp", "--checkpoint-every", h.rng.choice(("0.001", "0.02", "60"))]
    for event in events + ["alone"]:
        before = h.files()
        if event == "alone":
            h.make_room()
        status = h.run(event, extra + (["--resume"] if "c.ckp" in before else []), reference["seconds"])
        h.check_whole()
        expect("c.ckp" not in before or "c.ckp" in h.files(), "the checkpoint is gone")
        expect(before <= h.files(), "gone: %s" % (before - h.files()))
        expect(status != 130 or "c.ckp" in h.files(), "interrupted, and no checkpoint")
        expect(status not in (0, 130) or set(OUTPUTS) <= h.files(), "not everything was written")
        if status == 0:
            for name in OUTPUTS[:3]:
                expect(digest(os.path.join(h.dir, name)) == reference[name], "%s is not that of an undisturbed render" % name)


def recording_options(rng):
    return ["-q", "-t", "1", "--size", "48x48", "--block", "16", "--levels", rng.choice(("linear:2:8:2", "geometric:4:64:2")),
            "--reference-spp", rng.choice(("0", "8")), "--sequence", "seq"]


def check_recording(h, reference, complete):
    manifest, listed = os.path.join(h.dir, "seq", "manifest.json"), []
    if os.path.exists(manifest):
        listed = json.loads(read(manifest))["blocks"]
    there = {os.path.basename(p) for p in glob.glob(os.path.join(h.dir, "seq", "block-*"))}
    for name in there:
        expect(digest(os.path.join(h.dir, "seq", name)) == reference[name], "%s is not that of an undisturbed recording" % name)
    named = {b["file"] for b in listed}
    expect(named <= there, "the manifest names %s, which are not there" % (named - there))
    expect(not complete or named == there, "the manifest lacks %s" % (there - named))
    for b in listed:
        expect("%08x" % zlib.crc32(read(os.path.join(h.dir, "seq", b["file"]))) == b["crc32"], "the checksum of %s" % b["file"])
    return there


def recording_history(h, events, reference):
    for event in events + ["alone"]:
        before = h.files()
        if event == "alone":
            h.make_room()
        blocks = [] if event == "alone" or h.rng.random() < 0.6 else ["--blocks", "%d-8" % h.rng.randrange(9)]
        status = h.run(event, blocks, reference["seconds"])
        check_recording(h, reference, status in (0, 130) and not blocks)
        expect({f for f in before if "block-" in f} <= h.files(), "gone: %s" % (before - h.files()))
    expect(len(check_recording(h, reference, True)) == 9, "not every block was recorded")
    expect(not h.files() - {"seq/manifest.json"} - {"seq/block-%05d.lseq" % i for i in range(9)}, "something else was left")


# --- all of them -----------------------------------------------------------------------------------------------------------

def undisturbed(program, options, known):
    """The digests of what these options make, and the seconds it takes."""
    key = " ".join(options)
    if key not in known:
        with tempfile.TemporaryDirectory() as folder:
            start = time.time()
            subprocess.run([program, SCENE, *options], cwd=folder, check=True, stdin=subprocess.DEVNULL)
            known[key] = {"seconds": time.time() - start}
            for base, _, names in os.walk(folder):
                known[key].update((n, digest(os.path.join(base, n))) for n in names)
    return known[key]


def tell(i, seed, h, why, keep):
    print("not ok %d - history %d of seed %d: %s" % (i + 1, i, seed, why))
    for line in h.log:
        print("#   " + line)
    if keep:
        shutil.copytree(h.dir, os.path.join(keep, "history-%d" % i))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--runs", type=int, default=1000, help="runs of the path tracer, in histories of two to six (1000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", metavar="DIR", help="copy the folder of a history that fails there")
    parser.add_argument("--bin", default=os.path.join(ROOT, os.environ.get("BUILD", "build"), "bin", "lull-render"))
    o = parser.parse_args()
    known, runs, i, failed, counts = {}, 0, 0, 0, {}
    while runs < o.runs:
        rng = random.Random("%d %d" % (o.seed, i))
        image = rng.random() < 0.6
        options = image_options(rng) if image else recording_options(rng)
        reference = undisturbed(o.bin, options, known)
        h = History(o.bin, tempfile.mkdtemp(prefix="lull-model-"), options, rng)
        try:
            events = [rng.choice(("int", "term", "kill", "kill", "full", "alone")) for _ in range(rng.randint(1, 5))]
            if rng.random() < 0.3:
                h.mount(rng.choice(TMPFS_K))
                counts["tmpfs"] = counts.get("tmpfs", 0) + h.mounted
            (image_history if image else recording_history)(h, events, reference)
        except (Broken, ValueError, KeyError, IndexError, OSError, struct.error, subprocess.TimeoutExpired) as why:
            failed += 1
            tell(i, o.seed, h, "%s: %s" % (type(why).__name__, why), o.keep)
        finally:
            h.close()
        for line in h.log:
            kind = line.split("# ")[1].split(",")[0].split(" ")[0]
            counts[kind] = counts.get(kind, 0) + 1
        runs += len(h.log)
        i += 1
    told = ", ".join("%d %s" % (n, k) for k, n in sorted(counts.items()))
    print("%s %d - %d runs in %d histories of seed %d (%s)" % ("not ok" if failed else "ok", i + 1, runs, i, o.seed, told))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
