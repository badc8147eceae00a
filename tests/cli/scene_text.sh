#!/bin/sh
# Scenes and spectra as editors of other systems write them: line ends of CR and of CR LF, a mark (U+FEFF) at the beginning.
. "$(dirname "$0")/lull_render_setup"

cat >lf.pbrt <<'S'
# a comment at the beginning
Film "rgb" "integer xresolution" 4 "integer yresolution" 4 # and one behind a directive
Camera "orthographic"
WorldBegin
LightSource "infinite"
# a comment before the colour
Material "diffuse" "spectrum reflectance" "s.spd"
Translate 0 0 5 # the last one
Shape "disk" "float radius" 9
S
printf '# pairs\n400 .1 # violet\n500,.3\n# red\n600 .9\n' >lf.spd
picture() { cp "$1.pbrt" scene.pbrt && "$P" scene.pbrt -q --spp 1 --strict --reproducible -o "$2"; } # its name is in the picture
same() { picture "$1" got.exr && cmp got.exr lf.exr; }

cp lf.spd s.spd
t "line ends of LF" picture lf lf.exr
tr '\n' '\r' <lf.pbrt >cr.pbrt
t "of CR" same cr
sed 's/$/\r/' lf.pbrt >crlf.pbrt
t "of CR LF" same crlf
awk '/before the colour/ { printf "%s\r", $0; next } { print }' lf.pbrt >both.pbrt
t "of both kinds" same both
tr '\n' '\r' <lf.spd >s.spd
t "a spectrum: of CR" same crlf
sed 's/$/\r/' lf.spd >s.spd
t "of CR LF" same crlf
{ printf '\357\273\277'; cat lf.spd; } >s.spd
t "after a mark" same cr
printf '400 1\r\n500 1\r600 x\r' >s.spd
refused 's.spd:3: "x" (expected a number)' cr.pbrt -q --spp 1 -o x.exr
refused 'cr.pbrt:7:20: ' cr.pbrt -q --spp 1 -o x.exr
refused 'crlf.pbrt:7:20: ' crlf.pbrt -q --spp 1 -o x.exr
exit $bad
