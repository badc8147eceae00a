#!/bin/sh
# The Debian packages: made, held against Debian's rules, installed into a root of their own, used there, and purged.
# DEB_ROOT=debian (as root, minutes, a package mirror): that root is this Debian with nothing else in it, and apt finds what they
# depend on. Else it is empty, and the programs run with this machine's libraries.
. "$(dirname "$0")/setup"
needs dpkg-buildpackage dpkg-dev
needs dh debhelper
root=$tmp/root
if [ "${DEB_ROOT-}" = debian ]; then
    mmdebstrap --variant=apt --include=g++,pkg-config "$(. /etc/os-release && echo "$VERSION_CODENAME")" "$root" >"$tmp/log" 2>&1 || {
        echo "not ok 1 - mmdebstrap"
        tail "$tmp/log" | sed 's/^/# /'
        exit 1
    }
    for file in /etc/resolv.conf /etc/apt/apt.conf.d/*proxy*; do [ ! -e "$file" ] || cp "$file" "$root$file"; done
    usr=/usr work=$root/tmp
    # the programs find their criteria by /proc; it is mounted for one command only
    inside() { unshare --mount sh -c 'mount -t proc proc "$0/proc" && exec chroot "$0" "$@"' "$root" env -i PATH=/usr/sbin:/usr/bin HOME=/tmp sh -c "cd /tmp && $1"; }
    as apt "shift; cp \"\$@\" $root/tmp && chroot $root apt-get update -q && exec chroot $root apt-get install -y --no-install-recommends \$(for f; do echo /tmp/\${f##*/}; done)"
    dpkg_at="chroot $root dpkg"
else
    usr=$root/usr work=$tmp/work
    mkdir -p "$root/var/lib/dpkg" "$work"
    : >"$root/var/lib/dpkg/status"
    inside() { sh -c "cd $work && $1"; }
    dpkg_at="dpkg --root=$root --force-not-root --force-depends --log=/dev/null"
    as apt "shift; exec $dpkg_at -i \"\$@\""
fi
files() { find "$root" -path "$root/var" -prune -o -path "$root/tmp" -prune -o \( -name '*lull*' -o -name 'ggn*' \) -print; }
as sudo 'exec "$@"'
as make "exec $(command -v make) -s \"\$@\""
line=$(readme_line "make deb")
t "README's line: $line" sh -c "$line"
if command -v lintian >/dev/null; then t "lintian finds no error" lintian --fail-on error --allow-root build/deb/*.changes
else n=$((n + 1)); echo "ok $n - lintian # SKIP no lintian: apt-get install lintian"; fi
field() { dpkg-deb -f build/deb/lull_*.deb "$1"; }
t "MPI and its launcher are suggested, and not needed" sh -c "echo '$(field Suggests)' | grep -q 'libopenmpi.*openmpi-bin' && ! echo '$(field Depends)' | grep -q mpi"
t "images are recommended" sh -c "echo '$(field Recommends)' | grep -q openimageio && ! echo '$(field Depends)' | grep -q openimageio"
multiarch=lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)
t "criteria and modules have no soname" sh -c "objdump -p $root/usr/$multiarch/lull/*.so $root/usr/$multiarch/lull/modules/*.so >$tmp/elf && ! grep SONAME $tmp/elf"
t "the host library has one, by which its package is named" sh -c "objdump -p $root/usr/$multiarch/liblull-host.so.1 | grep -q 'SONAME *liblull-host.so.1'"
cp tests/cli/room.pbrt "$work"
t "a scene is rendered" inside "$usr/bin/lull-render room.pbrt --size 60x40 --block 20 --spp-max 32 -q -o a.exr --stop-map a.csv && cat a.csv"
t "  …by each criterion" inside "for c in fixed halfbuf variance ggn attributes; do $usr/bin/lull-render room.pbrt --size 60x40 --block 20 --spp-max 32 -q -c \$c -o \$c.exr || exit 1; done"
t "lull-check holds an installed criterion against its contract" inside "$usr/bin/lull-check -q halfbuf"
t "the example host is built against it" inside "export PKG_CONFIG_PATH=$usr/$multiarch/pkgconfig PKG_CONFIG_SYSROOT_DIR=${usr%/usr} &&
    c++ -std=c++11 $usr/share/doc/lull-dev/examples/host.cpp \$(pkg-config --cflags --libs lull-host) -o host"
t "  …finds the criteria, and stops its noisy half later" inside "LD_LIBRARY_PATH=$usr/$multiarch ./host observer stops.csv && awk -F';' 'NR == 2 { exit !(\$NF + 0 > \$2 + 0) }' stops.csv"
t "the example criterion is built, and keeps the contract" inside "cc -shared -fPIC -fvisibility=hidden \$(PKG_CONFIG_PATH=$usr/$multiarch/pkgconfig \
    PKG_CONFIG_SYSROOT_DIR=${usr%/usr} pkg-config --cflags lull-criterion) -Wl,--version-script=$usr/share/doc/lull-dev/examples/plugin.map \
    $usr/share/doc/lull-dev/examples/null.c -o mine.so -lm && $usr/bin/lull-check -q ./mine.so"
doc=$root/usr/share/doc/lull
t "README and pages are there, as pages and not packed" test -s $doc/README.md -a -s $doc/docs/hosting.md -a -s $doc/plugin-api/python/README.md -a -s $doc/docs/demo.png
t "  …and what README leads to" sh -c "cd $doc && for to in \$(grep -o '](\([a-z][^)#:]*\)' README.md | sed 's/](//' | sort -u); do
    [ -e \$to ] || case \$to in tests/README.md | CONTRIBUTING.md) ;; *) echo \$to && exit 1 ;; esac; done"
t "a scene that came with it is rendered" inside "$usr/bin/lull-render $usr/share/lull/scenes/demo.pbrt --size 48x32 --block 16 --spp-max 16 -q -o demo.exr"
t "the denoiser can be fetched" inside "$usr/bin/lull-denoiser-setup --help | grep -q python3-venv"
t "man pages are there" sh -c "zcat $root/usr/share/man/man1/lull-render.1.gz | grep -q lull-render && zcat $root/usr/share/man/man7/lull-criterion.7.gz | grep -q criterion"
t "purge" $dpkg_at --purge lull lull-dev liblull-host1
t "  …leaves nothing" test -z "$(files)"
echo "1..$n"
