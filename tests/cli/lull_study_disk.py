"""A study served while the disk does not sync (lull_study_disk.sh). Speaks TAP. PATIENCE is there only so that a server which hangs ends
the test."""

import atexit
import itertools
import json
import os
import subprocess
import sys
import time
import urllib.request

PROGRAM, TMP = sys.argv[1:]
STUDY, HOLD, CALLS = (os.path.join(TMP, name) for name in ("study", "hold", "calls"))
PATIENCE = 120  # seconds
numbers = itertools.count(1)


def check(ok, name, detail=""):
    print(f"{'ok' if ok else 'not ok'} {next(numbers)} - {name}", flush=True)
    if not ok:
        sys.exit("# " + str(detail)[:2000].replace("\n", "\n# "))


def hold(text=""):
    with open(HOLD, "w") as f:
        f.write(text)


class Server:
    def __init__(self):
        env = {**os.environ, "LD_PRELOAD": os.path.join(TMP, "calls.so"), "CALLS": CALLS, "HOLD": HOLD}
        self.child = subprocess.Popen(
            [PROGRAM, "serve", STUDY, "--listen", "127.0.0.1:0"], env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        atexit.register(self.child.kill)
        self.link = self.child.stdout.readline().strip()

    def get(self, address, body=None):
        """What is answered; None: nothing."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.link + address, data, {"Content-Type": "application/json"} if data else {})
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
                return answer.read()
        except OSError as e:
            print(f"# {address}: {e}")
            return None

    def person(self):
        told = self.get("api/people", {"consent": True})
        return told and json.loads(told)["key"]

    def trial(self, key, slot):
        plan = json.loads(self.get(f"api/people/{key}"))["slots"][slot]
        level = 0 if plan["catch"] else json.loads(self.get("api/study"))["views"][0]["blocks"][plan["block"]]["levels"][0]
        trial = {"slot": slot, "revision": 0, "level": level, "answer": 1, "rating": 0, "ms": 500}
        return self.get(f"api/people/{key}/trials", trial)

    def done(self, key):
        return [t["slot"] for t in json.loads(self.get(f"api/people/{key}"))["trials"]]


def synced(how):
    """How often the log was synced (how: "", or " waits")."""
    with open(CALLS) as f:
        return f.read().split("\n").count("fdatasync study.db-wal" + how)


def eventually(test):
    until = time.monotonic() + PATIENCE
    while not test() and time.monotonic() < until:
        time.sleep(0.01)
    return test()


server = Server()
first, second = server.person(), server.person()
picture = sorted(os.listdir(os.path.join(STUDY, "stimuli", "v0")))[0]

hold()
check(server.trial(first, 0), "a trial is acknowledged though the disk does not answer")
check(eventually(lambda: synced(" waits") > 0), "  …and is being synced")
for name, address in (("the page", ""), ("a script", "main.js"), ("the words", "texts.json"), ("a picture", f"stimuli/v0/{picture}"),
                      ("the study", "api/study")):
    check(server.get(address), f"  …{name} is served meanwhile")
check(server.trial(second, 0) and server.trial(second, 1), "  …another's trials are acknowledged meanwhile")
check(server.trial(first, 1), "  …and the next one of the same person")
third = server.person()
check(third, "  …and somebody begins")
before = synced("")
os.remove(HOLD)
check(eventually(lambda: synced("") > before), "what came during a sync is synced by the next")

hold()
check(server.trial(third, 0), "a trial that is not synced yet")
server.child.kill()
server.child.wait()
os.remove(HOLD)
server = Server()
check([server.done(key) for key in (first, second, third)] == [[0, 1], [0, 1], [0]], "  …outlives a kill, as do the others")

hold("fails")
check(server.trial(third, 1), "a trial that cannot be synced")
check(eventually(lambda: server.child.poll() is not None), "  …ends the server")
err = server.child.communicate()[1]
check(server.child.returncode != 0 and "study.db-wal: the latest answers may not be on the disk: " in err, "  …which says so", err)
os.remove(HOLD)
server = Server()
server.trial(third, 2)
server.child.terminate()
check(eventually(lambda: server.child.poll() is not None) and not os.path.exists(os.path.join(STUDY, "study.db-wal")),
      "a server that is told to end leaves everything in study.db")
print(f"1..{next(numbers) - 1}")
