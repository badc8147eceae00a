#!/bin/sh
# What a picture depends on: an option that makes another picture makes another identity, so that no checkpoint of the one is taken for
# one of the other. Every option of --help has its line here: an example, or why it has none.
. "$(dirname "$0")/lull_render_setup"
common="$scene --size 24x16 --block 8 --spp-min 4 --spp-max 12 -q --reproducible"
oiiotool --create 24x16 1 --fill:color=1 8x8+0+0 -d uint8 -o mask.png
identity() { # the lines that a checkpoint holds behind its magic
    python3 - "$1" <<'P'
import struct, sys
data = open(sys.argv[1], "rb").read()
sys.stdout.buffer.write(data[16:16 + struct.unpack_from("<Q", data, 8)[0]])
P
}
render() { # NAME OPTIONS…: NAME.exr and NAME.txt, the identity
    name=$1; shift
    rm -f "$name.ckp"
    eval '"$P"' $common --checkpoint "$name.ckp" -o "$name.exr" "$@" && identity "$name.ckp" >"$name.txt"
}
t "the render to compare with" render base
t "  …has an identity" grep -q '^seed=0$' base.txt
same() { oiiotool -a --fail 0 --hardfail 0 --warn 0 --diff "$1" "$2"; } # the pixels of every layer
told() { # OPTIONS…: the identity differs where the picture does
    render other "$@" && { ! cmp -s base.txt other.txt || same base.exr other.exr; }
}
kept() { # OPTIONS…: the same picture and the same identity
    render other "$@" && cmp base.txt other.txt && { cmp -s base.exr other.exr || same base.exr other.exr; }
}
cat >decide <<'O'
--block 16
--criterion fixed
--visible 0.1
--error 2
--mask mask.png
--param visible=0.4
--spp-min 8
--spp-max 16
--max-seam 1.5
--crop 0,0,8,8
--look-at "0 1 3 0 1 0 0 1 0"
--fov 30
--light-selection power
--sampler sobol
--integrator bsdf-only
--max-depth 2
--filter box
--seed 9
--size 32x16
--aov depth
O
cat >leave <<'O'
--effects all
--strict
--threads 1
--rank-timeout 5
--no-progress
--quiet
--reproducible
--preview p.png
--stop-map s.csv
--report r.json
--report r.json --live
--html h.html
--checkpoint-every 0
--time-budget 1000
--max-check-overhead 0.9
O
while read -r option; do
    t "another picture is another identity: $option" told "$option"
done <decide
t "  …and so is --spp" sh -c "'$P' $scene --size 24x16 --block 8 --spp 12 -q --checkpoint u.ckp -o u.exr && ! cmp -s base.ckp u.ckp"
while read -r option; do
    t "the same picture and identity: $option" kept "$option"
done <leave
# Of other work than a picture, of where files are, and --denoise, whose parameter and planes are in the identity (denoised.sh).
elsewhere="--usage --help --version --list-criteria --output --checkpoint --resume --live --quoted --display-server --denoise --spp --json --quote
--quote-map --quote-pilot --camera-path --frame-seed --frames --plan-every --plan-shot --shot-table --debug-path --explain --blocks --levels --name
--past-stops --planes --reference-spp --sequence"
"$P" --help | grep -oE '^ +(-.,? )?--[a-z-]+' | grep -oE -e '--[a-z-]+' | sort -u >all
{ cut -d' ' -f1 decide leave; printf '%s\n' $elsewhere; } | sort -u >known
t "every option of --help is here" sh -c "comm -23 all known | tee missing; ! test -s missing"
echo "1..$n"
exit $bad
