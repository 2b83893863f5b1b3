# SPDX-License-Identifier: Apache-2.0
# The printed error of the picture's mean against the spread over 48 seeds, through a
# Gaussian filter: pixels share samples, and errors added as if they did not are 1.5 times
# too small. A spread over 48 runs is known to 10 %.
sed "s:type=\"box\":type=\"gaussian\":; s:filename\" value=\":&$ROOT/scenes/:" "$ROOT/scenes/cornell.xml" >cornell.xml
for seed in $(seq 48); do
    importon gradient cornell.xml -m mono -D res=12 --spp 4 --points independent --seed "$seed" -p 'white*' --json -q || exit 9
    importon jacobian cornell.xml -m mono -D res=12 --spp 4 --points independent --seed "$seed" -p 'white*' --json -q -o J >>table || exit 9
done >answers
# ratio: of "value se" lines, the spread over the error told.
ratio() {
    awk '{ n++; s += $1; q += $1 * $1; v += $2 * $2 }
         END { r = sqrt((q - s * s / n) / (n - 1) / (v / n)); print n, (r > .7 && r < 1.35) ? "as told" : "spread/reported " r }'
}
sed 's/.*"mean","value":\([^,]*\),"se":\([^,]*\),.*/\1 \2/' answers | ratio
sed 's/.*"mean":\(.*\),"se":\([^}]*\)}],.*/\1 \2/' table | ratio
sed 's/.*"mean":\(.*\),"se":\(.*\)}}/\1 \2/' table | ratio
