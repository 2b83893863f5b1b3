# SPDX-License-Identifier: Apache-2.0
# Recorded walks answer without the scene: what render and gradient of its recorded walks would say.
mkdir in && cp "$ROOT/scenes/cornell.xml" in && cp -r "$ROOT/scenes/cornell" in
importon record in/cornell.xml -D res=16 --spp 8 --seed 3 --points independent --survival 0 -q -o room.walks
importon gradient in/cornell.xml -D res=16 --spp 8 --seed 3 --points independent --json >traced.json
importon render in/cornell.xml -D res=16 --spp 8 --seed 3 --points independent -q --no-preview -o traced.exr
importon render in/cornell.xml -D res=16 --spp 64 --seed 9 --set white.reflectance.value=0.6 -q --no-preview -o target.exr
importon gradient in/cornell.xml -D res=16 --spp 8 --seed 3 --points independent -T target.exr --json >loss.json
rm -r in
number() { grep -o "\"$2\":[^,}]*" "$1" | head -1; }
params() { grep -o '"params":.*' "$1" | tr -d ' \n'; }
echo "- at the parameters of the draw"
importon what-if room.walks --gradient --json >kept.json
[[ $(number kept.json value) == "$(number traced.json value)" && $(number kept.json se) == "$(number traced.json se)" ]] && echo mean: equal
importon what-if room.walks -T target.exr --gradient --json >kept_loss.json
# Recorded walks are sums of products here, which round in another order.
numbers() { params "$1" | grep -oE '[-+]?[0-9][-+.0-9e]*'; }
paste <(number loss.json value | cut -d: -f2; numbers loss.json) <(number kept_loss.json value | cut -d: -f2; numbers kept_loss.json) |
    awk '{ d = $1 - $2; s = $1 * 1e-9; if (d * d > s * s) bad++ } END { if (NR > 20 && !bad) print "loss and gradient: equal to 1e-9" }'
importon what-if room.walks -o kept.exr -q --no-preview >answer && importon compare kept.exr traced.exr | grep max
grep -c 'effective sample size 1$' answer
echo "- a sensor by name"
importon what-if room.walks --sensor camera --json >named.json; [[ $(number named.json value) == "$(number kept.json value)" ]] && echo mean: equal
importon what-if room.walks --sensor nowhere; echo "exit $?"
echo "- elsewhere"
importon what-if room.walks --sweep 'white.reflectance.value=0.2:0.8:4' | awk '{ print NF, $4 }'
importon what-if room.walks --region 0,0,4,16 --set red.reflectance.value=0,0,0 | grep -c 'mean of the region'
importon what-if room.walks --set light.radiance.value=1,1,1 -T target.exr --loss log --mask target.exr --json | grep -o '"loss":"log"'
