#!/usr/bin/env bash
# One picture by many tasks of a Slurm cluster: a job array in which every task renders its own range of sample
# numbers into its own film, and a job that merges the films when all of them are done.
#
#     scripts/slurm/render.sh SCENE OUT TASKS SAMPLES [SBATCH OPTION...] [-- RENDER FLAG...]
#
#     scripts/slurm/render.sh scene.toml out 64 65536 --time=4:00:00 --cpus-per-task=8 -- --size 1920x1080
#
# SCENE     the scene file
# OUT       a folder that every node sees; films go to OUT/parts, the result is OUT/whole.npz, .exr and .png
# TASKS     tasks in the array
# SAMPLES   samples a pixel in all. Every task gets a whole number of blocks of 256, so that the merged film equals
#           that of a single run to 1e-12; the last one takes what is left.
#
# SBATCH OPTIONs (partition, memory, gres, time) go to the array, RENDER FLAGs to `etendue render`. ETENDUE names the
# program if it is not on the path. Prints the numbers of the array and of the merge job.
#
# A task that is killed or preempted and requeued goes on from its own film, and so does everything when the same command
# is given again: tasks that were done are done at once. Slurm sends SIGTERM before it kills, on which the film is saved;
# without it at most a minute is lost (--checkpoint). For a warning before the time is over: --signal=B:TERM@60.
# The merge waits for all tasks and is dropped when one fails for good (its log says why); give the command again once
# the cause is gone. OUT/whole.npz is made anew each time, from the films in OUT/parts.
set -euo pipefail

usage() {
    [ $# = 0 ] || printf '%s: %s\n\n' "$0" "$*" >&2
    sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0" >&2
    exit 2
}
number() { # name value
    [[ $2 =~ ^[1-9][0-9]{0,9}$ ]] || usage "$1 is a whole number from 1, not \"$2\""
}

# Sample numbers and film of a task: range OUT TASKS SAMPLES TASK sets first, end, part.
block=256
range() {
    local blocks=$((($3 + block - 1) / block))
    # shellcheck disable=SC2017 # whole blocks are meant
    first=$((blocks * $4 / $2 * block)) end=$((blocks * ($4 + 1) / $2 * block))
    end=$((end < $3 ? end : $3))
    part=$(printf '%s/parts/%08d-%08d' "$1" "$first" "$end")
}

# The jobs themselves, to which sbatch gives a copy of this file.
case ${1-} in
--task)
    etendue=$2 scene=$3 out=$4 tasks=$5 samples=$6
    shift 6
    range "$out" "$tasks" "$samples" "$SLURM_ARRAY_TASK_ID"
    # Two at a time would overwrite each other's work: an older task may take a while to die.
    exec 9>"$part.lock"
    flock --timeout 120 9 || {
        echo "another task is at work on $part.npz" >&2
        exit 1
    }
    # exec: Slurm's signals are for the program, which saves its film.
    exec "$etendue" render "$scene" --samples "$first..$end" --film "$part.npz" --output "$part.png" \
        --progress plain --threads "${SLURM_CPUS_ON_NODE:-1}" "$@"
    ;;
--merge)
    etendue=$2 out=$3 tasks=$4 samples=$5
    films=()
    for ((task = 0; task < tasks; task++)); do
        range "$out" "$tasks" "$samples" "$task"
        films+=("$part.npz")
    done
    # `merge` never replaces a film, so a new one is made beside the old and renamed.
    rm -f "$out/merging.npz"
    "$etendue" merge "$out/merging.npz" "${films[@]}"
    mv "$out/merging.npz" "$out/whole.npz"
    exec "$etendue" develop "$out/whole.npz" -o "$out/whole.exr" -o "$out/whole.png"
    ;;
-h | --help) usage 2>&1 ;;
esac

[ $# -ge 4 ] || usage "SCENE, OUT, TASKS and SAMPLES are needed"
scene=$1 out=$2 tasks=$3 samples=$4
shift 4
number TASKS "$tasks"
number SAMPLES "$samples"
((tasks <= (samples + block - 1) / block)) ||
    usage "$samples samples are $(((samples + block - 1) / block)) blocks of $block: too few for $tasks tasks"
options=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
    options+=("$1")
    shift
done
[ $# = 0 ] || shift
[ -r "$scene" ] || usage "cannot read the scene $scene"
etendue=$(command -v "${ETENDUE:-etendue}") ||
    usage "no program ${ETENDUE:-etendue}: put it on the path, or name it in ETENDUE"
command -v sbatch >/dev/null || usage "no sbatch here: this is for a Slurm cluster"
"$etendue" check "$scene" >/dev/null

mkdir -p "$out/parts" "$out/log"
# Jobs start elsewhere: they get absolute names.
etendue=$(realpath "$etendue") scene=$(realpath "$scene") out=$(realpath "$out")
array=$(sbatch --parsable --job-name=etendue --array="0-$((tasks - 1))" --requeue --open-mode=append \
    --output="$out/log/part-%a.txt" ${options[@]+"${options[@]}"} \
    "$0" --task "$etendue" "$scene" "$out" "$tasks" "$samples" "$@")
array=${array%%;*}
merge=$(sbatch --parsable --job-name=etendue-merge --dependency="afterok:$array" --requeue --open-mode=append \
    --kill-on-invalid-dep=yes --output="$out/log/merge.txt" \
    "$0" --merge "$etendue" "$out" "$tasks" "$samples")
echo "array $array, merge ${merge%%;*}"
