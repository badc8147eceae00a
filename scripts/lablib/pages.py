"""Fills the pages of docs/ from the figures in docs/results/.

scripts/lablib/templates/NAME.md makes the whole page NAME.md, where that or its figures (results/NAME.json) are. In every other page, what stands
between `<!-- lab: EXPRESSION -->` and `<!-- lab: end -->` is the value of the expression (`bench.page()`: the text that the job bench
makes of its figures). Over the first table of a job whose figures are older than what they depend on (lablib/sources.py) stands a line
that says so."""
import glob
import os
import re
import sys

from lablib import (agreement, ablation, artists, bench, cost_page, denoised, full_size, kept, paper, peers, profile, published, quote_accuracy,
                    references, scale, shots, sources, tool, truth)

TEMPLATES = os.path.join(tool.ROOT, "scripts", "lablib", "templates")
OTHERS = ("ggn/README.md", "ggn/models/README.md", "ggn/sight/README.md")  # pages outside docs/ that show figures
RESULTS = ("results.md", "results/decisions.md")
FIGURES = {"agreement": agreement, "ablation": ablation, "bench": bench, "cost": cost_page, "quote": quote_accuracy, "references": references,
           "profile": profile, "scale": scale, "denoised": denoised, "kept": kept, "full_size": full_size, "paper": paper, "peers": peers,
           "artists": artists, "shots": shots, "published": published, "truth": truth}  # results/NAME.json: who makes text of it
PLACE = re.compile(r"(<!-- lab: (?!end -->)(.*?) -->\n).*?(<!-- lab: end -->)", re.S)


def options(parser):
    parser.add_argument("--check", action="store_true", help="write nothing; say, one line each, what is not what the templates make of "
                        "the figures, and which figures of the tables stand in README.md by hand")
    parser.add_argument("--stale", action="store_true", help="write nothing; list figures that were measured before a file that they depend "
                        "on changed, and end with 1 if there are any")
    parser.add_argument("--docs", type=tool.path, default=tool.DOCS, help="pages and figures (docs)")


class Job:
    """What templates see of a job: its figures as `results`, and its functions of them. stale: what stands over the first of its tables
    on a page."""

    def __init__(self, module, results, stale):
        self.module, self.results, self.stale, self.said = module, results, stale, False

    def __getattr__(self, name):
        def of_figures(*more, **named):
            text = getattr(self.module, name)(self.results, *more, **named)
            if self.stale and not self.said and isinstance(text, str) and re.search(r"^\|", text, re.M):
                self.said, text = True, "%s\n\n%s" % (self.stale, text)
            return text
        return of_figures


def made(docs):
    """[(path of a page, its text as the templates make it)]"""
    try:
        import jinja2
    except ImportError:
        raise tool.Refused("jinja2 is missing: apt-get install python3-jinja2") from None
    env = jinja2.Environment(loader=jinja2.FileSystemLoader(TEMPLATES), trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
                             undefined=jinja2.StrictUndefined)
    stale = {name: sources.stale(docs, name, module.SOURCES) for name, module in FIGURES.items()}

    def jobs():  # anew for each page
        return {name: Job(module, tool.results(docs, name), stale[name]) for name, module in FIGURES.items()}

    def of_figures(name, make):
        try:
            return make()
        except (jinja2.TemplateError, LookupError, TypeError, AttributeError, StopIteration) as why:
            raise tool.Refused("%s: its figures are not whole (%r)" % (name, why)) from why

    def filled(text):
        seen = jobs()
        return PLACE.sub(lambda found: found[1] + env.compile_expression(found[2], undefined_to_none=False)(**seen) + found[3], text)

    pages = []
    for name in sorted(glob.glob(os.path.join(docs, "**", "*.md"), recursive=True)) + [os.path.join(docs, "..", other) for other in OTHERS]:
        if os.path.exists(name):
            with open(name, encoding="utf-8") as file:
                text = file.read()
            pages.append((name, of_figures(name, lambda: filled(text))))
    whole = {name: env.get_template(name) for name in sorted(env.list_templates())}
    return pages + [(os.path.join(docs, name), of_figures(name, lambda: template.render(jobs()))) for name, template in whole.items()
                    if any(os.path.exists(os.path.join(docs, *there)) for there in ((name,), ("results", os.path.basename(name)[:-3] + ".json")))]


def fill(docs):
    for name, text in made(docs):
        with open(name + ".tmp", "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(name + ".tmp", name)


def by_hand(docs):
    """Figures of the tables of RESULTS that README.md tells too; defaults of options are no such figures."""
    decimals = lambda text: re.findall(r"(?<![\w.`-])\d+\.\d\d+(?![\w.])", text)
    figures = set()
    for page in RESULTS:
        with open(os.path.join(docs, page), encoding="utf-8") as file:
            figures |= {x for line in file if line.startswith("| ") for x in decimals(line)}
    with open(os.path.join(docs, "..", "README.md"), encoding="utf-8") as file:
        text = re.sub(r"```.*?```|`[^`]*`", "", file.read(), flags=re.S)
    return sorted(figures & set(decimals(text)))


def without_age(text):
    """A page without what it says of its age: that is other after each commit, and `--stale` asks for it."""
    return re.sub(sources.SENTENCE + r"\n\n", "", text)


def main(o):
    if o.stale:
        found = [(name, sources.stale(o.docs, name, module.SOURCES)) for name, module in FIGURES.items()]
        print("".join("%s: %s\n" % (name, why.strip("*")) for name, why in found if why), end="")
        return 1 if any(why for _, why in found) else 0
    if not o.check:
        return fill(o.docs)
    wrong = []
    for name, text in made(o.docs):
        with open(name, encoding="utf-8") as file:
            if without_age(file.read()) != without_age(text):
                wrong.append("%s is not what its template makes of the figures: scripts/lab pages" % os.path.relpath(name, tool.ROOT))
    wrong += ["README.md tells %s, a figure of docs/results.md or docs/results/decisions.md" % x for x in by_hand(o.docs)]
    print("".join("lab pages: %s\n" % line for line in wrong), end="", file=sys.stderr)
    return 1 if wrong else 0
