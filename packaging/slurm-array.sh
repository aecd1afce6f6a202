#!/bin/bash
# Frames of a job by many machines: Slurm counts the shards, each is a task of a job array.
#
#     sbatch --array=0-15 --cpus-per-task=4 slurm-array.sh JOB.json OUT
#
# OUT is one folder of all machines. Frames that are complete are kept, so that a task that is started again goes on where the last
# one was killed. Slurm does so after the loss of a node; with RequeueExit=75 in slurm.conf after a stop or a full disk too.
# The array begins at 0 and has no gap; what a failed task left, the same command makes.
#SBATCH --job-name=gonio-frames
#SBATCH --array=0-3
#SBATCH --cpus-per-task=1
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=%x-%A_%a.jsonl
#SBATCH --error=%x-%A_%a.err
set -eu

# What stops it again and again is no accident.
if ((${SLURM_RESTART_COUNT:-0} > 50)); then exit 1; fi

# The scheduler's CPUs: task/affinity and task/cgroup bind the task to them. Where Slurm binds nothing, each task takes CPUs that no
# other one has; goniod inherits the locks, which end with it.
cpus=${SLURM_CPUS_PER_TASK:-1}
export LP_NUM_THREADS=$cpus # llvmpipe, where there is no GPU
if (($(nproc) > cpus)); then
    taken=()
    for range in $(taskset -cp $$ | sed 's/.*://; s/,/ /g'); do
        for cpu in $(seq "${range%-*}" "${range#*-}"); do
            exec {lock}< "/sys/devices/system/cpu/cpu$cpu"
            if ((${#taken[@]} < cpus)) && flock -n "$lock"; then taken+=("$cpu"); else exec {lock}<&-; fi
        done
    done
    if ((${#taken[@]} > 0)); then
        taskset -cp "$(IFS=,; echo "${taken[*]}")" $$ >&2
    fi
fi

exec goniod --oneshot "$1" --out "$2" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"
