# SPDX-License-Identifier: Apache-2.0
# Levels, a catalogue, settings that make the scene of the answer, and what cannot be had.
design() { importon design "$ROOT/scenes/office.xml" -m mono -D spp=32 "$@"; echo "exit $?"; }
design -w work.average=450,work.uniformity=0.6,eyes.ugr=20
design -w work.average=450 --choose 'lamp_*=lamps/opal.ldt,lamps/batwing.ies,none' --watts '*:batwing=25' --others 1 --settings levels
sed 1d levels
cat >catalogue <<'X'
# places  file               settings
lamp_1?   lamps/opal.ldt     cost=120
lamp_1?   lamps/batwing.ies  cost=90 watts=25 levels=0.05,1
lamp_1?   none
lamp_2?   lamps/opal.ldt     cost=120 # the other side
lamp_2?   none
X
design -w 0.average=300 --catalogue catalogue --least cost
design -w work.average=700 -w eyes.ugr=19
# The room of an answer reads what was said.
importon read "$ROOT/scenes/office.xml" -m mono -D spp=64 --luminaire 'lamp_*=lamps/batwing.ies' --set @levels --grid --sensor 0 | head -2
# Two of the luminaires are enough where they may move; what was found is a scene.
design -w work.average=200,work.uniformity=0.5 --lamps 'lamp_1[13]' --move 'lamp_1[13].position[0-1]' --settings places | sed 's/ *after .*//'
importon read "$ROOT/scenes/office.xml" -m mono -D spp=64 --set @places --grid --sensor 0 | head -2
# The same bits on any number of threads.
for t in 1 3; do importon design "$ROOT/scenes/office.xml" -m mono -D spp=16 -w work.average=450,eyes.ugr=22 --json -t $t >answer$t; done
cmp answer1 answer3 && echo same
