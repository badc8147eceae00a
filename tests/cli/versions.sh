#!/bin/sh
# Each version stands in one header, and whatever else says one says the same: product, ABI of criteria, host library.
. "$(dirname "$0")/tap_setup"
bin=${BUILD:-build}/bin
number() { # number NAME FILE
    sed -n "s/^#define $1_MAJOR \([0-9]*\).*/\1/p; s/^#define $1_MINOR \([0-9]*\).*/\1/p" "plugin-api/include/lull/$2" | paste -sd.
}
product=$(sed -n 's/^#define BASE_VERSION "\(.*\)"$/\1/p' plugin-api/base/version.h)
abi=$(number LULL_API criterion.h) host=$(number LULL_HOST host.h)
same() { [ "$1" = "$2" ] || { echo "'$1', expected '$2'"; return 1; }; }
first() { "$@" 2>&1 | sed 1q; }

t "the product has three numbers, the ABI and the host library two" sh -c "echo '$product $abi $host' |
    grep -Eqx '[0-9]+([.][0-9]+){2}( [0-9]+[.][0-9]+){2}'"
# What is made from them
files="lull-host.pc lull-criterion.pc lull-config.cmake lull-config-version.cmake"
# shellcheck disable=SC2046
t "make writes what pkg-config and CMake read" make -s OUT="$tmp" $(for f in $files; do echo "$tmp/$f"; done)
t "pkg-config lull-host" same "$(sed -n 's/^Version: //p' "$tmp/lull-host.pc")" "$host"
t "pkg-config lull-criterion" same "$(sed -n 's/^Version: //p' "$tmp/lull-criterion.pc")" "$abi"
t "CMake's find_package(lull): the host library" same "$(sed -n 's/^set(PACKAGE_VERSION \(.*\))/\1/p' "$tmp/lull-config-version.cmake")" "$host"
t "  …lull_CRITERION_VERSION" same "$(sed -n 's/^set(lull_CRITERION_VERSION \(.*\))/\1/p' "$tmp/lull-config.cmake")" "$abi"
t "  …and no file has a gap" sh -c "cd $tmp && ! grep -n '@[A-Z_]*@' $files"
for program in lull-render ggn lull-check lull-report lull-plot lull-study; do
    t "$program --version" same "$(first "$bin/$program" --version)" "$program (Lull) $product"
done
t "lull-denoiser-setup --version" same "$(first scripts/packages/lull-denoiser-setup --version)" "lull-denoiser-setup (Lull) $product"
t "Python" same "$(python3 -c 'import runpy; print(runpy.run_path("plugin-api/python/lull/version.py")["PRODUCT"])')" "$product"
t "  …the package and pyproject.toml have no number of their own" sh -c \
    '! grep -nE "^(__version__|version) = \"" plugin-api/python/lull/__init__.py plugin-api/python/pyproject.toml'
# What must be a text of its own
t "Blender's add-on" same "$(sed -n 's/^bl_info = .*"version": (\([0-9, ]*\)).*/\1/p' plugin-api/python/lull/__init__.py | sed 's/, /./g')" "$product"
t "debian/changelog" same "$(sed -n '1s/^lull (\(.*\)) .*/\1/p' debian/changelog)" "$product"
t "man pages (make man)" sh -c "! grep -HE '^[.]TH ' docs/man/*.[17] | grep -vF '\"Lull $product\"'"
cat >"$tmp/pages.py" <<'END'
"""Prints every version on a page, in a header or in a source that is not the one it speaks of."""
import pathlib, re, sys

product, abi, host = sys.argv[1:]
WORDS = ((r"\b[Ll]ull(?:-[a-z]+)?(?: for Python| \(Lull\))?[ -](\d+(?:\.\d+)+)", product), (r"find_package\(lull[ ](\d+(?:\.\d+)+)", host),
         (r"(?:criterion\.h` \| the ABI|frozen at|between the two), version (\d+\.\d+)", abi), (r"\(the ABI\) is frozen at (\d+\.\d+)", abi))
api = pathlib.Path("plugin-api")
files = [pathlib.Path("README.md"), *pathlib.Path("docs").rglob("*.md"), *pathlib.Path("scripts/packages").glob("*"), *pathlib.Path("ggn").glob("*.md"),
         *(f for end in ("md", "h", "c", "in", "py") for part in (api, pathlib.Path("pathtracer")) for f in part.rglob(f"*.{end}"))]
wrong, seen = [], {words: 0 for words, _ in WORDS}
for file in filter(pathlib.Path.is_file, files):
    text = file.read_text(encoding="utf-8")
    for words, wanted in WORDS:
        for found in re.finditer(words, text):
            if words is WORDS[0][0] and text[:found.start()].endswith("find_package("):
                continue
            seen[words] += 1
            wrong += [f"{file}: {found[0]!r}, expected {wanted}"] if found[1] != wanted else []
wrong += [f"no page has {words}" for words, count in seen.items() if not count]
changes = re.split(r"^# ", (api / "CHANGES.md").read_text(encoding="utf-8"), flags=re.M)
for title, wanted, headers in (("Versions of the ABI", abi, ["criterion.h"]), ("Versions of the host library", host, ["host.h", "host_draft.h"])):
    said = re.findall(r"^## (\S+)", next(part for part in changes if part.startswith(title)), re.M)
    wrong += [f"CHANGES.md, {title}: the newest is {said[0]}, expected {wanted}"] if said[0] != wanted else []
    for name in headers:
        wrong += [f"{name}: {found[0]!r}, but CHANGES.md has {', '.join(said)}" for found in
                  re.finditer(r"\b[Ss]ince (\d+\.\d+)", (api / "include/lull" / name).read_text(encoding="utf-8")) if found[1] not in said]
print("\n".join(wrong))
sys.exit(bool(wrong))
END
t "pages, sources, \"since\" in headers, CHANGES.md" python3 "$tmp/pages.py" "$product" "$abi" "$host"
echo "1..$n"
