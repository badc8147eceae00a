#!/bin/sh
# lull-render --denoise, with a denoiser whose answers are known (tests/stub/oidn.c): what is written, said and refused.
. "$(dirname "$0")/lull_render_setup"
LULL_OIDN=$(cd "$(dirname "$P")/../tests/oidn-stub" && pwd)/libOpenImageDenoise.so.2
export LULL_OIDN OIDN_STUB=box
picture="$scene -q --size 48x40 --block 16 --reproducible"
common="$picture --spp-max 400"
layers() { exrheader "$1" | grep -o '^ *[a-zA-Z_.]*, 32-bit' | tr -d ' ,' | sed 's/32-bit//' | tr '\n' ' '; }
mean() { oiiotool "$1" --ch "$2" -o mean.exr && iinfo --stats mean.exr | sed -n 's/.*Stats Avg: *\([0-9.]*\).*/\1/p'; }
plane() { oiiotool "$1" --ch "$2" --chnames R,G,B -o "$3"; }
same() { oiiotool --fail 0 --warn 0 "$1" "$2" --diff; }

"$P" $common --denoise -o blend.exr --preview blend.png --report r.json
"$P" $common --denoise=full -o full.exr
ln -s "$P" linked
t "a link to the program is the program" sh -c "./linked $common --denoise -o linked.exr && cmp linked.exr blend.exr"
t "layers: what is kept, the noisy and the denoised picture, the weight, both errors" test "$(layers blend.exr)" = \
    "B G R albedo.B albedo.G albedo.R denoised.B denoised.G denoised.R lull.error.V lull.noisy_error.V lull.p_noisy.V lull.reason.V lull.spp.V lull.weight.V noisy.B noisy.G noisy.R normal.X normal.Y normal.Z "
plane full.exr R,G,B kept.exr && plane full.exr denoised.R,denoised.G,denoised.B denoised.exr
t "full: the picture is the denoised one" same kept.exr denoised.exr
plane blend.exr noisy.R,noisy.G,noisy.B noisy.exr
some() { awk -v w="$(mean blend.exr lull.weight.V)" 'BEGIN { exit !(w > 0.01 && w < 0.99) }'; }
t "blend: some of the noisy picture is kept, not all" some
w=lull.weight.V
plane blend.exr $w,$w,$w weight.exr && plane blend.exr R,G,B kept.exr && plane blend.exr denoised.R,denoised.G,denoised.B denoised.exr
oiiotool noisy.exr weight.exr --mul denoised.exr denoised.exr weight.exr --mul --sub --add -o mixed.exr
t "  …and the picture is that mixture" oiiotool --fail 1e-5 --warn 1e-5 kept.exr mixed.exr --diff
t "the report has the weight and both errors" sh -c "grep -q '\"noisy_weight\":[[:space:]]*0[.]' r.json && grep -q '\"noisy_error\"' r.json"
t "the criterion is denoised" grep -q '"id":[[:space:]]*"denoised"' r.json
"$P" $common --denoise -t 1 -o one.exr && "$P" $common --denoise -t 3 -o three.exr
t "the same bytes for any number of threads" cmp one.exr three.exr
interrupted c.ckpt $common --denoise -o part.exr
"$P" $common --denoise --checkpoint c.ckpt --resume -o resumed.exr
t "and after a resume" cmp blend.exr resumed.exr
"$P" $common -c fixed -p spp=32 -o plain.exr && "$P" $common -c fixed -p spp=32 --denoise -o fixed.exr
plane plain.exr R,G,B a.exr && plane fixed.exr noisy.R,noisy.G,noisy.B b.exr
t "any criterion: the noisy picture is the one without --denoise" same a.exr b.exr
"$P" $picture --spp 8 --denoise -o uniform.exr
t "--spp: nobody judges, the picture is denoised all the same" sh -c "exrheader uniform.exr | grep -q lull.weight && ! exrheader uniform.exr | grep -q noisy_error"
"$P" $scene -q --size 48x40 --block 16 --denoise --quote >quote.txt
t "a quote has both prices" sh -c "grep -q ' denoised  *[0-9]' quote.txt && grep -q ' noisy  *[0-9]' quote.txt"
t "  …and its drafts begin where their first looks are" \
    sh -c "grep -q '^ *8 x  rough  *16 ' quote.txt && grep -q '^ *4 x  draft  *32 ' quote.txt && grep -q '^ *2 x  good  *64 ' quote.txt"

refused "leave out --denoise" "$scene" --sequence d --denoise
refused "expected blend or full" "$scene" --denoise=much
LULL_OIDN=/nowhere
refused "/nowhere" "$scene" -q --denoise -o x.exr
refused "--denoise: " "$scene" -q --spp 4 --denoise -o x.exr
LULL_OIDN=$(cd "$(dirname "$P")/../tests/oidn-stub" && pwd)/libOpenImageDenoise.so.2 OIDN_STUB=crash
"$P" $picture --spp 8 --denoise -o crash.exr 2>err; status=$?
t "a denoiser that crashes: status not 0, one line, and the noisy picture is there" \
    sh -c "[ $status -ne 0 ] && [ \$(wc -l <err) = 1 ] && grep -q 'the picture is the noisy one: Open Image Denoise' err"
plane crash.exr R,G,B c.exr && plane uniform.exr noisy.R,noisy.G,noisy.B u.exr
t "  …with the samples that were taken" same c.exr u.exr

# A denoiser that never ends, until somebody asks the program to.
asked() { # asked SIGNAL ARGUMENTS...: the status after the signal, which comes while a picture is denoised
    rm -f begun
    sent=$1; shift
    OIDN_STUB=endless OIDN_STUB_BEGUN=$PWD/begun timeout 100 "$P" "$@" >out 2>err & pid=$!
    until [ -e begun ] || ! kill -0 $pid 2>/dev/null; do sleep 0.1; done
    kill -"$sent" $pid; wait $pid; status=$?
}
for s in TERM INT; do
    asked $s $picture --spp 8 --denoise -o asked.exr --report asked.json
    t "SIG$s while the last picture is denoised: 130, one line" sh -c "[ $status = 130 ] && [ \$(wc -l <err) = 1 ] && grep -q 'the noisy one: interrupted' err"
    plane asked.exr R,G,B c.exr
    t "  …and the noisy picture is there, the report says interrupted" sh -c "oiiotool --fail 0 --warn 0 c.exr u.exr --diff && grep -q '\"interrupted\":[[:space:]]*true' asked.json"
done
asked TERM $picture --spp 8 --denoise --frames 1-2 -o frame_%d.exr
t "  …of a frame of a shot: none is there, which would say that it is done" sh -c "[ $status = 130 ] && ! ls frame_* && [ ! -s err ]"
echo "1..$n"
exit $bad
