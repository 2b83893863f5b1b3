# SPDX-License-Identifier: Apache-2.0
# What is wrong in a file is said with its place.
try() {
    echo "<scene version='3.0.0'>$1</scene>" >f.xml
    importon bend trace f.xml
    echo "exit $?" >&2
}
rays="<rays type='beam'/>"
try "$rays"
try "<medium type='graded'/>$rays"
try "<medium type='graded'><volume type='lens'/></medium>$rays"
try "<medium type='graded'><volume type='rod'><float name='g' value='1'/></volume></medium>$rays"
try "<medium type='graded'><volume type='grid'><integer name='cells' value='0'/></volume></medium>$rays"
try "<medium type='graded'><volume type='grid'><string name='filename' value='no.vol'/></volume></medium>$rays"
try "<medium type='graded'><volume type='grid'/><float name='stepp' value='1'/></medium>$rays"
try "<medium type='graded'><volume type='grid'/></medium>"
try "<medium type='graded'><volume type='grid'/></medium><rays type='beam'><target type='points'/></rays>"
try "<medium type='graded'><volume type='grid'/></medium>$rays<target type='image'/>"
try "<medium type='graded'><volume type='grid'/><surface type='mesh'><string name='filename' value='no.obj'/></surface></medium>$rays"
try "<medium type='graded'><volume type='grid'/></medium>$rays<target type='path'><boolean name='from_truth' value='true'/></target>"
printf 'VOL\003\001\000\000\000\377\377\377\177\002\000\000\000\002\000\000\000\001\000\000\000' >bad.vol
head -c 100 /dev/zero >>bad.vol
try "<medium type='graded'><volume type='grid'><string name='filename' value='bad.vol'/></volume></medium>$rays"
try "<medium type='graded'><volume type='grid'><string name='filename' value='bad.vol'/><float name='index' value='1.3'/></volume></medium>$rays"
try "<medium type='graded'><volume type='grid'/></medium><rays type='beam'><integer name='count' value='9000000'/><integer name='views' value='60000'/></rays>"
try "<medium type='graded'><volume type='grid'/></medium>$rays<target type='focus'><boolean name='from_truth' value='true'/></target>"
importon bend draw f.xml
echo "exit $?" >&2
