#!/bin/sh
# scripts/setup where nothing can be installed: what it says, and that it changes nothing. Programs are stand-ins in a folder of their own.
cd "$(dirname "$0")/../.." || exit 2
. tests/cli/tap_setup
mkdir "$tmp/path"
stand_in() { printf '#!/bin/sh\n%s\n' "$2" >"$tmp/path/$1" && chmod +x "$tmp/path/$1"; }
set_up() { env -i PATH="$tmp/path" /bin/sh scripts/setup "$@" >"$tmp/out" 2>"$tmp/said"; }
said() { cat "$tmp/said"; grep -q "$1" "$tmp/said"; }
stand_in id 'echo 1000'
stand_in sudo 'exit 1'
t "without apt a build goes on" set_up clang-format
t "  …and what it wants is said, by Debian's names" said '^setup: no apt-get here; wanted, by the names of Debian: gcc .*libembree-dev .*clang-format'
t "  …the optional ones apart" said '^setup: optional: libopenmpi-dev openmpi-bin qemu-user help2man$'
t "  …and where other names are" said 'CONTRIBUTING.md'
stand_in apt-get 'echo called >&2; exit 1'
stand_in dpkg-query 'for p; do :; done; case $p in libembree-dev) printf unknown ;; *) printf installed ;; esac'
t "with apt, but not as root: it stops" sh -c "! env -i PATH=$tmp/path /bin/sh scripts/setup 2>$tmp/said"
t "  …names what is missing, and that only" said '^setup: install them as root: apt-get install libembree-dev$'
stand_in dpkg-query 'printf installed'
t "when all is there, nothing is said" set_up
t "  …at all" test ! -s "$tmp/said"
echo "1..$n"
