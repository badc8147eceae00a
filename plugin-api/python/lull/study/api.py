# SPDX-License-Identifier: MIT
"""What a study answers to a request, without sockets: files of the page, stimuli, and the JSON of people and trials.

The addresses, all relative to the study's link (which ends in '/', after the token if there is one):
    GET  (nothing), FILE, vendor/FILE    the page
    GET  texts.json                      what the page says
    GET  stimuli/vVIEW/FILE.png
    GET  api/study                       the study file
    POST api/people                      {"consent": true} → {"key", "id"}
    GET  api/people/KEY                  {"id", "profile", "slots": […], "trials": […]}
    POST api/people/KEY/profile          an object: what they told and measured
    POST api/people/KEY/trials           {"slot", "revision", "level", "answer", "rating", "ms", "layout"}
Nothing is changed unless all of the body is right. A trial that is there already is acknowledged again, so a page may repeat
what it did not hear about; a different one in its place is refused with 409. One thread, which never waits for the disk to
sync."""
from __future__ import annotations

import functools
import hmac
import os
import re
import secrets
import stat
import time
from dataclasses import dataclass
from typing import Any, NamedTuple, Optional, Sequence

from .definition import ADJUSTMENT, TWO_INTERVAL, VALIDATION, Study, is_number, is_plain_name, members
from .files import Refused, loads, print_json
from .plan import Slot, dropped_frames, make_plan, person_seed, plan_count, plan_minutes, slot_takes
from .store import MAX_PEOPLE, MAX_PROFILE, MAX_TIMES, Conflict, Person, Store, Trial

MAX_BODY = 65536
MAX_MS = 86400000  # a day
MAX_REVISION = 1000
TYPES = {".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8",
         ".json": "application/json", ".png": "image/png", ".txt": "text/plain; charset=utf-8"}


@dataclass
class Site:
    folder: str  # the study's
    page: str  # the folder of the page
    study: Study
    store: Store
    token: Optional[str] = None  # first part of every address
    hosts: Optional[Sequence[str]] = None  # what the Host header may say; None: anything

    def __post_init__(self) -> None:
        kept = max(4, 500000 // (plan_count(self.study) + 1))  # half a million slots: no number of people fills the memory
        self.plan = functools.lru_cache(kept)(functools.partial(make_plan, self.study))


class Request(NamedTuple):
    """Headers are None when not sent."""
    method: str
    path: str  # as sent, starts with '/', without the query
    body: bytes = b""
    host: Optional[str] = None
    origin: Optional[str] = None
    fetch_site: Optional[str] = None
    content_type: Optional[str] = None


class Response(NamedTuple):
    status: int
    type: str
    body: bytes
    keep: bool = False  # whether a browser may keep it for ever
    why: str = ""  # for the log when the request was refused


class Denied(Exception):
    """The request is answered with a status and why."""

    def __init__(self, status: int, why: str) -> None:
        super().__init__(why)
        self.status = status


def refusal(status: int, why: str) -> Response:
    return Response(status, "application/json", print_json({"error": why}, pretty=False).encode(), why=why)


def _json(value: Any) -> Response:
    return Response(200, "application/json", print_json(value, pretty=False).encode())


def now_utc() -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())


# --- files ---

def _file(root: str, folder: str, name: str, keep: bool = False) -> Response:
    """ROOT/[FOLDER/]NAME, plain names only and no link, so that nothing outside can be named."""
    kind = TYPES.get(os.path.splitext(name)[1])
    if not kind or not is_plain_name(name) or (folder and not is_plain_name(folder)):
        raise Denied(404, "no such file")
    try:
        descriptor = os.open(os.path.join(root, folder, name), os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError:
        raise Denied(404, "no such file") from None
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise Denied(404, "no such file")
        with open(descriptor, "rb", closefd=False) as file:
            return Response(200, kind, file.read(), keep)
    finally:
        os.close(descriptor)


def _get_file(site: Site, path: str) -> Response:
    folder, slash, name = path.partition("/")
    if folder == "stimuli" and "/" in name:
        folder, _, name = name.partition("/")
        return _file(os.path.join(site.folder, "stimuli"), folder, name, keep=True)
    if path == "texts.json":
        return _file(site.folder, "", path)
    return _file(site.page, folder, name) if slash else _file(site.page, "", path or "index.html")


# --- people ---

def _post_person(site: Site, body: dict[str, Any]) -> Response:
    if body.get("consent") is not True:
        raise Denied(400, "consent is needed")
    store = site.store
    with store.changing():
        number = store.next_number()
        if number >= MAX_PEOPLE:
            raise Denied(500, "this study is full")
        person = Person(0, secrets.token_hex(4), secrets.token_hex(16), person_seed(site.study, number), now_utc())
        store.add_person(person)
    return _json({"key": person.key, "id": person.id})


def _slot_members(study: Study, slot: Slot) -> dict[str, int]:
    fields = {"view": slot.view, "catch": slot.catch}
    if study.task == VALIDATION:
        fields["condition"] = slot.condition
    else:
        fields["block"] = slot.block
    return {**fields, "screen": slot.screen, "start": slot.start} if study.task == ADJUSTMENT else {**fields, "side": slot.side}


def _get_person(site: Site, person: Person) -> Response:
    slots = [_slot_members(site.study, slot) for slot in site.plan(person.seed)]
    trials = [{name: getattr(t, name) for name in ("slot", "revision", "level", "answer", "rating")}
              for t in site.store.trials(person.row)]
    return Response(200, "application/json", '{{"id":"{}","profile":{},"slots":{},"trials":{}}}'.format(
        person.id, site.store.profile(person.row), print_json(slots, False), print_json(trials, False)).encode())


def _post_profile(site: Site, person: Person, body: dict[str, Any]) -> Response:
    text = print_json(body, pretty=False)
    if len(text.encode()) > MAX_PROFILE:
        raise Denied(413, "the profile is too long")
    site.store.set_profile(person.row, text)
    return _json({})


# --- trials ---

def _whole(body: dict[str, Any], name: str, lo: float, hi: float) -> int:
    """A whole number in [lo, hi]; absent counts as 0."""
    value = body.get(name, 0)
    if not is_number(value, lo, hi):
        raise Denied(400, f"no such {name}")
    return int(value)


def _read_trial(study: Study, plan: Sequence[Slot], body: dict[str, Any]) -> Trial:
    adjustment, validation = study.task == ADJUSTMENT, study.task == VALIDATION
    slot = _whole(body, "slot", 0, len(plan) - 1)
    if "slot" not in body:
        raise Denied(400, "no such slot")
    revision = _whole(body, "revision", 0, MAX_REVISION if adjustment else 0)
    level = _whole(body, "level", 0, 1e9)
    answer = _whole(body, "answer", 1 if study.task == TWO_INTERVAL else 0, 0 if adjustment else 1 if validation else 2)
    if validation and "answer" not in body:
        raise Denied(400, "no such answer")
    rating = _whole(body, "rating", 1 if validation else 0, 5 if validation else 0)
    if not is_number(body.get("ms"), 0, MAX_MS, whole=False):
        raise Denied(400, "no time")
    if validation and body.get("layout") not in ("beside", "flip"):
        raise Denied(400, "no layout")
    times = body.get("frame_ms", "")
    if not isinstance(times, str) or len(times) > MAX_TIMES or dropped_frames(study, plan[slot], times) is None:
        raise Denied(400, "no times of frames")
    if not slot_takes(study, plan[slot], level):
        raise Denied(400, "no such level")
    layout = body["layout"] if validation else ""
    return Trial(slot, revision, level, answer, rating, float(body["ms"]), layout, now_utc(), times)


def _is_turn(site: Site, person: Person, plan: Sequence[Slot], trial: Trial) -> bool:
    """In the plan's order; settings in any order within the screens reached."""
    done, revisions = site.store.slots_done(person.row), site.store.revisions(person.row, trial.slot)
    if trial.revision < revisions:  # there already: the store compares
        return True
    if site.study.task != ADJUSTMENT:
        return trial.slot == done
    # a screen is reached when all slots of those before it are done, and they are the first in the plan
    return trial.revision == revisions and plan[trial.slot].screen <= plan[min(done, len(plan) - 1)].screen


def _post_trial(site: Site, person: Person, body: dict[str, Any]) -> Response:
    plan = site.plan(person.seed)
    trial = _read_trial(site.study, plan, body)
    if not _is_turn(site, person, plan, trial):
        raise Denied(409, "it is not this trial's turn: another window may have gone on")
    try:
        with site.store.changing():
            site.store.add_trial(person.row, trial)
    except Conflict as error:
        raise Denied(409, str(error)) from None
    return _json({"done": site.store.slots_done(person.row), "of": len(plan)})


# --- routes ---

def _split_key(path: str) -> Optional[tuple[str, str]]:
    """KEY and REST of "KEY" or "KEY/REST"."""
    match = re.fullmatch("([0-9a-f]{32})(?:/(.*))?", path, re.DOTALL)
    return (match[1], match[2] or "") if match else None


def _answer_person(site: Site, path: str, body: Optional[dict[str, Any]]) -> Response:
    key, rest = _split_key(path) or ("", "")
    person = site.store.find(key=key) if key else None
    if not person:
        raise Denied(404, "nobody has this link")
    if body is None and rest == "":
        return _get_person(site, person)
    if body is not None and rest == "profile":
        return _post_profile(site, person, body)
    if body is not None and rest == "trials":
        return _post_trial(site, person, body)
    raise Denied(404, "no such address")


def _check_origin(site: Site, q: Request) -> None:
    """Whether a request is let in at all."""
    if site.hosts is not None and q.host not in site.hosts:  # a name of somebody else's that points here
        raise Denied(403, "wrong Host")
    if q.method != "POST":
        return
    if q.fetch_site is not None and q.fetch_site != "same-origin":
        raise Denied(403, "a request from another site")
    if q.origin is not None and (q.host is None or q.origin.partition("://")[1:] != ("://", q.host)):
        raise Denied(403, "a request from another site")
    if not (q.content_type or "").startswith("application/json"):  # no form of another site can send this
        raise Denied(403, "Content-Type must be application/json")


def _answer_post(site: Site, path: str, text: bytes) -> Response:
    try:
        body = loads(text)
    except ValueError:
        body = None
    if not isinstance(body, dict):
        raise Denied(400, "the body must be one JSON object")
    if path == "api/people":
        return _post_person(site, body)
    if path.startswith("api/people/"):
        return _answer_person(site, path[len("api/people/"):], body)
    raise Denied(404, "no such address")


def _route(site: Site, q: Request) -> Response:
    _check_origin(site, q)
    if q.method not in ("GET", "HEAD", "POST"):
        raise Denied(405, "GET and POST only")
    path = q.path[1:] if q.path.startswith("/") else q.path
    if site.token:
        token, path = _split_key(path) or ("", "")
        if not hmac.compare_digest(token, site.token):
            raise Denied(403, "wrong token")
    if q.method == "POST":
        return _answer_post(site, path, q.body)
    if path == "api/study":  # study.json, and what the page would otherwise make of it by rules of its own
        return _json({**members(site.study), "minutes": plan_minutes(site.study), "shown_frames": site.study.shown_frames()})
    if path.startswith("api/people/"):
        return _answer_person(site, path[len("api/people/"):], None)
    return _get_file(site, path)


def answer(site: Site, request: Request) -> Response:
    """Always gives a response."""
    try:
        return _route(site, request)
    except Denied as error:
        return refusal(error.status, str(error))
    except Refused as error:  # a failure of the machine, not of the request
        return refusal(500, str(error))
