"""The statistics of `lull-study report` against published values, closed forms, data whose answer is known, and what the program in C
made of the same trials; who counts; and what is drawn. Every expected figure is counted here, from the plan and the answers alone."""
import io
import itertools
import json
import math
import os
import shutil
import tempfile

import numpy as np
import tap
from lull.study.definition import Block, Study, View, members, parse
from lull.study.figures import curves_figure, people_figure, shares_figure, thresholds_figure
from lull.study.people import PLAIN, Cell, Judgement, People, Result, print_status
from lull.study.plan import CATCH_IDENTICAL, make_plan, person_seed
from lull.study.psychometric import Choice, Curve, Estimate, estimate, p_correct, t975, wilson
from lull.study.report import write_report
from lull.study.store import Person, Store, Trial
from lull.study.summary import against_noisy, ceiling, intraclass, pearson, people_needed, share, thresholds
from made import ID, add_trials, open_store
from scipy.special import ndtr, ndtri


def near(a, b, by):
    assert abs(a - b) <= by, (a, b, by)


def test_quantiles():
    """quantiles are those of the tables"""
    for df, wanted in ((1, 12.7062), (2, 4.3027), (10, 2.2281), (30, 2.0423), (40, 2.0211), (1000, 1.9623)):
        near(t975(df), wanted, 1e-4)
    near(float(p_correct(5.0, 6.0, 0.5)), 0.988624934, 1e-8)  # half and half of 0.977249868


def test_wilson():
    """Wilson's interval is Wilson's"""
    for (k, n), (lo, hi) in (((8, 10), (0.4902, 0.9433)), ((0, 10), (0.0, 0.2775)), ((10, 10), (0.7225, 1.0)), ((1, 10), (0.0179, 0.4042))):
        near(wilson(k, n)[0], lo, 5e-4)
        near(wilson(k, n)[1], hi, 5e-4)
    near(sum(wilson(50, 100)), 1.0, 1e-12)


LEVELS, EACH = 13, 40


def expected_choices(t, spread, bias):
    """EACH choices per level at exactly the expected share, half with the noise first; bias moves the shares apart."""
    choices = []
    for level, first in itertools.product(range(LEVELS), (False, True)):
        x = 4.0 + 0.5 * level
        d = ndtri(p_correct(x, t, spread))
        correct = round(EACH / 2 * ndtr(d + bias if first else d - bias))
        choices += [Choice(x, first, i < correct) for i in range(EACH // 2)]
    return choices


def test_curves_come_back():
    """a curve comes back"""
    for t, spread, bias in ((7.0, 0.5, 0.0), (6.3, 0.33, 0.0), (8.1, 0.75, 0.0), (7.0, 0.5, 0.8), (7.0, 0.5, -0.4)):
        (e,) = estimate([Curve(expected_choices(t, spread, bias), 4, 10)])
        near(e.t, t, 0.12)
        assert e.lo < t < e.hi and e.hi - e.lo < 0.8 and e.trials == LEVELS * EACH
        near(math.log2(e.spread / spread), 0.0, 0.7)


def test_blocks_help():
    """blocks help each other"""
    whole = expected_choices(7.0, 0.33, 0.8)
    curves = [Curve(whole[i::17], 4, 10) for i in range(9)]
    (alone,), together = estimate(curves[:1]), estimate(curves)
    assert together[0].hi - together[0].lo < alone.hi - alone.lo


def test_joint_posterior():
    """estimates are those of the joint posterior, summed here one product at a time"""
    spreads, lapses, biases = [0.15, 0.22, 0.33, 0.5, 0.75, 1.1, 1.6], [0.0, 0.03, 0.08, 0.2], [-0.8, -0.4, 0.0, 0.4, 0.8]
    of_spread, of_lapse, of_bias = [0.05, 0.1, 0.2, 0.3, 0.2, 0.1, 0.05], [0.4, 0.4, 0.15, 0.05], [0.06, 0.24, 0.4, 0.24, 0.06]
    grid, curves = [2 + i / 12 for i in range(121)], []
    for b, t in enumerate((5.5, 7.0, 8.2)):  # around the threshold, with slips
        xs = [t - 1.5 + 0.25 * i for i in range(14)]
        curves.append(Curve([Choice(x, (i + b) % 2 == 1, x < t + (0.9 if i % 3 == b else -0.4) or i % 5 == 0) for i, x in enumerate(xs)], 4, 10))
    habits = list(itertools.product(range(5), range(4)))

    def likelihood(curve, t, spread, bias, lapse):
        product = 1.0
        for c in curve.choices:
            d = ndtri(0.5 + 0.5 * ndtr((t - c.x) / spread))
            p = min(0.5 * lapse + (1 - lapse) * ndtr(d + bias if c.first else d - bias), 1 - 1e-9)
            product *= p if c.correct else 1 - p
        return product
    table = np.array([[[[likelihood(c, t, s, biases[b], lapses[k]) for b, k in habits] for s in spreads] for t in grid] for c in curves])
    given = np.array([[0.8 if own == s else 0.2 / (1 if s in (0, 6) else 2) if abs(own - s) == 1 else 0 for s in range(7)] for own in range(7)])
    evidence = np.einsum("os,ctoh->csh", given, table)
    prior = np.array([[of_spread[s] * of_lapse[k] * of_bias[b] for b, k in habits] for s in range(7)])
    middles = [(math.log2(a) + math.log2(b)) / 2 for a, b in zip(spreads, spreads[1:])]
    edges = [2 * math.log2(spreads[0]) - middles[0], *middles, 2 * math.log2(spreads[-1]) - middles[-1]]

    def reached(weights, edges, q):
        below = 0.0
        for i, w in enumerate(weights / weights.sum()):
            if below + w >= q:
                return edges[i] + (edges[i + 1] - edges[i]) * (q - below) / w
            below += w
        return edges[-1]
    for b, e in enumerate(estimate(curves)):
        others = prior * np.prod(np.delete(evidence, b, 0), 0)
        joint = np.einsum("sh,os,toh->to", others, given, table[b])
        of_t, of_s = joint.sum(1), joint.sum(0)
        mean = np.average(grid, weights=of_t)
        near(e.se, math.sqrt(np.average((np.array(grid) - mean)**2, weights=of_t)), 1e-3)  # the product's d comes from a table
        for got, spread, q in ((e.t, e.spread, 0.5), (e.lo, e.spread_lo, 0.025), (e.hi, e.spread_hi, 0.975)):
            near(got, reached(of_t, [2 + (i - 0.5) / 12 for i in range(122)], q), 2e-3)
            near(math.log2(spread), reached(of_s, edges, q), 5e-3)


def test_slips():
    """slips in catch trials are lapses; guessing tells nothing"""
    slips = [Choice(PLAIN, i % 2 == 1, i < 3) for i in range(6)]
    (e,) = estimate([Curve(expected_choices(7.0, 0.5, 0.0) + slips, 4, 10)])
    near(e.t, 7.0, 0.25)
    near(e.spread, 0.5, 0.3)
    (e,) = estimate([Curve([Choice(4.0 + 0.5 * (i % LEVELS), i % 2 == 1, i // 2 % 2 == 1) for i in range(200)], 4, 10)])
    assert e.lo < 4.0  # below every level: nothing was ever seen


# --- people over one view, whose settings or judgements are given ---

VIEW = View("v", 32, 8, blocks=[Block(i, 8 * i, 0, 8 * i + 8, 8, [16, 1024]) for i in range(4)])


def people_of(settings=(), judgements=(), excluded=()):
    people = People.__new__(People)
    people.study = Study(ID, "adjustment", 7, views=[VIEW], conditions=["a"])
    people.cells, people.first = [Cell(VIEW, block) for block in VIEW.blocks], [0, 4]
    people.results = [Result(str(i), estimates={c: Estimate(2, t, 1.0, 2.0, 0.1, 0.5) for c, t in enumerate(own)}) for i, own in enumerate(settings)]
    people.results += [Result(str(i), judgements=list(own)) for i, own in enumerate(judgements)]
    for i in excluded:
        people.results[i].excluded = "because"
    return people


def test_thresholds():
    """thresholds are means over people that count"""
    settings = [[5, 6, 7, 11], [6, 7, 8, 9], [7, 8, 9, 12], [0, 0, 0, 0]]
    t = thresholds(people_of(settings, excluded=[3]))
    near(t[0].t, 6.0, 1e-12)
    near(t[0].hi - t[0].t, 4.3027 / math.sqrt(3.0), 1e-4)  # standard deviation 1, three people
    near(t[3].t, (10 + 9 + 10) / 3, 1e-12)  # none beyond the highest level, 2^10
    assert t[0].people == 3 and t[3].at_cap == 2 and t[0].trials == 6
    assert t[3].hi == math.inf and t[3].lo < t[3].t and t[3].censored() == "above" and t[0].censored() == ""
    t = thresholds(people_of(settings[:1]))
    assert (t[0].lo, t[0].hi) == (1.0, 2.0)  # one person: their own interval
    assert math.isnan(thresholds(people_of())[0].t)


def test_censored():
    """who sees noise at every level, or at none, has a threshold of which one end is not known"""
    seen = [Choice(4.0 + 0.5 * (i % LEVELS), i // 2 % 2 == 1, True) for i in range(60)]
    found = estimate([Curve(seen, 4, 10), Curve(expected_choices(7.0, 0.5, 0.0), 4, 10)])
    assert found[0].t > 10.0 and found[0].hi > 11.0  # up to the end of the prior, which says nothing
    for count in (1, 3):
        people = people_of([[6, 7, 8, 9]] * count)
        for r in people.results:
            r.estimates = {0: found[0], 1: found[1], 2: Estimate(2, 4.0, 4.0, 4.0, 0.0, 0.0), 3: Estimate(2, 3.0, 2.5, 5.0, 0.1, 0.5)}
        t = thresholds(people)
        assert (t[0].t, t[0].lo, t[0].hi, t[0].at_cap, t[0].censored()) == (10.0, min(found[0].lo, 10.0), math.inf, count, "above")
        assert t[1].censored() == "" and math.isfinite(t[1].hi)
        assert (t[2].t, t[2].lo, t[2].hi, t[2].at_floor, t[2].censored()) == (4.0, -math.inf, 4.0, count, "below")
        assert (t[3].t, t[3].lo, t[3].hi) == (4.0, -math.inf, 5.0)
    # one of three at the cap: the mean may be larger, Student's low end holds for what was seen
    t = thresholds(people_of([[9, 5, 5, 5], [9.5, 5, 5, 5], [10, 5, 5, 5]]))[0]
    near(t.lo, 9.5 - 4.3027 * 0.5 / math.sqrt(3.0), 1e-4)
    assert (t.t, t.hi, t.at_cap) == (9.5, math.inf, 1)
    # settings: any at the highest level might have gone on
    people = people_of([[5, 5, 5, 5]])
    people.results[0].set_to = [(0, 10.0), (0, 10.0), (1, 9.0), (1, 10.0), (2, 8.0), (2, 8.0), (3, 4.0), (3, 4.0)]
    people.estimate()
    t = thresholds(people)
    assert [x.censored() for x in t] == ["above", "above", "", "below"] and [x.t for x in t] == [10.0, 9.5, 8.0, 4.0]
    assert [x.at_cap for x in t] == [1, 0, 0, 0] and t[0].lo < 10.0 and t[3].hi > 4.0


def test_ceiling():
    """the noise ceiling is between people"""
    c = ceiling(people_of([[5, 6, 7, 8], [6, 7, 8, 9], [4, 5, 6, 7]]))
    assert (c.people, c.blocks) == (3, 4)
    near(c.pearson_lower, 1.0, 1e-12)
    near(c.spearman_upper, 1.0, 1e-12)
    near(c.median_abs_log2_lower, (0.0 + 1.5 + 1.5) / 3, 1e-12)  # against the mean of the other two
    near(c.median_abs_log2_upper, (0.0 + 1.0 + 1.0) / 3, 1e-12)
    near(c.within_one_lower, 1 / 3, 1e-12)
    near(ceiling(people_of([[5, 6, 7, 8], [8, 7, 6, 5]])).pearson_lower, -1.0, 1e-12)
    alone = ceiling(people_of([[5, 6, 7, 8]]))
    assert alone.people == 0 and math.isnan(alone.pearson_lower) and math.isnan(pearson(np.ones(3), np.arange(3.0)))


def test_judgements():
    """judgements are shares"""
    def own(same):  # always or never the same; the last is a catch trial
        return [Judgement(0, 0 if k < 4 else -1, same, 5 if same else 2) for k in range(5)]
    people = people_of(judgements=[own(1), own(0)])
    s = share(people, None, 0)
    assert (s.n, s.same, s.rating, share(people, 0, 0).share) == (8, 4, 3.5, 0.5)
    near(intraclass(people, 0), 1.0, 1e-12)  # all of the variance is between people
    people = people_of(judgements=[own(1), own(0)], excluded=[1])
    assert share(people, None, 0).n == 4 and math.isnan(intraclass(people, 0)) and share(people, 1, 0).n == 0
    mixed = [[Judgement(0, 0, k % 2, 3) for k in range(4)] for _ in range(2)]
    assert intraclass(people_of(judgements=mixed), 0) == 0.0  # none of it


def test_power():
    """power is the textbook formula"""
    assert people_needed(0.7, 0.1, 1, 0.0) == 354  # 7.849 · (0.21 + 0.24) / 0.01 = 353.2
    assert people_needed(0.7, 0.1, 10, 0.0) == 36
    assert people_needed(0.7, 0.1, 10, 1.0) == 354  # more of the same person tells nothing more
    assert people_needed(0.05, 0.1, 1, 0.0) == people_needed(0.15, 0.1, 1, 0.0)


def test_kinds():
    """a kind is held against the noisy picture of the same block, person by person"""
    people = people_of([[5, 6, 7, 9.5], [6, 7, 6.5, 8]])
    views = [View("v." + kind, 16, 8, kind, blocks=VIEW.blocks[:2]) for kind in ("noisy", "blend")]
    people.study.views, people.cells, people.first = views, [Cell(v, b) for v in views for b in v.blocks], [0, 2, 4]
    d = against_noisy(people, "blend")  # 2 and 3.5, 0.5 and 1: means 2.75 and 0.75
    assert (d.octaves, d.people, d.blocks) == (1.75, 2, 2)
    near(d.hi - d.octaves, 12.7062 * 1.0, 1e-4)
    assert against_noisy(people, "blend", 3).octaves == 2.25 and against_noisy(people, "denoised").people == 0
    for own, ends in (([5, 6, 7, 10], (False, True)), ([10, 6, 7, 9], (True, False)), ([5, 6, 4, 9], (True, False)), ([10, 6, 11, 9], (True, True))):
        people.results[0].estimates = {c: Estimate(2, t, 1.0, 2.0, 0.1, 0.5) for c, t in enumerate(own)}
        d = against_noisy(people, "blend")  # what is above the levels may differ by more, or by less where the noisy one is
        assert (math.isinf(d.lo), math.isinf(d.hi)) == ends, (own, d)


# --- people with plans and answers ---

TRIALS, MIN_MS = 40, 200
STEPS = [16 << k for k in range(9)]  # 2^4 … 2^12


def study_of(task, **changed):
    blocks = [Block(i, 10 * i, 0, 10 * i + 10, 10, STEPS) for i in range(2)]
    return Study(ID, task, 7, trials=TRIALS, repeats=10, show_ms=700, min_ms=MIN_MS, max_fast=0.1, conditions=["a", "b"],
                 views=[View("v", 20, 10, blocks=[] if task == "validation" else blocks)], **changed)


def people_who(study, *answers):
    """Each answers the whole plan so: answers(slot, i, k) -> members of a trial; the k-th of its block."""
    store = open_store()
    for number, answer in enumerate(answers):
        seed = person_seed(study, number)
        with store.changing():
            row = store.add_person(Person(0, f"{number:08x}", f"{number:032x}", seed, "2024-01-01T00:00:00Z"))
        trials, of_block = [], [0, 0]
        for i, slot in enumerate(make_plan(study, seed)):
            told = {"level": 0, "answer": 0, "rating": 0, "ms": 1000.0, **answer(slot, i, of_block[slot.block])}
            trials.append(Trial(i, 0, **told, at=f"2024-01-01T00:{i // 60:02d}:{i % 60:02d}Z"))
            of_block[slot.block] += 1
        add_trials(store, row, *trials)
    people = People(study, store)
    people.estimate()
    return people


def right(slot, _, k):
    return {"level": 0 if slot.catch else STEPS[k % 9], "answer": slot.side + 1}


def wrong(slot, i, k):
    return {**right(slot, i, k), "answer": 2 - slot.side}


def by_sight(slot, i, k):
    """Sees the noise below 2^8 samples and nothing above: there, and for 256 itself, says "first" whatever is shown."""
    told = right(slot, i, k)
    return told if told["level"] < 256 else {**told, "answer": 1}


def test_right_answers():
    """an answer is right when it names the noisy interval"""
    people = people_who(study_of("2ifc"), right, wrong, by_sight)
    for r, correct in zip(people.results, (2 * TRIALS, 0, None)):
        choices = [Choice(*choice) for _, choice in r.choices]
        assert (len(choices), sum(c.x == PLAIN for c in choices), r.catch_total) == (2 * TRIALS, 2 * TRIALS // 10, 2 * TRIALS // 10)
        assert sum(c.first for c in choices) == TRIALS and correct in (None, sum(c.correct for c in choices))  # half of all, by the plan
    sure, never, sees = people.results
    assert sure.catch_passed == sure.catch_total and not sure.excluded and never.excluded == "0 of 8 catch trials passed" and not sees.excluded
    for _, (x, first, correct) in sees.choices:
        assert correct == (x < 8.0 or first)  # blind answers are right when the noise came first
    for b in (0, 1):
        assert sure.estimates[b].t > 12.0 and never.estimates[b].t < 4.0  # seen at every level; never better than guessing
        near(sees.estimates[b].t, 7.5, 0.6)  # between the last that is seen, 2^7, and the first that is not


def judge(slot, *_):
    same = slot.catch == CATCH_IDENTICAL or (not slot.catch and slot.condition == 0)
    return {"answer": int(same), "rating": 5 if same else 2}


def test_catch_trials():
    """catch trials of a validation have two sides"""
    people = people_who(study_of("validation"), judge, lambda *a: {**judge(*a), "answer": 1})
    assert [(r.catch_total, r.catch_passed) for r in people.results] == [(2, 2), (2, 1)]
    assert people.results[1].excluded == "1 of 2 catch trials passed"
    assert all(j.same == (j.condition == 0) and j.rating == (5 if j.same else 2) for j in people.results[0].judgements if j.condition >= 0)


def hurry(fast):
    """So many of the first answers are too fast, by a hair, and wrong: one that entered an estimate would be seen in it."""
    def answer(slot, i, k):
        told = right(slot, i, k)
        return {**told, "ms": MIN_MS - 0.5 if i < fast else MIN_MS, "answer": 3 - told["answer"] if i < fast and not slot.catch else told["answer"]}
    return answer


def test_fast_answers():
    """fast answers are counted and left out; more than a tenth, and a person does not count"""
    people = people_who(study_of("2ifc"), hurry(0), hurry(8), hurry(9))
    for r, fast in zip(people.results, (0, 8, 9)):
        assert (r.fast, r.done, len(r.choices), r.catch_total) == (fast, 80, 80 - fast, 8) and all(c[2] for _, c in r.choices)
        assert r.median_s == MIN_MS / 1000 and r.last == "2024-01-01T00:01:19Z"
    assert [r.excluded for r in people.results] == ["", "", "9 of 80 answers in less than 200 ms"]
    setting = people_who(study_of("adjustment"), lambda slot, i, k: {
        "level": 4096 if i == 0 else 512 if slot.block else 64, "ms": 1.0 if i == 0 else 2000.0}).results[0]  # the first is of another world
    assert [setting.estimates[b].t for b in (0, 1)] == [6.0, 9.0] and sum(e.trials for e in setting.estimates.values()) == 19
    assert (setting.fast, setting.settings, setting.excluded) == (1, 20, "")
    strict = study_of("validation")
    strict.min_ms = 1000.5
    r = people_who(strict, judge).results[0]
    assert (len(r.judgements), r.fast, r.catch_total, r.excluded) == (0, 22, 2, "22 of 22 answers in less than 1000.5 ms")
    old = {k: v for k, v in members(study_of("2ifc")).items() if k not in ("min_ms", "max_fast", "asked_by", "contact")}
    r = people_who(parse("test", json.dumps(old)), hurry(80)).results[0]  # a study without the rule keeps every answer
    assert (r.fast, len(r.choices), r.excluded) == (0, 80, "")


def test_status():
    """the status has a line for everybody"""
    out, study = io.StringIO(), study_of("2ifc")
    print_status(out, people_who(study))
    people = people_who(study, right, hurry(9))
    people.results[0].done = 12  # as if they had gone away
    print_status(out, people)
    assert out.getvalue() == (
        "2ifc: 0 people, 0 finished, 0 under way, 0 without an answer\n"
        "2ifc: 2 people, 1 finished, 1 under way, 0 without an answer; last answer 2024-01-01T00:01:19Z\n"
        "person          done    catch  median s  fast  minutes  last answer\n"
        "00000000       12/80      8/8       1.0     0      1.3  2024-01-01T00:01:19Z\n"
        "00000001       80/80      8/8       0.2     9      0.3  2024-01-01T00:01:19Z"
        "  does not count: 9 of 80 answers in less than 200 ms\n"), out.getvalue()


def test_report_of_c():
    """the report of a data base of the program in C has the figures that it had there, but for one threshold below the levels, which is
    censored now; Student's quantile had four decimals"""
    made = "tests/data/study-of-c"
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(os.path.join(made, "study.db"), folder)
        with open(os.path.join(made, "study.json")) as file:
            study = parse("study.json", file.read())
        with Store(folder, study.id) as store:
            write_report(os.path.join(folder, "report"), People(study, store), pictures=False)
        for name in ("people.csv", "estimates.csv", "blocks.csv", "thresholds.csv"):
            with open(os.path.join(folder, "report", name)) as ours, open(os.path.join(made, "report", name)) as theirs:
                was = theirs.read()
                if name == "blocks.csv":
                    was = was.replace("at_cap\n", "at_cap;at_floor\n").replace(";0\n", ";0;0\n")
                was = was.replace(";14.06;4.14;60.31;1.1494;", ";16.00;0.00;60.31;nan;")
                for a, b in itertools.zip_longest(ours.read().split("\n"), was.split("\n")):
                    for x, y in itertools.zip_longest(a.split(";"), b.split(";")):
                        assert x == y or abs(float(x) - float(y)) <= 0.01 + 2e-5 * abs(float(y)), (name, a, b)


def test_pictures():
    """what is drawn is what the tables say"""
    people = people_of([[5, 6, 7, 8], [6, 7, 8, 9]])
    t = thresholds(people)
    line = thresholds_figure(people, t).axes[0].containers[0].lines[0]
    assert np.allclose(line.get_xydata(), [(c, 2.0**t[c].t) for c in range(4)])
    arrows = thresholds_figure(people, thresholds(people_of(2 * [[4, 6, 7, 10]]))).axes[0].lines[-2:]
    assert [line.get_xydata().tolist() for line in arrows] == [[[0, 16.0]], [[3, 1024.0]]]
    lines = people_figure(people, t).axes[0].lines
    assert np.allclose(lines[1].get_xydata(), [(2.0**t[c].t, 2.0**(6 + c)) for c in range(4)])
    seen = people_who(study_of("2ifc"), right, by_sight)
    axes = curves_figure(seen, thresholds(seen)).axes
    shares = dict(axes[0].collections[0].get_offsets())
    assert len(axes) == 2 and shares[16.0] == shares[128.0] == 1.0 and 0.5 <= shares[4096.0] < 1.0
    near(np.interp(2.0**thresholds(seen)[0].t, *axes[0].lines[0].get_data()), 0.75, 0.05)  # three in four
    judged = people_who(study_of("validation"), judge)
    axes = shares_figure(judged).axes[0]
    assert [list(c.lines[0].get_ydata()) for c in axes.containers] == [[100, 100], [0, 0]]
    assert [x.get_text() for x in axes.get_xticklabels()] == ["v", "(all)"]


tap.main(globals())
