#!/bin/sh
# ggn label by several processes: views are shared out; what goes wrong is said once, and commands that share nothing refuse.
. "$(dirname "$0")/lull_render_setup"
. "$here/mpi_setup"
G=${P%/*}/ggn
same() { cmp "$1" "$2"; }
mkdir alone
for v in a b c; do
    "$P" "$scene" -q --size 24x24 --block 24 --sampler independent --seed ${#v} --sequence alone/$v --levels geometric:16:384:4.8 --reference-spp 0
done
cp -r alone shared
t "labels by one process" "$G" label alone
for processes in 2 5; do
    rm -f shared/*/labels.json
    t "labels by $processes processes" sh -c "mpirun --oversubscribe -n $processes $G label shared >said"
    t "  …each view by one of them" test "$(grep -c ' blocks labelled' said)" = 3
    for v in a b c; do t "  …the same of view $v" same alone/$v/labels.json shared/$v/labels.json; done
done
says='ggn [a-z]*'
printf x >shared/b/block-00000.lseq
mpi_refused "block-00000.lseq" 3 "$G" label shared
mpi_refused "unknown option" 3 "$G" label --nonsense shared
mpi_refused "start it without mpirun" 2 "$G" train --data shared --out model.ggn
t "  …before anything is written" test ! -e model.ggn.ckpt -a ! -e model.ggn.csv
mpi_refused "start it without mpirun" 2 "$G" inspect "$here/../../ggn/models/lull-3.ggn"
exit $bad
