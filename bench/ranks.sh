#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Scaling of ranks under mpirun: bench/ranks.sh FOLDER OF THE PROGRAM [MPI] [MOST RANKS] [ROUNDS].
# The runs of a round follow each other, and of each the least seconds of all rounds count: on a machine
# with other work, those of a moment without it. Seconds are those between the start and the end of a
# rank's program, of the slowest rank. MPI takes some tenths of a second to start and to end its
# processes; `start` is what a run of next to no work takes, and where it says so it is not counted.
#
#   start          of two ranks, of one process; processor seconds
#   strong         the same gradient by 1, 2, 4, ... ranks of one thread: speed / ranks
#   weak           as many samples a rank: time of one rank / time
#   ranks/threads  two ranks of one thread against one process of two threads: speed, with and without
#                  the start; processor seconds of these / of those, without the start
#   fit            the same of a fit of 300 steps of some milliseconds: messages cost most there
#   memory         peak of a rank, against one process: pictures of 1024 x 1024 and 2048 x 2048; what
#                  MPI takes itself is the peak of a rank with a small picture, less one process with it
set -eu
export PATH=$1:$PATH LC_ALL=C OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_hwloc_base_binding_policy=none
export OMPI_MCA_btl_vader_single_copy_mechanism=none
mpi=${2-openmpi} most=${3-$(nproc)} rounds=${4-3}
scenes=$(cd "$(dirname "$0")/.." && pwd)/scenes
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export WORK=$work
# A rank of a run: its seconds, processor seconds and peak, in a file of its own. MPICH's ranks
# talk to mpirun through a file that they inherit.
cat >"$work/rank.py" <<'P'
import os, resource, subprocess, sys, time
begin = time.monotonic()
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, close_fds=False).returncode
seconds, used = time.monotonic() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
with open(os.path.join(os.environ["WORK"], "rank.%d" % os.getpid()), "w") as f:
    print("%.6f %.6f %d" % (seconds, used.ru_utime + used.ru_stime, used.ru_maxrss), file=f)
sys.exit(code)
P
declare -A wall cpu peak
# once NAME COMMAND...
once() {
    local name=$1 w c p
    shift
    rm -f "$work"/rank.[0-9]*
    "$@" python3 "$work/rank.py" importon "${run[@]}" >"$work/said" 2>&1 || { cat "$work/said" >&2; exit 1; }
    read -r w c p < <(awk '{ c += $2; if ($1 > w) w = $1; if ($3 > p) p = $3 } END { print w, c, p }' "$work"/rank.[0-9]*)
    wall[$name]=$(awk -v a="$w" -v b="${wall[$name]-1e9}" 'BEGIN { print a < b ? a : b }')
    cpu[$name]=$(awk -v a="$c" -v b="${cpu[$name]-1e9}" 'BEGIN { print a < b ? a : b }')
    peak[$name]=$p
}
two=("mpirun.$mpi" -n 2)
counts=()
for ((n = 1; n <= most; n *= 2)); do counts+=("$n"); done
gradient=(gradient "$scenes/cornell.xml" -D res=64 -q)
importon render "$scenes/furnace.xml" --spp 64 -q --no-preview --no-manifest -o "$work/target.exr"
fit=(fit "$scenes/furnace.xml" -T "$work/target.exr" -p 'ball.*' --set ball.reflectance.value=0.8 --spp 16 -n 300
    --optimizer adam --no-intervals --tolerance 1e-15 -q)
for ((round = 0; round < rounds; round++)); do
    run=(gradient "$scenes/furnace.xml" --spp 1 -q -t 1)
    once start env
    once 'start 2' "${two[@]}"
    run=("${gradient[@]}" --spp 1024 -t 2)
    once threads env
    for n in "${counts[@]}"; do
        run=("${gradient[@]}" --spp 1024 -t 1)
        once "strong $n" "mpirun.$mpi" -n "$n"
        run=("${gradient[@]}" --spp $((1024 * n)) -t 1)
        once "weak $n" "mpirun.$mpi" -n "$n"
    done
    run=("${fit[@]}" -t 2)
    once fit env
    run=("${fit[@]}" -t 1)
    once 'fit 2' "${two[@]}"
done
for res in 16 1024 2048; do
    run=(render "$scenes/cornell.xml" -D res=$res --spp 1 -q --no-preview --no-manifest -o "$work/x.exr" -t 1)
    once "memory $res 1" env
    once "memory $res 2" "${two[@]}"
done
ratio() { awk -v a="$1" -v b="$2" -v n="${3-1}" 'BEGIN { printf "%.2f", a / b / n }'; }
less() { awk -v a="$1" -v b="$2" 'BEGIN { print a - b }'; }
extra=$(less "${wall[start 2]}" "${wall[start]}") extra_cpu=$(less "${cpu[start 2]}" "${cpu[start]}")
echo "start: of $mpi $extra s, $extra_cpu processor seconds of two ranks"
for n in "${counts[@]}"; do
    echo "ranks $n: strong $(ratio "${wall[strong 1]}" "${wall[strong $n]}" "$n"), weak $(ratio "${wall[weak 1]}" "${wall[weak $n]}")"
done
# against NAME THREADS RANKS
against() {
    local w=${wall[$2]} r=${wall[$3]} c
    c=$(ratio "$(less "${cpu[$3]}" "$extra_cpu")" "${cpu[$2]}")
    echo "$1, two ranks / two threads: $(ratio "$w" "$r") ($w s, $r s), without the start $(ratio "$w" "$(less "$r" "$extra")"); processor seconds $c"
}
[[ ${wall[strong 2]-} ]] && against gradient threads 'strong 2'
against 'fit of 300 steps' fit 'fit 2'
own=$((peak[memory 16 2] - peak[memory 16 1]))
echo "memory: $mpi takes $own kB of a rank"
for res in 1024 2048; do
    a=${peak[memory $res 1]} b=${peak[memory $res 2]}
    echo "memory of a rank / of one process, picture of $res x $res: $(ratio "$b" "$a") ($b kB, $a kB); without what $mpi takes $(ratio $((b - own)) "$a")"
done
