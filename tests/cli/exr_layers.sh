#!/bin/sh
# An EXR as colour, as alpha and as sky: its picture is found by the names of its channels, whatever their order, type and
# company; what does not tell is refused in a line; a cropped file is placed and said.
. "$(dirname "$0")/lull_render_setup"
command -v oiiotool >/dev/null || { echo "1..0 # SKIP no oiiotool"; exit 0; }

# make VALUES NAMES COUNT OPTIONS…: t.exr of one colour
make() { values=$1 names=$2 count=$3; shift 3; oiiotool --pattern "constant:color=$values" 8x4 "$count" --chnames "$names" "$@" -o t.exr; }
cat >colour.pbrt <<'S'
LookAt 0 0 -5  0 0 0  0 1 0
Camera "orthographic"
Film "rgb" "integer xresolution" 4 "integer yresolution" 4
WorldBegin
LightSource "infinite" "string filename" "t.exr"
Texture "t" "spectrum" "imagemap" "string filename" "t.exr"
Texture "f" "float" "imagemap" "string filename" "t.exr"
Material "diffuse" "texture reflectance" "t"
Shape "disk" "float radius" 1 "texture alpha" "f"
S
picture() { "$P" colour.pbrt -q --spp 8 --reproducible -o "$1" --strict; }
same_as() { picture got.exr && cmp "$1" got.exr; }

make .2,.5,.8 R,G,B 3
t "red, green and blue" picture rgb.exr
make .8,.03,.5,7,.2 B,Z,G,AO.R,R 5
t "  …in another order among other channels" same_as rgb.exr
make .2,.5,.8,1 .R,.G,.B,.A 4
t "  …of V-Ray" same_as rgb.exr
make 9,9,9,.2,.5,.8,1,5 V.Diffuse.R,V.Diffuse.G,V.Diffuse.B,V.Combined.R,V.Combined.G,V.Combined.B,V.Combined.A,V.Depth.Z 8
t "  …of Blender" same_as rgb.exr
make .2,.5,.8,3,7 R,G,B,N,NF 5 -d NF=uint32
t "  …beside integers" same_as rgb.exr
make .4 Y 1
t "luminance" picture grey.exr
for names in R luminance mask; do
    make .4 $names 1
    t "  …called $names" same_as grey.exr
done
make 3,.4,1 Z,Y,A 3
t "  …beside depth, opaque" same_as grey.exr
make 9,9,9,8,8,8 a.R,a.G,a.B,b.R,b.G,b.B 6
refused "t.exr: several layers, a, b: keep one (expected R, G and B, or a layer Combined)" colour.pbrt -q --spp 1 -o x.exr
make .4,.1,.1 Y,RY,BY 3
refused "luminance and chroma" colour.pbrt -q --spp 1 -o x.exr
make 1,2,3 N.X,N.Y,N.Z 3
refused "t.exr: none of its channels is a picture: N.X, N.Y, N.Z" colour.pbrt -q --spp 1 -o x.exr

# Colours in other primaries: those of ACES 2065-1 and CIE XYZ, made Rec. 709's by Imf::RGBtoXYZ · Imf::XYZtoRGB of OpenEXR 3.
# colours CHROMATICITIES VALUES EXPECTED: as sky and reflectance
sed -e /alpha/d -e '/"f"/d' colour.pbrt >in.pbrt; echo 'Shape "disk" "float radius" 1' >>in.pbrt
colours() {
    make "$3" R,G,B 3
    "$P" in.pbrt -q --spp 8 --reproducible -o up.exr --strict
    make "$2" R,G,B 3 "--attrib:type=float[8]" chromaticities "$1"
    "$P" in.pbrt -q --spp 8 --reproducible -o got.exr --strict && idiff -q -fail 1e-5 up.exr got.exr
}
ap0=.7347,.2653,0,1,.0001,-.077,.32168,.33767
t "colours of ACES" colours $ap0 .5,.4,.3 .71386097,.37936744,.25630845
t "  …of CIE XYZ" colours 1,0,0,1,0,0,.33333333,.33333333 .5,.4,.3 .85594847,.27823170,.26331571
t "  …outside of Rec. 709 are cut off" colours $ap0 .2,.5,.8 0,.55262102,.78711577
t "  …of Rec. 709 in three digits" colours .64,.33,.3,.6,.15,.06,.313,.329 .5,.4,.3 .5,.4,.3
cat >numbers.pbrt <<'S'
LookAt 0 0 -5  0 0 0  0 1 0
Camera "orthographic"
Film "rgb" "integer xresolution" 4 "integer yresolution" 4
WorldBegin
LightSource "infinite"
Texture "c" "spectrum" "imagemap" "string filename" "t.exr"
Texture "f" "float" "imagemap" "string filename" "t.exr"
Material "diffuse" "string normalmap" "t.exr"
Shape "disk" "float radius" 1 "texture alpha" "f"
S
make .5,.4,.3 R,G,B 3
"$P" numbers.pbrt -q --spp 8 --reproducible -o up.exr
make .5,.4,.3 R,G,B 3 "--attrib:type=float[8]" chromaticities $ap0
t "numbers stay as they are, also after the same file's colours" sh -c "'$P' numbers.pbrt -q --spp 8 --reproducible -o got.exr && cmp up.exr got.exr"
for wrong in 0,0,0,0,0,0,0,0 .64,.33,.3,.6,.15,.06,.8,.1 .1,.1,.2,.2,.3,.3,.2,.2 nan,.33,.3,.6,.15,.06,.31,.33; do
    make .5,.4,.3 R,G,B 3 "--attrib:type=float[8]" chromaticities $wrong
    refused "cannot read t.exr: its chromaticities are no colour space" in.pbrt -q --spp 1 -o x.exr
done

# What pbrt-v3 reads of a float image is its luminance, whatever its alpha.
cat >v3.pbrt <<'S'
LookAt 0 0 -5  0 0 0  0 1 0
Camera "orthographic"
Film "image" "integer xresolution" 4 "integer yresolution" 4
WorldBegin
Texture "f" "float" "imagemap" "string filename" "t.exr"
AreaLightSource "diffuse" "bool twosided" true
Shape "disk" "float radius" 9 "texture alpha" "f"
S
make .2,.5,.8,.05 R,G,B,A 4
t "a float image of v3" "$P" v3.pbrt -q --spp 64 -o up.exr
make .45788 Y 1
t "  …is its luminance" sh -c "'$P' v3.pbrt -q --spp 64 -o got.exr && idiff -q -fail .02 up.exr got.exr"

# slope LEFT RIGHT SCALE PICTURE: a plane with a displacement that runs from LEFT to RIGHT
slope() {
    oiiotool --pattern "fill:left=$1:right=$2" 64x4 1 --chnames Y -d float -o t.exr
    cat >slope.pbrt <<S
LookAt 0 0 -5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [-.4 .4 -.4 .4]
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
WorldBegin
LightSource "distant" "point3 from" [1 0 -2]
Texture "f" "float" "imagemap" "string filename" "t.exr" "string wrap" "clamp" "float scale" $3
Material "diffuse" "texture displacement" "f"
Shape "bilinearmesh" "point3 P" [.5 -.5 0 -.5 -.5 0 .5 .5 0 -.5 .5 0]
S
    "$P" slope.pbrt -q --spp 8 -o "$4"
}
slope 0 1 .25 up.exr
slope 1 0 -.25 got.exr
t "heights of a negative scale" idiff -q -fail 1e-4 up.exr got.exr
slope -1 0 .25 got.exr
t "heights below 0" idiff -q -fail 1e-4 up.exr got.exr
slope 0 0 .25 got.exr
t "  …without slope it is another picture" sh -c '! idiff -q -fail 1e-4 up.exr got.exr'

"$P" "$scene" -q --size 32x16 --spp 1 --block 8 --crop 8,4,24,12 -o t.exr
t "a cropped picture is placed and said" sh -c "'$P' colour.pbrt --spp 1 -o x.exr 2>&1 | grep 'its pixels are not those of its whole picture'"
refused "its pixels are not those of its whole picture" colour.pbrt -q --strict --spp 1 -o x.exr
echo "1..$n"
exit $bad
