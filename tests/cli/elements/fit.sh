# SPDX-License-Identifier: Apache-2.0
# Lamp design: the floor's target is met, the answer can be taken up with --set @FILE, bounds hold.
scene=$ROOT/scenes/elements/b.xml
common=(-m mono -D res=16 --eps 5e-3 -q --no-image)
importon elements "$scene" "${common[@]}" --fit -p 'light_left*' --lux floor=0.25 \
    --recovered found.txt --json >a.json || exit 9
importon elements "$scene" "${common[@]}" --set @found.txt --lux floor --json >b.json || exit 9
importon elements "$scene" "${common[@]}" --fit -p 'light*' --lux floor=2 --lux 3:back=1 \
    --bounds 'light*=1,20' | sed -n 's/ *$//; /bound/p' | tr -s ' ' | sort
python3 - <<END
import json
fit = json.load(open("a.json"))["fit"]
again = json.load(open("b.json"))["measure"]
print(fit["linear"], len(fit["params"]), abs(fit["goals"][0]["after"] - 0.25) < 1e-6, abs(again - 0.25) < 0.01)
END
