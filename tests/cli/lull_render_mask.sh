#!/bin/sh
# lull-render --mask: painted blocks get more samples, the others the same; refusals, and what a resumed run must notice.
. "$(dirname "$0")/lull_render_setup"
common="$scene -q --size 64x48 --block 16 -c halfbuf -p threshold=0.02 --spp-max 4000"
counts() { cut -d';' -f2- "$1" | tr ';' '\n' | grep .; }
# block 5 is touched by one white pixel, block 6 by a grey one: 4^-1 and 4^-0.5 of the quality parameter
oiiotool --create 64x48 1 --fill:color=1 1x1+20+20 --fill:color=0.5 1x1+40+20 -d uint8 -o mask.png
oiiotool --create 64x48 3 -d uint8 -o black.png
oiiotool --create 60x48 1 -d uint8 -o small.png
echo "no picture" >text.png

"$P" $common --stop-map plain.csv && "$P" $common --mask mask.png --stop-map masked.csv
"$P" $common --mask black.png --stop-map black.csv
"$P" $common -p threshold=0.005 --stop-map white.csv && "$P" $common -p threshold=0.01 --stop-map grey.csv
of() { counts "$1" | sed -n "$2p"; }
others() { counts "$1" | sed '6,7d'; }
t "a white pixel: its block stops as with a quarter of the quality parameter" test "$(of masked.csv 6)" = "$(of white.csv 6)"
t "a grey one: half of the quality parameter" test "$(of masked.csv 7)" = "$(of grey.csv 7)"
more() { [ "$(of masked.csv "$1")" -gt "$(of plain.csv "$1")" ]; }
t "the white one got more samples" more 6
t "so did the grey one" more 7
t "the other blocks stop as without a mask" test "$(others masked.csv)" = "$(others plain.csv)"
t "a black mask changes nothing" cmp plain.csv black.csv
observed() { "$P" "$scene" -q --size 64x48 --block 16 -c observer --spp-max 4000 --stop-map "$@"; }
observed v.csv --mask mask.png --visible 0.4 && observed w.csv --visible 0.1
t "--visible is scaled too" test "$(of v.csv 6)" = "$(of w.csv 6)"
judged() { "$P" "$scene" -q --size 64x48 --block 16 -c ggn --spp-max 400 "$@"; }
judged --stop-map g.csv --mask mask.png --visible 0.9 --report g.json
judged --stop-map gw.csv --visible 0.225
judged --stop-map gp.csv --visible 0.9
t "ggn: the quality parameter of the network is scaled" test "$(of g.csv 6) $(others g.csv)" = "$(of gw.csv 6) $(others gp.csv)"
t "  …and that is more than without" test "$(of g.csv 6)" -gt "$(of gp.csv 6)"
factors() { grep -o '"dial":[[:space:]]*[0-9.]*' "$1" | grep -o '[0-9.]*$' | tr '\n' ' '; }
t "the report names the mask" grep -q '"mask":[[:space:]]*"mask.png"' g.json
t "  …and the factor of each block" test "$(factors g.json)" = "1 1 1 1 1 0.25 0.5 1 1 1 1 1 "

interrupted c.ckpt $common --mask mask.png --stop-map part.csv
"$P" $common --mask mask.png --checkpoint c.ckpt --resume --stop-map resumed.csv
t "a checkpoint holds the history of every quality parameter" cmp masked.csv resumed.csv
"$P" $common --mask mask.png --time-budget 0.05 --checkpoint d.ckpt --stop-map part.csv
refused "mask" $common --mask black.png --checkpoint d.ckpt --resume
refused "60x48 pixels" $common --mask small.png
refused "text.png" $common --mask text.png
refused "none.png" $common --mask none.png
refused "takes the same samples" $scene -q --size 64x48 --spp 4 --mask mask.png -o x.exr
refused "nor --mask" $scene -q --size 64x48 --block 16 --sequence seq --levels linear:4:8:4 --mask mask.png
refused "visible=VALUE" $scene -q --size 64x48 -c ggn --mask mask.png
refused "no quality parameter" $scene -q --size 64x48 -c fixed --mask mask.png
echo "1..$n"
exit $bad
