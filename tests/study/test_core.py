"""What a study is made of: its file, the plan of a person, the store of trials, export and import, addresses; and a data base that the
program in C made."""
import itertools
import os
import shutil
import socket
import sqlite3
import subprocess
import sys
import tempfile
import urllib.request

import tap
from lull.study.definition import members, parse
from lull.study.files import Refused, loads, print_json, protect, replaced
from lull.study.options import Command, Option, integer
from lull.study.options import parse as parse_options
from lull.study.plan import CATCH_IDENTICAL, CATCH_PLAIN, make_plan, person_seed
from lull.study.server import PORT, keep_token, parse_address
from lull.study.store import Conflict, Store, Trial
from lull.study.transfer import export_trials, import_trials
from made import ID, TASKS, add_person, add_trials, open_store, study_of
from tap import raises


def test_definition_comes_back():
    """a study comes back as it was written"""
    for task in TASKS:
        study = study_of(task, min_ms=150.5, max_fast=0.1, asked_by='Ada "Example"', contact="c" * 199)
        text = print_json(members(study), pretty=True)
        again = parse("test", text)
        assert again == (study if task == "validation" else study_of(task, min_ms=150.5, max_fast=0.1, asked_by='Ada "Example"',
                                                                     contact="c" * 199))
        assert print_json(members(again), pretty=True) == text
        assert len(again.views[0].blocks) == (0 if task == "validation" else 4)


def test_json():
    """JSON is strict where it comes in, and looks like cJSON's where it goes out; no number loses a digit"""
    for text in ('{"a":NaN}', "[" * 100000, '"\\ud800"', b"\xff", '{"a":1} x', "", "{'a':1}"):
        raises(ValueError, "", loads, text)
    assert print_json({"a": [1, 2.0, 0.1, float("nan")], "b": {}, "c": "é\x01\"", "d": None}, False) == (
        '{"a":[1,2,0.1,null],"b":{},"c":"é\\u0001\\"","d":null}')
    assert print_json({"a": [{"b": True}, 1]}, True) == '{\n\t"a":\t[{\n\t\t\t"b":\ttrue\n\t\t}, 1]\n}'
    for value in (0.1 + 0.7, 1e22, 5e-324, 9007199254740991, 1 / 3):
        assert loads(print_json(value, False)) == value


def test_balance():
    """two intervals: every block as often, as many catch trials, the noise as often first, no block twice in a row"""
    study = study_of("2ifc")
    for seed in range(50):
        plan = make_plan(study, seed)
        assert len(plan) == 80 and all(a.block != b.block for a, b in zip(plan, plan[1:]))
        for b in range(4):
            own = [s for s in plan if s.block == b]
            assert (len(own), sum(s.catch == CATCH_PLAIN for s in own), sum(s.side == 0 for s in own)) == (20, 2, 10)


def test_seeds():
    """a plan depends on the seed alone"""
    for task in TASKS:
        study = study_of(task)
        one, other = person_seed(study, 0), person_seed(study, 1)
        assert one != other and one < 2**53
        assert make_plan(study, one) == make_plan(study, one) != make_plan(study, other)


def test_everything_is_shown():
    """a validation shows every picture, settings every block on each screen"""
    plan = make_plan(study_of("validation"), 1)
    assert [sum(s.condition == c for s in plan) for c in (0, 1)] == [3, 3] and len(plan) == 8
    assert sorted(s.catch for s in plan if s.condition == -1) == [CATCH_PLAIN, CATCH_IDENTICAL]
    plan = make_plan(study_of("adjustment"), 1)
    assert sorted((s.screen, s.block) for s in plan) == [(i, b) for i in range(3) for b in range(4)] and all(0 <= s.start <= 2 for s in plan)


def test_store():
    """trials are added and never changed; who is deleted takes their own"""
    store = open_store()
    row, other, t = add_person(store, 1, 5), add_person(store, 2, 6), Trial(3, 0, 64, 1, 0, 12.5, at="now")
    add_trials(store, row, t, t)
    raises(Conflict, "trial 3 is done already, with another answer", add_trials, store, row, t._replace(answer=2))
    add_trials(store, row, t._replace(revision=1, answer=2))
    add_trials(store, other, t._replace(slot=0))
    assert [(x.answer, x.ms) for x in store.trials(row)] == [(1, 12.5), (2, 12.5)]
    assert store.slots_done(row) == 1 and store.revisions(row, 3) == 2 and store.next_number() == 2
    store.delete(row)
    assert store.trials(row) == [] and len(store.trials(other)) == 1 and store.find(id="00000001") is None and store.next_number() == 2


def test_all_or_nothing():
    """what fails in the middle of a change changes nothing"""
    store = open_store()
    row = add_person(store, 1, 5)
    t = Trial(0, 0, 64, 1, 0, 1.0)
    raises(Conflict, "done already", add_trials, store, row, t, t._replace(ms=2.0))
    assert store.trials(row) == []


def test_deleted():
    """of a deleted person no byte stays in the file; a store belongs to its study"""
    with tempfile.TemporaryDirectory() as folder:
        with open_store(folder) as store:
            store.delete(add_person(store, 10, 5, '{"secret":"XYZZYPLUGH"}'))
        with open(os.path.join(folder, "study.db"), "rb") as file:
            assert b"XYZZYPLUGH" not in file.read()
        raises(Refused, "belongs to another study", Store, folder, ID[::-1])
        raises(Refused, "nobody has taken part yet", Store, os.path.join(folder, "none"), ID)


def test_transfer():
    """what is exported can be imported, once and whole, without keys"""
    study = study_of("2ifc")
    with tempfile.TemporaryDirectory() as folder:
        a, b, store, to = os.path.join(folder, "a.json"), os.path.join(folder, "b.json"), open_store(), open_store()
        for person in range(3):
            seed = person_seed(study, person)
            row, plan = add_person(store, 10 + person, seed), make_plan(study, seed)
            add_trials(store, row, *(Trial(i, 0, 0 if plan[i].catch else 64, 1 + i % 2, 0, 0.1 * i, at="2024-01-01T00:00:00Z")
                                     for i in range(10 * person)))
        assert export_trials(study, store, a) == import_trials(study, to, a) == export_trials(study, to, b) == 3
        with open(a) as one, open(b) as two:
            text = one.read()
            assert text == two.read() and "key" not in text
        raises(Refused, "is in the study already", import_trials, study, to, a)
        with open(a, "w") as file:
            file.write(text.replace('"level":\t64', '"level":\t94'))
        fresh = open_store()
        raises(Refused, "a trial that this study cannot have", import_trials, study, fresh, a)
        assert fresh.people() == []


C_STUDY = "tests/data/study-of-c"
PATIENCE_S = 120  # only so that a server which hangs ends the test


def test_database_of_c():
    """a data base that the program in C made opens: the same people and trials in the same export"""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("study.json", "study.db"):
            shutil.copy(os.path.join(C_STUDY, name), folder)
        with open(os.path.join(C_STUDY, "study.json"), "rb") as file:
            text = file.read()
        study = parse("study.json", text)
        assert print_json(members(study), pretty=True).encode() + b"\n" == text
        with Store(folder, study.id) as store:
            assert export_trials(study, store, os.path.join(folder, "trials.json")) == 4
            for person in store.people():
                assert person.seed == person_seed(study, person.row - 1)
                for trial in store.trials(person.row):  # as a page that did not hear of it would send it again
                    add_trials(store, person.row, trial)
        with open(os.path.join(folder, "trials.json")) as ours, open(os.path.join(C_STUDY, "trials.json")) as theirs:
            for a, b in itertools.zip_longest(ours, theirs):  # which rounded numbers to 15 digits, seeds too
                near = [float(line.split("\t")[-1].rstrip(",\n")) for line in (a, b)] if a != b else [0.0, 0.0]
                assert abs(near[0] - near[1]) <= 4e-16 * near[0], (a, b)


def test_old_database():
    """one from before there were clips gets its column"""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(os.path.join(C_STUDY, "study.db"), folder)
        with sqlite3.connect(os.path.join(folder, "study.db")) as db:
            db.execute("ALTER TABLE trial DROP COLUMN frame_ms")
            (study_id,) = db.execute("SELECT id FROM study").fetchone()
        db.close()
        with Store(folder, study_id) as store:
            assert [t.frame_ms for t in store.trials(1)] == [""] * len(store.trials(1)) != []


def test_addresses():
    """addresses are numbers"""
    for text, *wanted in (("127.0.0.1", "127.0.0.1", PORT, False, True), ("127.8.9.1:80", "127.8.9.1", 80, False, True),
                          ("0.0.0.0:0", "0.0.0.0", 0, False, False), ("192.168.1.5:8080", "192.168.1.5", 8080, False, False),
                          ("[::1]", "::1", PORT, True, True), ("[::]:81", "::", 81, True, False),
                          ("127.0.0.1:65535", "127.0.0.1", 65535, False, True), ("126.0.0.1", "126.0.0.1", PORT, False, False)):
        assert list(parse_address(text)) == wanted, text
    for text, why in (("", "not an address in numbers"), ("localhost", "not an address in numbers, like 127.0.0.1 or [::1]"),
                      ("127.0.0.1:", "a port is 0 … 65535"), ("127.0.0.1:x", "a port is"), ("127.0.0.1:70000", "a port is"),
                      ("127.0.0.1:65536", "a port is"), ("127.0.0.1:-1", "a port is"), ("127.0.0.1:1x", "a port is"),
                      ("[::1", "expected ADDRESS, ADDRESS:PORT or [ADDRESS6]:PORT"), ("[::1]x", "expected ADDRESS"),
                      ("::1", "not an address"), ("1.2.3", "not an address"), ("127.0.0.1:²", "a port is")):
        raises(Refused, f"--listen {text}: {why}", parse_address, text)


def test_token():
    """the token of links is made once, 32 hex digits, readable again; another text is refused"""
    with tempfile.TemporaryDirectory() as folder:
        first = keep_token(folder)
        assert len(first) == 32 and int(first, 16) >= 0 and keep_token(folder) == first
        with open(os.path.join(folder, "token"), "w") as file:
            file.write("0" * 31 + "\n")
        raises(Refused, "not a token", keep_token, folder)


def test_outputs():
    """a file is whole or as before; nothing goes onto the study's own, by whatever name"""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "a")
        for text, mode in ("one", 0o600), ("two", 0o640):
            with replaced(path) as file:
                file.write(text)
            assert text == "one" or os.stat(path).st_mode & 0o777 == 0o600  # of the file that was there
            os.chmod(path, mode)
        try:
            with replaced(path) as file:
                file.write("three")
                raise KeyError
        except KeyError:
            pass
        assert open(path).read() == "two" and os.listdir(folder) == ["a"]
        raises(Refused, "it is a folder", replaced(folder).__enter__)
        raises(Refused, "cannot write there: No such file", replaced(path + "/b").__enter__)
        os.mkdir(os.path.join(folder, "stimuli"))
        os.symlink("study.db", os.path.join(folder, "link"))
        raises(Refused, "among the pictures", protect, folder, folder + "/stimuli/../stimuli/x")
        raises(Refused, "the study's own study.db", protect, folder, folder + "/link")
        protect(folder, folder + "/report.json")


def test_options():
    """options before, between and behind arguments, by a beginning that is theirs alone"""
    command = Command("lull-study x", "DIR", 1, 2, "", (Option("number", "N", "", integer(1, 9), letter="n"), Option("nothing", "", "")))
    assert parse_options(command, ["a", "--num=3", "b", "--noth"]) == (["a", "b"], {"number": 3, "nothing": True})
    assert parse_options(command, ["-n4", "--", "-n"]) == (["-n"], {"number": 4})
    for words, why in ((["--n", "3", "a"], "--n: unknown option, or the beginning of several"), (["-x"], "-x: unknown option"),
                       (["--number"], "--number: a value is needed"), (["--nothing=1", "a"], "--nothing: this option takes no value"),
                       (["-n", "10", "a"], "--number 10: expected an integer from 1 to 9"), ([], "expected DIR"),
                       (["a", "b", "c"], "c: one argument too many; expected DIR"), (["-n", "1_0", "a"], "expected an integer")):
        raises(Refused, why, parse_options, command, words)


SERVE = """import sys
from lull.study import server
server.IDLE_S, server.SWEEP_S, server.MAX_CONNECTIONS = 1, 0.1, 4
server.serve(sys.argv[1], "plugin-api/python/lull/study/page", "127.0.0.1:0")"""


def test_quiet_connections():
    """who sends half a request, or nothing, is left when time is over; who comes when all places are taken, at once; others are served"""
    request = b"POST /api/people HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n"
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(os.path.join(C_STUDY, "study.json"), folder)
        server = subprocess.Popen([sys.executable, "-c", SERVE, folder], stdout=subprocess.PIPE, text=True)
        try:
            port = int(server.stdout.readline().rsplit(":", 1)[1].rstrip("/\n"))
            for sent in (b"", request, request + b"\r\n1234"):
                with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as quiet:
                    quiet.sendall(sent)
                    assert left(quiet), sent
            many = [socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) for _ in range(8)]
            assert all(left(s) for s in many)
            for s in many:
                s.close()
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=PATIENCE_S) as page:
                assert b"main.js" in page.read()
        finally:
            server.terminate()
            assert server.wait(PATIENCE_S) == 0


def left(connection):
    """Whether the server has ended it, without an answer."""
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


tap.main(globals())
