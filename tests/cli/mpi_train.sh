#!/bin/sh
# ggn train and ggn evaluate by several processes: the same model again for as many, the curves of one process but for rounding for any
# number, the same tables; a process that dies or hangs; the checkpoint of some resumed by others; processes that do not have the same.
. "$(dirname "$0")/lull_render_setup"
. "$here/mpi_setup"
G=${P%/*}/ggn
says='ggn [a-z]*'
data=$here/../data/train-demo
same() { cmp "$1" "$2"; }
timeless() { cut -d, -f1-8 "$1"; }
# As many rows, losses within a hundredth; what rounding does to accuracies of so few blocks says nothing
near_curves() { # near_curves A B [PHASE]: only rows of the phase
    cut -d, -f1,2,3,5 "$1" | grep "${3:-,}" >a.txt; cut -d, -f1,2,3,5 "$2" | grep "${3:-,}" >b.txt
    paste -d, a.txt b.txt | awk -F, '$1 != "phase" { for (i = 3; i <= 4; i++) { d = $i - $(i + 4); if (d < 0) d = -d
        if ($1 != $5 || $2 != $6 || !(d <= 0.01 * $i)) exit 1 } }' && [ "$(wc -l <a.txt)" = "$(wc -l <b.txt)" ]
}
same_curves() { timeless "$1" >a.txt; timeless "$2" >b.txt; cmp a.txt b.txt; }
tiny="--data $data --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 5 --batch-denoiser 4 --picture 0.5"

# --- same bytes ---
short="$tiny --steps-denoiser 3 --steps 4 --epoch-steps 2 --average 2"
t "a model by one process" "$G" train $short --out one.ggn --threads 2 -q
for processes in 2 3 5; do # more than crops in a batch, too
    t "$processes processes" sh -c "mpirun --oversubscribe -n $processes $G train $short --out many.ggn \
        --threads $((processes == 3 ? 2 : 1)) 2>said"
    t "  …the same curves but for rounding" near_curves one.ggn.csv many.ggn.csv
    t "  …progress is told once" test "$(grep -c 'judge  *4/4' said)" -eq 1
    t "  …and what was sent" grep -q "^$processes processes: [0-9]* messages, [0-9.]* MB per step" said
    mv many.ggn first.ggn; mv many.ggn.csv first.csv; rm -f many.*
    t "  …again" mpi $processes "$G" train $short --out many.ggn --threads 1 -q
    t "  …the same model" same first.ggn many.ggn
    t "  …the same curves but for times" same_curves first.csv many.ggn.csv
    rm -f many.*
done
paper="--preset paper $tiny --picture 0 --epochs 1 --batch 100" # three validation chains: as many as processes, below
t "the published order by one process" "$G" train $paper --out one-paper.ggn -q
t "  …by three processes" mpi 3 "$G" train $paper --out many.ggn -q
t "  …the same curves but for rounding" near_curves one-paper.ggn.csv many.ggn.csv

# --- evaluation ---
t "tables by one process" sh -c "$G evaluate -d $data -m one.ggn -o one-figures >one.txt"
for processes in 2 3 5; do
    rm -rf many-figures
    t "tables by $processes processes" sh -c "mpirun --oversubscribe -n $processes $G evaluate -d $data -m one.ggn \
        -o many-figures >many.txt"
    t "  …the same tables" same one.txt many.txt
    t "  …the same figures" diff -r one-figures many-figures
done
# What holds a block back is shared too: the small set above has no half buffers, a recording does.
mkdir guarded
t "a recording with half buffers" "$P" "$scene" -q --size 80x80 --block 40 --sampler independent --levels geometric:2:96:1.35 \
    --reference-spp 0 --sequence guarded/view --name view
{
    printf '{"format": "lull-labels", "version": 1, "source": "observer", "detail": "made up", "cap": 10000, "spread": 0.15, "blocks": ['
    for id in 0 1 2 3; do printf '%s{"id": %d, "threshold": 20, "censored": false}' "$([ $id = 0 ] || echo ,)" $id; done
    echo ']}'
} >guarded/view/labels.json
# held PROCESSES FOLDER OPTIONS...: the table to FOLDER.txt, the figures into FOLDER
held() {
    processes=$1 folder=$2; shift 2
    mpirun --oversubscribe -n "$processes" "$G" evaluate -d guarded -m one.ggn -p visible=0.9 -p gate=0 --recorded --no-quality "$@" \
        -o "$folder" >"$folder.txt"
}
t "the guard's tables by one process" held 1 one-held -p tail=0.6
t "  …which holds blocks back" sh -c "$G evaluate -d guarded -m one.ggn -p visible=0.9 -p gate=0 --recorded --no-quality -p tail=0 -p gini=0 \
    -o none-held >none-held.txt && ! cmp one-held/*-stops-oneggn.csv none-held/*-stops-oneggn.csv"
for processes in 2 3; do
    t "the guard's tables by $processes processes" held $processes many-held -p tail=0.6
    t "  …the same tables" same one-held.txt many-held.txt
    t "  …the same figures" diff -r one-held many-held
done
for h in 0 1; do mkdir -p host$h; cp one.ggn host$h/model.ggn; done
mpi_refused "a.ggn: No such file" 3 "$G" evaluate -d "$data" -m a.ggn
printf x >>host1/model.ggn
mpi_refused "rank 1 on host $(hostname)" 2 sh -c "cd host\$OMPI_COMM_WORLD_RANK && exec $G evaluate -d $data -m model.ggn"

# --- processes that do not have the same: folders of their own stand for hosts ---
for h in 0 1; do cp -r "$data" host$h/data; cp one.ggn host$h/init.ggn; done
own="--data data --kr 3 --km 3 --kd 4 --crop 32 --ratio 0 --batch 4 --steps-denoiser 1 --steps 1 --picture 0.5"
each() { mpi_refused "$1" 2 sh -c "cd host\$OMPI_COMM_WORLD_RANK && exec $2 $G train $own --out m.ggn -q $3"; }
each "has instructions=base (LULL_ISA)" 'env LULL_ISA=$([ $OMPI_COMM_WORLD_RANK = 1 ] && echo base || echo avx512)' ""
each "has options-crc=" "" '--lr 0.01$OMPI_COMM_WORLD_RANK'
each "rank 1 on host $(hostname)" "" '--seed $OMPI_COMM_WORLD_RANK' # of which synthetic data are a function
cp one-paper.ggn host1/init.ggn
each "init.ggn: networks of another" "" "--init init.ggn"
"$G" train $short --out host1/init.ggn --seed 7 -q
each "has files-crc=" "" "--init init.ggn"
swap=$(cd host1/data && ls */*.lseq | head -n 1); other=$(cd host1/data && ls */*.lseq | sed -n 2p)
mv "host1/data/$swap" x; mv "host1/data/$other" "host1/data/$swap"; mv x "host1/data/$other"
each "rank " "" "" # by the block's number in the file, or by the pixels
rm "host1/data/$swap"
each "$swap: No such file" "" ""
t "nothing was written where something differed" test ! -e host0/m.ggn -a ! -e host1/m.ggn

# --- faults ---
long="$tiny --steps-denoiser 40 --steps 20 --epoch-steps 4 -q"
begin() { # begin N ARGUMENTS...: in the background, until there is a checkpoint
    processes=$1; shift
    rm -f part.*
    start part.ggn.ckpt "$processes" "$G" train $long --out part.ggn --threads 1 "$@"
}
t "a longer training, by one process" "$G" train $long --out long.ggn
t "…by two" mpi 2 "$G" train $long --out long2.ggn

kill_one
t "  …there is no model" test ! -e part.ggn
t "  …the checkpoint goes on, with two processes" mpi 2 "$G" train $long --out part.ggn --resume
t "  …to the same curves but for rounding" near_curves long.ggn.csv part.ggn.csv denoiser

hang_one 2
t "  …the checkpoint goes on, with one process" "$G" train $long --out part.ggn --resume
t "  …to the same curves but for rounding" near_curves long.ggn.csv part.ggn.csv denoiser

begin 2
kill -INT "$(pid_of 0)"
ended "interrupted at rank 0" 130 "interrupted; --resume continues"
t "  …the checkpoint goes on, with two processes" mpi 2 "$G" train $long --out part.ggn --resume
t "  …to the same model" same long2.ggn part.ggn
t "  …and the same curves" same_curves long2.ggn.csv part.ggn.csv
exit $bad
