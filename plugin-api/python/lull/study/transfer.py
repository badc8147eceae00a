# SPDX-License-Identifier: MIT
"""Raw trials out of a study and into it again: one JSON file, its form in FORMAT.md.

Keys are not in the file: it does not let its reader go on in a person's name, and an imported person gets a new key."""
from __future__ import annotations

import json
import re
import secrets
from typing import Any, Optional

from .api import MAX_MS, MAX_REVISION
from .definition import TWO_INTERVAL, VALIDATION, Study, is_number
from .files import Refused, loads, print_json, read_file, write_line
from .plan import Slot, dropped_frames, make_plan, slot_takes
from .store import MAX_TIMES, Conflict, Person, Store, Trial


# --- out ---

def _meaning(study: Study, slot: Slot, trial: Trial) -> dict[str, Any]:
    """What a reader of the file wants to know of a trial without making the plan again; the import does not look at it."""
    view = study.views[slot.view]
    fields: dict[str, Any] = {"view": view.name, "catch": slot.catch}
    if study.task == VALIDATION:
        return {**fields, "condition": study.conditions[slot.condition] if slot.condition >= 0 else None,
                "judged_is": "AB"[slot.side]}
    block = view.blocks[slot.block]
    fields["block"] = block.id
    if study.task == TWO_INTERVAL:
        return {**fields, "noise_in": slot.side + 1, "correct": trial.answer == slot.side + 1}
    return {**fields, "started_at": block.levels[slot.start]}


def _trial_members(study: Study, plan: list[Slot], trial: Trial) -> dict[str, Any]:
    names = "slot", "revision", "level", "answer", "rating", "ms", "layout", *(("frame_ms",) if trial.frame_ms else ()), "at"
    fields = {name: getattr(trial, name) for name in names}
    return {**fields, **(_meaning(study, plan[trial.slot], trial) if trial.slot < len(plan) else {})}


def export_trials(study: Study, store: Store, path: str) -> int:
    """Writes all trials. How many people there are."""
    people = []
    for person in store.people():
        plan = make_plan(study, person.seed)
        people.append({"id": person.id, "seed": person.seed, "created": person.created,
                       "profile": json.loads(store.profile(person.row)),
                       "trials": [_trial_members(study, plan, trial) for trial in store.trials(person.row)]})
    write_line(path, print_json({"format": "lull-study-trials", "version": 1, "study": study.id, "task": study.task,
                                 "people": people}, pretty=True))
    return len(people)


# --- in ---

def _is_text(value: Any, most: int) -> bool:
    return isinstance(value, str) and len(value.encode()) <= most


def _read_trial(study: Study, plan: list[Slot], o: Any) -> Optional[Trial]:
    bounds = {"slot": len(plan) - 1, "revision": MAX_REVISION, "level": 10**9, "answer": 2, "rating": 5}
    texts = {"layout": 15, "at": 31, "frame_ms": MAX_TIMES}
    o = {"frame_ms": "", **o} if isinstance(o, dict) else {}
    if (not all(is_number(o.get(name), 0, most) for name, most in bounds.items()) or
            not all(_is_text(o.get(name), most) for name, most in texts.items()) or
            not is_number(o.get("ms"), 0, MAX_MS, whole=False)):
        return None
    trial = Trial._make([*(int(o[name]) for name in bounds), float(o["ms"]), *(o[name] for name in texts)])
    slot = plan[trial.slot]
    fits = slot_takes(study, slot, trial.level) and dropped_frames(study, slot, trial.frame_ms) is not None
    return trial if fits else None


def _import_person(study: Study, store: Store, path: str, o: Any) -> None:
    o = o if isinstance(o, dict) else {}
    trials = o.get("trials")
    if (not _is_text(o.get("id"), 8) or not re.fullmatch("[0-9a-f]{8}", o["id"]) or
            not is_number(o.get("seed"), 0, 2**53 - 1) or not _is_text(o.get("created"), 31) or
            not isinstance(o.get("profile"), dict) or not isinstance(trials, list)):
        raise Refused(f"{path}: a person without a proper id, seed, created, profile or trials")
    person = Person(0, o["id"], secrets.token_hex(16), int(o["seed"]), o["created"])
    if store.find(id=person.id):
        raise Refused(f"{path}: person {person.id} is in the study already; nothing was imported")
    row = store.add_person(person, print_json(o["profile"], pretty=False))
    plan = make_plan(study, person.seed)
    for fields in trials:
        trial = _read_trial(study, plan, fields)
        if not trial:
            raise Refused(f"{path}: person {person.id} has a trial that this study cannot have")
        try:
            store.add_trial(row, trial)
        except Conflict as error:
            raise Refused(str(error)) from None


def import_trials(study: Study, store: Store, path: str) -> int:
    """Adds all people of the file, or none: a file of another study, a person who is there already, a trial that cannot be
    of this study are refused. How many there were."""
    try:
        root = loads(read_file(path, 1 << 29))
    except ValueError:
        root = None
    if not isinstance(root, dict) or root.get("format") != "lull-study-trials" or not isinstance(root.get("people"), list):
        raise Refused(f"{path}: not a file of `lull-study export`")
    if root.get("study") != study.id:
        raise Refused(f"{path}: trials of another study")
    with store.changing():
        for o in root["people"]:
            _import_person(study, store, path, o)
    return len(root["people"])
