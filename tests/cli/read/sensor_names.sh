# SPDX-License-Identifier: Apache-2.0
# Sensors by name and by number: the same; names and numbers that there are not; a unit behind a number.
desk=$ROOT/scenes/desk.xml
read_one() { importon read "$desk" -m mono --spp 64 -q --sensor "$1"; }
cmp <(read_one board) <(read_one 1) && read_one board | cut -c1-5
read_one bord
read_one 2
read_one -1
loss() { importon gradient "$desk" -m mono --spp 16 -q -p batwing.scale.value -T "=500@$1"; }
cmp <(loss desk) <(loss 0) && ! cmp -s <(loss desk) <(loss board) && echo the same
loss dask
for want in work.average=500lx work.middle=500 wrk.average=500; do
    importon read "$ROOT/scenes/office.xml" -m mono --grid --report page.html --spp 16 -q -w $want >/dev/null
done
true
