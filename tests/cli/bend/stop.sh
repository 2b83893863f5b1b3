# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: output/overwrite traces and fits too, and fit/interrupt ends a fit.
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
# A fit writes what it has; a slow machine has nothing yet after four seconds.
for seconds in 4 16 64; do
    importon bend fit "$ROOT/scenes/bend/luneburg.xml" --optimizer adam -n 1000000 -q --json -o out >fit.json 2>said &
    pid=$!
    sleep $seconds
    kill -TERM $pid
    wait $pid
    status=$?
    [[ -s fit.json ]] && break
done
echo "exit $status"
cat said >&2
python3 -c 'import json; a = json.load(open("fit.json")); print(a["complete"], a["value"] > 0)'
ls out | grep -c -e '^rays' -e '^field' -e '^loss'
