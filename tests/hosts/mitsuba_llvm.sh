#!/bin/sh
# Mitsuba 3 as a host, variant llvm_ad_rgb, where an LLVM is found that it can use.
BUILD=${BUILD:-build}
export BUILD PYTHONPATH=plugin-api/python:tests/hosts
python=build/hosts/venv/bin/python3
# The newest one: Mitsuba takes the first it finds, which on Debian 12 may be too old for it.
library=$(find /usr/lib -name 'libLLVM*.so*' 2>/dev/null | sed 's/.*libLLVM[-.a-z]*\([0-9]*\).*/\1 &/' | sort -n | tail -n 1)
[ -z "$library" ] || export DRJIT_LIBLLVM_PATH="${DRJIT_LIBLLVM_PATH:-${library#* }}"
probe='import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
mi.render(mi.load_file("tests/hosts/scenes/box.xml"), spp=1).numpy()'
if "$python" -c "$probe" >/dev/null 2>&1; then
    "$python" tests/hosts/test_mitsuba.py llvm_ad_rgb | sed 's/ - / - llvm: /'
else
    echo "ok 1 - llvm_ad_rgb # SKIP no Mitsuba in build/hosts/venv, or no LLVM that it can use: run make test-hosts"
fi
