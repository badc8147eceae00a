#!/bin/sh
# Pages lead somewhere: every relative link of every page, with its section; every file that docs/tour.md names, and in it the functions
# that the step names; the index of docs/ is whole; the manual's pages are short; tables have rows.
. "$(dirname "$0")/ggn_setup"
command -v git >"$tmp/out" && git rev-parse -q --git-dir >"$tmp/out" 2>&1 || { echo "ok 1 # SKIP no repository"; echo "1..1"; exit 0; }
cat >"$tmp/pages.py" <<'END'
import os, re, subprocess, sys
FILES = subprocess.check_output(["git", "ls-files"], text=True).split()
def sections(path):
    heads = re.findall(r"^#+ (.*)$", open(path, encoding="utf-8").read(), re.M)
    return {re.sub(r"[^\w\- ]", "", h.strip().lower()).replace(" ", "-") for h in heads}
def links():
    for page in (f for f in FILES if f.endswith(".md") and "/templates/" not in f):
        text = re.sub(r"```.*?```", "", open(page, encoding="utf-8").read(), flags=re.S)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            path, _, section = target.partition("#")
            to = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
            if "://" not in target and (not os.path.exists(to) or section and section not in sections(to)):
                yield f"{page}: {target}"
def steps():
    for row in open("docs/tour.md", encoding="utf-8"):
        names = re.findall(r"`([^`]+)`", row.rsplit("|", 2)[-2]) if re.match(r"\| \d", row) else []
        found = [[f for f in FILES if ("/" + f).endswith("/" + n)] for n in names if "." in n]
        text = "".join(open(f, encoding="utf-8").read() for fs in found for f in fs)
        missing = [n for n in names if "." in n and not [f for f in FILES if ("/" + f).endswith("/" + n)]]
        missing += [n for n in names if "." not in n and not re.search(rf"\b{n}\b", text)]
        yield from (f"docs/tour.md: {row.split('|')[1].strip()}: {n}" for n in missing)
def index():
    listed = re.findall(r"\]\(([^)\s]+)\)", open("docs/README.md", encoding="utf-8").read())
    listed += re.findall(r"\]\(([^)\s]+)\)", open("docs/results.md", encoding="utf-8").read())
    yield from (f for f in FILES if re.fullmatch(r"docs/(results/)?[^/]+\.md", f) and f != "docs/README.md" and f[5:] not in listed)
def length():
    for f in FILES:
        if re.fullmatch(r"docs/[^/]+\.md", f) and len(open(f, encoding="utf-8").readlines()) > 120:
            yield f"{f}: more than 120 lines: what was measured belongs to docs/results/"
def tables():
    for f in (f for f in FILES if f.endswith(".md") and "/templates/" not in f):
        rows = open(f, encoding="utf-8").read().split("\n")
        yield from (f"{f}:{i + 1}: a table without rows" for i, row in enumerate(rows[:-1]) if re.fullmatch(r"\|(-+\|)+", row) and rows[i + 1][:1] != "|")
bad = list({"tables": tables, "links": links, "tour": steps, "index": index, "length": length}[sys.argv[1]]())
print("\n".join(bad))
sys.exit(bool(bad))
END
python3 "$tmp/pages.py" links >"$tmp/out" 2>"$tmp/err"
check "every link of a page leads to a file and a section" $?
python3 "$tmp/pages.py" tour >"$tmp/out" 2>"$tmp/err"
check "every file and function of the tour is there" $?
python3 "$tmp/pages.py" index >"$tmp/out" 2>"$tmp/err"
check "docs/README.md and docs/results.md list every page of docs/" $?
python3 "$tmp/pages.py" length >"$tmp/out" 2>"$tmp/err"
check "no page of the manual is longer than 120 lines" $?
python3 "$tmp/pages.py" tables >"$tmp/out" 2>"$tmp/err"
check "no table of a page is without rows" $?
echo "1..$n"
exit $bad
