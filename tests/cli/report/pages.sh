# SPDX-License-Identifier: Apache-2.0
# A page of a folder's results; it is replaced by a newer one, and by nothing else.
mkdir r
importon render "$ROOT/scenes/furnace.xml" -D res=8 --spp 4 -q --se -o r/picture.exr
importon report r || exit 9
importon report r --title again || exit 9
grep -c '"title":"again"' r/report.html
grep -c '"command":"importon render ' r/report.html
importon report r -o - -q | cmp - <(importon report r -o - -q) && echo same
echo mine >mine.html
importon report r -o mine.html
cat mine.html
importon report r --scene "$ROOT/scenes/furnace.xml" -D res=8 --walks 3 -q || exit 9
grep -o '"kind":"walks"' r/report.html
grep -o '"pixel":' r/report.html | wc -l
importon report r --walks 3
# What is no result.
mkdir empty broken
importon report empty
importon report missing
echo '{"importon":"0.2.0","command":"fit","params":[1,]}' >broken/parameters.json
importon report broken
echo "exit $?"
echo '{"somebody":"else"}' >r/other.json
importon report r
