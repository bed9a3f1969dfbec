#!/bin/sh
# One part of a picture, as a task of a job array. Submitted by submit.sh, which says how many parts there are.
#
# Slurm sends SIGTERM before it takes a node away (and at the end of the time limit, by --signal). Sparing then writes a checkpoint and
# ends with 130; the task is put back into the queue and goes on from there, on any node.
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:TERM@60

part=$SLURM_ARRAY_TASK_ID
name="$SPARING_FOLDER/part-$part"

# The shell must hear the signal itself and pass it on: `exec` would leave nobody to requeue.
"$SPARING" render "$@" --threads "${SLURM_CPUS_PER_TASK:-1}" --shard "$part/$SPARING_PARTS" -o "$name.exr" \
    --checkpoint "$name.checkpoint.exr" --checkpoint-interval 2m --resume --progress alf &
render=$!
trap 'kill -TERM $render' TERM
code=0
wait $render || code=$?
# A signal ends the first wait; the second has the program's own exit code.
if [ $code -gt 128 ]; then
    code=0
    wait $render || code=$?
fi
if [ $code -eq 130 ]; then
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_$part"
fi
exit $code
