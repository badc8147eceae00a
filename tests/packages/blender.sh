#!/bin/sh
# The add-on for Blender: made by README's line, installed as Preferences do into a home of its own, without any variable, found
# again by the next start, and rendered with. In Blender 3.4 as an add-on, in later ones (or the Python module bpy) as an extension.
. "$(dirname "$0")/setup"
as make "exec $(command -v make) -s \"\$@\""
line=$(readme_line "make blender")
t "README's line: $line" sh -c "$line"
zip=$PWD/build/blender/lull-$(sed -n 's/^#define BASE_VERSION "\(.*\)"/\1/p' plugin-api/base/version.h).zip
bpy=$PWD/build/hosts/bpy/bin/python3
held() { # held WHAT: the last start got that far
    cat "$tmp/said"
    grep -qx "HELD $1" "$tmp/said"
}
try() { # try NAME COMMAND...: in a home of its own
    home=$tmp/$(echo "$1" | tr -d ' .'); name=$1
    mkdir "$home"
    shift
    start() { (cd / && env -i HOME="$home" PATH=/usr/bin:/bin timeout 3600 "$@" >"$tmp/said" 2>&1); }
    start "$@" install "$zip" "$home"
    t "$name: it is installed" held installed
    start "$@" use "$home"
    t "  …and kept" held kept
    t "  …with the criteria that it carries" held criteria
    for c in observer ggn; do t "  …rendered by $c" held "rendered by $c"; done
}
skip() { n=$((n + 1)); echo "ok $n - $1 # SKIP $2: make test-hosts"; }
if command -v blender >/dev/null; then
    try "Blender $(blender --version 2>/dev/null | sed -n '1s/Blender //p')" blender -b -noaudio --python-exit-code 3 --python "$PWD/tests/packages/blender.py" --
    t "  …rendered by the command line" env -i HOME="$home" PATH=/usr/bin:/bin blender -b "$home/cube.blend" -noaudio --python-exit-code 3 --python-expr \
        "import sys; from lull.blender import cli; sys.exit(cli.main())" -- -c fixed --spp-max 2 --spp-min 2 -q -o "$home/out.exr"
    t "  …to a picture" test -s "$home/out.exr"
else skip "Blender" "no blender"; fi
if version=$("$bpy" -c 'import bpy; print(bpy.app.version_string)' 2>/dev/null | tail -n 1) && [ "$version" ]; then
    try "bpy $version" "$bpy" "$PWD/tests/packages/blender.py" --
    t "  …rendered by denoised, with Blender's own denoiser" held "rendered by denoised"
    cli=$(find build/hosts/bpy/lib -path '*bl_pkg/cli/blender_ext.py' | head -n 1)
    if [ "$cli" ]; then t "Blender's validation of extensions" "$bpy" "$cli" validate --valid-tags= "$zip"; else skip "Blender's validation of extensions" "no bl_pkg"; fi
else skip "bpy" "not in build/hosts/bpy"; fi
echo "1..$n"
