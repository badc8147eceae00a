#!/bin/sh
# lull-render --display-server: what a viewer has at the end is the image, and no viewer changes the image.
. "$(dirname "$0")/lull_render_setup"
S="$scene -q --size 90x60 --block 30 -c fixed -p spp=40 --reproducible"
R="$P $S"

shown() { # shown MODE OUT ARGUMENTS...: renders for the viewer of viewer.py
    mode=$1 out=$2
    shift 2
    rm -f port
    python3 "$here/viewer.py" port "$out" $mode &
    viewer=$!
    while [ ! -e port ] && kill -0 $viewer; do sleep 0.05; done
    "$@" --display-server "127.0.0.1:$(cat port)"
    status=$?
    [ "$mode" = silent ] && kill $viewer
    wait $viewer 2>/dev/null
    return $status
}

$R -o plain.exr
t "a viewer is shown the render" shown "" seen.json $R -o a.exr
t "  …which is the same bytes" cmp plain.exr a.exr
oiiotool a.exr --ch R,G,B,lull.error.V,lull.spp.V -o some.exr
oiiotool --info --dumpdata some.exr >pixels
t "  …the viewer has the image and its layers" python3 -c "
import json, re
seen = json.load(open('seen.json'))
assert (seen['name'], seen['width'], seen['height'], seen['creates']) == ('room.pbrt', 90, 60, 1), seen['name']
assert seen['channels'] == ['R', 'G', 'B', 'lull.spp', 'lull.p_noisy', 'lull.error']
compared = 0
for line in open('pixels'):
    m = re.match(r' *Pixel \((\d+), (\d+)\): *(.*)', line)
    if not m: continue
    x, y, values = int(m[1]), int(m[2]), [float(v) for v in m[3].split()]
    for v, c in zip(values, (0, 1, 2, 5, 3)):
        w = seen['pixels'][c][y * 90 + x]
        assert w is None and v != v or abs(v - w) <= 1e-5 * abs(v) + 1e-6, (x, y, c, v, w)
        compared += 1
assert compared == 5 * 90 * 60, compared"
t "  …and each block's frame, all stopped, with their samples" python3 -c "
import json
drawing = json.load(open('seen.json'))['drawing']
assert sorted(v[:2] for t, v in drawing if t == 18) == [[30 * x + .5, 30 * y + .5] for x in range(3) for y in range(2)], drawing
assert sum(t == 10 for t, _ in drawing) == 6 * 3, drawing  # 40: the pen is set down twice for 4, once for 0"
t "with a crop it is as large as the blocks" shown "" crop.json $R --crop 40,10,50,20 -o crop.exr
t "  …" python3 -c "
import json
seen = json.load(open('crop.json'))
assert (seen['width'], seen['height'], seen['updates']) == (30, 30, seen['updates']) and None not in seen['pixels'][0]"
t "one that takes nothing" shown silent x.json $R -o b.exr
t "  …changes nothing" cmp plain.exr b.exr
t "nobody there" $R -o c.exr --display-server localhost:1
t "  …changes nothing" cmp plain.exr c.exr
t "  …and is said" sh -c "${R%-q*} --size 8x8 -c fixed -p spp=2 -o d.exr --display-server localhost:1 2>&1 | grep -q '^lull-render: --display-server: no viewer has taken'"
rm -f log
refused "--display-server nosuch.invalid:1: no such host" $S -o e.exr --display-server nosuch.invalid:1
refused "expected HOST or HOST:PORT" $S -o e.exr --display-server h:99999
refused "--quote shows no image: leave out --display-server" $S --quote --display-server localhost
refused "--sequence shows no image" $S --sequence dir --display-server localhost
echo "1..$n"
exit $bad
