#!/bin/sh
# lull-report FRAME.exr... -o SHEET.png: a shot as a moving picture, read by hand; what is refused.
. "$(dirname "$0")/lull_render_setup"
report=$(dirname "$P")/lull-report
small="-q --size 48x32 --block 16 --spp 4"
"$P" "$scene" --frames 1-3 $small -o f_%d.exr --preview f_%d.png
cat >look.py <<'PY'
"""Prints frames, size, delays; checks every chunk. Frame K goes to frame_K.ppm."""
import struct, sys, zlib
data = open(sys.argv[1], "rb").read()
assert data[:8] == b"\x89PNG\r\n\x1a\n"
at, number, frames, delays = 8, 0, [], []
while at < len(data):
    size, name = struct.unpack(">I4s", data[at:at + 8])
    body = data[at + 8:at + 8 + size]
    assert struct.unpack(">I", data[at + 8 + size:at + 12 + size])[0] == zlib.crc32(name + body), name
    at += 12 + size
    if name == b"IHDR":
        width, height = struct.unpack(">II", body[:8])
    elif name == b"acTL":
        assert not frames
        count, loops = struct.unpack(">II", body)
    elif name in (b"fcTL", b"fdAT"):
        assert struct.unpack(">I", body[:4])[0] == number, "order"
        number += 1
        if name == b"fcTL":
            assert struct.unpack(">4I", body[4:20]) == (width, height, 0, 0)
            delays.append("%d/%d" % struct.unpack(">HH", body[20:24]))
            frames.append(b"")
        else:
            frames[-1] += body[4:]
    elif name == b"IDAT":
        frames[-1] += body
assert name == b"IEND" and len(frames) == count and loops == 0
for k, packed in enumerate(frames):
    raw, rows, last = zlib.decompress(packed), [], bytes(3 * width)
    assert len(raw) == height * (3 * width + 1)
    for y in range(height):
        kind, row = raw[y * (3 * width + 1)], bytearray(raw[y * (3 * width + 1) + 1:(y + 1) * (3 * width + 1)])
        for x in range(3 * width):
            a, b, c = row[x - 3] if x > 2 else 0, last[x], last[x - 3] if x > 2 else 0
            near = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            row[x] = (row[x] + (0, a, b, (a + b) // 2, near)[kind]) & 255
        last = bytes(row)
        rows.append(last)
    open("frame_%d.ppm" % (k + 1), "wb").write(b"P6 %d %d 255\n" % (width, height) + b"".join(rows))
print(count, "%dx%d" % (width, height), *delays)
PY
t "frames become an animated PNG" "$report" f_1.exr f_2.exr f_3.exr -o sheet.png
python3 look.py sheet.png >said 2>&1 || cat said
t "  …with all frames, 24 a second, every part in order" grep -qx '3 484x202 1000/24000 1000/24000 1000/24000' said
oiiotool f_2.png --resize:filter=box 240x160 -o want.png
oiiotool frame_2.ppm --cut 240x160+0+0 -o got.png
t "  …each the picture that is shown" oiiotool --fail 0.004 --warn 0.004 want.png got.png --diff
"$report" f_1.exr --fps 10 -o one.png
t "one frame, ten a second" sh -c 'python3 look.py one.png | grep -qx "1 484x202 1000/10000"'
report_refuses() { P=$report refused "$@"; }
"$P" "$scene" -q --size 32x32 --spp 1 -o small.exr
oiiotool f_1.exr --ch R,G,B -o plain.exr
report_refuses "small.exr: 32x32 pixels; the frames before have 48x32" f_1.exr small.exr -o x.png
report_refuses "plain.exr: " f_1.exr plain.exr -o x.png
report_refuses "f_2.png: a sheet is made of the frames' .exr files" f_1.exr f_2.png -o x.png
report_refuses "a page has one picture" f_1.exr f_2.exr f_3.exr -o x.html
report_refuses "--fps belongs to a sheet" f_1.exr --fps 24 -o x.html
t "nothing is left of what was refused" test ! -e x.png -a ! -e x.html
echo "1..$n"
exit $bad
