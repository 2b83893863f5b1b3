# SPDX-License-Identifier: Apache-2.0
# Every light and reflectance, and the lights' shares that add up to the measurement.
importon elements "$ROOT/scenes/elements/b.xml" -m mono -D res=16 --eps 5e-3 -q --no-image \
    --lux floor --sensitivity >table || exit 9
awk '{print $1, NF}' table | sort | head -n 20
grep -o 'number .*' table | tr -s ' ' # an elasticity is no share: it may be more than 100 %
