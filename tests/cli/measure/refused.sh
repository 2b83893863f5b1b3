# SPDX-License-Identifier: Apache-2.0
# Photographs and folders that do not go with the scene are refused by name, before anything is traced.
S=$SCENES/still.xml
measure() { importon measure "$@" -m mono --spp 4; echo "exit $?" >&2; }
grey() { printf 'P5 %d %d 255\n' "$1" "$2"; head -c $(($1 * $2)) /dev/zero | tr '\0' "$3"; }
grey 24 18 '\200' >left.pgm
grey 24 17 '\200' >right.pgm
grey 24 18 '\0' >black.pgm
grey 24 18 '\377' >white.pgm
mkdir empty none two; cp "$S" two/a.xml; cp "$S" two/b.xml; cp "$S" none/s.xml; cp left.pgm none/front.pgm
measure "$S"
measure empty
measure none
measure two
measure "$S" left.pgm right.pgm
measure "$S" nowhere.png
measure "$S" black.pgm
measure "$S" black.pgm@0
measure "$S" --photo left=white.pgm
measure "$S" --photo left
measure "$S" left.pgm left.pgm@0
measure "$S" left.pgm --stages lamps
measure "$S" left.pgm -p 'ball.*'
measure "$S" left.pgm --hold '*' --hold '*.pose'
measure "$S" left.pgm@7
measure "$S" black.pgm@0 -o refused
test -e refused && echo 'a refused measurement has left a folder' >&2
echo mine >measure.json
measure "$S" left.pgm -o .
