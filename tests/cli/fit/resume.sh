# SPDX-License-Identifier: Apache-2.0
# A fit resumed after it had converged writes the same files, its reason too; a fit with another lens,
# another number of one, or another camera, is another fit.
scene=$ROOT/scenes/furnace.xml
importon render "$scene" --spp 64 -q -o t.exr || exit 9
for optimizer in lm lbfgs; do
    fit=(importon fit "$scene" --spp 16 -q --target t.exr --set ball.reflectance.value=0.8 -p 'ball.*' --picture-spp 2
        --optimizer $optimizer --checkpoint $optimizer.state)
    "${fit[@]}" -o $optimizer.1 >/dev/null || exit 9
    "${fit[@]}" -o $optimizer.2 --resume >/dev/null || exit 9
    for file in parameters.json loss.csv recovered.txt; do cmp $optimizer.{1,2}/$file; done
    grep -o '"reason":"[^"]*"' $optimizer.2/parameters.json
done
# Points are part of a fit.
"${fit[@]}" -o sobol.0 --resume --points independent >/dev/null
echo "exit $?"
rm $optimizer.state
"${fit[@]}" -o sobol.1 --points sobol >/dev/null || exit 9
"${fit[@]}" -o sobol.2 --points sobol --resume >/dev/null || exit 9
for file in parameters.json loss.csv recovered.txt; do cmp sobol.{1,2}/$file; done
echo garbage >>lm.state
importon fit "$scene" --spp 16 -q --target t.exr --set ball.reflectance.value=0.8 -p 'ball.*' --optimizer lm \
    --checkpoint lm.state --resume

mkdir bend
cp "$ROOT/scenes/bend/seen.xml" bend/
cp -r "$ROOT/scenes/textured" .
seen=(bend/seen.xml -D cells=1 -D width=8)
importon render "${seen[@]}" --spp 4 -q -o seen.exr || exit 9
importon info "${seen[@]}" --json >info.json || exit 9
python3 - <<'P'
import json
(p,) = [p for p in json.load(open("info.json"))["params"] if p["name"].startswith("lens") and p["count"] == 64]
for name, change in (("same", 0), ("other", 1e-6)):
    v = list(p["value"])
    v[40] += change
    open(name + ".txt", "w").write(p["name"] + "=" + ",".join(map(repr, v)) + "\n")
P
fit=(importon fit "${seen[@]}" -T seen.exr -p 'map.*' --spp 2 -n 2 --no-intervals -q --checkpoint state)
"${fit[@]}" --set @same.txt >/dev/null || exit 9
"${fit[@]}" --set @other.txt --resume
echo "exit $?"
sed -i 's/<volume type="grid">/& <point name="lo" value="-1.25, -1, -1"\/>/' bend/seen.xml
"${fit[@]}" --set @same.txt --resume >/dev/null
echo "exit $?"
cp "$ROOT/scenes/bend/seen.xml" bend/
sed -i 's/<float name="fov" value="18"/<float name="fov" value="19"/' bend/seen.xml
"${fit[@]}" --set @same.txt --resume >/dev/null
echo "exit $?"
cp "$ROOT/scenes/bend/seen.xml" bend/
"${fit[@]}" --set @same.txt --resume >/dev/null
echo "exit $?"
