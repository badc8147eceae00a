#!/bin/sh
# The ABI's header is clean C99 and C++11 with every compiler there is, has no padding, needs only stddef.h and stdint.h, and
# makes a working criterion with nothing else; the version script leaves one symbol. The kit is clean C99 and C++11 too.
. "$(dirname "$0")/tap_setup"
header=plugin-api/include/lull/criterion.h
flags="-Wall -Wextra -Wpedantic -Wshadow -Wundef -Werror -fsyntax-only"
for cc in gcc clang; do
    command -v $cc >/dev/null 2>&1 || continue
    # shellcheck disable=SC2086
    t "$cc, C99, no padding" $cc -std=c99 $flags -Wpadded -xc $header
    # shellcheck disable=SC2086
    t "$cc, C99 without a C library" $cc -std=c99 -ffreestanding -nostdinc -isystem "$($cc -print-file-name=include)" $flags -xc $header
done
for cxx in g++ clang++; do
    command -v $cxx >/dev/null 2>&1 || continue
    # shellcheck disable=SC2086
    t "$cxx, C++11, no padding" $cxx -std=c++11 $flags -Wold-style-cast -Wpadded -xc++ $header
done
echo '#include <lull/criterion_kit.h>' >"$tmp/kit.h"
for cc in gcc clang; do
    command -v $cc >/dev/null 2>&1 || continue
    # shellcheck disable=SC2086
    t "the kit: $cc, C99" $cc -std=c99 $flags -Wconversion -Iplugin-api/include -xc "$tmp/kit.h"
done
for cxx in g++ clang++; do
    command -v $cxx >/dev/null 2>&1 || continue
    # shellcheck disable=SC2086
    t "the kit: $cxx, C++11" $cxx -std=c++11 $flags -Wconversion -Iplugin-api/include -xc++ "$tmp/kit.h"
done
t "includes stddef.h and stdint.h only" sh -c "[ \"\$(grep -c '^#include' $header)\" = 2 ]"
t "declares one function" sh -c "[ \"\$(grep -c '^LULL_EXPORT' $header)\" = 1 ]"
t "null.c builds as its comment says" sh -c "\${CC:-cc} -shared -fPIC -fvisibility=hidden -Wl,--version-script=plugin-api/plugin.map \
    -Iplugin-api/include plugin-api/examples/null.c -o $tmp/null.so -lm && nm -D --defined-only $tmp/null.so | awk '\$2 != \"A\"' | \
    awk 'END { exit !(NR == 1 && \$3 == \"lull_criterion_entry_v1\") }'"
t "and keeps the contract" "${BUILD:-build}/bin/lull-check" -q "$tmp/null.so"
# a criterion in C++ against the same header
cat >"$tmp/cxx.cc" <<'CXX'
#include <lull/criterion.h>
struct lull_instance { int unused; };
static int32_t create(const lull_host *, const lull_pair *, uint32_t, uint32_t, lull_instance **i, lull_error *)
{ static lull_instance one; *i = &one; return LULL_OK; }
static int32_t requirements(const lull_instance *, lull_requirements *r, lull_error *) { r->first_spp = 1; return LULL_OK; }
static int32_t begin(lull_instance *, const lull_frame *, lull_error *) { return LULL_OK; }
static int32_t evaluate(lull_instance *, const lull_view *, const lull_block *, uint32_t, lull_decision *, uint32_t, uint32_t,
                        lull_error *) { return LULL_OK; }
static void end(lull_instance *) {}
static const void *extension(const char *) { return nullptr; }
static const lull_criterion c = {sizeof(lull_criterion), LULL_API_MINOR, "cxx", "cxx", "1", "cxx", nullptr, 0, 0,
    LULL_THREADS_NONE, 0, create, requirements, begin, evaluate, end, end, extension};
const lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index == 0 ? &c : nullptr; }
CXX
t "a criterion in C++" sh -c "\${CXX:-c++} -std=c++11 -Wall -Wextra -Werror -shared -fPIC -fvisibility=hidden -Iplugin-api/include \
    $tmp/cxx.cc -o $tmp/cxx.so && ${BUILD:-build}/bin/lull-check -q -o entry -o table -o symbols $tmp/cxx.so"
# the README's recipe, as it stands there
awk '/^```c$/ { c = 1; next } c && /^```$/ { exit } c' plugin-api/README.md >"$tmp/recipe.c"
t "the README's recipe keeps the contract" sh -c "\${CC:-cc} -std=c99 -Wall -Wextra -Werror -shared -fPIC -fvisibility=hidden \
    -Wl,--version-script=plugin-api/plugin.map -Iplugin-api/include $tmp/recipe.c -o $tmp/recipe.so -lm && ${BUILD:-build}/bin/lull-check -q $tmp/recipe.so"
# and a criterion of the kit in C++
cat >"$tmp/kit.cc" <<'CXX'
#include <lull/criterion_kit.h>
static void judge(lull_instance *, const lull_view *, const lull_block *block, lull_decision *decision, uint32_t)
{ decision->action = block->spp >= 64 ? LULL_STOP : LULL_CONTINUE; }
static const lull_kit_rule rule = {0, 0, nullptr, judge, nullptr};
LULL_KIT_CRITERION(rule, nullptr, 0, "kit", "kit", "1", "kit");
CXX
t "a criterion of the kit in C++ keeps the contract" sh -c "\${CXX:-c++} -std=c++11 -Wall -Wextra -Werror -shared -fPIC -fvisibility=hidden \
    -Wl,--version-script=plugin-api/plugin.map -Iplugin-api/include $tmp/kit.cc -o $tmp/kit.so && ${BUILD:-build}/bin/lull-check -q $tmp/kit.so"
# pkg-config, installed elsewhere
t "pkg-config names the include and the criterion directory" sh -c "make -s OUT=$tmp PREFIX=/opt/x LIBDIR=lib64 $tmp/lull-criterion.pc &&
    PKG_CONFIG_PATH=$tmp pkg-config --cflags lull-criterion | grep -qF -e -I/opt/x/include &&
    [ \"\$(PKG_CONFIG_PATH=$tmp pkg-config --variable=criteriondir lull-criterion)\" = /opt/x/lib64/lull ]"
echo "1..$n"
