#!/bin/sh
# Progress on a terminal: blocks in half characters, cleared at the end and when interrupted, as wide as the terminal is; plain
# lines where that is no terminal or nobody wants colours.
. "$(dirname "$0")/lull_render_setup"
export LC_ALL=C.UTF-8 TERM=xterm-256color
unset NO_COLOR
R="$P $scene --size 96x64 --block 16 -c fixed -p spp=400 -t 2 -o a.exr"
on() { python3 "$here/terminal.py" "$@" >said.json; }
said() { python3 -c "
import json
s = json.load(open('said.json'))
text, map_rows = '\n'.join(s['fullest']), [r for r in s['fullest'] if '\u2580' in r]
assert $1, s"; }

t "on a terminal" on 80 24 -- $R
t "  …blocks are drawn, 6 x 4 of 4 x 4 half characters" said "s['status'] == 0 and len(map_rows) == 8 and all(r == '\u2580' * 24 for r in map_rows)"
t "  …with a legend, the criterion and the line below" said "'\u2588 active' in text and 'criterion fixed' not in text and 'blocks active' in s['fullest'][-1] and 'ETA' in s['fullest'][-1]"
t "  …and nothing of it is left at the end" said "'\u2580' not in ''.join(s['left']) and not s['coloured'] and s['left'][0].startswith('lull-render: 400 spp')"
t "the quality parameter is told" on 80 24 interrupt=1 -- $P $scene --size 96x64 --block 16 --visible 0.1 --spp-max 1000000 -o b.exr
t "  …" said "'criterion observer, visible 0.1' in s['fullest'] and s['status'] == 130"
t "interrupted, the terminal is as it was" said "'\u2580' not in ''.join(s['left']) and not s['coloured']"
t "many blocks share characters" on 40 16 -- $P $scene --size 400x400 --block 4 -c fixed -p spp=16 -o c.exr
t "  …" said "0 < len(map_rows) <= 7 and all(len(r) <= 39 for r in s['fullest']) and s['status'] == 0"
t "a terminal that becomes narrower" on 80 24 narrow=20 -- $R
t "  …gets shorter lines" said "s['status'] == 0 and s['widest_before'][0] > 24 and s['widest'] < 20 and '\u2580' not in ''.join(s['left'])"
for plain in --no-progress "NO_COLOR=1" "TERM=dumb"; do
    case $plain in -*) set -- $R $plain ;; *) set -- env "$plain" $R ;; esac
    t "$plain: no map and no escape" on 80 24 -- "$@"
    t "  …" said "'\u2580' not in text and s['status'] == 0 and s['left'][0].startswith('lull-render: 400 spp') or 'blocks active' in s['left'][0]"
done
t "another character set: the line alone" on 80 24 -- env LC_ALL=C $R
t "  …" said "'\u2580' not in text and s['status'] == 0"
t "to a file, lines as they are" sh -c "$R 2>notes && ! grep -q \"\$(printf '\\033')\" notes && grep -q '^lull-render: 400 spp' notes"
echo "1..$n"
exit $bad
