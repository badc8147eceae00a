#!/bin/sh
# Built with Debian's hardening flags and -flto, as distributions do: without a warning, to the same pictures and decisions.
. "$(dirname "$0")/setup"
needs dpkg-buildflags dpkg-dev
case $(${CC:-gcc} --version) in *"Free Software Foundation"*) ;; *) echo "ok 1 - $0 # SKIP -flto of another compiler than gcc"; echo "1..1"; exit 0 ;; esac
flags() { DEB_BUILD_MAINT_OPTIONS=hardening=+all dpkg-buildflags --get "$1"; }
out=$BUILD/flags
built() {
    make --no-print-directory -j"$(nproc)" OUT="$out" CPPFLAGS="$(flags CPPFLAGS)" CFLAGS="$(flags CFLAGS) -flto=auto" \
        CXXFLAGS="$(flags CXXFLAGS) -flto=auto" LDFLAGS="$(flags LDFLAGS) -flto=auto" all >"$tmp/build.log" 2>&1 || { tail "$tmp/build.log"; return 1; }
}
t "all is built" built
t "  …without a warning" sh -c "! grep -A 5 -i warning $tmp/build.log"
for c in observer ggn; do
    t "  …the same decisions and picture by $c" sh -c "cd $tmp && for of in $BUILD $out; do
        $repo/\$of/bin/lull-render $room -c $c --preview \$(basename \$of).png --stop-map \$(basename \$of).csv || exit 1; done &&
        cmp $(basename "$BUILD").png flags.png && cmp $(basename "$BUILD").csv flags.csv"
done
t "  …and what LDFLAGS asked for" sh -c "readelf -d $out/bin/lull-render $out/lib/liblull-host.so.1 | grep -c 'FLAGS_1.*NOW' | grep -qx 2"
echo "1..$n"
