# SPDX-License-Identifier: MIT
"""`lull-study VERB DIR`: thresholds and judgements from people, on a page served from this machine. numpy, scipy, matplotlib
and aiohttp take their time: each verb imports what it needs."""
from __future__ import annotations

import os
import sys
from typing import Any, Callable, Sequence

from ..program import run
from . import prepare
from .definition import MAX_VIEWS, read_study
from .files import Refused, check_output, protect
from .options import Command, Option, parse
from .store import Store

Work = Callable[[Sequence[str], dict[str, Any]], None]  # arguments, options
VERBS: dict[str, tuple[Work, str, Command]] = {}


def _verb(name: str, arguments: str, short: str, doc: str, *options: Option, most: int = 0) -> Callable[[Work], Work]:
    n = 2 if arguments in ("DIR FILE", "DIR PERSON") else 1

    def register(work: Work) -> Work:
        VERBS[name] = work, short, Command("lull-study " + name, arguments, n, most or n, doc, options)
        return work
    return register


def _page() -> str:
    """The folder of the page: the one that is named, or the one of this program."""
    named = os.environ.get("LULL_STUDY_PAGE")
    if named and not os.path.exists(os.path.join(named, "index.html")):
        raise Refused(f"LULL_STUDY_PAGE={named[:200]}: no index.html in it")
    return named or os.path.join(os.path.dirname(os.path.abspath(__file__)), "page")


@_verb("init", "DIR --task TASK --views FOLDER...", "make a study from recorded sequences or pictures",
       "Makes the study DIR: study.json, the pictures it shows, and texts.json, what the page says (edit or translate it).",
       *prepare.OPTIONS, most=1 + MAX_VIEWS)
def _init(words: Sequence[str], o: dict[str, Any]) -> None:
    o["views"] = [*o.get("views", []), *words[1:]]
    if len(o["views"]) > MAX_VIEWS:
        raise Refused(f"at most {MAX_VIEWS} views")
    prepare.prepare(words[0], _page(), o)


@_verb("serve", "DIR", "serve its page on this machine",
       "Serves the study until interrupted and prints its link. However the server ends, no trial that it acknowledged is "
       "lost; a power cut may take those of the last moment, which are asked again.",
       Option("listen", "ADDRESS[:PORT]", "where to listen, in numbers (127.0.0.1:8737; port 0: any). Beyond this machine "
              "the link has a token", letter="l"))
def _serve(words: Sequence[str], o: dict[str, Any]) -> None:
    from .server import serve
    serve(words[0], _page(), o.get("listen", "127.0.0.1"))


@_verb("status", "DIR", "who takes part, how far, how quickly",
       "Who takes part, how far everybody is, how many catch trials they passed, how quickly they answer, and who would not "
       "count in a report made now. The study may be served at the same time.")
def _status(words: Sequence[str], _: dict[str, Any]) -> None:
    from .people import People, print_status
    study = read_study(words[0])
    with Store(words[0], study.id) as store:
        print_status(sys.stdout, People(study, store))


@_verb("report", "DIR", "thresholds, agreement, judgements: CSV, JSON, pictures",
       "Thresholds with intervals (thresholds.csv is what `ggn label --human` and `ggn compare` read), who counts and why "
       "not, how well people agree; or shares of judgements with intervals, and how many people a difference of 10 % takes.",
       Option("output", "FOLDER", "where the report goes (DIR/report)", letter="o"),
       Option("no-pictures", "", "tables only", letter="n"))
def _report(words: Sequence[str], o: dict[str, Any]) -> None:
    from .people import People
    from .report import write_report
    study, out = read_study(words[0]), o.get("output", os.path.join(words[0], "report"))
    with Store(words[0], study.id) as store:
        protect(words[0], os.path.join(out, "people.csv"))
        write_report(out, People(study, store), "no_pictures" not in o)


@_verb("export", "DIR -o FILE", "all raw trials",
       "Writes all raw trials and what people told of themselves to one JSON file.",
       Option("output", "FILE", "the file to write (required)", letter="o"))
def _export(words: Sequence[str], o: dict[str, Any]) -> None:
    from .transfer import export_trials
    if "output" not in o:
        raise Refused("--output FILE is needed (--help says more)")
    check_output(o["output"])
    study = read_study(words[0])
    with Store(words[0], study.id) as store:
        protect(words[0], o["output"])
        print(f"{o['output']}: {export_trials(study, store, o['output'])} people")


@_verb("import", "DIR FILE", "raw trials of the same study",
       "Adds everybody of an exported file to a copy of the same study: all of them or, if anything is amiss, nobody.")
def _import(words: Sequence[str], _: dict[str, Any]) -> None:
    from .transfer import import_trials
    study = read_study(words[0])
    with Store(words[0], study.id, create=True) as store:
        print(f"{words[0]}: {import_trials(study, store, words[1])} people imported")


@_verb("delete", "DIR PERSON", "one participant and their trials",
       "Deletes a person, by the code that the page showed them, and all their trials. Exported files and reports made "
       "before still hold them.")
def _delete(words: Sequence[str], _: dict[str, Any]) -> None:
    study = read_study(words[0])
    with Store(words[0], study.id) as store:
        person = store.find(id=words[1])
        if not person:
            raise Refused(f"{words[0]}: nobody has the code {words[1][:32]}")
        store.delete(person.row)
    print(f"{words[0]}: {person.id} and all their trials are deleted; make the report again")


def _run(arguments: Sequence[str]) -> None:
    if arguments and arguments[0] in VERBS:
        work, _, command = VERBS[arguments[0]]
        work(*parse(command, arguments[1:]))
        return
    if arguments and not arguments[0].startswith("-"):
        raise Refused(f"{arguments[0][:64]}: unknown verb (lull-study --help lists them)")
    after = "Verbs:\n" + "".join(f"  {name:8} {short}\n" for name, (_, short, _) in VERBS.items())
    parse(Command("lull-study", "VERB DIR [OPTION...]", 0, 0, "Asks people, on a page that this machine serves: from how "
                  "many samples on a block looks converged, or whether a reconstructed picture looks the same as its "
                  "reference.",
                  after=after + "\n`lull-study VERB --help` says more."), arguments)
    raise Refused("a verb is needed (lull-study --help lists them)")


def main() -> int:
    """The exit status: 0 done, 1 out of memory, 2 bad usage, bad input, or an output could not be written."""
    arguments = sys.argv[1:]
    verb = f" {arguments[0]}" if arguments and arguments[0] in VERBS else ""
    return run("lull-study" + verb, lambda: _run(arguments), "apt-get install python3-aiohttp python3-scipy python3-matplotlib, "
                  "or pip install 'lull[study]'")
