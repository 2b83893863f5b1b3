# SPDX-License-Identifier: Apache-2.0
# A glass by name disperses as its numbers do: the table has them to 8 digits.
scene() { # PROPERTIES OF THE MEDIUM
    cat <<END
<scene version="3.0.0">
    <medium type="graded">
        <volume type="rod"><float name="n0" value="1.6"/><float name="g" value="0.4"/></volume>
        <float name="step" value="0.05"/>
        $1
        <surface type="plane"><float name="offset" value="3"/></surface>
    </medium>
    <rays type="beam"><integer name="count" value="20"/><float name="radius" value="0.5"/>
        <float name="start" value="-1"/><string name="wavelengths" value="0.45 0.55 0.65"/></rays>
    <target type="spot"/>
</scene>
END
}
named() { scene "<string name='glass' value='$1'/>"; }
numbers="<vector name='sellmeier_b' value='1.03961212, 0.231792344, 1.01046945'/>
<vector name='sellmeier_c' value='0.00600069867, 0.0200179144, 103.560653'/>"
named N-BK7 >named.xml
named n-bk7 >small.xml
named N-SF6 >other.xml
scene "$numbers" >numbers.xml
for name in named small other numbers; do importon bend trace $name.xml -q -o $name.csv >/dev/null || exit 9; done
cmp named.csv small.csv || exit 8
python3 - <<'END' || exit 8
import csv
read = lambda name: [[float(x) for x in r] for r in list(csv.reader(open(name)))[1:]]
named, numbers, other = read("named.csv"), read("numbers.csv"), read("other.csv")
far = lambda a, b: max(abs(x - y) for p, q in zip(a, b) for x, y in zip(p, q))
assert len(named) == 60 and far(named, numbers) < 1e-7 < 1e-3 < far(named, other), (far(named, numbers), far(named, other))
END
named N-BK8 >a.xml
named 'liquid water' >b.xml
scene "<string name='glass' value='N-BK7'/><vector name='cauchy' value='1.5, 0, 0'/>" >c.xml
for name in a b c; do importon bend trace $name.xml; done
