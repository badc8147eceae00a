#!/bin/sh
# The wheel: made, held against its tag, installed into a new virtual environment by README's line, used there, and removed.
. "$(dirname "$0")/setup"
/usr/bin/python3 -c 'import tomllib, venv, ensurepip, numpy' 2>"$tmp/log" || {
    echo "ok 1 - $0 # SKIP no /usr/bin/python3 of 3.11 with venv and numpy: apt-get install python3-venv python3-numpy"
    echo "1..1"
    exit 0
}
# numpy is the system's: nothing is fetched
/usr/bin/python3 -m venv --system-site-packages "$tmp/venv" || exit 1
as pip "exec $tmp/venv/bin/pip \"\$@\" -q --disable-pip-version-check --no-index"
as make "PATH=/usr/bin:\$PATH exec $(command -v make) -s \"\$@\""
python=$tmp/venv/bin/python
site=$("$python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')
run() { (cd "$tmp" && env -u PATH "$python" "$@"); }
line=$(readme_line "make wheel")
t "README's line: $line" sh -c "$line"
wheel=$(echo build/wheel/lull-*.whl)
t "the same files make the same bytes" sh -c "cp $wheel $tmp && make wheel && cmp $wheel $tmp/${wheel##*/}"
cat >"$tmp/wheel.py" <<'END'
import base64, hashlib, re, subprocess, sys, tempfile, zipfile
from pathlib import Path
wheel = zipfile.ZipFile(sys.argv[1])
rows = [row.rsplit(",", 2) for row in wheel.read(next(n for n in wheel.namelist() if n.endswith("RECORD"))).decode().split()]
assert [row[0] for row in rows] == wheel.namelist()
for name, digest, size in rows[:-1]:
    data = wheel.read(name)
    assert digest == "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("="), name
    assert int(size) == len(data), name
folder = tempfile.mkdtemp(dir=Path(__file__).parent)
wheel.extractall(folder)
minor = int(re.search(r"-py3-none-manylinux_2_(\d+)_x86_64[.]whl$", sys.argv[1])[1])
elf = [path for path in Path(folder).rglob("*") if path.is_file() and path.read_bytes()[:4] == b"\x7fELF"]
names = {path.name for path in elf}
assert len(elf) == 11, names
assert "lull/py.typed" in wheel.namelist(), "type checkers would not look at its types"
assert len([name for name in wheel.namelist() if name.endswith(".ggn")]) == 1, "a model of before is no part of it"
for path in elf:
    text = subprocess.run(["objdump", "-pT", path], text=True, capture_output=True, check=True).stdout
    assert set(re.findall(r"NEEDED +(\S+)", text)) <= names | {"libc.so.6", "libm.so.6", "libz.so.1"}, (path, text)
    for beside in set(re.findall(r"NEEDED +(\S+)", text)) & names:  # found before the system's
        runpath = re.findall(r"R(?:UN)?PATH +[$]ORIGIN(\S*)", text)
        assert runpath and Path(f"{path.parent}{runpath[0]}/{beside}").exists(), (path, beside)
    assert max((int(v) for v in re.findall(r"GLIBC_2[.](\d+)", text)), default=0) <= minor, path
END
t "its record is right, and its libraries need what the tag allows" "$python" "$tmp/wheel.py" "$wheel"
if audit=$(command -v auditwheel || ls build/hosts/audit/bin/auditwheel 2>/dev/null); then
    tag=${wheel##*none-}
    t "auditwheel says the same" sh -c "$audit show $wheel | tr '\n' ' ' | grep -q 'consistent with the following platform tag: \"${tag%.whl}\"'"
else n=$((n + 1)); echo "ok $n - auditwheel # SKIP no auditwheel: pip install auditwheel"; fi
t "it needs numpy and nothing else" run -c 'from importlib.metadata import requires; assert [r for r in requires("lull") if "extra" not in r] == ["numpy>=1.20"]'
run -m lull >"$tmp/said" 2>&1
found() { cat "$tmp/said"; grep -qE "$1" "$tmp/said"; }
t "python -m lull: its own library" found "^library +$site/lull/lib/liblull-host.so.1$"
for c in fixed ggn halfbuf observer variance; do t "  …the criterion $c, ready" found "^criterion +$c +[0-9.]+ +ready +.$site/lull/lib/lull/$c.so.$"; done
t "  …the model" found "^model +$site/lull/lib/lull/lull-3.ggn$"
t "  …no denoiser, and how to get one" found "^denoiser .*pip install pyoidn"
oidn=$repo/$BUILD/tests/oidn-stub/libOpenImageDenoise.so.2
if [ -e "$oidn" ]; then # as pip would install the extra lull[denoise]
    mkdir -p "$site/pyoidn/oidn/lib" && cp "$oidn" "$site/pyoidn/oidn/lib" && : >"$site/pyoidn/__init__.py"
    run -m lull >"$tmp/said" 2>&1
    t "the denoiser of pyoidn" found "^denoiser +$site/pyoidn/oidn$"
    t "  …makes denoised ready" found "^criterion +denoised +[0-9.]+ +ready "
else n=$((n + 1)); echo "ok $n - the denoiser of pyoidn # SKIP no $oidn: make test-tools"; fi
# The host of the package's README, smaller, over a renderer whose right half is noisy.
{
    cat <<'END'
import numpy as np
def my_renderer(x0, y0, x1, y1, seed, spp):
    noise = np.random.default_rng(seed).normal(0, 1, (spp, y1 - y0, x1 - x0, 3)).mean(0)
    return 0.5 + noise * np.where(np.arange(x0, x1) < 48, 1e-3, 0.5)[None, :, None]
END
    sed -n '/^```python/,/^```/p' plugin-api/python/README.md | sed '/^```$/q' | grep -v '^```' | sed 's/1920, 1080, spp_max=4096/96, 64, block=32, spp_max=256/'
    cat <<'END'
assert result.outcome == "done" and picture.shape == (64, 96, 3), result
assert samples[:, :32].max() < samples[:, 64:].min(), samples[0]
END
} >"$tmp/host.py"
t "the host of the package's README" run "$tmp/host.py"
t "  …leaves its files" sh -c "cd $tmp && [ -s picture.exr ] && [ -s report.json ] && [ -s stop-map.png ]"
# Blender has a Python of its own: what lies beside lull here must not come before it.
if command -v blender >/dev/null; then
    echo 'raise ImportError("of another Python")' >"$site/json.py"
    blender -b --factory-startup -noaudio --python-expr "import bpy; s = bpy.context.scene; s.render.engine = 'CYCLES'; s.render.resolution_x = 48; \
s.render.resolution_y = 36; bpy.ops.wm.save_as_mainfile(filepath='$tmp/cube.blend')" >"$tmp/log" 2>&1
    t "python -m lull.blender, by the Blender on PATH" sh -c "cd $tmp && PATH=/usr/bin:/bin $python -m lull.blender cube.blend -c halfbuf --spp-max 32 -q -o cube.exr && [ -s cube.exr ]"
    rm "$site/json.py"
else n=$((n + 1)); echo "ok $n - python -m lull.blender # SKIP no blender: make test-hosts"; fi
extras() { for e in denoise:pyoidn mitsuba:mitsuba luxcore:pyluxcore blender:bpy plot:matplotlib study:aiohttp; do
    unzip -p "$wheel" '*/METADATA' | grep -q "^Requires-Dist: ${e#*:}.*extra == \"${e%:*}\"" || return; done; }
t "the extras denoise, mitsuba, luxcore, blender, plot and study" extras
t "a criterion that is a Python file" sh -c "$python -c 'import lull; assert lull.load(\"plugin-api/examples/dammertz.py\").info.id == \"dammertz\"'"
t "one version everywhere" sh -c "$python -c 'import lull; print(lull.__version__)' | grep -qxF \"\$(build/bin/lull-render --version | sed -n '1s/.* //p')\" &&
    unzip -p $wheel '*/METADATA' | grep -qxF \"Version: \$($python -c 'import lull; print(lull.__version__)')\""
t "the programs' and the packages'" sh -c "head -n 1 debian/changelog | grep -qF \"(\$($python -c 'import lull; print(lull.__version__)'))\""
t "lull-study, a program" sh -c "$tmp/venv/bin/lull-study --version | grep -qx 'lull-study (Lull) .*' && unzip -l $wheel | grep -q study/page/vendor/jspsych.js"
t "  …which shows people a recording, without any other program" run "$tmp/venv/bin/lull-study" init shown --task thresholds --views \
    "$PWD/tests/data/recorded/train/one-view0" --asked-by Ada --contact here
t "lull-plot, a program" sh -c "$tmp/venv/bin/lull-plot --version | grep -qx 'lull-plot (Lull) .*'"
t "pip uninstall" "$tmp/venv/bin/pip" uninstall -q -y lull
t "  …leaves nothing" sh -c "! find $site -iname '*lull*' | grep ."
echo "1..$n"
