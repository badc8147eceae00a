"""`lull-study` over raw HTTP: what is refused changes nothing and is logged; what is stored comes back. Speaks TAP.

Every command, request and answer, what is stored, the exports and the reports are kept as they come and compared at the end
(tests/cli/whole/study.txt; whole.py says how to record anew)."""

import atexit
import http.client
import json
import os
import re
import signal
import socket
import struct
import sqlite3
import subprocess
import sys
import tempfile
import zlib

sys.dont_write_bytecode = True
import whole

PROGRAM = sys.argv[1]
GGN = os.path.join(os.path.dirname(PROGRAM), "ggn")
TMP = tempfile.TemporaryDirectory()
count = 0
failed = 0
kept = {}  # section -> text
drawn = {}  # what is drawn at random -> its name


def keep(section, text):
    """Adds to a section, without what differs from run to run."""
    for word, name in drawn.items():
        text = text.replace(word, name)
    for regex, word in (
        (re.escape(TMP.name), "TMP"),
        (re.escape(whole.ROOT), "TREE"),
        (re.escape(PROGRAM), "lull-study"),
        (r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", "TIME"),
        (r"\b(?!0{32})[0-9a-f]{32}\b", "HEX32"),
        (r"(127\.0\.0\.1|0\.0\.0\.0)(:|, port )\d{2,}", r"\1\2PORT"),
        (r"/[0-9a-f]{19}/", "/HALF/"),
        (r"\.tmp-lull\d+-\d+\.", ".tmp."),
    ):
        text = re.sub(regex, word, text)
    kept[section] = kept.get(section, "") + text


def pixels_told(data):
    """Size and checksum of a picture's pixels."""
    shown = whole.pixels(data)
    return "%s, checksum %08x" % (shown.split("\n")[0], zlib.crc32(shown.encode()))


def keep_files(section, folder):
    """The files of a folder: text as it is, pictures that are shown by a checksum of their pixels, those of a report (whose letters are
    matplotlib's) by their size; tests/study/statistics.py looks at what is drawn."""
    for path, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            with open(os.path.join(path, name), "rb") as f:
                data = f.read()
            name = os.path.relpath(os.path.join(path, name), folder)
            if data[:4] == b"\x89PNG":
                keep(section, "%s: %s\n" % (name, pixels_told(data) if "/" in name else "%d x %d" % struct.unpack(">II", data[16:24])))
            elif name == "texts.json":
                with open(os.path.join(whole.ROOT, "plugin-api", "python", "lull", "study", "page", "texts.en.json"), "rb") as f:
                    keep(section, name + (": those of the page\n" if f.read() == data else ": other texts\n"))
            elif not name.startswith("study.db"):
                keep(section, "--- %s\n%s\n" % (name, data.decode()))


def check(ok, name, detail=""):
    global count, failed
    count += 1
    failed += not ok
    print(f"{'ok' if ok else 'not ok'} {count} - {name}", flush=True)
    if not ok and detail != "":
        print("# " + str(detail)[:2000].replace("\n", "\n# "))


def png(path, width, height, value):
    rows = b"".join(b"\0" + bytes(value(x, y) for x in range(width) for _ in range(3)) for y in range(height))

    def chunk(kind, data):
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")

    with open(path, "wb") as f:
        f.write(
            b"\x89PNG\r\n\x1a\n"
            + chunk(b"IHDR", width.to_bytes(4, "big") + height.to_bytes(4, "big") + b"\x08\x02\0\0\0")
            + chunk(b"IDAT", zlib.compress(rows))
            + chunk(b"IEND", b"")
        )


def view(name, pictures, width=32, height=16):
    folder = os.path.join(TMP.name, name)
    os.makedirs(folder)
    for i, picture in enumerate(pictures):
        png(os.path.join(folder, picture + ".png"), width, height, lambda x, y: (100 + (x * 37 + y * 91 + 13 * i) % (3 + i)))
    return folder


ASKING = ["--asked-by", "Ada Example, Test Lab", "--contact", "room 7, or ada@lab.example"]


def lull_study(*args):
    if args[:1] == ("init",) and "--asked-by" not in args and "--contact" not in args:
        args = (*args, *ASKING)
    r = subprocess.run([PROGRAM, *args], capture_output=True, text=True)
    if len(args) < 100:
        keep("commands", "$ lull-study %s\n%s%sexit %d\n" % (" ".join(args), r.stdout, r.stderr, r.returncode))
    return r


def fails(name, pattern, *args):
    r = lull_study(*args)
    check(
        r.returncode == 2 and any(line.startswith("lull-study ") and pattern in line for line in r.stderr.split("\n")),
        name,
        f"{r.returncode} {r.stderr}",
    )


class Server:
    headers = {}  # those of all answers

    def __init__(self, folder, listen="127.0.0.1:0"):
        self.log = open(os.path.join(TMP.name, "serve.log"), "w")
        self.child = subprocess.Popen(
            [PROGRAM, "serve", folder, "--listen", listen], stdout=subprocess.PIPE, stderr=self.log, text=True
        )
        atexit.register(self.child.kill)  # also when a test ends in the middle
        self.link = self.child.stdout.readline().strip()
        rest = self.link.split("://")[1]
        self.authority, self.prefix = rest.split("/", 1)
        self.prefix = "/" + self.prefix
        self.port = int(self.authority.rsplit(":", 1)[1])

    def request(self, method, address, body=None, headers=None, prefix=None, host=None):
        c = http.client.HTTPConnection("127.0.0.1", self.port)
        h = {"Host": host or self.authority}
        if body is not None:
            h["Content-Type"] = "application/json"
        h.update(headers or {})
        h = {k: v for k, v in h.items() if v is not None}
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        c.putrequest(
            method, (self.prefix if prefix is None else prefix) + address, skip_host=True, skip_accept_encoding=True
        )
        for k, v in h.items():
            c.putheader(k, v)
        if data is not None:
            c.putheader("Content-Length", str(len(data)))
        c.endheaders()
        if data is not None:
            try:
                c.send(data)
            except OSError:
                pass
        r = c.getresponse()
        raw = r.read()
        c.close()
        self.keep(method, address, body, {**(headers or {}), **({"Host": host} if host else {})}, r, raw)
        return r.status, raw, dict(r.getheaders())

    def keep(self, method, address, body, headers, r, raw):
        """Request and answer; of the page's own files the kind alone."""
        told = dict(r.getheaders())
        kind, cache = told.pop("Content-Type", "none"), told.pop("Cache-Control", "none")
        for name in ("Date", "Connection", "Content-Length"):
            told.pop(name, None)
        if "X-Content-Type-Options" not in told:  # the library's own answer
            return
        if kind == "application/json" and b'"key":"' in raw:
            person = json.loads(raw)
            n = len(drawn) // 2 + 1
            drawn[person["key"]], drawn[person["id"]] = "KEY%d" % n, "PERSON%d" % n
        shown = body if isinstance(body, bytes) else json.dumps(body).encode() if body is not None else b""
        line = "%s %s %s%s" % (method, address, headers or "", "" if body is None else " " + shown.decode("latin-1"))
        if len(line) > 400:
            line = line[:60] + "... %d in all" % len(line)
        usual = (kind, cache) == ("application/json", "no-store")
        line += " -> %d" % r.status + ("" if usual else " %s, %s" % (kind, cache))
        if kind == "application/json" and address != "texts.json":
            line += " " + raw.decode()
        elif kind == "image/png":
            line += " " + pixels_told(raw)
        keep("served", line + "\n")
        if told != Server.headers:
            keep("served", "".join("%s: %s\n" % item for item in sorted(told.items())))
        Server.headers = told

    def json(self, method, address, body=None, **more):
        status, raw, _ = self.request(method, address, body, **more)
        return status, json.loads(raw)

    def raw(self, data):
        with socket.create_connection(("127.0.0.1", self.port), timeout=60) as s:
            s.sendall(data)
            s.shutdown(socket.SHUT_WR)  # nothing more comes, which ends the connection, not the 120 s that the server would wait
            try:
                return s.recv(65536)
            except ConnectionResetError:
                return b""
            except socket.timeout:
                return b"HTTP/1.1 200 the connection is kept"

    def refusals(self):
        self.log.flush()
        with open(self.log.name) as f:
            return [line for line in f if " refused " in line]

    def stop(self, sig=signal.SIGTERM):
        for line in self.refusals():
            keep("refused", line)
        self.child.send_signal(sig)
        self.child.stdout.close()
        return self.child.wait()


def contents(folder):
    db = sqlite3.connect(os.path.join(folder, "study.db"))
    found = [db.execute(f"SELECT * FROM {table} ORDER BY 1, 2, 3").fetchall() for table in ("person", "trial")]
    db.close()
    return found


def keep_export(path):
    """An export, a line for each trial."""
    whole_file = json.load(open(path))
    people = whole_file.pop("people")
    keep("exported", json.dumps(whole_file) + "\n")
    for person in people:
        trials = person.pop("trials")
        keep("exported", json.dumps(person) + "\n" + "".join(json.dumps(t) + "\n" for t in trials))


def keep_contents(folder):
    for table, rows in zip(("person", "trial"), contents(folder)):
        for row in rows:
            keep("stored", "%s %s: %s\n" % (os.path.basename(folder), table, "; ".join(map(str, row))))


# --- init ---
levels = view("levels", ["reference", "n-16", "n-64", "n-256", "n-1024"])
study = os.path.join(TMP.name, "study")
init = [
    "init",
    study,
    "--task",
    "thresholds",
    "--method",
    "2ifc",
    "--views",
    levels,
    "--block",
    "16",
    "--trials",
    "10",
    "--catch",
    "0.2",
]
r = lull_study(*init)
check(r.returncode == 0 and "20 trials for each person" in r.stdout, "init from pictures", r.stderr)
definition = json.load(open(os.path.join(study, "study.json")))
check(
    [b["levels"] for b in definition["views"][0]["blocks"]] == [[16, 64, 256, 1024]] * 2
    and os.path.exists(os.path.join(study, "texts.json")),
    "study.json holds blocks and levels, texts.json lies beside",
)

keep_files("made", study)


def same_as_crop(picture, block, source):
    """Whether the stimulus is the block's part of the picture that it was made from."""
    made = os.path.join(study, "stimuli", "v0", f"b{block}-{picture}.png")
    cut = ["oiiotool", os.path.join(levels, source + ".png"), "--cut", f"16x16+{16 * block}+0", "--origin", "+0+0"]
    return subprocess.run([*cut, made, "--fail", "0", "--diff"], capture_output=True).returncode == 0


for b in (0, 1):
    for picture, source in (("reference", "reference"), ("16", "n-16"), ("1024", "n-1024")):
        check(same_as_crop(picture, b, source), f"stimulus {picture} of block {b} is cut from its picture")
    check(not same_as_crop("heavy", b, "reference"), f"stimulus heavy of block {b} is another")
    check(os.path.exists(os.path.join(study, "stimuli", "v0", f"b{b}-heavy.png")), f"  …and there, block {b}")
fails("init: not over another study", "a study already", *init)
def refuses(name, pattern, *args):
    """An init that is refused and makes nothing."""
    where = os.path.join(TMP.name, "refused")
    fails("init: " + name, pattern, "init", where, *args)
    check(not os.path.exists(where), "  …and nothing is made")


intervals = ["--task", "thresholds", "--method", "2ifc", "--block", "16", "--views", levels]
refuses("nobody asks", "--asked-by NAME and --contact ADDRESS are needed", *intervals, "--contact", "here")
refuses("no address", "--asked-by NAME and --contact ADDRESS are needed", *intervals, "--asked-by", "Ada")
refuses("a blank name", "--asked-by: expected one line", *intervals, "--asked-by", "  ", "--contact", "here")
refuses("an address of two lines", "--contact: expected one line", *intervals, "--asked-by", "Ada", "--contact", "a\nb")
refuses("a name of 200 bytes", "--asked-by: expected one line", *intervals, "--asked-by", "é" * 100, "--contact", "here")
refuses("nine trials give no threshold", "--trials 9: ", *intervals, "--trials", "9")
refuses("an interval that no screen shows", "--show 49: ", *intervals, "--show", "49")
refuses("repeats of intervals", "--repeats does nothing in this task (2ifc)", *intervals, "--repeats", "2")
for option in ("--trials", "--show", "--gap"):
    refuses(option + " of settings", option + " does nothing in this task (adjustment)", "--task", "thresholds", "--views", levels, option, "60")
refuses("catch trials of settings", "--catch does nothing in this task (adjustment)", "--task", "thresholds", "--views", levels, "--catch", "0")
refuses("trials of a validation", "--trials does nothing in this task (validation)", "--task", "validation", "--views", levels, "--trials", "30")
nowhere = os.path.join(TMP.name, "nowhere")
refuses("a view that is not there", "nowhere", "--task", "thresholds", "--views", nowhere)
os.makedirs(os.path.join(TMP.name, "empty"))
refuses("a view without a picture", "neither manifest.json nor a picture called reference", "--task", "thresholds", "--views", os.path.join(TMP.name, "empty"))
refuses("a block that no view has", "has no block 99", "--task", "thresholds", "--views", levels + ":99", "--block", "16")
check(
    definition["asked_by"] == ASKING[1] and definition["contact"] == ASKING[3] and definition["min_ms"] == 150 and definition["max_fast"] == 0.1,
    "study.json says who asks, and which answers are too fast",
)
os.makedirs(os.path.join(TMP.name, "own"))
for name in ("texts.json", "study.json"):
    with open(os.path.join(TMP.name, "own", name), "w") as f:
        f.write("mine\n")
fails("init: not over another study", "a study already", "init", os.path.join(TMP.name, "own"), *intervals)
os.remove(os.path.join(TMP.name, "own", "study.json"))
fails("init: not over somebody's texts", "is there and would be replaced", "init", os.path.join(TMP.name, "own"), *intervals)
check(open(os.path.join(TMP.name, "own", "texts.json")).read() == "mine\n", "  …and they stay")
os.remove(os.path.join(TMP.name, "own", "texts.json"))
os.makedirs(os.path.join(TMP.name, "own", "stimuli"))
os.rename(view("v0", ["reference", "n-16", "n-64", "n-256"]), os.path.join(TMP.name, "own", "stimuli", "v0"))
fails("init: not into its own view", "lies among the pictures", "init", os.path.join(TMP.name, "own"), "--task=thresholds", "--views", os.path.join(TMP.name, "own", "stimuli", "v0"))
check(sorted(os.listdir(os.path.join(TMP.name, "own", "stimuli", "v0"))) == ["n-16.png", "n-256.png", "n-64.png", "reference.png"], "  …and its pictures stay")
fails("init: no views", "--views are needed", "init", os.path.join(TMP.name, "none"), "--task", "thresholds")
many = [str(i) for i in range(1026)]
fails("init: 1025 views", "at most 1024 views", "init", os.path.join(TMP.name, "none"), "--task", "thresholds", "--views", *many[:1025])
fails("init: 1026 views", "one argument too many", "init", os.path.join(TMP.name, "none"), "--task", "thresholds", "--views", *many)
named = os.path.join(TMP.name, "named")
os.makedirs(named)
for length in (95, 96):
    with open(os.path.join(named, "study.json"), "w") as f:
        json.dump({**definition, "views": [{**definition["views"][0], "name": "n" * length}]}, f)
    r = lull_study("report", named)
    told = "a name must be 1 … 95 letters" in r.stderr
    check(r.returncode == 2 and told == (length == 96), f"a name of {length} letters", r.stderr)
fails(
    "init: no such task",
    "--task taste: expected thresholds or validation",
    "init",
    os.path.join(TMP.name, "none"),
    "--task",
    "taste",
    "--views",
    levels,
)
fails(
    "init: not a view",
    "neither manifest.json nor a picture called reference",
    "init",
    os.path.join(TMP.name, "none"),
    "--task",
    "thresholds",
    "--views",
    TMP.name,
)
fails(
    "init: too few levels",
    "levels to show",
    "init",
    os.path.join(TMP.name, "none"),
    "--task",
    "thresholds",
    "--views",
    levels,
    "--spp-min",
    "200",
)
check(not os.path.exists(os.path.join(TMP.name, "none", "study.json")), "init: what failed looks like no study")
other = view("other", ["reference", "lull"], 20, 20)
fails(
    "init: sizes differ",
    "the reference has",
    "init",
    os.path.join(TMP.name, "odd"),
    "--task",
    "validation",
    "--views",
    (lambda f: (png(os.path.join(f, "big.png"), 21, 20, lambda x, y: 7), f)[1])(
        view("odd-view", ["reference", "lull"], 20, 20)
    ),
)
fails("serve: not a study", "study.json", "serve", TMP.name)
fails("serve: names are not looked up", "not an address in numbers", "serve", study, "--listen", "localhost")

# --- serving ---
server = Server(study)
status, page, headers = server.request("GET", "")
check(
    status == 200
    and b"main.js" in page
    and "default-src 'none'" in headers["Content-Security-Policy"]
    and headers["Referrer-Policy"] == "no-referrer"
    and b'<link rel="icon" href="data:image/svg+xml,' in page,
    "the page, with its icon and a policy that lets nothing in from outside",
)
for name in ("main.js", "study.css", "texts.json", "vendor/jspsych.js", "vendor/questplus.js"):
    check(server.request("GET", name)[0] == 200, f"GET {name}")
status, picture, headers = server.request("GET", "stimuli/v0/b1-64.png")
check(
    status == 200 and picture[:4] == b"\x89PNG" and "immutable" in headers["Cache-Control"], "a picture, kept by the browser"
)
status, person = server.json("POST", "api/people", {"consent": True})
key = person["key"]
status, me = server.json("GET", f"api/people/{key}")
check(
    status == 200 and len(me["slots"]) == 20 and sum(s["catch"] for s in me["slots"]) == 4 and me["trials"] == [],
    "consent, a key, a plan",
)


def trial(slot, level=None, answer=1, **more):
    s = me["slots"][slot]
    return {
        "slot": slot,
        "revision": 0,
        "level": level or (0 if s["catch"] else 64),
        "answer": answer,
        "rating": 0,
        "ms": 512.5,
        **more,
    }


address = f"api/people/{key}/trials"
check(server.json("POST", address, trial(0)) == (200, {"done": 1, "of": 20}), "a trial is stored")
check(server.json("POST", address, trial(0)) == (200, {"done": 1, "of": 20}), "sent again it is acknowledged again")

# --- what is refused ---
before, logged = contents(study), len(server.refusals())
secret = os.path.join(TMP.name, "secret.txt")
open(secret, "w").write("secret")
os.symlink(secret, os.path.join(study, "stimuli", "v0", "link.txt"))
cases = [
    ("another answer in its place", 409, "POST", address, trial(0, answer=2), {}),
    ("a trial out of turn", 409, "POST", address, trial(5), {}),
    ("a slot beyond the plan", 400, "POST", address, {**trial(1), "slot": 20}, {}),
    ("a negative slot", 400, "POST", address, {**trial(1), "slot": -1}, {}),
    ("no slot", 400, "POST", address, {k: v for k, v in trial(1).items() if k != "slot"}, {}),
    ("a slot in words", 400, "POST", address, {**trial(1), "slot": "1; DROP TABLE trial"}, {}),
    ("a slot that is a fraction", 400, "POST", address, {**trial(1), "slot": 1.5}, {}),
    ("a level that the block has not", 400, "POST", address, {**trial(1), "level": 63}, {}),
    ("a huge level", 400, "POST", address, {**trial(1), "level": 1e300}, {}),
    ("a level in a catch trial", 400, "POST", address, {**trial(1), "level": 64 if me["slots"][1]["catch"] else 0}, {}),
    ("no such answer", 400, "POST", address, {**trial(1), "answer": 3}, {}),
    ("no time", 400, "POST", address, {k: v for k, v in trial(1).items() if k != "ms"}, {}),
    ("a revision in the wrong task", 400, "POST", address, {**trial(0), "revision": 1}, {}),
    ("malformed JSON", 400, "POST", address, b'{"slot": 1, ', {}),
    ("JSON that is no object", 400, "POST", address, b"[1, 2]", {}),
    ("nested without end", 400, "POST", address, b"[" * 60000, {}),
    ("an empty body", 400, "POST", address, b"", {}),
    ("an oversized body", 413, "POST", address, b" " * 70000, {}),
    ("an oversized profile", 413, "POST", f"api/people/{key}/profile", {"x": "y" * 20000}, {}),
    ("no consent", 400, "POST", "api/people", {"consent": False}, {}),
    ("consent in words", 400, "POST", "api/people", {"consent": "true"}, {}),
    ("an unknown key", 404, "POST", f"api/people/{'0' * 32}/trials", trial(1), {}),
    ("SQL in the key", 404, "POST", "api/people/' OR 1=1 --/trials".replace(" ", "%20"), trial(1), {}),
    ("SQL in an address", 404, "GET", "api/people/'%3B%20DROP%20TABLE%20person%3B--", None, {}),
    ("an unknown address", 404, "POST", "api/delete", {}, {}),
    ("a post from another site", 403, "POST", "api/people", {"consent": True}, {"Origin": "http://evil.example"}),
    ("a post from a page without origin", 403, "POST", "api/people", {"consent": True}, {"Origin": "null"}),
    (
        "a post that the browser calls foreign",
        403,
        "POST",
        "api/people",
        {"consent": True},
        {"Sec-Fetch-Site": "cross-site"},
    ),
    (
        "a form of another site",
        403,
        "POST",
        "api/people",
        {"consent": True},
        {"Content-Type": "application/x-www-form-urlencoded"},
    ),
    ("text of another site", 403, "POST", "api/people", {"consent": True}, {"Content-Type": "text/plain"}),
    ("no Content-Type", 403, "POST", "api/people", {"consent": True}, {"Content-Type": None}),
    ("another name for this machine", 403, "GET", "api/study", None, {"Host": "evil.example"}),
    ("PUT", 405, "PUT", "study.json", b"{}", {}),
    ("DELETE", 405, "DELETE", f"api/people/{key}", None, {}),
    ("out of the folder", 404, "GET", "../study.db", None, {}),
    ("out of the folder, encoded", 404, "GET", "%2e%2e/%2e%2e/etc/passwd", None, {}),
    ("out of the folder, encoded slashes", 404, "GET", "stimuli/..%2f..%2fstudy.json", None, {}),
    ("out of the folder, from stimuli", 404, "GET", "stimuli/v0/../../study.db", None, {}),
    ("an absolute path", 404, "GET", "//etc/passwd", None, {}),
    ("a zero byte", 404, "GET", "study.css%00.png", None, {}),
    ("a hidden file", 404, "GET", ".token", None, {}),
    ("the database", 404, "GET", "study.db", None, {}),
    ("a link out of the folder", 404, "GET", "stimuli/v0/link.txt", None, {}),
    ("a folder", 404, "GET", "vendor", None, {}),
]
for name, wanted, method, where, body, more in cases:
    status, raw, _ = server.request(method, where, body, headers=more)
    check(status == wanted and b"root:" not in raw and b"secret" not in raw, f"refused: {name}", f"{status} {raw[:200]}")
check(contents(study) == before, "nothing was changed by them")
check(len(server.refusals()) - logged >= len(cases) - 1, "all of them were logged", len(server.refusals()) - logged)
check(
    server.request("GET", "api/study", headers={"X-Long": "x" * 100000})[0] in (400, 413, 431, 494),
    "refused: endless headers",
)
for name, data in (
    ("no HTTP", b"\0\1\2\3 hello\r\n\r\n"),
    ("a negative length", b"POST /api/people HTTP/1.1\r\nHost: x\r\nContent-Length: -5\r\n\r\n"),
    (
        "half a request",
        b"POST /api/people HTTP/1.1\r\nHost: "
        + server.authority.encode()
        + b'\r\nContent-Type: application/json\r\nContent-Length: 16\r\n\r\n{"consent"',
    ),
):
    got = server.raw(data)
    check(b" 200 " not in got.split(b"\r\n")[0], f"refused: {name}", got[:100])
check(contents(study) == before and server.json("GET", "api/study")[0] == 200, "and the server goes on")
check(all(c == "\n" or " " <= c for line in server.refusals() for c in line), "the log has no control characters")
check(
    server.json("POST", f"api/people/{key}/profile", {"name": "Robert'); DROP TABLE trial;--"})[0] == 200
    and server.json("GET", f"api/people/{key}")[1]["profile"]["name"] == "Robert'); DROP TABLE trial;--",
    "SQL in a name is a name",
)
check(
    server.json(
        "POST",
        "api/people",
        {"consent": True},
        headers={"Origin": "http://" + server.authority, "Sec-Fetch-Site": "same-origin"},
    )[0]
    == 200,
    "the page itself may post",
)

# --- killed in the middle ---
server.json("POST", address, trial(1))
server.stop(signal.SIGKILL)
server = Server(study)
status, me = server.json("GET", f"api/people/{key}")
check([t["slot"] for t in me["trials"]] == [0, 1], "killed without warning: every acknowledged trial is there")
for slot in range(2, 8):
    server.json("POST", address, trial(slot, answer=me["slots"][slot]["side"] + 1))
check(len(server.json("GET", f"api/people/{key}")[1]["trials"]) == 8, "and it goes on")
check(server.stop() == 0, "serve ends with 0 when interrupted")

# --- beyond this machine ---
server = Server(study, "0.0.0.0:0")
check(len(server.prefix) == 34, "beyond this machine the link has a token", server.link)
check(
    server.request("GET", "")[0] == 200 and server.json("POST", "api/people", {"consent": True})[0] == 200,
    "with the token all is as usual",
)
for name, prefix in (("no", "/"), ("a wrong", "/" + "0" * 32 + "/"), ("half a", server.prefix[:20] + "/")):
    check(
        server.request("GET", "api/study", prefix=prefix)[0] == 403
        and server.request("POST", "api/people", {"consent": True}, prefix=prefix)[0] == 403,
        f"refused: {name} token",
    )
link = server.prefix
server.stop()
server = Server(study, "0.0.0.0:0")
check(server.prefix == link, "the token stays when it is started again")
server.stop()

# --- what was collected ---
fails(
    "report: nobody took part",
    "nobody has taken part yet",
    "report",
    (lambda d: (lull_study("init", d, *init[2:]), d)[1])(os.path.join(TMP.name, "fresh")),
)
adjustment = os.path.join(TMP.name, "adjustment")
lull_study("init", adjustment, "--task", "thresholds", "--views", levels, "--block", "16")
server = Server(adjustment)
codes = []
for levels_set in ((64, 256), (16, 256), (1024, 1024)):
    person = server.json("POST", "api/people", {"consent": True})[1]
    codes.append(person["id"])
    slots = server.json("GET", f"api/people/{person['key']}")[1]["slots"]
    for i, s in enumerate(slots):
        server.json(
            "POST",
            f"api/people/{person['key']}/trials",
            {"slot": i, "revision": 0, "level": levels_set[s["block"]], "answer": 0, "rating": 0, "ms": 1500},
        )
check(
    server.json(
        "POST",
        f"api/people/{person['key']}/trials",
        {"slot": 0, "revision": 2, "level": 16, "answer": 0, "rating": 0, "ms": 1},
    )[0]
    == 409,
    "a revision may not leave one out",
)
server.json(
    "POST",
    f"api/people/{person['key']}/trials",
    {"slot": 0, "revision": 1, "level": 256, "answer": 0, "rating": 0, "ms": 1500},
)
server.stop()
keep_contents(study)
keep_contents(adjustment)
r = lull_study("report", adjustment)
keep_files("reported-adjustment", os.path.join(adjustment, "report"))
report = os.path.join(adjustment, "report")
lines = open(os.path.join(report, "blocks.csv")).read().split("\n")
wanted = {
    0: (64 * 16 * (1024 if slots[0]["block"] == 1 else 512)) ** (1 / 3),
    1: (256 * 256 * (1024 if slots[0]["block"] == 0 else 512)) ** (1 / 3),
}
got = {int(line.split(";")[1]): float(line.split(";")[2]) for line in lines[1:] if line}
check(
    r.returncode == 0 and all(abs(got[b] / wanted[b] - 1) < 1e-3 for b in wanted),
    "report: thresholds are the geometric means over people and settings",
    f"{r.stderr} {got} {wanted}",
)
check(
    all(
        os.path.exists(os.path.join(report, f))
        for f in (
            "thresholds.csv",
            "thresholds-levels.json",
            "estimates.csv",
            "people.csv",
            "report.json",
            "thresholds.png",
            "people.png",
        )
    ),
    "report: all its files",
)
r = subprocess.run(
    [GGN, "compare", os.path.join(report, "thresholds.csv"), os.path.join(report, "thresholds-levels.json"), "--json"],
    capture_output=True,
    text=True,
)
check(
    r.returncode == 0 and '"blocks": 2' in r.stdout and json.loads(r.stdout)["mae"] < 0.01,
    "report: ggn compare reads CSV and JSON",
    r.stderr,
)
ceiling = json.load(open(os.path.join(report, "report.json")))["noise_ceiling"]
check(
    ceiling["people"] == 0 and ceiling["pearson_lower"] is None,
    "report: two blocks are too few for a noise ceiling, and it says so",
)
exported = os.path.join(TMP.name, "trials.json")
r = lull_study("export", adjustment, "-o", exported)
check(
    r.returncode == 0
    and len(json.load(open(exported))["people"]) == 3
    and "key" not in json.load(open(exported))["people"][0],
    "export, without keys",
)


def bytes_of(folder):
    """Every file of a folder, with its bytes."""
    return {
        os.path.join(path, name): open(os.path.join(path, name), "rb").read()
        for path, _, names in os.walk(folder)
        for name in names
        if not name.endswith("-shm")
    }


kept_bytes = bytes_of(adjustment)
os.symlink(os.path.join(adjustment, "study.db"), os.path.join(TMP.name, "elsewhere.json"))
os.symlink(adjustment, os.path.join(TMP.name, "another"))
for name in ("study.db", "study.json", "texts.json", "token", "study.db-wal", "study.db-shm", "stimuli/v0/b0-16.png", "stimuli/v0/new.json", "stimuli/x"):
    for path in (os.path.join(adjustment, name), os.path.join(TMP.name, "another", ".", name)):
        fails("export: not onto the study's own " + name, os.path.basename(name), "export", adjustment, "-o", path)
fails("export: not onto it by a link", "the study's own study.db", "export", adjustment, "-o", os.path.join(TMP.name, "elsewhere.json"))
fails("report: not among the pictures", "lies among the pictures", "report", adjustment, "-n", "-o", os.path.join(adjustment, "stimuli", "v0"))
check(bytes_of(adjustment) == kept_bytes, "  …and nothing in the folder has changed")
inside = os.path.join(adjustment, "trials.json")
check(lull_study("export", adjustment, "-o", inside).returncode == 0 and open(inside).read() == open(exported).read(), "export: beside them")
os.remove(inside)
copy = os.path.join(TMP.name, "copy")
os.makedirs(copy)
for name in ("study.json", "texts.json"):
    with open(os.path.join(adjustment, name)) as f, open(os.path.join(copy, name), "w") as g:
        g.write(f.read())
keep_export(exported)
check(lull_study("import", copy, exported).returncode == 0, "import into a copy of the study")
lull_study("export", copy, "-o", exported + "2")
check(open(exported).read() == open(exported + "2").read(), "and out again: the same bytes")
fails("import: nobody twice", "is in the study already", "import", copy, exported)
fails("import: another study", "trials of another study", "import", study, exported)
fails("delete: nobody has that code", "nobody has the code", "delete", adjustment, "zzzzzzzz")
check(
    lull_study("delete", adjustment, codes[2]).returncode == 0
    and lull_study("report", adjustment, "-n").returncode == 0
    and codes[2] not in open(os.path.join(report, "people.csv")).read(),
    "delete: gone from the next report",
)
check(len(contents(adjustment)[1]) == 8, "delete: the others' trials stay")
# --- a validation ---
validation = os.path.join(TMP.name, "validation")
rooms = [view(name, ["reference", "lull", "fixed"], 24, 24) for name in ("room", "hall")]
lull_study("init", validation, "--task", "validation", "--views", *rooms, "--repeats", "5", "--catch", "0.2")
server = Server(validation)


def judge(says):  # says(slot) -> same or different
    key = server.json("POST", "api/people", {"consent": True})[1]["key"]
    slots = server.json("GET", f"api/people/{key}")[1]["slots"]
    for i, s in enumerate(slots):
        same = int(says(s))
        trial = {"slot": i, "answer": same, "rating": 5 if same else 2, "ms": 900, "layout": "beside"}
        assert server.json("POST", f"api/people/{key}/trials", trial)[0] == 200
    return slots


names = json.load(open(os.path.join(validation, "study.json")))["conditions"]
lull = names.index("lull")
slots = judge(lambda s: s["catch"] == 2 or s["condition"] == lull)  # lull looks the same, fixed does not
judge(lambda s: s["catch"] == 2 or (s["condition"] == lull and s["view"] == 0))  # lull only in the first view
judge(lambda s: s["catch"] == 1)  # fails every catch trial
check(
    len(slots) == 24 and sum(s["catch"] == 1 for s in slots) == 2 and sum(s["catch"] == 2 for s in slots) == 2,
    "validation: a plan with catch trials",
)
key = server.json("POST", "api/people", {"consent": True})[1]["key"]
good = {"slot": 0, "answer": 1, "rating": 5, "ms": 900, "layout": "flip"}
for name, bad in (
    ("rating", {"rating": 6}),
    ("layout", {"layout": "above"}),
    ("level", {"level": 16}),
    ("answer", {"answer": 2}),
):
    check(server.json("POST", f"api/people/{key}/trials", {**good, **bad})[0] == 400, f"validation: refused: a wrong {name}")
server.stop()
keep_contents(validation)
keep_files("made", validation)
r = lull_study("report", validation)
keep_files("reported-validation", os.path.join(validation, "report"))
lull_study("export", validation, "-o", exported)
keep_export(exported)
report = os.path.join(validation, "report")
rows = [line.strip().split(";") for line in open(os.path.join(report, "judgements.csv"))]
table = {(row[0], row[1]): row for row in rows[1:]}
check(
    r.returncode == 0
    and table["room", "lull"][2:4] == ["10", "10"]
    and table["hall", "lull"][2:4] == ["5", "10"]
    and table["(all)", "lull"][2:5] == ["15", "20", "0.7500"]
    and table["(all)", "fixed"][2:4] == ["0", "20"],
    "validation: shares per view and pooled, without the one who fails the catch trials",
    r.stderr + str(table),
)
check(
    abs(float(table["(all)", "lull"][5]) - 0.5313) < 2e-3 and abs(float(table["(all)", "lull"][6]) - 0.8881) < 2e-3,
    "validation: Wilson's interval",
    table["(all)", "lull"],
)
check(
    "75 % [53, 89]" in open(os.path.join(report, "scenes.csv")).read()
    and os.path.exists(os.path.join(report, "shares.png")),
    "validation: table and picture",
)
found = json.load(open(os.path.join(report, "report.json")))
check(
    found["people_that_count"] == 2
    and len(found["excluded"]) == 1
    and found["conditions"][lull]["people_for_10_percent"] > 30,
    "validation: report.json says who does not count, and how many people it takes",
    found,
)

# --- the command line: help, and both bounds of every number ---
check(lull_study().returncode == 2 and lull_study("taste", study).returncode == 2 and lull_study("-x").returncode == 2, "usage")
VERBS = ("init", "serve", "status", "report", "export", "import", "delete")
for verb in ((), *((v,) for v in VERBS)):
    check(lull_study(*verb, "--help").returncode == 0, " ".join((*verb, "--help")))
pages = os.path.join(whole.ROOT, "docs", "man")
manual = "".join(open(os.path.join(pages, name)).read() for name in os.listdir(pages) if re.fullmatch("lull-study.*[.]1", name))
manual = re.sub(r"\\f[BIR]|\\", "", manual)
for verb in VERBS:
    said = subprocess.run([PROGRAM, verb, "--help"], capture_output=True, text=True).stdout
    options = set(re.findall("--[a-z][a-z-]*", said)) - {"--help", "--usage", "--version"}
    check(options <= set(re.findall("--[a-z][a-z-]*", manual)) and ".B lull-study " + verb in manual, f"{verb}: in the manual pages", options)
for option in "trials repeats catch show gap break-every spacing spp-min spp-max block seed task method".split():
    fails(f"--{option}=x", f"--{option} x: expected", "init", f"--{option}=x")

# --- two intervals and settings of several people, with their reports ---
wide = view("wide", ["reference", "n-16", "n-64", "n-256", "n-1024"], 40, 20)
choices = os.path.join(TMP.name, "choices")
lull_study("init", choices, "--task=thresholds", "--method=2ifc", "--views", wide, levels, "--block=20", "--trials=12", "--catch=0.2", "--seed=5",
    "--show=300", "--gap=200", "--break-every=7")
settings = os.path.join(TMP.name, "settings")
lull_study("init", settings, "--task=thresholds", "--views", wide, levels, "--block=10", "--repeats=3", "--spp-min=17", "--seed=6")
for folder, people in ((choices, 3), (settings, 4)):
    server = Server(folder)
    studied = server.json("GET", "api/study")[1]
    for person in range(people):
        key = server.json("POST", "api/people", {"consent": True})[1]["key"]
        server.json("POST", f"api/people/{key}/profile", {"answers": {"vision": "well", "age": 20 + person}})
        for i, s in enumerate(server.json("GET", f"api/people/{key}")[1]["slots"]):
            block = studied["views"][s["view"]]["blocks"][s["block"]]
            if "side" in s:  # more is seen where the samples are few; the last one fails the catch trials
                level = 0 if s["catch"] else block["levels"][(i + person) % 4]
                right = person < 2 if s["catch"] else level * (1 + s["view"]) <= 100 << person or i % 4 == 0
                answer = s["side"] + 1 if right else 2 - s["side"]
            else:  # the last one leaves most settings where they started
                level, answer = block["levels"][s["start"] if person == 3 and i % 5 else min(2, s["block"] * 7 % 3 + (i * (person + 2) % 5 == 0))], 0
            body = {"slot": i, "revision": 0, "level": level, "answer": answer, "rating": 0, "ms": 700 + 10.5 * i}
            if person == 1 and i == 20:
                break  # went away
            status, got = server.json("POST", f"api/people/{key}/trials", body)
    server.stop()
    keep_contents(folder)
    lull_study("report", folder, "-o", folder + "-report")
    keep_files("reported-" + os.path.basename(folder), folder + "-report")
    lull_study("export", folder, "-o", exported)
    keep_export(exported)
for folder, gone in ((choices, (-3, -1)), (validation, (-3, -2, -1))):  # who is left: one who went away; one of whom no spread is known
    people = [row[1] for row in contents(folder)[0]]
    for i in gone:
        lull_study("delete", folder, people[i])
    lull_study("report", folder, "-o", folder + "-left")
    keep_files("left-" + os.path.basename(folder), folder + "-left")
lull_study("report", study)  # too few trials for a threshold
keep_files("left-study", os.path.join(study, "report"))
recorded = os.path.join(whole.ROOT, "tests", "data", "recorded")
sequence = os.path.join(TMP.name, "sequence")
lull_study("init", sequence, "--task=thresholds", "--views", os.path.join(recorded, "train", "one-view0"), os.path.join(recorded, "validation", "two"),
    "--spacing=0.9", "--spp-min=12", "--spp-max=2000")
made = json.load(open(os.path.join(sequence, "study.json")))
keep("sequence", json.dumps({**made, "id": ""}, indent=1) + "\n" + "\n".join(
    sorted(os.path.join(path, n)[len(sequence):] for path, _, names in os.walk(sequence) for n in names)))

# --- how it stands ---
quick = os.path.join(TMP.name, "quick")
lull_study("init", quick, "--task=thresholds", "--views", levels, "--block=16", "--repeats=5")
server = Server(quick)
for fast in (1, 2):  # of ten settings
    person = server.json("POST", "api/people", {"consent": True})[1]
    for i, s in enumerate(server.json("GET", f"api/people/{person['key']}")[1]["slots"]):
        ms = 299.9 if i < fast else 300
        body = {"slot": i, "revision": 0, "level": 16 if i < fast else 256, "answer": 0, "rating": 0, "ms": ms}
        server.json("POST", f"api/people/{person['key']}/trials", body)
third = server.json("POST", "api/people", {"consent": True})[1]["id"]
r = lull_study("status", quick)
lines = r.stdout.split("\n")
check(
    r.returncode == 0
    and lines[0].startswith("adjustment: 3 people, 2 finished, 0 under way, 1 without an answer; last answer 2")
    and lines[2].split()[1:6] == ["10/10", "0/0", "0.3", "1", "0.0"]
    and lines[3].endswith("does not count: 2 of 10 answers in less than 300 ms")
    and lines[4].split() == [third, "0/10", "0/0", "-", "0", "0.0", "-"],
    "status, while it is served",
    r.stdout + r.stderr,
)
server.stop()
r = lull_study("report", quick, "-n")
keep_files("reported-quick", os.path.join(quick, "report"))
rows = [line.split(";") for line in open(os.path.join(quick, "report", "blocks.csv")).read().split("\n")[1:3]]
check(
    r.returncode == 0 and [row[2] for row in rows] == ["256.00"] * 2 and "3 answers in less than 300 ms are left out" in r.stdout,
    "report: what was set in less than a look is in no threshold",
    r.stdout + str(rows),
)
fails("status: nobody took part", "nobody has taken part yet", "status", os.path.join(TMP.name, "fresh"))

# --- what an init, a server and a store refuse ---
def init_fails(name, *args):
    r = lull_study("init", os.path.join(TMP.name, name), *args)
    check(r.returncode == 2 and not os.path.exists(os.path.join(TMP.name, name, "study.json")), "init refuses: " + name, r.stderr)


init_fails("nothing", "--task=validation")
init_fails("method", "--task=validation", "--method=2ifc", "--views", rooms[0])
init_fails("recording", "--task=validation", "--views", os.path.join(recorded, "test", "three"))
init_fails("twice", "--task=thresholds", "--views", levels, levels + "/")
init_fails("named-badly", "--task=thresholds", "--views", view("a b", ["reference", "n-1", "n-2", "n-3"]))
init_fails("others", "--task=validation", "--views", rooms[0], view("attic", ["reference", "lull", "other"], 24, 24))
init_fails("fewer", "--task=validation", "--views", rooms[0], view("cellar", ["reference", "lull"], 24, 24))
init_fails("odd-name", "--task=validation", "--views", view("shed", ["reference", "a b"], 24, 24))
os.makedirs(os.path.join(TMP.name, "unfinished"))
with open(os.path.join(recorded, "test", "three", "manifest.json")) as f:
    manifest = json.load(f)
json.dump({**manifest, "blocks": []}, open(os.path.join(TMP.name, "unfinished", "manifest.json"), "w"))
init_fails("no-blocks", "--task=thresholds", "--views", os.path.join(TMP.name, "unfinished"))
json.dump(manifest, open(os.path.join(TMP.name, "unfinished", "manifest.json"), "w"))
init_fails("no-files", "--task=thresholds", "--views", os.path.join(TMP.name, "unfinished"))
mixed = view("mixed", ["n-300", "reference", "heavy", "n-20", "20", "x1000", "n-25", "notes", "n-2", "n-5000"], 16, 16)
open(os.path.join(mixed, ".hidden-7.png"), "w").close()
open(os.path.join(mixed, "plain"), "w").close()
lull_study("init", os.path.join(TMP.name, "chosen"), "--task", "thresholds", "--views", mixed, "--block", "16", "--spp-min", "2", "--spp-max", "5000", "--spacing", "0.5")
keep_files("chosen", os.path.join(TMP.name, "chosen"))
for name, token in (("short", "0" * 31 + "\n"), ("bare", "0" * 32), ("long", "0" * 33 + "\n"), ("capitals", "A" * 32 + "\n")):
    with open(os.path.join(study, "token"), "w") as f:
        f.write(token)
    fails("serve: a token that is none: " + name, "not a token", "serve", study, "--listen", "0.0.0.0:0")
os.remove(os.path.join(study, "token"))
with open(os.path.join(TMP.name, "fresh", "study.db"), "w") as f:
    f.write("garbage " * 100)
fails("report: a store that is none", "file is not a database", "report", os.path.join(TMP.name, "fresh"))
with open(os.path.join(copy, "study.json")) as f:
    changed = {**json.load(f), "id": "0" * 32}
json.dump(changed, open(os.path.join(copy, "study.json"), "w"))
fails("report: people of another study", "belongs to another study", "report", copy)
fails("export: onto a folder", "cannot write there", "export", study, "-o", TMP.name)
with open(os.path.join(TMP.name, "no.json"), "w") as f:
    f.write("{}")
fails("import: no export", "not a file of", "import", study, os.path.join(TMP.name, "no.json"))
os.environ["LULL_STUDY_PAGE"] = os.path.join(TMP.name, "none")
fails("serve: a page that is none", "no index.html in it", "serve", study)
os.environ["LULL_STUDY_PAGE"] = os.path.join(TMP.name, "named")
with open(os.path.join(TMP.name, "named", "index.html"), "w") as f:
    f.write("another page\n")
server = Server(study)
check(server.request("GET", "")[1] == b"another page\n", "serve: the page that is named")
for size in (65536, 65537):
    body = b'{"consent":false,"x":"%s"}' % (b"y" * (size - 24))
    check((len(body), server.request("POST", "api/people", body)[0]) == (size, 400 if size == 65536 else 413), f"a body of {size} bytes")
fails("serve: a port that is taken", "Address already in use", "serve", study, "--listen", server.authority)
server.stop()
del os.environ["LULL_STUDY_PAGE"]

# --- as many people as there may be ---
db = sqlite3.connect(os.path.join(settings, "study.db"))
db.execute("UPDATE sqlite_sequence SET seq = 99999 WHERE name = 'person'")
db.commit()
db.close()
server = Server(settings)
check([server.json("POST", "api/people", {"consent": True})[0] for _ in range(2)] == [200, 500], "the 100000th person is the last")
server.stop()

count, good = whole.compare("study", kept, count + 1)
print(f"1..{count - 1}")
sys.exit(0 if good and not failed else 1)
