#!/bin/sh
# Libraries where distributions want them: LIBDIR of 64-bit systems and of Debian's multi-arch; found by programs, pkg-config and CMake.
. "$(dirname "$0")/setup"
as make "exec $(command -v make) -s -o all PREFIX=/usr \"\$@\"" # all: what is built
cat >"$tmp/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.16)
project(example C CXX)
find_package(lull 1.0 REQUIRED)
add_executable(example $repo/plugin-api/examples/host.cpp)
target_link_libraries(example lull::host)
add_library(mine MODULE $repo/plugin-api/examples/null.c)
target_link_libraries(mine lull::criterion m)
set_target_properties(mine PROPERTIES PREFIX "" C_VISIBILITY_PRESET hidden
  LINK_FLAGS -Wl,--version-script=$repo/plugin-api/plugin.map)
file(WRITE \${CMAKE_BINARY_DIR}/criteria "\${lull_CRITERIA_DIR}")
END
by_pkg_config() { # what the .pc files say, in the root that they are installed in
    (
        export PKG_CONFIG_SYSROOT_DIR="$root" PKG_CONFIG_PATH="$root$dir/pkgconfig"
        # shellcheck disable=SC2046
        "${CXX:-c++}" -std=c++11 plugin-api/examples/host.cpp $(pkg-config --cflags --libs lull-host) -o "$root/host" &&
            [ "$(pkg-config --variable=criteriondir lull-criterion)" = "$root$dir/lull" ] && pkg-config --cflags lull-criterion
    )
}
by_cmake() { # by_cmake VERSION: 0 if find_package takes what is installed
    sed "s/find_package(lull 1.0/find_package(lull $1/" "$tmp/CMakeLists.txt" >"$tmp/CMakeLists.part" &&
        mkdir -p "$tmp/of-$1" && mv "$tmp/CMakeLists.part" "$tmp/of-$1/CMakeLists.txt" &&
        cmake -S "$tmp/of-$1" -B "$root/cmake-$1" -Dlull_DIR="$root$dir/cmake/lull"
}
cmake_builds() { cmake --build "$root/cmake-1.0" && [ "$(cat "$root/cmake-1.0/criteria")" = "$root$dir/lull" ]; }
fails() { ! "$@"; }
stops() { "$@" observer "$tmp/stops.csv" && awk -F';' 'NR == 2 { exit !($NF + 0 > $2 + 0) }' "$tmp/stops.csv"; }
skip() { n=$((n + 1)); echo "ok $n - $1 # SKIP no $2: apt-get install $2"; }
triplet=$("${CC:-cc}" -dumpmachine)
for LIBDIR in /usr/lib64 "lib/$triplet"; do
    root=$tmp/root-${LIBDIR##*/} dir=/usr/${LIBDIR#/usr/}
    mkdir "$root"
    t "LIBDIR=$LIBDIR" make install LIBDIR="$LIBDIR" DESTDIR="$root"
    t "  …holds the libraries, and no other folder does" sh -c "[ -s $root$dir/liblull-host.so.1 ] && [ -s $root$dir/lull/observer.so ] &&
        ! find $root -name '*.so*' -o -name '*.pc' -o -name '*.cmake' | grep -v '^$root$dir/'"
    t "  …the programs find criteria, modules and models" sh -c "cd $tmp && $root/usr/bin/lull-render $room -c ggn --preview a.png &&
        $root/usr/bin/ggn flip $repo/scenes/demo-reference.png $repo/scenes/demo-reference.png"
    if command -v pkg-config >/dev/null; then
        t "  …pkg-config: the example host is built" by_pkg_config
        t "  …and finds criteria" stops env LD_LIBRARY_PATH="$root$dir" "$root/host"
    else skip "pkg-config" pkg-config; fi
    if command -v cmake >/dev/null; then
        t "  …CMake: the package is found" by_cmake 1.0
        t "  …the example host and the example criterion are built" cmake_builds
        t "  …the host finds criteria" stops "$root/cmake-1.0/example"
        t "  …the criterion keeps the contract" "$root/usr/bin/lull-check" -q "$root/cmake-1.0/mine.so"
        for version in 2.0 1.999; do t "  …version $version is not found" fails by_cmake $version; done
    else skip "CMake" cmake; fi
    t "  …uninstall" make uninstall LIBDIR="$LIBDIR" DESTDIR="$root"
    t "  …leaves no file" sh -c "! find $root/usr ! -type d | grep ."
done
echo "1..$n"
