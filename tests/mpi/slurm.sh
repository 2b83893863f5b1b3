#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# slurm.sh FOLDER OF THE PROGRAM: a Slurm of this machine alone, with a controller and a node of its
# own in a temporary folder, runs the job array of docs/machines.md and the ranks of both MPIs. The
# results have the bits of one process. Prints TAP; skipped where Slurm or root is not there.
set -u
# MPI keeps memory until its processes end.
export ASAN_OPTIONS=${ASAN_OPTIONS:+$ASAN_OPTIONS:}detect_leaks=0
ROOT=$(cd "$(dirname "$0")/../.." && pwd)
programs=$1
export PATH=$programs:$PATH:/usr/sbin:/sbin LC_ALL=C
unset TMPDIR
for daemon in munged slurmctld slurmd sbatch srun; do
    command -v $daemon >/dev/null || { echo "1..0 # SKIP no $daemon (Debian: slurm-wlm)"; exit 0; }
done
((EUID == 0)) || { echo "1..0 # SKIP Slurm's daemons are started by root"; exit 0; }

work=$(mktemp -d)
cd "$work" || exit 99
mkdir state spool
chmod 755 .
count=0 failed=0
ok() {
    count=$((count + 1))
    if (($1 == 0)); then echo "ok $count - $2"; else
        failed=$((failed + 1))
        echo "not ok $count - $2"
        sed 's/^/# /' stderr | tail -n 20
    fi
}
skip() {
    count=$((count + 1))
    echo "ok $count - $1 # SKIP $2"
}
# Daemons are ended by the numbers that they wrote.
finish() {
    local daemon
    for daemon in slurmd slurmctld munged; do [[ -s $daemon.pid ]] && kill "$(<$daemon.pid)"; done
    for ((i = 0; i < 50; i++)); do
        [[ -e slurmd.pid || -e slurmctld.pid ]] || break
        sleep 0.1
    done
    cd / && rm -rf "$work"
}
trap finish EXIT
host=$(hostname -s) port=$((20000 + $$ % 10000 * 2))
head -c 128 /dev/urandom >key
chmod 400 key
cat >slurm.conf <<X
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket=$work/munge.sock
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
SlurmctldPort=$port
SlurmdPort=$((port + 1))
ProctrackType=proctrack/pgid
TaskPlugin=task/none
ReturnToService=2
SelectType=select/cons_res
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
NodeName=$host NodeAddr=127.0.0.1 CPUs=4 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
X
export SLURM_CONF=$work/slurm.conf
{
    munged --force --socket="$work/munge.sock" --key-file="$work/key" --pid-file="$work/munged.pid" \
        --log-file="$work/munged.log" --seed-file="$work/seed" && slurmctld -i && slurmd
} >stderr 2>&1 || { sed 's/^/# /' stderr; echo "1..0 # SKIP Slurm's daemons do not start here"; exit 0; }
state=
for ((i = 0; i < 100; i++)); do
    state=$(sinfo -h -o %t 2>>stderr)
    [[ $state == idle ]] && break
    sleep 0.2
done
[[ $state == idle ]] || { tail -n 20 slurm?*.log | sed 's/^/# /'; echo "1..0 # SKIP Slurm's node does not come up here"; exit 0; }

# ---- The job array of the page -----------------------------------------------------------

cp "$ROOT/scenes/furnace.xml" scene.xml
importon render scene.xml --spp 64 -q --no-preview -o photo.exr || exit 99
importon render scene.xml --spp 16 -q --no-preview -o whole.exr || exit 99
same() { importon compare whole.exr "$1" | grep -Eq '^max .* 0$'; }
sed -n "/^Slurm.*:\$/,/^\`\`\`\$/p" "$ROOT/docs/machines.md" | sed '1,/^```sh$/d; /^```$/d' |
    sed 's/65536/16/; s/1-64/1-4/; s/\/64/\/4/' >slurm.sh
grep -q sbatch slurm.sh && (. ./slurm.sh) >stdout 2>stderr
same picture.exr
ok $? "the array of the page: four jobs and a merge make the picture of one process"
# A job that is killed is run again.
rm -f part*.part picture.exr
sbatch --wait --array=1-2 --wrap \
    'importon render scene.xml --spp 4096 --part $SLURM_ARRAY_TASK_ID/2 -o part$SLURM_ARRAY_TASK_ID.part &
     [ $SLURM_ARRAY_TASK_ID = 1 ] || { sleep .1; kill -KILL $!; }
     wait $!' >stdout 2>stderr
[[ -e part1.part && ! -e part2.part ]]
ok $? "a job that is killed leaves no part"
importon merge part1.part -o picture.exr 2>stderr
grep -q 'parts are missing: 2/2' stderr
ok $? "merge says which is missing"
sbatch --wait --array=2 --wrap \
    'importon render scene.xml --spp 4096 --part $SLURM_ARRAY_TASK_ID/2 -o part$SLURM_ARRAY_TASK_ID.part' >stdout 2>stderr
importon render scene.xml --spp 4096 -q --no-preview -o whole.exr
importon merge part1.part part2.part -q -o picture.exr 2>stderr
same picture.exr
ok $? "run again, it completes the picture"

# ---- Ranks -------------------------------------------------------------------------------

gradient=(importon gradient scene.xml -T photo.exr --spp 32 --json)
"${gradient[@]}" >alone.json
export OMPI_MCA_btl_vader_single_copy_mechanism=none
for mpi in openmpi:pmix mpich:pmi2; do
    name=${mpi%:*} plugin=${mpi#*:}
    if [[ ! -e $programs/../mpi/libimporton-$name.so.0 ]]; then
        skip "srun --mpi=$plugin" "no $name"
    elif ! srun --mpi=list 2>&1 | grep -q "$plugin"; then
        skip "srun --mpi=$plugin" "this Slurm has no $plugin"
    else
        timeout 100 srun --mpi=$plugin -n 3 "${gradient[@]}" >ranks.json 2>stderr
        cmp -s alone.json ranks.json
        ok $? "three ranks of $name by srun --mpi=$plugin"
    fi
done
echo "1..$count"
((failed == 0))
