# SPDX-License-Identifier: Apache-2.0
# An output replaces a file of its own kind that the program wrote, and nothing else: not a scene, a
# photograph, a text or a checkpoint of another fit. --overwrite replaces what is not an input.
cp "$ROOT/scenes/furnace.xml" own.xml
cp "$ROOT/scenes/elements/a.xml" a.xml
importon render own.xml --spp 4 -q -o target.exr || exit 9
echo "a letter" >letter.txt
printf '\x89PNG\r\n\x1a\n a photograph' >photo.png
printf '\x76\x2f\x31\x01 a photograph' >photo.exr
printf 'ply\nformat ascii 1.0\n' >mesh.ply
mkdir dir
cp letter.txt dir/recovered.txt
cp photo.png dir/slice-y.png
cp letter.txt dir/ball.reflectance.value.exr
sha1sum ./*.* dir/* >before
run() { timeout 60 importon "$@" -q 2>&1 >/dev/null; echo "exit $?"; }
fit=(fit own.xml -T target.exr --spp 2 -n 1 --no-intervals)

for file in own.xml target.exr letter.txt; do run "${fit[@]}" --checkpoint $file; done
run "${fit[@]}" --checkpoint letter.txt --resume
run "${fit[@]}" --checkpoint own.xml --overwrite
run "${fit[@]}" --sheet photo.png -o dir2
run "${fit[@]}" -o dir
run render own.xml --spp 1 --paths own.xml
run render own.xml --spp 1 --pixel 1,1 -o own.xml
run render own.xml --spp 1 -o photo.exr
run render own.xml --spp 1 -o photo.pfm
for command in info check bench gradient; do run $command own.xml -o letter.txt; done
run info own.xml -o own.xml --overwrite
run compare target.exr target.exr -o target.exr
run jacobian own.xml --spp 2 -o dir
run elements a.xml --no-image --save a.xml
run elements a.xml --no-image --export mesh.ply
run elements a.xml -o photo.exr
run elements a.xml --no-image --fit --lux floor=1 -p '*' --recovered letter.txt
cp "$ROOT/scenes/bend/plume.xml" plume.xml
run bend fit plume.xml --checkpoint letter.txt
run bend fit plume.xml -o dir
run bend view plume.xml -o dir
run bend trace plume.xml -o letter.txt
run bend check plume.xml -o letter.txt
sha1sum --quiet -c before

echo "+ what it wrote itself"
rm -r dir
for again in 1 2; do
    run "${fit[@]}" -o dir --sheet sheet.png
    run render own.xml --spp 1 --paths walks.txt --count 2
    run render own.xml --spp 1 --pixel 1,1 -o walk.txt
    run render own.xml --spp 1 -o p.pfm
    run info own.xml -o answer
    run info own.xml -o answer --json
    run info own.xml -o answer --dump
    run check own.xml --paths 2 --fresh-spp 2 -o table
    run compare target.exr target.exr -o compared
    run gradient own.xml --spp 2 -o gradient.txt
    run jacobian own.xml --spp 2 -o dir
    run elements a.xml --no-image --stop 50 --save saved --export leaves.ply --export leaves.json
    run bend trace plume.xml -D count=4 -o exits.csv
    run bend check plume.xml -D count=4 -o bend.txt
    run bend fit plume.xml -D count=4 -n 1 -o dir
    run bend view plume.xml -D count=4 -o dir
done
echo "+ a new fit over an older checkpoint"
run "${fit[@]}" --checkpoint state
run "${fit[@]}" --checkpoint state
run "${fit[@]}" --checkpoint state --resume
run "${fit[@]}" --checkpoint state --overwrite
run "${fit[@]}" --checkpoint letter.txt --overwrite
head -c 19 letter.txt
