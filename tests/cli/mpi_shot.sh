#!/bin/sh
# mpirun lull-render --frames: processes share the frames, which are the same as from one.
. "$(dirname "$0")/lull_render_setup"
. "$here/mpi_setup"
small="-q --size 48x32 --block 16 --reproducible --spp 4 -t 1"
"$P" "$scene" --frames 1-3 $small -o one_%d.exr
t "processes share the frames" mpi 2 "$P" "$scene" --frames 1-3 $small -o two_%d.exr
for frame in 1 2 3; do t "  …frame $frame is the same" cmp one_$frame.exr two_$frame.exr; done
t "more processes than frames" mpi 3 "$P" "$scene" --frames 7,8 $small -o few_%d.exr
t "  …make them, too" test -e few_7.exr -a -e few_8.exr
mpi_refused "--plan-shot is the work of one process" 2 "$P" "$scene" --frames 1-3 -q --size 48x32 --plan-shot T.csv
echo "1..$n"
exit $bad
