# SPDX-License-Identifier: MIT
"""The order in which one person meets a study: a pure function of the study and of the person's seed.

Nothing of a plan is stored: it is made again from the seed whenever a trial comes in, the page asks, or the report reads."""
from __future__ import annotations

import math
import re
from typing import NamedTuple, Optional

from .definition import ADJUSTMENT, MAX_TRIALS, TWO_INTERVAL, VALIDATION, Study
from .files import Refused

NO_CATCH = 0
CATCH_PLAIN = 1  # heavy noise, which nobody misses
CATCH_IDENTICAL = 2  # validation: the reference against itself
MAX_STAND = 9999  # ms that a frame of a clip stood; the page says no more
_MASK = 2**64 - 1


class Slot(NamedTuple):
    """One trial to be done; members that its task does not use are 0."""
    view: int  # indices
    block: int = 0
    screen: int = 0  # adjustment: slots of one screen are done together, in any order
    condition: int = 0  # validation; -1 in a catch trial
    side: int = 0  # 0, 1: the noisy interval is the first, the second; the judged picture is A or left, B or right
    start: int = 0  # adjustment: index of the level shown first
    catch: int = NO_CATCH


class _Random:
    """SplitMix64 (Steele, Lea, Flood 2014)."""

    def __init__(self, state: int) -> None:
        self.state = state & _MASK

    def next(self) -> int:
        self.state = z = (self.state + 0x9e3779b97f4a7c15) & _MASK
        z = ((z ^ (z >> 30)) * 0xbf58476d1ce4e5b9) & _MASK
        z = ((z ^ (z >> 27)) * 0x94d049bb133111eb) & _MASK
        return z ^ (z >> 31)

    def below(self, n: int) -> int:
        """Uniform; the bias of the remainder is below n / 2^64."""
        return self.next() % n

    def shuffled(self, x: list) -> list:
        for i in range(len(x) - 1, 0, -1):
            j = self.below(i + 1)
            x[i], x[j] = x[j], x[i]
        return x


def person_seed(study: Study, n: int) -> int:
    """The seed of the study's n-th person. Below 2^53."""
    return _Random(study.seed * 0x2545f4914f6cdd1d + n).next() >> 11


def slot_takes(study: Study, slot: Slot, level: int) -> bool:
    """Whether a trial of the slot can have been at that level: 0 in catch trials and validations, else one of its
    block's."""
    if study.task == VALIDATION or slot.catch:
        return level == 0
    return level in study.views[slot.view].blocks[slot.block].levels


def dropped_frames(study: Study, slot: Slot, text: str) -> Optional[int]:
    """The text is what the page says of how long each frame of a clip stood in the two intervals: "42 41 0 83 …",
    milliseconds, 0 for one that was never drawn because the next was due. How many those are; None: it is no such text. Of
    stills it is empty."""
    n = 2 * study.shown_frames() if study.views[slot.view].frames > 1 else 0
    if n == 0:
        return 0 if text == "" else None
    parts = text.split(" ")
    if len(parts) != n or not all(re.fullmatch("[0-9]+", part) and int(part) <= MAX_STAND for part in parts):
        return None
    return sum(int(part) == 0 for part in parts)


def _catch_count(study: Study, n: int) -> int:
    """Of n trials so many are catch trials: at least one when there are any."""
    count = math.floor(study.catch_share * n + 0.5)
    return 1 if study.catch_share > 0.0 and count == 0 else count


def plan_count(study: Study) -> int:
    """Number of slots without making them; MAX_TRIALS + 1 when there would be more than that."""
    blocks = sum(len(view.blocks) for view in study.views)
    if study.task == ADJUSTMENT:
        n = blocks * study.repeats
    elif study.task == TWO_INTERVAL:
        n = blocks * study.trials
    else:
        n = len(study.views) * len(study.conditions) * study.repeats
        n += 2 * _catch_count(study, n // 2) if n <= MAX_TRIALS else 0
    return min(n, MAX_TRIALS + 1)


def plan_minutes(study: Study) -> float:
    """How long a person takes, roughly, without instructions and breaks. The times are guesses; of people nothing is known
    yet."""
    interval_s = (study.gap_ms + study.show_ms) / 1000.0
    trial_s = {ADJUSTMENT: 12.0, TWO_INTERVAL: 2.0 * interval_s + 1.0, VALIDATION: 15.0}[study.task]
    return plan_count(study) * trial_s / 60.0


def _adjustment(study: Study, random: _Random) -> list[Slot]:
    """Views one after the other in random order, each once per round of repeats."""
    slots: list[Slot] = []
    for repeat in range(study.repeats):
        for i, v in enumerate(random.shuffled(list(range(len(study.views))))):
            slots += [Slot(v, b, screen=repeat * len(study.views) + i, start=random.below(len(block.levels)))
                      for b, block in enumerate(study.views[v].blocks)]
    return slots


def _two_interval(study: Study, random: _Random) -> list[Slot]:
    """View by view, so that the page preloads one view at a time. In each round every block comes once, and no block follows
    itself: its next level depends on the answer, everybody else's is known and loaded before. Per block a permutation of the
    rounds says which are catch trials, and the noise comes as often first as second."""
    slots: list[Slot] = []
    catches = _catch_count(study, study.trials)
    for v in random.shuffled(list(range(len(study.views)))):
        n, last = len(study.views[v].blocks), -1
        ranks = [random.shuffled(list(range(study.trials))) for _ in range(n)]
        for turn in range(study.trials):
            order = random.shuffled(list(range(n)))
            if n > 1 and order[0] == last:
                order[0], order[-1] = order[-1], order[0]
            slots += [Slot(v, b, side=ranks[b][turn] & 1, catch=CATCH_PLAIN if ranks[b][turn] < catches else NO_CATCH)
                      for b in order]
            last = order[-1]
    return slots


def _validation(study: Study, random: _Random) -> list[Slot]:
    """All pictures in random order; half of the catch trials differ plainly, the other half not at all."""
    views, conditions = len(study.views), len(study.conditions)
    judged = views * conditions * study.repeats
    slots = [Slot(i % views, condition=i // views % conditions) for i in range(judged)]
    slots += [Slot(random.below(views), condition=-1, catch=CATCH_IDENTICAL if i % 2 else CATCH_PLAIN)
              for i in range(plan_count(study) - judged)]
    return [slot._replace(side=random.below(2)) for slot in random.shuffled(slots)]


def make_plan(study: Study, seed: int) -> list[Slot]:
    if plan_count(study) > MAX_TRIALS:
        raise Refused(f"study: more than {MAX_TRIALS} trials for one person; take fewer views or trials")
    make = {ADJUSTMENT: _adjustment, TWO_INTERVAL: _two_interval, VALIDATION: _validation}[study.task]
    return make(study, _Random(seed))
