#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# machines.sh FOLDER OF THE PROGRAM: machines that share no memory, played by this one: ranks under
# two daemons of Open MPI, and in two network namespaces where these may be made; and the job
# arrays of docs/machines.md, by GNU parallel, and by Slurm's commands with a stand-in for sbatch.
# The results have the bits of one process. Prints TAP.
set -u
# MPI keeps memory until its processes end.
export ASAN_OPTIONS=${ASAN_OPTIONS:+$ASAN_OPTIONS:}detect_leaks=0
ROOT=$(cd "$(dirname "$0")/../.." && pwd)
export PATH=$1:$PATH LC_ALL=C OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_hwloc_base_binding_policy=none OMPI_MCA_rtc=^hwloc
unset TMPDIR
work=$(mktemp -d)
cd "$work" || exit 99
count=0 failed=0
ok() {
    count=$((count + 1))
    if (($1 == 0)); then echo "ok $count - $2"; else
        failed=$((failed + 1))
        echo "not ok $count - $2"
        sed 's/^/# /' stderr | head -n 20
    fi
}
skip() {
    count=$((count + 1))
    echo "ok $count - $1 # SKIP $2"
}
: >stderr
cp "$ROOT/scenes/furnace.xml" scene.xml
importon render scene.xml --spp 64 -q --no-preview -o photo.exr || exit 99

# ---- Ranks that share no memory --------------------------------------------------------

gradient=(importon gradient scene.xml -T photo.exr --spp 32 --json)
"${gradient[@]}" >alone.json
cat >agent.sh <<'X'
#!/bin/sh
shift
exec sh -c "$*"
X
cat >agent_namespace.sh <<'X'
#!/bin/sh
host=$1
shift
exec ip netns exec "$host" sh -c "$*"
X
chmod +x agent*.sh
# daemons FILE COMMAND...: its output. Daemons of Open MPI on one machine may fail over a folder that
# both of them make at once, which those of two machines never do: then again. For the same reason
# none of them puts its list of cores into memory that the other reads (rtc_hwloc).
daemons() {
    local file=$1
    shift
    for try in 1 2 3 4 5 6; do
        timeout 100 "$@" >"$file" 2>stderr
        grep -q 'unable to create the desired directory\|orted(.*)\[' stderr || break
    done
}
if [[ -e $1/../mpi/libimporton-openmpi.so.0 ]] && command -v mpirun.openmpi >/dev/null; then
    daemons two.json mpirun.openmpi --mca plm_rsh_agent "$work/agent.sh" -H one:1,two:2 -n 3 "${gradient[@]}"
    cmp -s alone.json two.json
    ok $? "3 ranks under two daemons: rank 0 counts the work for all"
    a=imp$$a b=imp$$b
    if ((EUID == 0)) && command -v ip >/dev/null && ip netns add $a 2>stderr; then
        trap 'ip netns del $a; ip netns del $b; rm -rf "$work"' EXIT
        if ip netns add $b && ip link add $a type veth peer name $b && ip link set $a netns $a && ip link set $b netns $b &&
            ip -n $a addr add 10.213.7.1/24 dev $a && ip -n $b addr add 10.213.7.2/24 dev $b &&
            ip -n $a link set lo up && ip -n $b link set lo up && ip -n $a link set $a up && ip -n $b link set $b up; then
            daemons namespaces.json ip netns exec $a mpirun.openmpi --mca plm_rsh_agent "$work/agent_namespace.sh" \
                --mca btl tcp,self -H $a:1,$b:2 -n 3 "${gradient[@]}"
            cmp -s alone.json namespaces.json
            ok $? "3 ranks in two network namespaces, by TCP"
        else
            skip "ranks in two network namespaces" "no virtual link can be made"
        fi
    else
        skip "ranks in two network namespaces" "none can be made"
    fi
else
    skip "ranks that share no memory" "no Open MPI"
fi
[[ -n ${a-} ]] || trap 'rm -rf "$work"' EXIT

# ---- Job arrays ------------------------------------------------------------------------

# The commands of the page between its line "WORD...:" and the end of the block, for fewer
# parts and samples, on this machine.
commands() {
    sed -n "/^$1.*:\$/,/^\`\`\`\$/p" "$ROOT/docs/machines.md" | sed '1,/^```sh$/d; /^```$/d' |
        sed 's/65536/16/; s/1-64/1-4/; s/\/64/\/4/; s/{1\.\.64}/{1..4}/; s/--sshloginfile hosts //'
}
sbatch() { # --array=1-N ... --wrap COMMAND
    for SLURM_ARRAY_TASK_ID in 1 2 3 4; do SLURM_ARRAY_TASK_ID=$SLURM_ARRAY_TASK_ID sh -c "${!#}"; done
}
commands Slurm >slurm.sh
grep -q sbatch slurm.sh && (. ./slurm.sh) >/dev/null 2>stderr
importon render scene.xml --spp 16 -q -o whole.exr
importon compare whole.exr picture.exr | grep -Eq '^max .* 0$'
ok $? "Slurm's array of the page, with a stand-in for sbatch"
if command -v parallel >/dev/null; then
    rm -f part*.part
    commands 'GNU parallel' >parallel.sh
    grep -q parallel parallel.sh && (. ./parallel.sh) >merged.txt 2>stderr
    importon gradient scene.xml -T photo.exr | cmp -s - merged.txt
    ok $? "GNU parallel's of the page"
else
    skip "GNU parallel" "it is not installed"
fi
echo "1..$count"
((failed == 0))
