"""A small study that the tests beside it take, and people in it."""
import os
import subprocess

from lull.study.definition import parse
from lull.study.store import Person, Store

ID = "0123456789abcdef0123456789abcdef"
TASKS = ("adjustment", "2ifc", "validation")
BASE = ('{"format":"lull-study","version":1,"id":"' + ID + '","task":"%s","seed":7,"trials":20,"repeats":3,"catch_share":0.1,'
        '"show_ms":700,"gap_ms":400,"break_every":60,"min_catch_passed":0.75,"max_untouched":0.5,"conditions":["a","b"],'
        '"views":[{"name":"v","width":40,"height":10,"blocks":['
        '{"id":0,"x0":0,"y0":0,"x1":10,"y1":10,"levels":[16,64,256]},{"id":1,"x0":10,"y0":0,"x1":20,"y1":10,"levels":[16,64,256]},'
        '{"id":2,"x0":20,"y0":0,"x1":30,"y1":10,"levels":[16,64,256]},{"id":5,"x0":30,"y0":0,"x1":40,"y1":10,"levels":[16,64,512]}]}]}')


def study_text(task, instead_of="", with_this=""):
    """One view of 4 blocks (ids 0, 1, 2, 5) and two conditions."""
    text = BASE % task
    return text.replace(instead_of, with_this, 1) if instead_of else text


def study_of(task, **changed):
    study = parse("test", study_text(task))
    for name, value in changed.items():
        setattr(study, name, value)
    return study


def open_store(folder=None):
    return Store(folder, ID, create=True)


def add_person(store, number, seed, profile="{}"):
    """Their row; their key is the number in 32 hex digits."""
    person = Person(0, f"{number:08x}", f"{number:032x}", seed, "2024-01-01T00:00:00Z")
    with store.changing():
        return store.add_person(person, profile)


def add_trials(store, row, *trials):
    with store.changing():
        for trial in trials:
            store.add_trial(row, trial)


def approve(name, text):
    """Against tests/study/whole/NAME.txt (support/approve.h); RECORD=1 writes it anew."""
    lines = "".join(f"{'' if line.startswith('>') else '  '}{line}\n" for line in text.splitlines())
    tool = os.path.join(os.environ.get("BUILD", "build"), "tests", "approve")
    ran = subprocess.run([tool, f"tests/study/whole/{name}.txt", "1"], input=lines, stdout=subprocess.PIPE, text=True)
    assert ran.returncode == 0, ran.stdout
