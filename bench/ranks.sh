#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Scaling of ranks under mpirun: bench/ranks.sh FOLDER OF THE PROGRAM [MPI] [MOST RANKS]. Minima of five
# interleaved runs, seconds from start to end of the process that mpirun starts included.
#
#   strong   the same gradient by 1, 2, 4, ... ranks of one thread: speed / ranks
#   weak     as many samples a rank: time of one rank / time
#   ranks/threads   two ranks of one thread against one process of two threads: speed
set -eu
export PATH=$1:$PATH LC_ALL=C OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_hwloc_base_binding_policy=none
mpi=${2-openmpi} most=${3-$(nproc)}
scene=$(cd "$(dirname "$0")/.." && pwd)/scenes/cornell.xml
spp=256
declare -A best
# once NAME COMMAND...
once() {
    local name=$1 begin end t
    shift
    begin=$(date +%s%N)
    "$@" >/dev/null 2>&1
    end=$(date +%s%N)
    t=$((end - begin))
    [[ ! ${best[$name]-} || $t -lt ${best[$name]} ]] && best[$name]=$t
    return 0
}
run() { importon gradient "$scene" -D res=64 -q "$@"; }
ranks() {
    local n=$1
    shift
    "mpirun.$mpi" -n "$n" importon gradient "$scene" -D res=64 -q "$@"
}
counts=()
for ((n = 1; n <= most; n *= 2)); do counts+=("$n"); done
for _ in 1 2 3 4 5; do
    once threads run --spp $spp -t 2
    for n in "${counts[@]}"; do
        once "strong $n" ranks "$n" --spp $spp -t 1
        once "weak $n" ranks "$n" --spp $((spp * n)) -t 1
    done
done
awk_ratio() { awk -v a="$1" -v b="$2" -v n="$3" 'BEGIN { printf "%.2f", a / b / n }'; }
for n in "${counts[@]}"; do
    echo "ranks $n: strong $(awk_ratio "${best[strong 1]}" "${best[strong $n]}" "$n"), weak $(awk_ratio "${best[weak 1]}" "${best[weak $n]}" 1)"
done
[[ ${best[strong 2]-} ]] && echo "two ranks / two threads: $(awk_ratio "${best[threads]}" "${best[strong 2]}" 1)"
