# SPDX-License-Identifier: Apache-2.0
# Lamps that there are not, no meters, wants that contradict each other, damaged catalogues: refused by name.
design() { importon design "$ROOT/scenes/office.xml" -m mono -D spp=4 "$@"; echo "exit $?" >&2; }
catalogue() { printf '%s\n' "$@" >catalogue; design -w work.average=500 --catalogue catalogue; }
design
design -w work=500
design -w work.average
design -w work.brightness=3
design -w nothing.average=500
design -w work.average=nan
design -w work.average=-1
design -w work.uniformity=1.2
design -w work.average=500,work.average=400
design -w work.average=500,work.maximum=400
design -w work.ugr=19
design -w work.average=500 --lamps 'spot_*'
design -w work.average=500 --watts none=3
design -w work.average=500 --cost x
design -w work.average=500 --least cost
design -w work.average=500 --levels 0,1
design -w work.average=500 --levels 0.5,2
design -w work.average=500 --choose lamp_11
design -w work.average=500 --choose 'spot=lamps/opal.ldt'
design -w work.average=500 --choose 'lamp_*=lamps/nowhere.ldt'
design -w work.average=500 --luminaire 'lamp_11=lamps/opal.ldt,lamps/opal.ldt'
design -w work.average=500 --catalogue nowhere
catalogue '# nothing'
catalogue 'lamp_*'
catalogue 'lamp_* lamps/opal.ldt' 'lamp_* lamps/batwing.ies watts=25 price=3'
catalogue 'lamp_* none watts=3'
catalogue 'lamp_* lamps/opal.ldt levels=2'
catalogue 'lamp_* a,b'
importon design "$SCENES/two_lamps.xml" -m mono -w 0.average=1 --lamps one --watts 3; echo "exit $?" >&2
importon design "$SCENES/two_lamps.xml" -m mono -w 0.average=1; echo "exit $?" >&2
# One sample has no error, a meter without a grid, no --sensor, blanks, what an older file is.
design -w work.average=500 --spp 1
design -w work.average=500 --sensor 1
design -w 'work.average=50, work.brightness=3'
design -w 'work.average=50, work.average=60 '
design -w work.average=50 --settings older.txt >/dev/null
design -w work.average=50000 --settings older.txt >/dev/null; test -s older.txt || echo gone
# A search that was ended says so.
importon design "$ROOT/scenes/office.xml" -m mono -D spp=256 -w work.average=430,work.maximum=480 --levels 1 --nodes 1; echo "exit $?" >&2
# Places: names, components, bounds, a catalogue.
design -w work.average=500 --move 'spot.position'
design -w work.average=500 --move 'lamp_11.position[3]'
design -w work.average=500 --move 'lamp_11.position[1-0]'
design -w work.average=500 --move 'lamp_11.position[2]=3,2'
design -w work.average=500 --move 'lamp_11.position[2]=0,1'
design -w work.average=500 --steps 3
design -w work.average=500 --choose 'lamp_*=lamps/opal.ldt,none' --move 'lamp_11.position'
