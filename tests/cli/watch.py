"""What `python3 -m lull watch` answers; r.json, p.png and p.html are a render in the current folder. Called by watch.sh."""
import base64
import http.client
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time

os.mkdir("f")
with open("secret.png", "wb") as file:
    file.write(b"\x89PNG\r\n\x1a\nsecret")
server = subprocess.Popen([sys.executable, "-m", "lull", "watch", "f"], stdout=subprocess.PIPE, text=True)
address = server.stdout.readline().strip()
port = int(re.fullmatch(r"http://127\.0\.0\.1:(\d+)/", address)[1])


def ask(path, method="GET", host=f"127.0.0.1:{port}", at="127.0.0.1"):
    connection = http.client.HTTPConnection(at, port, timeout=60)
    connection.putrequest(method, path, skip_host=True)
    connection.putheader("Host", host)
    connection.endheaders()
    answer = connection.getresponse()
    body = answer.read().decode()
    connection.close()
    return answer.status, body


def state():
    status, body = ask("/state")
    assert status == 200
    return json.loads(body)


def put(report, name="f/r.json", age_s=0.0):
    with open(name + ".new", "w") as file:
        file.write(report if isinstance(report, str) else json.dumps(report))
    os.replace(name + ".new", name)
    at = time.time() - age_s
    os.utime(name, (at, at))


try:
    with open("r.json") as file:
        report = json.load(file)
    with open("p.html", encoding="utf-8") as file:
        page = file.read()
    data = lambda text: json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)[1])

    status, body = ask("/")
    assert status == 200 and 'id="waiting"' in body and 'http-equiv="refresh"' in body and state() is None, body

    # the render goes on, then it is over
    now = {"share": 0.25, "left_s": 12.5, "known": True}
    put({**report, "progress": now})
    said = state()
    assert said["report"] == {**report, "progress": now} and said["live"]["picture"] is None and said["live"]["age_s"] < 60, said
    shutil.copy("p.png", "f/p.png")
    put(report)
    said = state()
    with open("p.png", "rb") as file:
        png = file.read()
    assert said["report"] == report and said["live"]["picture"] == "data:image/png;base64," + base64.b64encode(png).decode()
    status, body = ask("/")
    assert data(body)["report"] == data(page)["report"] == report and data(body)["live"] and "live" not in data(page)
    assert re.findall('<img alt="" data-layer="([a-z]*)"', body) == re.findall('<img alt="" data-layer="([a-z]*)"', page) == ["picture"]
    assert body.count("<script") == 2 and "connect-src 'self'" in body and "connect-src" not in page
    cut = lambda text: re.sub(r'<img alt="".*?>\n|<script type="application/json".*?</script>| connect-src \'self\';', "", text, flags=re.S)
    assert cut(body) == cut(page), "the rest is that of --html"

    # nothing but the two answers, and to this machine only
    for path in ("/../secret.png", "/..%2fsecret.png", "/%2e%2e/secret.png", "//etc/passwd", "/etc/passwd", "/p.png", "/r.json", "/state/", "/?x", "*"):
        assert ask(path)[0] in (400, 404), path
    assert ask("/", "POST")[0] == ask("/", "PUT")[0] == 501
    for host in ("evil.example", f"evil.example:{port}", "", f"127.0.0.1.evil.example:{port}"):
        assert ask("/state", host=host)[0] == 403, host
    assert ask("/", host=f"localhost:{port}")[0] == 200
    with open("/proc/net/tcp") as file:
        listening = [line.split()[1] for line in file if line.split()[3] == "0A" and line.split()[1].endswith(":%04X" % port)]
    assert listening == ["0100007F:%04X" % port], listening

    # no name leads out of the folder
    def named(*words):
        put({**report, "command": ["lull-render", *words]})
        return state()["live"]["picture"]
    assert named("--preview", "/somewhere/else/p.png") and named("--preview=p.png") and named("--prev", "p.png")
    for words in (("--preview", "../secret.png"), ("--preview=..",), ("--preview",), ("--preview", ""), ("--preview", "x\0.png"),
                  ("--preview", "r.json"), (), ("--preview", "p" * 5000)):
        assert named(*words) is None, words
    os.symlink("../secret.png", "f/link.png")
    assert named("--preview", "link.png") is None
    os.symlink("p.png", "f/near.png")
    assert named("--preview", "near.png")
    put(report, "outside.json")
    os.remove("f/r.json")
    os.symlink("../outside.json", "f/outside.json")
    assert state() is None

    # what is no report is passed over; of several reports the newest counts
    put({**report, "seed": 1}, "f/old.json", 100)
    put({**report, "seed": 2}, "f/new.json", 50)
    for k, text in enumerate(("", "{", "[" * 100000, "null", "[]", '{"blocks": 1}', '{"blocks": [], "width": "a", "height": 2}', "\xff{}")):
        put(text, f"f/bad{k}.json")
        assert state()["report"]["seed"] == 2, text[:9]
    os.mkdir("f/folder.json")
    os.mkfifo("f/pipe.json")
    assert state()["report"]["seed"] == 2
    evil = "</script><script>alert(1)</script><!--"
    put({**report, "scene": evil})
    status, body = ask("/")
    assert data(body)["report"]["scene"] == evil and body.count("<script") == 2
    put({**report, "history": [[[k, 0.123456789, 0.987654321] for k in range(100000)]]})
    assert "history" not in state()["report"]
finally:
    server.send_signal(signal.SIGINT)
    assert server.wait(60) == 0
