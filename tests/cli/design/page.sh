# SPDX-License-Identifier: Apache-2.0
# The page of a room and that of a design: what is wanted, plans, luminaires, a view, and no script.
office="$ROOT/scenes/office.xml"
rows() { sed -n '/^<p>importon/d; s/<[^>]*>/ /g; s/  */ /g; s/&#8804;/<=/; s/&#8805;/>=/; /[a-z0-9]/p' "$1" | grep -v 'default-src\|:root'; }
importon read "$office" -m mono -D spp=64 -D view=1 --grid --sensor 0 -w work.average=500,work.uniformity=0.6,work.minimum=800 --report room.html >/dev/null
echo "exit $?"
grep -c '<svg\|data:image/png' room.html
grep -c '<script' room.html
sed 's/data:image[^"]*//' room.html | sed '/<svg/,/<\/svg>/d' >text.html
rows text.html
importon design "$office" -m mono -D spp=32 -D view=1 -w work.average=450 --choose 'lamp_*=lamps/opal.ldt,lamps/batwing.ies,none' --watts '*:batwing=25' --report design.html >/dev/null
echo "exit $?"
sed 's/data:image[^"]*//' design.html | sed '/<svg/,/<\/svg>/d' >text.html
rows text.html
# Names are text, a page is replaced by a page alone, and a page is of grids.
sed 's/id="work"/id="a\&lt;b\&gt;"/' "$office" >odd.xml
importon read odd.xml -a "$ROOT/scenes" -m mono -D spp=4 -D view=1 --grid --sensor 0 --report room.html >/dev/null && grep -c 'a&#60;b&#62;' room.html
echo mine >mine.html
importon read "$office" -m mono -D spp=4 --grid --report mine.html >/dev/null; echo "exit $?"
importon read "$office" -m mono --report room.html; echo "exit $?"
importon read "$office" -m mono --grid -w work.average=1; echo "exit $?"
importon read "$office" -m mono -D spp=4 -D view=1 --grid --sensor 1 -w work.average=1 --report room.html >/dev/null; echo "exit $?"
