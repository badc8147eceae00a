#!/bin/sh
# Image files in, as textures: which alpha is the value of a float texture, which way up a file of Radiance is, names that mean
# something to a library.
. "$(dirname "$0")/lull_render_setup"
command -v oiiotool >/dev/null || { echo "1..0 # SKIP no oiiotool"; exit 0; }

# files: what no writer of ours makes
python3 - <<'E' || exit 2
import struct, zlib
def png(name, kind, pixel, **others):
    chunk = lambda t, d: struct.pack(">I", len(d)) + t + d + struct.pack(">I", zlib.crc32(t + d))
    row = b"\0" + bytes(pixel) * 2
    open(name, "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 2, 8, kind, 0, 0, 0))
                           + b"".join(chunk(n.encode(), bytes(d)) for n, d in others.items()) + chunk(b"IDAT", zlib.compress(row * 2)) + chunk(b"IEND", b""))
def tga(name, pixel):
    open(name, "wb").write(struct.pack("<BBB9xHHBB", 0, 0, 2, 1, 1, 8 * len(pixel), 8 if len(pixel) == 4 else 0) + bytes(pixel))
def bmp(name, masks, pixel):
    head = struct.pack("<IiiHHIIiiII4I", 56, 2, 2, 1, 32, 3, 16, 0, 0, 0, 0, *masks)
    open(name, "wb").write(b"BM" + struct.pack("<IHHI", 86, 0, 0, 70) + head + bytes(pixel) * 4)
png("grey.png", 0, [188]), png("grey_alpha.png", 4, [188, 20])
colours = [188, 90, 40]
png("colours.png", 2, colours), png("key.png", 2, colours, tRNS=[0, 188, 0, 90, 0, 40])
png("palette.png", 3, [1], PLTE=[0, 0, 0] + colours, tRNS=[255, 20])
png("sixty.png", 0, [60]), png("alpha.png", 6, [188, 90, 40, 60])
byte = [255 << 8 * i for i in range(4)]
bmp("bgra.bmp", [byte[2], byte[1], byte[0], byte[3]], [40, 90, 188, 20])
bmp("abgr.bmp", [byte[3], byte[2], byte[1], byte[0]], [20, 40, 90, 188])
bmp("rgbx.bmp", [byte[0], byte[1], byte[2], 0], [188, 90, 40, 0])
bmp("ten.bmp", [1023 << 20, 1023 << 10, 1023, 0], [188, 90, 40, 0])
tga("colour.tga", [40, 90, 188]), tga("colour_alpha.tga", [40, 90, 188, 20])
E
cat >float.pbrt <<'S'
LookAt 0 0 -5  0 0 0  0 1 0
Camera "orthographic"
Film "rgb" "integer xresolution" 4 "integer yresolution" 4
WorldBegin
Texture "f" "float" "imagemap" "string filename" "FILE" "string encoding" "linear"
AreaLightSource "diffuse" "bool twosided" true
Shape "disk" "float radius" 9 "texture alpha" "f"
S
picture() { # picture SCENE FILE OUT
    sed "s#FILE#$2#" "$1.pbrt" >scene.pbrt
    "$P" scene.pbrt -q --spp 64 --reproducible -o "$3"
}
same() { picture "$1" "$2" up.exr && picture "$1" "$3" got.exr && cmp up.exr got.exr; } # same SCENE FILE FILE

# what pbrt-v4 reads of a float image: alpha of a PNG of four channels, else grey or the mean of the colours
t "grey beside alpha" same float grey.png grey_alpha.png
t "alpha beside colours" same float sixty.png alpha.png
t "colours of a TGA with alpha" same float colour.tga colour_alpha.tga
t "colours of a PNG, one of them transparent" same float colours.png key.png
t "  …in a palette" same float colours.png palette.png
t "  …which are another value than that alpha" sh -c '! cmp up.exr sixty.exr' "$(picture float sixty.png sixty.exr)"

# a picture of 3 x 2 in each order that Radiance knows: -Y is from the top down, the second axis is that of a scanline
python3 - <<'E' || exit 2
size = {"X": 3, "Y": 2}
def along(axis):
    n = list(range(size[axis[1]]))
    return n if axis in ("+X", "-Y") else n[::-1]
for order in "-Y +X", "-Y -X", "+Y -X", "+Y +X", "+X -Y", "+X +Y", "-X +Y", "-X -Y":
    a, b = order.split()
    data = b""
    for i in along(a):
        for j in along(b):
            x, y = (j, i) if a[1] == "Y" else (i, j)
            data += bytes([40 + 70 * x, 40 + 120 * y, 90, 128])
    head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n%s %d %s %d\n" % (a, size[a[1]], b, size[b[1]])
    open("order%s.hdr" % order.replace(" ", ""), "wb").write(head.encode() + data)
E
cat >colour.pbrt <<'S'
LookAt 0 0 -5  0 0 0  0 1 0
Camera "orthographic"
Film "rgb" "integer xresolution" 12 "integer yresolution" 12
WorldBegin
LightSource "infinite"
Texture "t" "spectrum" "imagemap" "string filename" "FILE"
Material "diffuse" "texture reflectance" "t"
Shape "bilinearmesh" "point3 P" [-1 -1 0 1 -1 0 -1 1 0 1 1 0]
S
for order in -Y-X +Y-X +Y+X +X-Y +X+Y -X+Y -X-Y; do
    t "a file of Radiance, $order" same colour order-Y+X.hdr "order$order.hdr"
done
t "  …is compared right side up" sh -c "'${P%lull-render}ggn' flip order-Y+X.hdr order+X+Y.hdr --json | grep -q '\"max\": 0.000000'"
oiiotool order-Y+X.hdr -d uint8 --attrib Orientation 4 -o turned.dpx
sed "s#FILE#turned.dpx#" colour.pbrt >scene.pbrt
refused "turned.dpx: a DPX whose first pixel is not at the top left" scene.pbrt -q --spp 1 -o x.exr

for file in bgra abgr rgbx; do
    t "a BMP of 32 bits, $file" same colour colours.png $file.bmp
done
sed "s#FILE#ten.bmp#" colour.pbrt >scene.pbrt
refused "cannot read ten.bmp: a BMP whose colours are no bytes" scene.pbrt -q --spp 1 -o x.exr

# one line, without one of libpng's
printf '\211PNG\r\n\032\n\0\0\0\0IEND\256B\140\202' >empty.png
sed "s#FILE#empty.png#" colour.pbrt >scene.pbrt
refused "cannot read empty.png: damaged PNG file (it does not begin with its header)" scene.pbrt -q --spp 1 -o x.exr

printf 'Pf\r\n1 1\r\n-1.0\r\n\0\0\200\077' >crlf.pfm
sed "s#FILE#crlf.pfm#" colour.pbrt >scene.pbrt
refused "cannot read crlf.pfm: a PFM whose header ends in CR and LF" scene.pbrt -q --spp 1 -o x.exr
printf 'Pf\n1 1\n-1.0\n\0\0\200\077' >lf.pfm
t "  …in LF it is read" picture colour lf.pfm got.exr

# a TIFF of a third of its pixels, whose reader goes on
oiiotool --pattern noise 64x64 3 -d uint8 --compression none -o whole.tif && head -c 4000 whole.tif >cut.tif
sed "s#FILE#cut.tif#" colour.pbrt >scene.pbrt
refused "cannot read cut.tif: not an image that can be read" scene.pbrt -q --spp 1 -o x.exr
t "  …the whole is read" picture colour whole.tif got.exr

# the picture of a light: what is no light is 0 and said, in a sky of either shape; all else is right
python3 - <<'E' || exit 2
import struct
def pfm(name, width, height, pixels):
    values = [0.5] * (3 * width * height)
    for (x, y), v in pixels.items(): values[3 * ((height - 1 - y) * width + x)] = v
    open(name, "wb").write(b"PF\n%d %d\n-1\n" % (width, height) + struct.pack("<%df" % len(values), *values))
inf = float("inf")
pfm("good.pfm", 32, 16, {(20, 2): 65504.0 / 1e9})
for name, v in ("inf", inf), ("minus-inf", -inf), ("nan", float("nan")), ("negative", -1.0):
    pfm("long-%s.pfm" % name, 32, 16, {(20, 2): v, (21, 2): v})
    pfm("square-%s.pfm" % name, 16, 16, {(3, 9): v})
E
cat >sky.pbrt <<'S'
LookAt 0 0 5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.5 .5 -.5 .5 ]
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
WorldBegin
LIGHT
Material "diffuse" "rgb reflectance" [ 1 1 1 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -1 -1 0  1 -1 0  1 1 0  -1 1 0 ]
S
SKY='LightSource "infinite" "string filename"'
says() { # says LINE LIGHT: it renders with a light near .5, says so, and --strict refuses
    sed "s#LIGHT#$2#" sky.pbrt >scene.pbrt
    "$P" scene.pbrt --no-progress --spp 64 --seed 3 -o got.exr 2>err.txt && [ "$(grep -cF "$1" err.txt)" = 1 ] || return 1
    oiiotool got.exr --ch R,G,B --printstats | awk '/Stats Avg/ {exit !($3 > .44 && $3 < .52 && $4 > .48 && $4 < .52)}' || return 1
    "$P" scene.pbrt -q --spp 1 --strict -o none.exr 2>err.txt
    [ $? = 2 ] && [ ! -e none.exr ] && grep -qF "$1" err.txt
}
for bad_pixel in inf minus-inf nan negative; do
    t "a sky with $bad_pixel" says "long-$bad_pixel.pfm: 2 of its 512 pixels are infinite, NaN or negative, the first at x = 20, y = 2" "$SKY \"long-$bad_pixel.pfm\""
    t "  …that is square" says "square-$bad_pixel.pfm: 1 of its 256 pixels are infinite, NaN or negative, the first at x = 3, y = 9" "$SKY \"square-$bad_pixel.pfm\""
done
t "a sky without says nothing" sh -c "sed 's#LIGHT#$SKY \"good.pfm\"#' sky.pbrt >scene.pbrt && '$P' scene.pbrt -q --spp 1 --strict -o got.exr"

# '?' is no query
cp up.exr one.exr
for file in grey.png colour.tga order-Y+X.hdr one.exr; do
    cp "$file" "a?b.${file##*.}"
    t "a file called a?b.${file##*.}" same float "$file" "a?b.${file##*.}"
done
t "  …is compared" sh -c "'${P%lull-render}ggn' flip one.exr 'a?b.exr' --json | grep -q '\"max\": 0.000000'"
echo "1..$n"
exit $bad
