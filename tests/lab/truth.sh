#!/bin/sh
# scripts/lab truth: its observer is that of `ggn visible`, and a small run from recording to table.
cd "$(dirname "$0")/../.." || exit 2
. tests/cli/tap_setup
if ! /usr/bin/python3 -c 'import numpy' 2>/dev/null; then echo "ok 1 # SKIP no numpy (python3-numpy)"; echo "1..1"; exit 0; fi
ggn=$PWD/$BUILD/bin/ggn

/usr/bin/python3 - "$tmp" <<'END'
import struct, sys, zlib
import numpy as np
rng = np.random.default_rng(5)
y, x = np.mgrid[:60, :130]
picture = 0.5 + 0.2 * np.sin(x / 7)[..., None] * np.cos(y / 5)[..., None] + np.zeros(3)
for name, noise in (("first", 0.02), ("second", 0.02), ("image", 0.06)):
    codes = np.rint(255 * np.clip(picture + noise * rng.standard_normal((60, 130, 1)), 0, 1)).astype(np.uint8)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + row.tobytes() for row in codes)
    with open("%s/%s.png" % (sys.argv[1], name), "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 130, 60, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
    np.save("%s/%s.npy" % (sys.argv[1], name), codes)
END
"$ggn" visible "$tmp/first.png" "$tmp/image.png" --second "$tmp/second.png" --block 130 --json >"$tmp/seen.json"
t "the observer in numpy says what ggn visible does" /usr/bin/python3 - "$tmp" <<'END'
import json, sys
sys.path.insert(0, "scripts")
import numpy as np
from lablib import law, tool
def light(name):
    v = np.load("%s/%s.npy" % (sys.argv[1], name)) / 255
    return law.lightness(np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4))
first, second, image = map(light, ("first", "second", "image"))
mine = law.true(image, first, second, law.texture(first, second)) / tool.observer()["level"]
theirs = json.load(open(sys.argv[1] + "/seen.json"))["worst"]
assert abs(mine / theirs - 1) < 1e-4 and theirs > 1, (mine, theirs)  # sums in float and in double
END

truth="scripts/lab truth --work $tmp/work --scenes cornell-box --size 40 --spp 48 --reference-spp 128 --seeds 1 --sizes 40 16 --threads 2"
t "a run from recording to table" sh -c "$truth --criteria fixed:spp=20 observer null >$tmp/table"
t "  …asks the criteria about whole blocks, as a renderer does" sh -c "grep -q '^| fixed:spp=20 | 16 px | other scenes | 4 of 4 | ' $tmp/table &&
    grep -q '^| null | 40 px | other scenes | 0 of 1 | ' $tmp/table && grep -q '^| observer | 40 px ' $tmp/table"
t "  …at the samples that they have named" sh -c "mkdir $tmp/docs && $truth --recorded --criteria fixed:spp=33 --write $tmp/docs >/dev/null &&
    python3 -c 'import json; f = json.load(open(\"$tmp/docs/results/truth.json\")); assert {b[0] for s in f[\"scenes\"].values() for k in s.values() for b in k} == {38}'"
t "  …goes on from what is recorded" sh -c "$truth --recorded --criteria null 2>$tmp/err | grep -q '^| null | 16 px ' && ! grep -q seed $tmp/err"
t "  …and says what is missing" sh -c "! $truth --recorded --scenes chess 2>$tmp/err && grep -q '^lab truth: no scene is recorded in ' $tmp/err"
echo "1..$n"
