#!/bin/sh
# ggn evaluate by several processes: the same tables for any number; processes that do not have the same are refused by name.
. "$(dirname "$0")/lull_render_setup"
. "$here/mpi_setup"
G=${P%/*}/ggn
says='ggn [a-z]*'
data=$here/../data/train-demo
same() { cmp "$1" "$2"; }
t "a model" "$G" train --data "$data" --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 5 --batch-denoiser 4 \
    --steps-denoiser 3 --steps 4 --epoch-steps 2 --out one.ggn -q

t "tables by one process" sh -c "$G evaluate -d $data -m one.ggn -o one-figures >one.txt"
for processes in 2 3 5; do
    rm -rf many-figures
    t "tables by $processes processes" sh -c "mpirun --oversubscribe -n $processes $G evaluate -d $data -m one.ggn \
        -o many-figures >many.txt"
    t "  …the same tables" same one.txt many.txt
    t "  …the same figures" diff -r one-figures many-figures
done
for h in 0 1; do mkdir -p host$h; cp one.ggn host$h/model.ggn; done
mpi_refused "a.ggn: No such file" 3 "$G" evaluate -d "$data" -m a.ggn
printf x >>host1/model.ggn
mpi_refused "rank 1 on host $(hostname)" 2 sh -c "cd host\$OMPI_COMM_WORLD_RANK && exec $G evaluate -d $data -m model.ggn"

# --- processes that do not have the same: folders of their own stand for hosts ---
for h in 0 1; do cp -r "$data" host$h/data; cp one.ggn host$h/model.ggn; done
each() { mpi_refused "$1" 2 sh -c "cd host\$OMPI_COMM_WORLD_RANK && exec $2 $G evaluate -d data -m model.ggn"; }
each "has instructions=base (LULL_ISA)" 'env LULL_ISA=$([ $OMPI_COMM_WORLD_RANK = 1 ] && echo base || echo avx512)'
swap=$(cd host1/data && ls */*.lseq | head -n 1); other=$(cd host1/data && ls */*.lseq | sed -n 2p)
mv "host1/data/$swap" x; mv "host1/data/$other" "host1/data/$swap"; mv x "host1/data/$other"
each "rank " "" # by the block's number in the file, or by the pixels
rm "host1/data/$swap"
each "$swap: No such file" ""
exit $bad
