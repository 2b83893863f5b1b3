# SPDX-License-Identifier: Apache-2.0
# SIGTERM ends a trace that would take many seconds, at once.
for verb in trace check; do
    importon bend $verb "$ROOT/scenes/bend/rod.xml" -D count=3000000 -q >answer &
    pid=$!
    sleep 3
    start=$(date +%s%N)
    kill -TERM $pid
    wait $pid
    echo "exit $?"
    (($(date +%s%N) - start < 5000000000)) || echo late
done
# A fit writes what it has.
importon bend fit "$ROOT/scenes/bend/luneburg.xml" --optimizer adam -n 1000000 -q --json -o out >fit.json &
pid=$!
sleep 4
kill -TERM $pid
wait $pid
echo "exit $?"
python3 -c 'import json; a = json.load(open("fit.json")); print(a["complete"], a["value"] > 0)'
ls out | grep -c -e '^rays' -e '^field' -e '^loss'
