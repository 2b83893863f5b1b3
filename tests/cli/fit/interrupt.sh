# SPDX-License-Identifier: Apache-2.0
# Ctrl-C writes the state reached and exits with 130; --resume goes on.
scene=$ROOT/scenes/furnace.xml
importon render "$scene" --spp 256 -q --seed 1 -o t.exr || exit 9
fit=(importon fit "$scene" --spp 64 -q --target t.exr --set ball.reflectance.value=0.8 -p 'ball.*'
    --tolerance 1e-15 --checkpoint state --picture-spp 4 -o result)
"${fit[@]}" --iterations 1000000 >/dev/null &
sleep 1.5
kill -INT $!
wait $!
echo "exit $?"
[[ -s state && -s result/parameters.json && -s result/recovered.png ]] || exit 9
"${fit[@]}" --resume --iterations 5 --json >answer.json
echo "exit $?"
python3 -c 'import json; v = json.load(open("answer.json"))["params"][0]["value"]; assert abs(v - 0.5) < 0.05, v'
