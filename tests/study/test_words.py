"""What lull-study says, word by word, against what the program in C said and is recorded: plans, refusals, trials, turns, requests,
imports."""
import os
import tempfile

import tap
from lull.study.api import MAX_BODY, Request, Site, answer
from lull.study.files import Refused
from lull.study.definition import Study, View, parse
from lull.study.plan import make_plan, person_seed, plan_count
from lull.study.store import MAX_PROFILE, Trial
from lull.study.transfer import export_trials, import_trials
from made import ID, TASKS, add_person, add_trials, approve, open_store, study_of, study_text

PAGE = "plugin-api/python/lull/study/page"
OTHER_VIEW = ('"views":[', '"views":[{"name":"w","width":30,"height":20,"blocks":['
              '{"id":3,"x0":0,"y0":0,"x1":30,"y1":10,"levels":[1,2,4,8,1000000000]},'
              '{"id":4,"x0":5,"y0":5,"x1":30,"y1":20,"levels":[20]}]},')
STUDIES = [
    ('lull-study', 'lull-sequence'), ('"version":1', '"version":0'), ('"version":1', '"version":2'),
    ('"id":"0123', '"id":"x123'), ('"id":"0123', '"id":"00123'), ('"id":"0123', '"id":"123'), ('"seed":7', '"seed":-1'),
    ('"seed":7', '"seed":9007199254740991'), ('"seed":7', '"seed":9007199254740992'), ('"trials":20', '"trials":x'),
    ('"trials":20', '"trials":0'), ('"trials":20', '"trials":1000'), ('"trials":20', '"trials":1001'),
    ('"trials":20', '"trials":2.5'), ('"repeats":3', '"repeats":0'), ('"catch_share":0.1', '"catch_share":-0.1'),
    ('"catch_share":0.1', '"catch_share":0.5'), ('"catch_share":0.1', '"catch_share":0.51'),
    ('"show_ms":700', '"show_ms":0'), ('"gap_ms":400', '"gap_ms":0'), ('"break_every":60', '"break_every":-1'),
    ('"min_catch_passed":0.75', '"min_catch_passed":1.01'), ('"max_untouched":0.5', '"max_untouched":null'),
    ('"task":"', '"task":"x'), ('"conditions":["a","b"]', '"conditions":[]'),
    ('"conditions":["a","b"]', '"conditions":["a",""]'), ('"conditions":["a","b"]', '"conditions":["a b"]'),
    ('"name":"v"', '"name":"../v"'), ('"name":"v"', '"name":".v"'), ('"name":"v"', '"name":7'),
    ('"name":"v"', '"name":"v.blend","kind":"blend"'), ('"name":"v"', '"name":"v.noisy","kind":"blend"'),
    ('"name":"v"', '"name":".blend","kind":"blend"'), ('"name":"v"', '"name":"v","kind":"blend"'),
    ('"name":"v"', '"name":"v.","kind":""'), ('"name":"v"', '"name":"v.blend","kind":3'),
    ('"width":40', '"frames":16,"width":40'), ('"width":40', '"frames":18,"width":40'),
    ('"width":40', '"frames":1,"width":40'), ('"width":40', '"frames":61,"width":40'),
    ('"width":40', '"frames":2.5,"width":40'), ('"show_ms":700', '"show_ms":700,"fps":24'),
    ('"show_ms":700', '"show_ms":700,"fps":0'), ('"show_ms":700', '"show_ms":700,"fps":121'), ('"width":40', '"width":0'),
    ('"width":40', '"width":32769'), ('"height":10', '"height":9'),
    ('"views":[', '"views":[{"name":"v","width":1,"height":1,"blocks":[{"id":0,"x0":0,"y0":0,"x1":1,"y1":1,"levels":[1]}]},'),
    ('"views":[{', '"views":[1,{'), ('"blocks":[', '"blocks":[7,'), ('"blocks":[', '"other":['),
    ('"views":[', '"views":[],"x":['), ('"x1":40', '"x1":41'), ('"x1":40', '"x1":30'), ('"x0":30', '"x0":-1'),
    ('"y0":0', '"y0":10'), ('"y0":0', '"y0":9'), ('"y1":10', '"y1":0'), ('"id":5', '"id":2'), ('"id":5', '"id":3'),
    ('"id":5', '"id":32769'), ('[16,64,512]', '[16,64,64]'), ('[16,64,512]', '[16,64,65]'), ('[16,64,512]', '[]'),
    ('[16,64,512]', '[0,64]'), ('[16,64,512]', '[1,64]'), ('[16,64,512]', '[16,1000000000]'),
    ('[16,64,512]', '[16,1000000001]'), ('[16,64,512]', '[16.5]'), ('[16,64,512]', '["16"]'), (']}]}', ''), ('{', '['),
    ('"trials"', '"min_ms":-1,"trials"'), ('"trials"', '"min_ms":60000,"trials"'), ('"trials"', '"min_ms":60001,"trials"'),
    ('"trials"', '"max_fast":1.01,"trials"'), ('"trials"', '"max_fast":true,"trials"'),
    ('"trials"', '"asked_by":"Ada","trials"'), ('"trials"', '"asked_by":7,"trials"'),
    ('"trials"', '"asked_by":"  ","trials"'), ('"trials"', '"contact":"a\\nb","trials"'),
    ('"trials"', '"contact":"a\\u007fb","trials"'),
]
VALUES = [
    ('none', ''), ('slot', None), ('slot', '-1'), ('slot', '0.5'), ('slot', '"0"'), ('slot', '1'), ('slot', '7'),
    ('slot', '8'), ('slot', '11'), ('slot', '12'), ('slot', '79'), ('slot', '80'), ('revision', None), ('revision', '-1'),
    ('revision', '1'), ('revision', '1000'), ('revision', '1001'), ('level', None), ('level', '0'), ('level', '63'),
    ('level', '16'), ('level', '256'), ('level', '512'), ('level', '64.5'), ('level', '-64'), ('level', '4294967360'),
    ('answer', None), ('answer', '-1'), ('answer', '0'), ('answer', '1'), ('answer', '2'), ('answer', '3'), ('rating', None),
    ('rating', '-1'), ('rating', '0'), ('rating', '1'), ('rating', '5'), ('rating', '6'), ('ms', None), ('ms', '-0.5'),
    ('ms', '0'), ('ms', '86400000'), ('ms', '86400000.5'), ('ms', '"1"'), ('layout', None), ('layout', '"flip"'),
    ('layout', '"above"'), ('layout', '7'),
]
POSTS = [
    ('/api/people', '{}'), ('/api/people', '{"consent":1}'), ('/api/people', '[]'), ('/api/people', '{'),
    ('/api/people', None), ('/api/peoples', '{}'), ('/main.js', '{}'),
    ('/api/people/00000000000000000000000000000001', '{}'), ('/api/people/00000000000000000000000000000001/profiles', '{}'),
    ('/api/people/00000000000000000000000000000002/profile', '{}'),
    ('/api/people/00000000000000000000000000000001/profile', ' { "a" : [1, 2.50] } '),
]
IMPORTS = [
    ('', ''), ('lull-study-trials', 'lull-study'), ('"study":\t"0', '"study":\t"1'), ('"people":\t[', '"people":\t{'),
    ('"id":\t"0000000a', '"id":\t"0000000g'), ('"id":\t"0000000a', '"id":\t"00000000a'),
    ('"id":\t"0000000a', '"id":\t"000000a'), ('"id":\t"0000000a', '"id":\t"0000000b'),
    ('"created":\t"2024-01-01T00:00:00Z', '"created":\t"0123456789012345678901234567890'),
    ('"created":\t"2024-01-01T00:00:00Z', '"created":\t"01234567890123456789012345678901'), ('"created"', '"made"'),
    ('"seed":\t', '"seed":\t-'), ('"seed":\t', '"seed":\t0.5'), ('"seed":\t', '"sed":\t'),
    ('"profile":\t{', '"profile":\t[{'), ('"trials":\t[', '"trials":\t7,"x":\t['), ('"slot":\t0', '"slot":\t-1'),
    ('"slot":\t0', '"slot":\t79'), ('"slot":\t0', '"slot":\t80'), ('"slot":\t0', '"slot":\t0.5'),
    ('"slot":\t0', '"slot":\t1'), ('"revision":\t0', '"revision":\t1000'), ('"revision":\t0', '"revision":\t1001'),
    ('"revision":\t0', '"revision":\t-1'), ('"level":\t64', '"level":\t16'), ('"level":\t64', '"level":\t65'),
    ('"level":\t64', '"level":\t4294967360'), ('"answer":\t1', '"answer":\t0'), ('"answer":\t1', '"answer":\t3'),
    ('"rating":\t0', '"rating":\t5'), ('"rating":\t0', '"rating":\t6'), ('"ms":\t0.5', '"ms":\t86400000'),
    ('"ms":\t0.5', '"ms":\t86400001'), ('"ms":\t0.5', '"ms":\t-1'), ('"layout":\t"', '"layout":\t"012345678901234'),
    ('"layout":\t"', '"layout":\t"0123456789012345'),
    ('"at":\t"2024-01-01T00:00:00Z', '"at":\t"0123456789012345678901234567890'),
    ('"at":\t"2024-01-01T00:00:00Z', '"at":\t"01234567890123456789012345678901'),
]


def printed_plan(study, seed):
    slots = make_plan(study, seed)
    words = [f" {t.view}.{t.block}:{t.condition},{t.screen}{'AB'[t.side]}{t.start}.{t.catch}" for t in slots]
    rows = ["".join(words[i:i + 12]) for i in range(0, len(words), 12)]
    return "\n".join([f"{study.task}, seed {seed}: {len(slots)} of {plan_count(study)}", *rows]) + "\n"


def test_plans():
    """plans are those of the program in C: view.block:condition,screen, side, start.catch"""
    said = ""
    for task in TASKS:
        study = parse("test", study_text(task, *OTHER_VIEW))
        for person in range(2):
            said += f"person {person}: {person_seed(study, person)}\n" + printed_plan(study, person + 7)
        study.trials, study.repeats = 5, 1
        for study.catch_share in (0, 0.01, 0.1, 0.5):
            said += printed_plan(study, 1)
    for views in (1000, 1001):
        study = Study(ID, "validation", 0, repeats=100, catch_share=0, views=[View("v", 1, 1)] * views, conditions=["a", "b"])
        try:
            told = f"{len(make_plan(study, 1))} "
        except Refused as error:
            told = f"0 {error}"
        said += f"{views} views: {plan_count(study)}; {told}\n"
        study.catch_share = 0.001
        said += f"with catch trials: {plan_count(study)}\n"
    approve("study-plans", said)


def test_studies():
    """a study file is taken, or refused in the words of before"""
    said = ""
    for task in TASKS:
        for instead_of, with_this in STUDIES:
            try:
                parse("test", study_text(task, instead_of, with_this))
                told = "taken"
            except Refused as error:
                told = str(error)
            said += f"{instead_of} -> {with_this[:60]}: {told}\n"
    approve("study-files", said)


class Asker:
    """Asks a site that has a store in memory, and writes down what comes."""

    def __init__(self, task):
        self.study, self.store, self.said, self.people = study_of(task), open_store(), f"> {task}\n", 0
        self.site = Site("tests/none", PAGE, self.study, self.store)

    def ask(self, method, path, body=None, **headers):
        r = answer(self.site, Request(method, path, (body or "").encode(), **headers))
        is_file = r.status == 200 and r.type != "application/json"
        self.said += f"{method} {path[:80]} {(body or '')[:100]}\n  {r.status} {r.type}{', kept ' if r.keep else ' '}"
        self.said += f"{'a file' if is_file else r.body.decode()}{', logged: ' if r.why else ''}{r.why}\n"

    def post(self, path, body, **headers):
        self.ask("POST", path, body, content_type="application/json", **headers)

    def somebody(self):
        """With a plan of their own; their link is the number in hex digits."""
        self.people += 1
        return add_person(self.store, self.people, 11)

    def trial(self, body):
        self.post(f"/api/people/{self.people:032x}/trials", body)

    def print_trials(self, row):
        for t in self.store.trials(row):
            self.said += (f"    stored {t.slot}.{t.revision} level {t.level} answer {t.answer} rating {t.rating} ms {t.ms:g} "
                          f"layout '{t.layout}'{'' if len(t.at) == 20 else ', no time'}\n")


def trial_body(task, name, value):
    """The body of a trial with one field otherwise; with None: without it."""
    usual = {"adjustment": ["0", "0", "64", "0", "0", "500", '""'], "2ifc": ["0", "0", "64", "1", "0", "500.25", '""'],
             "validation": ["0", "0", "0", "1", "3", "500", '"beside"']}[task]
    fields = dict(zip(("slot", "revision", "level", "answer", "rating", "ms", "layout"), usual))
    if name in fields:
        fields[name] = value
    return "{" + ",".join(f'"{k}":{v}' for k, v in fields.items() if v is not None) + "}"


def test_trials():
    """each field of a trial at its bounds, in each task"""
    said = ""
    for task in TASKS:
        a = Asker(task)
        for name, value in VALUES:
            row = a.somebody()
            a.trial(trial_body(task, name, value))
            a.print_trials(row)
        said += a.said
    approve("study-trials", said)


def test_turns():
    """whose turn it is: in the plan's order, or in any order within the screens reached"""
    order = [(1, 0), (5, 0), (2, 0), (2, 2), (2, 1), (2, 1), (0, 0), (0, 0), (1, 0), (1, 1), (3, 0), (9, 0), (5, 0), (8, 0), (4, 0), (0, 1),
             (6, 0), (7, 0), (9, 0), (8, 0), (10, 0), (11, 0), (11, 1), (11, 3)]
    said = ""
    for task in TASKS[:2]:
        a, two = Asker(task), task == "2ifc"
        row = a.somebody()
        for i, (slot, revision) in enumerate(order):
            a.trial(f'{{"slot":{slot},"revision":{0 if two else revision},"level":64,"answer":{2 if two else 0},"ms":{i}}}')
        for slot in range(4 if two else 0):
            for _ in range(2):
                a.trial(f'{{"slot":{slot},"level":64,"answer":1,"ms":5}}')
        a.print_trials(row)
        a.ask("GET", "/api/people/00000000000000000000000000000001")
        said += a.said
    approve("study-turns", said)


def test_requests():
    """addresses, methods, where a request comes from, and sizes at their bounds"""
    a = Asker("validation")
    a.somebody()
    for path, body in POSTS:
        a.post(path, body)
    me = "/api/people/00000000000000000000000000000001"
    for path in ("", "/", "/index.html", "/main.js", "main.js", "/none.js", "/study.css", "/vendor/jspsych.js", "/vendor", "/vendor/",
                 "/a/b/c.js", "/texts.json", "/stimuli/v0/x.png", "/stimuli/x.png", "/stimuli", "/README.md", "/.hidden.js", "/api/study",
                 "/api/people", "/api/people/", me, me + "/", me + "/trials", "/api/people/" + me[13:], "/api/people/0" + me[12:], me + "x"):
        a.ask("GET", path)
    for n in (MAX_PROFILE - 8, MAX_PROFILE - 7):
        a.post(me + "/profile", f'{{"a":"{" " * n}"}}')
    a.ask("HEAD", "/api/study")
    a.ask("PUT", "/api/study")
    json = "application/json"
    sources = [{}, {"content_type": "application/jso"}, {"content_type": "application/json; charset=utf-8"}, {"content_type": "text/json"},
               {"fetch_site": "same-site", "content_type": json}, {"fetch_site": "same-origin", "content_type": json},
               {"origin": "http://one:1", "host": "one:1", "content_type": json}, {"origin": "http://one:1", "content_type": json},
               {"origin": "null", "host": "one:1", "content_type": json}, {"origin": "http://two:2", "host": "one:1", "content_type": json},
               {"host": "two:2", "content_type": json}, {"host": "two", "content_type": json}]
    for a.site.hosts in (None, ("one:1", "two:2")):
        for source in sources:
            host, origin, site, kind = (source.get(name) or "-" for name in ("host", "origin", "fetch_site", "content_type"))
            a.said += f"host {host}, origin {origin}, {site}, {kind}: "
            a.ask("POST", "/api/people", '{"consent":false}', **source)
    a.site.hosts, a.site.token = None, ID
    for path in (f"/{ID}/index.html", f"/{ID}", f"/1{ID}/index.html", "/index.html", "/00000000000000000000000000000001/index.html"):
        a.ask("GET", path)
    approve("study-requests", a.said)


def test_imports():
    """what an import takes and what it says of the rest; a trial of each kind comes back"""
    with tempfile.TemporaryDirectory() as folder:
        path, again = os.path.join(folder, "a.json"), os.path.join(folder, "b.json")
        a = Asker("2ifc")
        for person in range(2):
            row = add_person(a.store, 10 + person, 11 + person, '{"answers":{"vision":"well"}}')
            add_trials(a.store, row, Trial(0, 0, 64, 1, 0, 0.5, at="2024-01-01T00:00:00Z"))
        n = export_trials(a.study, a.store, path)
        with open(path) as file:
            exported = file.read()
        a.said += f"{n}\n{exported}"
        for instead_of, with_this in IMPORTS:
            changed, told, to = exported.replace(instead_of, with_this, 1), "taken", open_store()
            assert changed != exported or instead_of == ""
            with open(path, "w") as file:
                file.write(changed + "\n")
            try:
                import_trials(a.study, to, path)
            except Refused as error:
                told = str(error)
            n = export_trials(a.study, to, again)
            with open(again) as file:
                differs = told == "taken" and file.read() != changed
            a.said += f"{instead_of} -> {with_this}: {told}\n  {n} people{', not the same bytes' if differs else ''}\n"
        approve("study-imports", a.said.replace(folder, "DIR"))


def test_random_bytes():
    """whatever comes as a request, there is an answer, and trials that were stored before stay as they were"""
    import random
    draw = random.Random(42)
    words = ["GET", "POST", "HEAD", "PUT", "/", "api/people", "api/study", "trials", "profile", f"{1:032x}", "slot", "level", "answer", "ms", "{",
             "}", "[", "]", '"', ":", ",", "0", "-1", "64", "1e300", "true", "null", "consent", "stimuli/v0/", "../", "%00", "\0", "é", "\ud800",
             "\\ud800", "frame_ms", "NaN"]

    def text(longest):
        return "".join(draw.choice(words) if draw.random() < 0.9 else chr(draw.randrange(1, 0x2fff)) for _ in range(draw.randrange(longest)))
    for task in TASKS:
        study, store = study_of(task), open_store()
        first = Trial(0, 0, 16, 1, 0, 3.0)
        row = add_person(store, 1, 5)
        add_trials(store, row, first)
        site = Site("/nonexistent", "/nonexistent", study, store, hosts=["h"])
        for _ in range(4000):
            path = draw.choice(["/api/people", f"/api/people/{1:032x}/trials", f"/api/people/{1:032x}/profile", "/" + text(6)])
            body = draw.choice([trial_body(task, *draw.choice(VALUES)), text(30)]).encode("utf-8", "surrogatepass")
            if draw.random() < 0.3:
                at = draw.randrange(len(body) + 1)
                body = body[:at] + bytes([draw.randrange(256)]) + body[at + draw.randrange(2):]
            q = Request(draw.choice(["POST", "POST", "GET", text(2)]), path, body[:MAX_BODY], draw.choice(["h", "h", "h", text(2), None]),
                        draw.choice([None, None, "http://h", text(3)]), draw.choice([None, "same-origin", text(2)]),
                        draw.choice(["application/json", "application/json", text(2), None]))
            r = answer(site, q)
            assert 200 <= r.status <= 599 and r.type and (r.status == 200) == (r.why == ""), q
        assert store.trials(row)[0] == first
        store.close()


tap.main(globals())
