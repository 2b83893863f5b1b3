# SPDX-License-Identifier: Apache-2.0
# Bad candidates, names and numbers are refused by name, before anything is traced.
cd "$SCENES" || exit 9
plan() { importon plan two_lamps.xml -m mono --spp 4 "$@"; echo "exit $?" >&2; }
plan --have 0,1,2
plan --sensors 7
plan --sensors 0,0
plan --sensors x
plan --of ball.reflectance
plan -p one.radiance.value --of two.radiance
plan --prior one.radiance
plan --prior one.radiance=-1
plan --prior nothing=1
plan -k 5
plan --noise read=nan
plan --noise white=2
plan --noise dark=1
plan --cost -1
plan --cost 'third=2'
plan --sphere 0,0,0,-1,4
plan --sphere 0,0,0,1,4 --up 0,0,0
plan --path nowhere
plan --up 0,1,0
plan --lamps three
plan --exposures 0
plan --sensors 2
plan --sensors 0,2
plan --budget 0.5
plan --sensors 0 --improve 2
