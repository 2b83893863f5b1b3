#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Scaling of ranks under mpirun: bench/ranks.sh FOLDER OF THE PROGRAM [MPI] [MOST RANKS] [ROUNDS].
# The runs of a round follow each other, and of each the least seconds of all rounds count: on a machine
# with other work, those of a moment without it. Seconds are those between the start and the end of a
# rank's program, of the slowest rank; mpirun's own start is not in them.
#
#   strong         the same gradient by 1, 2, 4, ... ranks of one thread: speed / ranks
#   weak           as many samples a rank: time of one rank / time
#   ranks/threads  two ranks of one thread against one process of two threads: speed; processor seconds
#                  of all, those / these
#   memory         peak of a rank, against one process: a picture of 1024 x 1024
set -eu
export PATH=$1:$PATH LC_ALL=C OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_hwloc_base_binding_policy=none
export OMPI_MCA_btl_vader_single_copy_mechanism=none
mpi=${2-openmpi} most=${3-$(nproc)} rounds=${4-5}
scene=$(cd "$(dirname "$0")/.." && pwd)/scenes/cornell.xml
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export WORK=$work
# A rank of a run: its seconds, processor seconds and peak, in a file of its own.
cat >"$work/rank.py" <<'P'
import os, resource, subprocess, sys, time
begin = time.monotonic()
code = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode
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
    "$@" python3 "$work/rank.py" importon "${run[@]}" >/dev/null 2>&1
    read -r w c p < <(awk '{ c += $2; if ($1 > w) w = $1; if ($3 > p) p = $3 } END { print w, c, p }' "$work"/rank.[0-9]*)
    wall[$name]=$(awk -v a="$w" -v b="${wall[$name]-1e9}" 'BEGIN { print a < b ? a : b }')
    cpu[$name]=$(awk -v a="$c" -v b="${cpu[$name]-1e9}" 'BEGIN { print a < b ? a : b }')
    peak[$name]=$p
}
counts=()
for ((n = 1; n <= most; n *= 2)); do counts+=("$n"); done
gradient=(gradient "$scene" -D res=64 -q)
for ((round = 0; round < rounds; round++)); do
    run=("${gradient[@]}" --spp 128 -t 2)
    once threads env
    for n in "${counts[@]}"; do
        run=("${gradient[@]}" --spp 128 -t 1)
        once "strong $n" "mpirun.$mpi" -n "$n"
        run=("${gradient[@]}" --spp $((128 * n)) -t 1)
        once "weak $n" "mpirun.$mpi" -n "$n"
    done
done
run=(render "$scene" -D res=1024 --spp 1 -t 2 -q --no-preview --no-manifest -o "$work/x.exr")
once "memory 1" env
run=(render "$scene" -D res=1024 --spp 1 -t 1 -q --no-preview --no-manifest -o "$work/x.exr")
once "memory 2" "mpirun.$mpi" -n 2
ratio() { awk -v a="$1" -v b="$2" -v n="${3-1}" 'BEGIN { printf "%.2f", a / b / n }'; }
for n in "${counts[@]}"; do
    echo "ranks $n: strong $(ratio "${wall[strong 1]}" "${wall[strong $n]}" "$n"), weak $(ratio "${wall[weak 1]}" "${wall[weak $n]}")"
done
[[ ${wall[strong 2]-} ]] &&
    echo "two ranks / two threads: $(ratio "${wall[threads]}" "${wall[strong 2]}"); processor seconds $(ratio "${cpu[threads]}" "${cpu[strong 2]}")"
echo "memory of a rank / of one process: $(ratio "${peak[memory 2]}" "${peak[memory 1]}") (${peak[memory 2]} kB, ${peak[memory 1]} kB)"
