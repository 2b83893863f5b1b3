# SPDX-License-Identifier: Apache-2.0
# Each pixel is a lamp's radiance: I = pixels/read^2, and the rest is arithmetic (plan_exact.c).
export SCENE=$SCENES/two_lamps.xml
plan() { importon plan "$SCENE" -m mono --spp 4 --noise read=0.1 "$@"; echo "exit $?"; }
plan --sensors 0,1
plan --sensors 0,1 --lamps each --exposures 1,2 --cost '1+1*t' --cost 'first*time 2=9' -k 2
plan --have 0 --sensors 1 --prior two.radiance=0.02 --criterion A
plan --sensors 1 --of 'two.radiance.value'
plan --sphere 10,0,0,2,3,80,90 --up 0,0,1 --budget 2
printf '# places\n0 0 2 0 0 0 at one\n10 0 2 10 0 0\n' >places
plan --path places --json | sed 's/,"/,\n"/g; s/\([0-9]\.[0-9]\{5\}\)[0-9]*/\1/g' | grep -v '"importon"\|spp\|seed'
echo "- sensors by name"
plan --sensors 0,1 >numbers; plan --sensors first,second >names; cmp numbers names && echo the same
