#!/bin/sh
# The host library as a renderer has it: its header, its symbols, the example in C++, an installed copy.
. "$(dirname "$0")/tap_setup"
build=${BUILD:-build}
lib=$build/lib/liblull-host.so.1
header=plugin-api/include/lull/host.h draft=plugin-api/include/lull/host_draft.h
flags="-Wall -Wextra -Wpedantic -Wshadow -Wundef -Wconversion -Werror -fsyntax-only -Iplugin-api/include"
for cc in gcc clang; do
    command -v $cc >/dev/null 2>&1 || continue
    # shellcheck disable=SC2086
    t "$cc, C99, no padding" $cc -std=c99 $flags -Wpadded -xc $header
    t "  …and the draft" $cc -std=c99 $flags -Wpadded -xc $draft
done
for cxx in g++ clang++; do
    command -v $cxx >/dev/null 2>&1 || continue
    # shellcheck disable=SC2086
    t "$cxx, C++11, no padding" $cxx -std=c++11 $flags -Wold-style-cast -Wpadded -xc++ $header
    t "  …and the draft" $cxx -std=c++11 $flags -Wold-style-cast -Wpadded -xc++ $draft
done
# What the header and the loader's declare, what the version script lists and what the library exports are one list.
sed -n -e "s/^LULL_EXPORT .*[ *]\(lull_[a-z_]*\)(.*/\1/p" -e "s/^\(lull_[a-z_]*\)(.*/\1/p" $header $draft plugin-api/include/lull/loader.h | sort >"$tmp/declared"
sed -n 's/^ *\(lull_[a-z_]*\);$/\1/p' plugin-api/host.map | sort >"$tmp/listed"
nm -D --defined-only "$lib" | awk '$2 != "A" { sub("@.*", "", $3); print $3 }' | sort >"$tmp/exported"
t "the frozen core has at most 30 functions, and a renderer needs no more" sh -c "[ \$(grep -c ^LULL_EXPORT $header) -le 30 ] && ! grep -q draft plugin-api/examples/host.cpp"
t "exports what the headers declare" diff "$tmp/declared" "$tmp/exported"
t "and what the version script lists" diff "$tmp/listed" "$tmp/exported"
t "each with its version" sh -c "! nm -D --defined-only $lib | awk '\$2 != \"A\"' | grep -v '@@LULL_HOST_1\$'"
t "needs no library of a renderer" sh -c "! objdump -p $lib | grep NEEDED | grep -v -e libc.so -e libm.so -e libcjson -e libpng -e libz.so \
    -e ld-linux -e libasan -e libubsan -e libtsan -e libgcc_s"
t "the example has at most 120 lines" sh -c "[ \$(wc -l <plugin-api/examples/host.cpp) -le 120 ]"
example="$build/bin/host-example"
t "the example stops its noisy half later" sh -c "$example observer $tmp/s.csv >$tmp/spp && awk '{ for (i = 1; i <= NF; i++)
    if ((i - 1) % 6 < 2) { if (\$i > 32) exit 1 } else if ((i - 1) % 6 > 3 && i < 13 && \$i < 64) exit 1 }' $tmp/spp"
t "its table says the same" sh -c "[ \"\$(tr ' ' ';' <$tmp/spp)\" = \"\$(sed 's/^observer;//; s/;\$//' $tmp/s.csv)\" ]"
t "and its picture is one" sh -c "$example fixed $tmp/s.png && head -c 8 $tmp/s.png | grep -q PNG"
t "an unknown criterion is one line" sh -c "! $example nobody $tmp/x.png 2>$tmp/said && [ \$(wc -l <$tmp/said) = 1 ] &&
    grep -q '^host: no criterion nobody ' $tmp/said && [ ! -e $tmp/x.png ]"
# As it is installed: header, library, pkg-config.
mkdir -p "$tmp/usr/lib/pkgconfig" "$tmp/usr/include/lull"
cp "$lib" "$tmp/usr/lib" && ln -s liblull-host.so.1 "$tmp/usr/lib/liblull-host.so" && cp plugin-api/include/lull/*.h "$tmp/usr/include/lull"
sed "s|@PREFIX@|$tmp/usr|g; s|@LIBDIR@|$tmp/usr/lib|g" plugin-api/lull-host.pc.in >"$tmp/usr/lib/pkgconfig/lull-host.pc"
san=
nm -D "$lib" | grep -q __asan_init && san=-fsanitize=address,undefined
t "builds against an installed copy" sh -c "PKG_CONFIG_PATH=$tmp/usr/lib/pkgconfig && export PKG_CONFIG_PATH &&
    \${CXX:-c++} -std=c++11 $san plugin-api/examples/host.cpp \$(pkg-config --cflags --libs lull-host) -o $tmp/host &&
    LULL_PLUGIN_PATH=$build/lib/lull LD_LIBRARY_PATH=$tmp/usr/lib $tmp/host observer $tmp/s2.csv >$tmp/spp2 && cmp $tmp/spp $tmp/spp2"
mkdir "$tmp/usr/lib/lull" && cp "$build/lib/lull/fixed.so" "$tmp/usr/lib/lull"
t "finds the criteria that are installed beside it" sh -c "unset LULL_PLUGIN_PATH && LD_LIBRARY_PATH=$tmp/usr/lib $tmp/host fixed $tmp/s3.csv &&
    ! LD_LIBRARY_PATH=$tmp/usr/lib $tmp/host observer $tmp/s3.csv"
mkdir "$tmp/far" && ln -s "$tmp/usr/lib/liblull-host.so.1" "$tmp/far"
t "  …or beside the file that its name links to" sh -c "unset LULL_PLUGIN_PATH && LD_LIBRARY_PATH=$tmp/far $tmp/host fixed $tmp/s4.csv"
echo "1..$n"
