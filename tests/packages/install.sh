#!/bin/sh
# `make install`, what it puts in place, and `make uninstall`.
. "$(dirname "$0")/setup"
as sudo 'exec "$@"'
as make "exec $(command -v make) -s -o all PREFIX=/opt/lull DESTDIR=$tmp/root \"\$@\"" # all: what is built
at=$tmp/root/opt/lull
line=$(readme_line "make && sudo make install")
t "README's line: $line" sh -c "$line"
t "a renderer that finds its criteria" sh -c "cd $tmp && $at/bin/lull-render $room --preview a.png && $at/bin/lull-render --list-criteria | grep -q ' $at/.*/observer.so'"
t "the same picture as from the build tree" sh -c "$BUILD/bin/lull-render $room --preview $tmp/b.png && cmp $tmp/a.png $tmp/b.png"
t "networks that find their models" "$at/bin/lull-render" $room -c ggn -o "$tmp/c.exr"
t "modules that the programs find" sh -c "$at/bin/ggn flip scenes/demo-reference.png scenes/demo-reference.png && [ -x $at/lib/lull/modules/lull-denoiser ]"
t "  …criteria that are Python files among them" sh -c "python3 -c 'import numpy' || exit 0
    cd $tmp && $at/bin/lull-render $room -c $repo/plugin-api/examples/dammertz.py -o d.exr"
t "a study, with its pictures and the words of its page" sh -c "$at/bin/lull-study init $tmp/study --task thresholds --views \
    tests/data/recorded/train/one-view0 --asked-by Ada --contact here && [ -s $tmp/study/texts.json ] && [ -s $tmp/study/stimuli/v0/b0-8.png ]"
t "a picture of numbers" sh -c "printf 'view;block;threshold;censored;stop;score\\na;0;100;0;110;\\na;1;200;0;190;\\n' >$tmp/stops.csv && $at/bin/lull-plot $tmp/stops.csv -o $tmp/stops.png && [ -s $tmp/stops.png ]"
t "a man page of each program" sh -c "for p in $at/bin/*; do [ -s $at/share/man/man1/\${p##*/}.1 ] || exit 1; done"
# As people press Tab: $@ are the words of the line, the last one is completed.
complete() { bash -c 'PATH=$0/bin:$PATH; . $0/share/bash-completion/completions/${1##*/}; COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)); _lull; echo "${COMPREPLY[@]}"' "$at" "$@"; }
completes() { want=$1; shift; complete "$@"; [ "$(complete "$@")" = "$want" ]; }
t "Tab: options" completes "--spp= --spp-max= --spp-min=" lull-render --spp
t "  …with a short form" completes "--criterion=" lull-render --crit
t "  …their choices" completes "box triangle gaussian" lull-render --filter =
t "  …as they begin" completes triangle lull-render --filter = t
t "  …criteria" completes observer lull-render -c obs
t "  …files" completes scenes/demo.pbrt lull-render scenes/demo.
t "  …commands" completes train ggn tr
t "  …and their options" completes "--preset=" ggn train --pres
t "  …of every program" sh -c "for p in $at/bin/*; do [ -e $at/share/bash-completion/completions/\${p##*/} ] || exit 1; done"
t "uninstall" make uninstall
t "  …leaves no file" sh -c "! find $tmp/root ! -type d | grep ." 
t "  …and no folder of its own" sh -c "! find $at -mindepth 1 -name '*lull*' | grep ."
t "a DESTDIR with a blank and a quote" make install DESTDIR="$tmp/it's a root"
t "  …is found whole" "$tmp/it's a root/opt/lull/bin/lull-render" $room -c ggn -o "$tmp/d.exr"
t "  …and emptied" make uninstall DESTDIR="$tmp/it's a root"
t "  …of every file" sh -c '! find "$0" ! -type d | grep .' "$tmp/it's a root"
refused() { ! make "$@" 2>"$tmp/err" && [ "$(wc -l <"$tmp/err")" = 1 ] && grep -q ': expected folders without blanks' "$tmp/err"; }
t "a PREFIX that make would cut apart is refused" refused install PREFIX="/opt/lull too" DESTDIR="$tmp/cut"
t "  …so is one for uninstall" refused uninstall PREFIX="/opt/lull too" DESTDIR="$tmp/cut"
echo "1..$n"
