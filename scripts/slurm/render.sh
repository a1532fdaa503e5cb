#!/usr/bin/env bash
# Renders one picture on a Slurm cluster. Each task of a job array renders its own range of samples into its own
# film, and a final job merges the films.
#
#     scripts/slurm/render.sh SCENE OUT TASKS SAMPLES [SBATCH OPTION...] [-- RENDER FLAG...]
#
#     scripts/slurm/render.sh scene.toml out 64 65536 --time=4:00:00 --cpus-per-task=8 -- --size 1920x1080
#
# SCENE     the scene file
# OUT       a folder on a file system shared by all nodes; films go to OUT/parts, results to OUT/whole.npz, .exr and .png
# TASKS     number of tasks in the array
# SAMPLES   total samples per pixel. Every task gets a whole number of blocks of 256 (the last one gets the rest), so that
#           the merged film equals that of a single run to 1e-12.
#
# SBATCH OPTIONs (partition, memory, gres, time) are passed to the array, RENDER FLAGs to `etendue render`. Set ETENDUE to
# the program if it is not on the path. Prints the job numbers of the array and of the merge job.
#
# A task that is killed or preempted and requeued resumes its own film. Running the same command again resumes all tasks;
# finished ones end at once. Slurm sends SIGTERM before it kills a task, and the task then saves its film. Without SIGTERM
# at most a minute is lost (--checkpoint). To get SIGTERM before the time limit: --signal=B:TERM@60.
# OUT holds one division: other TASKS or SAMPLES need another OUT.
# The merge job waits for all tasks, and is cancelled if one fails (its log says why). Run the command again after fixing the
# cause. OUT/whole.npz is re-created each time from the films in OUT/parts.
set -euo pipefail

usage() {
    [ $# = 0 ] || printf '%s: %s\n\n' "$0" "$*" >&2
    sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//;p}' "$0" >&2
    exit 2
}
number() { # name value
    [[ $2 =~ ^[1-9][0-9]{0,9}$ ]] || usage "$1 is \"$2\", but must be a whole number of at least 1"
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

# The jobs: sbatch runs a copy of this file.
case ${1-} in
--task)
    etendue=$2 scene=$3 out=$4 tasks=$5 samples=$6
    shift 6
    range "$out" "$tasks" "$samples" "$SLURM_ARRAY_TASK_ID"
    # Two processes would overwrite each other's film: a requeued task may start while the old one is still ending.
    exec 9>"$part.lock"
    flock --timeout 120 9 || {
        echo "another task is rendering $part.npz" >&2
        exit 1
    }
    # exec: Slurm's signals must reach the program, which then saves its film.
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
    # `merge` never overwrites a film, so write a new one beside the old one and rename it.
    rm -f "$out/merging.npz"
    "$etendue" merge "$out/merging.npz" "${films[@]}"
    mv "$out/merging.npz" "$out/whole.npz"
    exec "$etendue" develop "$out/whole.npz" -o "$out/whole.exr" -o "$out/whole.png"
    ;;
-h | --help) usage 2>&1 ;;
esac

[ $# -ge 4 ] || usage "missing arguments: SCENE, OUT, TASKS and SAMPLES are required"
scene=$1 out=$2 tasks=$3 samples=$4
shift 4
number TASKS "$tasks"
number SAMPLES "$samples"
blocks=$(((samples + block - 1) / block))
((tasks <= blocks)) || {
    [ "$blocks" = 1 ] && are="1 block" || are="$blocks blocks"
    usage "$samples samples are $are of $block: too few for $tasks tasks"
}
options=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
    options+=("$1")
    shift
done
[ $# = 0 ] || shift
[ -r "$scene" ] || usage "cannot read the scene $scene"
etendue=$(command -v "${ETENDUE:-etendue}") ||
    usage "${ETENDUE:-etendue} not found: put it on the path, or set ETENDUE"
command -v sbatch >/dev/null || usage "sbatch not found: run this on a Slurm cluster"
"$etendue" check "$scene" >/dev/null
# What is wrong with a flag is said here, not by every task. The last flag ends the command before it renders.
for flag in "$@"; do
    case $flag in
    --spp* | --rays* | --time* | --error* | --samples* | --adaptive | --film*)
        usage "$flag can't be a RENDER FLAG: each task has a film and samples of its own"
        ;;
    esac
done
"$etendue" render "$scene" --samples "0..$samples" --film part.npz --output part.png --progress plain --threads 1 "$@" --help >/dev/null
# The films of another division overlap with these.
if [ -d "$out/parts" ]; then
    declare -A planned=()
    for ((task = 0; task < tasks; task++)); do
        range "$out" "$tasks" "$samples" "$task"
        planned[$part.npz]=1
    done
    for film in "$out"/parts/*.npz; do
        [ ! -e "$film" ] || [ -n "${planned[$film]-}" ] ||
            usage "$film is not a part of $samples samples in $tasks tasks: give OUT's own TASKS and SAMPLES, or another OUT"
    done
fi

mkdir -p "$out/parts" "$out/log"
# Jobs start in another folder, so they need absolute paths.
etendue=$(realpath "$etendue") scene=$(realpath "$scene") out=$(realpath "$out")
array=$(sbatch --parsable --job-name=etendue --array="0-$((tasks - 1))" --requeue --open-mode=append \
    --output="$out/log/part-%a.txt" ${options[@]+"${options[@]}"} \
    "$0" --task "$etendue" "$scene" "$out" "$tasks" "$samples" "$@")
array=${array%%;*}
merge=$(sbatch --parsable --job-name=etendue-merge --dependency="afterok:$array" --requeue --open-mode=append \
    --kill-on-invalid-dep=yes --output="$out/log/merge.txt" \
    "$0" --merge "$etendue" "$out" "$tasks" "$samples")
echo "array $array, merge ${merge%%;*}"
