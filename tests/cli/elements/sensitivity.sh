# SPDX-License-Identifier: Apache-2.0
# Every light and reflectance, and the lights' shares that add up to the measurement.
importon elements "$ROOT/scenes/elements/b.xml" -m mono -D res=16 --eps 5e-3 -q --no-image \
    --lux floor --sensitivity | awk '{print $1, NF}' | sort | head -n 20
