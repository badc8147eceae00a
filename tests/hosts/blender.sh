#!/bin/sh
# Blender's Cycles as a host, in Blender and, where it is installed, in the Python module bpy.
BUILD=${BUILD:-build}
export BUILD
lines='^(ok|not ok|#|1\.\.)'
case $(blender --version 2>/dev/null | head -n 1) in
"") echo "ok 1 - Blender # SKIP no blender: run make test-hosts" ;;
"Blender 4."[0-3].*) # the host refuses them
    echo "ok 1 - Blender # SKIP $(blender --version | head -n 1) has no sampling pattern whose waves add up to one render" ;;
*)
    . tests/hosts/find-python
    for t in blender blender_command blender_engine; do
        PYTHON=$python blender -b --factory-startup -noaudio --python tests/hosts/test_$t.py 2>&1 | grep -E "$lines"
    done
    ;;
esac
python=build/hosts/bpy/bin/python3
if "$python" -c 'import bpy' 2>/dev/null; then
    for t in blender blender_command blender_engine; do
        "$python" tests/hosts/test_$t.py 2>&1 | grep -E "$lines" | sed 's/ - / - bpy: /'
    done
else
    echo "ok 1 - the Python module bpy # SKIP not in build/hosts/bpy: run make test-hosts"
fi
