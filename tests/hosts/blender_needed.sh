#!/bin/sh
# Blender with a Python that has no numpy, as Debian's blender alone: the add-on says in one line what to install, and that is all.
command -v blender >/dev/null || { echo "ok 1 - Blender # SKIP no blender: run make test-hosts"; exit 0; }
. tests/cli/tap_setup
mkdir "$tmp/hidden"
echo 'raise ImportError("hidden by the test")' >"$tmp/hidden/numpy.py"
start="import sys; sys.path[:0] = ['$tmp/hidden']; sys.path.append('plugin-api/python'); sys.modules.pop('numpy', None)"
said() { # said STATUS EXPRESSION: the status, and what it said of ours is one line that names the package
    status=0
    blender -b --factory-startup -noaudio --python-exit-code 3 --python-expr "$start; $2" >"$tmp/out" 2>&1 || status=$?
    cat "$tmp/out"
    [ "$status" = "$1" ] && ! grep -q Traceback "$tmp/out" && [ "$(grep -c numpy "$tmp/out")" = 1 ] && grep -q "$wanted" "$tmp/out"
}
wanted="^lull needs numpy, which this Python does not have: python3 -m pip install numpy$"
[ ! -e /usr/lib/python3.11/EXTERNALLY-MANAGED ] || wanted="^lull needs numpy, which this Python does not have: sudo apt install python3-numpy$"
t "the add-on is switched on and says what it needs" said 0 "import addon_utils; assert addon_utils.enable('lull'); \
import bpy; assert bpy.types.LULL_PT_needed.text; addon_utils.disable('lull'); assert not hasattr(bpy.types, 'LULL_PT_needed')"
t "its command line ends with status 2" said 2 "from lull.blender import cli"
echo "1..$n"
