#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# ranks.sh FOLDER OF THE PROGRAM, MPI [full|brief]: commands under mpirun give the bytes of one process,
# for 1, 2, 3 and 7 ranks with 1 and 2 threads each; and what goes wrong is said once. Each job
# runs in one of these eight combinations, with `full` in all; with `brief`, for sanitizers, three
# jobs do. Prints TAP.
set -u
mpi=$2 full= brief=
[[ ${3-} ]] && declare "$3=1"
ROOT=$(cd "$(dirname "$0")/../.." && pwd)
export PATH=$1:$PATH LC_ALL=C OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
# Where nothing but this machine takes part, no network is needed.
export OMPI_MCA_btl_vader_single_copy_mechanism=none OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_hwloc_base_binding_policy=none
unset TMPDIR
# Who has left memory behind is found in whole stacks: MPI's libraries have no frame pointers.
export ASAN_OPTIONS=${ASAN_OPTIONS:+$ASAN_OPTIONS:}fast_unwind_on_malloc=0
export LSAN_OPTIONS=suppressions=$ROOT/tests/mpi/lsan.supp:print_suppressions=0
mpirun=$(command -v "mpirun.$mpi" || command -v mpirun) || { echo "1..0 # SKIP no mpirun of $mpi"; exit 0; }
case $mpi in
    openmpi) "$mpirun" --version 2>&1 | grep -qi 'open *mpi\|open mpi\|openrte' ;;
    mpich) "$mpirun" --version 2>&1 | grep -qi 'hydra' ;;
esac || { echo "1..0 # SKIP $mpirun is of another MPI than $mpi"; exit 0; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 99
count=0 failed=0
ok() {
    count=$((count + 1))
    if (($1 == 0)); then echo "ok $count - $2"; else
        failed=$((failed + 1))
        echo "not ok $count - $2"
        sed 's/^/# /' "$work/stderr" | head -n 20
    fi
}
# ranks N COMMAND...: its words on standard error without mpirun's own.
ranks() {
    local n=$1 rc
    shift
    timeout 200 "$mpirun" -n "$n" "$@" 2>stderr
    rc=$?
    return $rc
}

# A job is a folder in which a command is run; what it leaves and prints is compared. EXR and
# PNG files tell the time and the command: of those, pixels.
job() {
    local name=$1 combination same=0 all=0 n t
    shift
    [[ $brief && " render texture fit_lm " != *" $name "* ]] && return
    mkdir -p "$name/alone"
    (cd "$name/alone" && importon "$@" -t 1 >stdout 2>stderr) || { cp "$name/alone/stderr" .; ok 1 "$name: alone"; return; }
    local turns=('2 2' '3 1' '7 1' '3 2' '2 1' '1 2') combinations
    combinations=("${turns[turn++ % 6]}")
    [[ $full ]] && combinations=('1 1' '1 2' '2 1' '2 2' '3 1' '3 2' '7 1' '7 2')
    for combination in "${combinations[@]}"; do
        read -r n t <<<"$combination"
        mkdir "$name/$n-$t"
        all=$((all + 1))
        (cd "$name/$n-$t" && ranks "$n" importon "$@" -t "$t" >stdout) || { cp "$name/$n-$t/stderr" .; continue; }
        compare "$name/alone" "$name/$n-$t" && same=$((same + 1))
    done
    ok $((same != all)) "$name: $same of $all combinations of ranks and threads have the bytes of one process"
}
turn=0
compare() {
    local file
    (cd "$1" && find . -type f ! -name '*.png' ! -name '*manifest' ! -name stderr) | while read -r file; do
        case $file in
            *.exr) importon compare "$1/$file" "$2/$file" 2>&1 | grep -Eq '^max .* 0$' ;;
            *) cmp -s <(sed 's/"seconds":[^,}]*//g' "$1/$file") <(sed 's/"seconds":[^,}]*//g' "$2/$file") ;;
        esac || { echo "# $2/$file differs"; exit 1; }
    done
}

scenes=$ROOT/scenes
cornell=("$scenes/cornell.xml" -D res=10) textured=("$scenes/textured.xml" -D width=12 -D height=9)
importon render "${cornell[@]}" --spp 64 -q --no-preview -o target.exr || exit 99
importon render "${textured[@]}" --spp 64 -q --no-preview -o textured.exr || exit 99
importon render "$scenes/furnace.xml" --spp 64 -q --no-preview -o f.exr || exit 99
job render render "${cornell[@]}" --spp 20 --se -o x.exr
job large render "$scenes/furnace.xml" -D res=360 --spp 1 -o x.exr
job guided render "${cornell[@]}" --spp 6 --guide --guide-share .3 -o x.exr
job gradient gradient "${cornell[@]}" -T "$work/target.exr" --spp 8 --json
job points gradient "${cornell[@]}" -T "$work/target.exr" --spp 16 --points sobol --json
job texture gradient "${textured[@]}" -T "$work/textured.exr" --spp 4 --json
job jacobian jacobian "${cornell[@]}" -p '*radiance*' --spp 6 -o x --json
job plan plan "${cornell[@]}" -p 'white.*' --exposures 1,2 --spp 4 --map x --json
job record record "${cornell[@]}" --spp 6 --json -o x.walks
job fog record "$scenes/fog.xml" -D res=10 --spp 2 --all-sensors -q -o x.walks
job check check "$scenes/furnace.xml" --paths 20 --spp 4 --json
job elements elements "$scenes/elements/a.xml" -D res=8 --json -o x.exr
job elements_fit elements "$scenes/elements/b.xml" -m mono -D res=16 --eps 5e-3 -q --no-image --fit -p 'light_left*' --lux floor=0.25 --json
for optimizer in adam lm lbfgs mma slsqp; do
    job "fit_$optimizer" fit "$scenes/furnace.xml" -T "$work/f.exr" -p 'ball.*' --set ball.reflectance.value=0.8 --spp 8 \
        -n 4 --optimizer $optimizer --picture-spp 2 --checkpoint state -o x --json
done

(cd render/alone && ranks 2 importon verify x.exr.manifest -t 2) >verdict
grep -q 'verified: .* all computed again' verdict
ok $? "two ranks verify what one process made"
(cd render/2-2 && importon verify x.exr.manifest -t 1) >verdict 2>stderr
grep -q 'verified: .* all computed again' verdict
ok $? "and one process what two made"

# ---- What goes wrong -----------------------------------------------------------------

# says TEXT NAME: standard error has this line once, and speaks for nobody else.
says() {
    local n others
    n=$(grep -cF -- "$1" stderr)
    others=$(grep '^importon:' stderr | grep -cvF -- "$1")
    ok $((n != 1 || others)) "$2"
}
# Every rank in a folder of its own, its process number in a file.
cat >each.sh <<'X'
rank=${OMPI_COMM_WORLD_RANK:-$PMI_RANK}
echo $$ >"pid$rank"
cd "rank$rank" || exit 99
exec importon "$@"
X
mkdir rank0 rank1 rank2
cp "$scenes/furnace.xml" rank0
ranks 2 bash each.sh render furnace.xml --spp 4 -o x.pfm --no-preview >/dev/null
[[ $? == 0 && -s rank0/x.pfm && ! -e rank1/x.pfm ]]
ok $? "a scene that only rank 0 can read is broadcast; rank 0 writes"
ranks 2 bash each.sh render furnace.xml --spp 4 -o y.pfm --no-preview --mpi-files shared >/dev/null
rc=$?
says "importon: rank 1: furnace.xml: cannot open: No such file or directory" "and said to be missing where ranks read"
ok $((rc != 2)) "with exit code 2 ($rc)"
for rank in 1 2; do sed 's/name="reflectance" value=".5"/name="reflectance" value=".6"/' "$scenes/furnace.xml" >rank$rank/furnace.xml; done
ranks 3 bash each.sh render furnace.xml --spp 4 -o y.pfm --no-preview --mpi-files shared >/dev/null
says "importon: furnace.xml: the set of parameter values of rank 1 differs from that of rank 0" "another scene on two ranks: said once"
ranks 2 importon render nothere.xml >/dev/null
says "importon: nothere.xml: cannot open: No such file or directory" "an error of all ranks is said once"
ranks 2 importon render "$scenes/furnace.xml" --ssp 4 >/dev/null
says "importon: render: unknown option '--ssp'; did you mean '--spp'?" "so is a wrong option"
sed 's/<sensor type="orthographic" id="camera">/&<float name="none" value="1"\/>/' "$scenes/furnace.xml" >lenient.xml
ranks 3 importon render lenient.xml --lenient --spp 2 -o lenient.pfm --no-preview >/dev/null
says "importon: warning: lenient.xml:" "a warning of all ranks is said once"
# A lamp too bright for a float, which few walks meet: these are left out, and said so.
cat >bad.xml <<'X'
<scene version="3.0.0"><integrator type="path"/>
    <sensor type="perspective"><float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform>
        <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="64"/><rfilter type="box"/></film>
    </sensor>
    <emitter type="constant"/>
    <shape type="sphere"><point name="center" x="0.3" y="0.2" z="0"/><float name="radius" value=".008"/>
        <emitter type="area"><rgb name="radiance" value="1e39"/></emitter></shape>
</scene>
X
importon render bad.xml --spp 16 --seed 2 -o bad.pfm --no-preview >/dev/null 2>alone.txt
ranks 3 importon render bad.xml --spp 16 --seed 2 -o bad.pfm --no-preview >/dev/null
grep -Eq '[2-9] of .* walks were left out' alone.txt && cmp -s alone.txt stderr
ok $? "walks of all ranks that were left out are said once, as by one process"
ranks 2 importon info "$scenes/furnace.xml" >/dev/null
says "importon: info runs in one process, and mpirun started 2" "commands for one process"
ranks 2 importon render "$scenes/furnace.xml" -o /nowhere/x.exr >/dev/null
rc=$?
says "importon: /nowhere/x.exr: cannot create: No such file or directory" "an output that cannot be written"
ok $((rc != 3)) "with exit code 3 ($rc)"
ranks 2 importon gradient - --spp 4 --json <"$scenes/furnace.xml" >piped.json
importon gradient - --spp 4 --json <"$scenes/furnace.xml" | cmp -s - piped.json
ok $? "a scene from standard input"
echo 'ball.reflectance.value=0.25' >rank0/set.txt
ranks 2 bash each.sh gradient "$scenes/furnace.xml" --spp 4 --set @set.txt --json >set.json
importon gradient "$scenes/furnace.xml" --spp 4 --set ball.reflectance.value=0.25 --json | cmp -s - set.json
ok $? "settings of a file that rank 0 has"
rm -rf rank1/*
ranks 2 bash each.sh render "$scenes/furnace.xml" --time 0.5 --json -o x.exr --no-preview >time.json
grep -q '"complete":true' time.json
ok $? "a time limit ends all ranks"
ranks 2 importon gradient "$scenes/furnace.xml" --time 0.5 --json -q >time.json
ok $? "that of gradients"
ranks 2 importon elements "$scenes/elements/d.xml" --time 0.3 --json --no-image -q >time.json
ok $? "that of finite elements too"

# ---- Ends ----------------------------------------------------------------------------

importon render "$scenes/furnace.xml" --spp 64 -q --no-preview -o rank0/target.exr || exit 99
fit=(fit "$scenes/furnace.xml" -T target.exr -p 'ball.*' --set ball.reflectance.value=0.8 --spp 256 --tolerance 1e-15
    --no-intervals --checkpoint state -t 1)
# begin N: in the background; wait for the checkpoint that comes after two seconds, or for SECONDS.
begin() {
    rm -f pid* rank0/state
    "$mpirun" -n 2 bash each.sh "${fit[@]}" -n 1000000 >out 2>stderr &
    for ((i = 0; i < 300; i++)); do
        sleep 0.1
        [[ -s $1 ]] && break
    done
}
# The state reached is that of a run that was not ended, and the run can go on.
goes_on() {
    local n
    n=$(sed -n 's/^iteration //p' rank0/state)
    (cd rank0 && ranks 3 importon "${fit[@]}" -n $((n + 2)) --resume >/dev/null && mv state resumed && importon "${fit[@]}" -n $((n + 2)) >/dev/null 2>&1)
    cmp -s rank0/state rank0/resumed
    ok $? "$1: resumed from iteration $n by 3 ranks, it has the bytes of a run that was not ended"
}
begin pid1
sleep 1
kill -INT "$(<pid0)"
wait $!
rc=$?
ok $((rc != 130)) "Ctrl-C of one rank ends all: exit code $rc"
n=$(grep -c '^importon: interrupted; --checkpoint state --resume goes on from there$' stderr)
ok $((n != 1)) "and says how to go on"
goes_on interrupted
begin rank0/state
kill -KILL "$(<pid1)"
wait $!
rc=$?
ok $((rc == 0)) "a rank that dies ends the run: exit code $rc"
# MPICH ends the others without asking; its mpirun says so.
if [[ $mpi == openmpi ]]; then
    n=$(grep -c '^importon: other ranks do not answer\|^importon: interrupted; --checkpoint state --resume' stderr)
    ok $((n != 2)) "with a sentence"
else
    ! grep -q 'BAD TERMINATION' out stderr
    ok $((!$?)) "with a sentence of mpirun's"
fi
goes_on died
echo "1..$count"
((failed == 0))
