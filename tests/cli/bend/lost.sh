# SPDX-License-Identifier: Apache-2.0
# No ray comes to its end: no command says that all is well. A part lost is told.
scene() {
    cat <<END
<scene version="3.0.0">
    <medium type="graded">
        <volume type="grid"><integer name="cells" value="6"/><float name="index" value="1.2"/></volume>
        <surface type="plane"><float name="offset" value="0.9"/></surface>
        <surface type="disc"><float name="radius" value="$2"/><string name="event" value="stop"/></surface>
    </medium>
    <rays type="beam"><integer name="count" value="50"/><float name="radius" value="0.5"/>
        <float name="start" value="$1"/></rays>
    <target type="spot"/>
</scene>
END
}
scene 3 1e-3 >none.xml
scene -0.9 0.25 >part.xml
for verb in trace check fit view; do
    importon bend $verb none.xml -q
    echo "exit $?" >&2
done
ls
importon bend check part.xml | grep ^rays
importon bend check part.xml -q --json | python3 -c '
import json, sys
print(*([r["value"], r["reference"], r["error"]] for r in json.load(sys.stdin)["rows"] if r["method"] == "rays"))'
