# SPDX-License-Identifier: Apache-2.0
# What recorded walks cannot answer is refused, with the reason.
export TMPDIR=$PWD
importon record "$ROOT/scenes/fog.xml" -D res=8 --spp 2 -q -o fog.walks
importon record "$ROOT/scenes/fog.xml" -D res=8 -D sigma=0 --spp 2 -q -o clear.walks
importon what-if clear.walks --set fog.sigma_t.value=0.5; echo $?
importon what-if fog.walks -p 'fog.sigma*' --gradient; echo $?
importon record "$ROOT/scenes/textured.xml" -D width=8 -D height=6 --spp 4 -q -o metal.walks
importon what-if metal.walks --set metal.alpha.value=0.01 2>&1 | sed 's/[0-9.e-]* of them/X of them/'; echo "${PIPESTATUS[0]}"
importon what-if metal.walks --sweep metal.alpha.value=0.3:0.01:2 | sed 's/[0-9.e-]* of them/X of them/' | tail -1
head -c 5000 metal.walks >short.walks
importon what-if short.walks; echo $?
importon what-if "$ROOT/scenes/fog.xml" 2>&1 | sed 's/.*: not/not/'
importon what-if metal.walks --region 0,0,99,99; echo $?
importon what-if metal.walks --sweep nothing=1; echo $?
# Beyond a bound, one value is refused and the rest are answered.
importon what-if metal.walks --sweep metal.alpha.value=-0.1:0.5:3 | awk 'NR > 1 { print $1, ($2 == "refused:" ? $0 : NF) }'
for option in '--part 1/2' '--time 1' '--manifest m'; do importon record "$ROOT/scenes/fog.xml" $option -o x; echo $?; done
importon record "$ROOT/scenes/fog.xml" --spp 4 --memory 0.01 -q -o x 2>&1 | sed 's/need about.*/need more/'
echo 1 >mine.txt
importon record "$ROOT/scenes/fog.xml" -o mine.txt; echo $?
