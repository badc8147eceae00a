#!/bin/sh
# Scenes and spectra as editors of other systems write them: line ends of CR and of CR LF, a mark (U+FEFF) at the beginning; UTF-16 is
# refused. Packed files may have names in capitals.
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

# A file says what a list of the same pairs says: in v4 nothing beyond its ends, in v3 its end values. v3 sorts both, v4 refuses them.
line='531 0 532 8 533 0' back='533 0 531 0 532 8' edge='500 2 560 2'
lamp() { # film, where the pairs come from
	printf 'Film "%s" "integer xresolution" 4 "integer yresolution" 4\nCamera "orthographic"\nWorldBegin\n' "$1"
	printf 'LightSource "infinite" "spectrum L" %s\nTranslate 0 0 5 Shape "disk" "float radius" 9\n' "$2"
}
listed() { lamp "$1" "[ $2 ]" >list.pbrt; lamp "$1" '"s.spd"' >file.pbrt; echo "$3" >s.spd; }
as_listed() { listed "$@" && picture list list.exr && picture file file.exr && cmp list.exr file.exr; }
t "a line of two nanometres: from a file as from a list" as_listed rgb "$line" "$line"
t "what ends within the light that is seen" as_listed rgb "$edge" "$edge"
t "the same in version 3" as_listed image "$edge" "$edge"
t "a line in version 3" as_listed image "$line" "$line"
t "sorted in version 3" as_listed image "$line" "$back"
t "a list, too" as_listed image "$back" "$line"
listed rgb "$line" "$back"
refused 's.spd: wavelength 531 after 533 (expected rising ones)' file.pbrt -q --spp 1 -o x.exr

{ printf '\377\376'; sed 's/./&\x00/g; s/$/\r\x00/' lf.pbrt; } >u16.pbrt
refused 'u16.pbrt:1:1: the text is UTF-16 (expected UTF-8)' u16.pbrt -q --spp 1 -o x.exr
{ printf '\376\377'; sed 's/./\x00&/g' lf.pbrt; } >u16.part
printf 'WorldBegin\nInclude "u16.part"\n' >u16.pbrt
refused 'u16.part:1:1: the text is UTF-16 (expected UTF-8)' u16.pbrt -q --spp 1 -o x.exr

cp lf.spd s.spd
cat >m.ply <<'S'
ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
-9 -9 0
9 -9 0
0 9 0
3 0 1 2
S
gzip -c m.ply >M.PLY.GZ
sed 's/^Shape .*/Shape "plymesh" "string filename" "m.ply"/' lf.pbrt >ply.pbrt
sed 's/m\.ply/M.PLY.GZ/' ply.pbrt | gzip -c >L.PBRT.GZ
t "a mesh" picture ply lf.exr
sed 's/m\.ply/M.PLY.GZ/' ply.pbrt >packed.pbrt
t "the same in .PLY.GZ" same packed
t "a scene in .PBRT.GZ" "$P" L.PBRT.GZ -q --spp 1 --strict -o x.exr
exit $bad
