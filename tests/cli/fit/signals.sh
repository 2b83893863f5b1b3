# SPDX-License-Identifier: Apache-2.0
# Not under sanitizers: fit/interrupt ends a fit too.
# SIGTERM and SIGHUP end a fit as Ctrl-C does: results and checkpoint are written, and the status tells which.
scene=$ROOT/scenes/furnace.xml
importon render "$scene" --spp 64 -q -o t.exr || exit 9
for signal in INT TERM HUP; do
    # Whoever runs the tests may ignore signals.
    env --default-signal=INT,TERM,HUP "$(type -P importon)" fit "$scene" --spp 16 --progress never --target t.exr --set ball.reflectance.value=0.55 -p 'ball.*' \
        --tolerance 1e-15 -n 1000000 --picture-spp 2 --checkpoint $signal.state -o $signal >$signal.txt 2>$signal.err &
    fit=$!
    for ((k = 0; k < 200; k++)); do [[ -s $signal.state ]] && break; sleep 0.1; done
    kill -$signal $fit
    wait $fit
    echo "$signal $?"
    cat $signal.err # so near, that what is left over is no warning however far it came
    [[ -s $signal.state && -s $signal/parameters.json && -s $signal/recovered.png ]] || exit 9
done
# nohup means it.
(trap '' HUP; importon render "$scene" --spp 4000 -q -o n.exr & sleep 0.3; kill -HUP $!; wait $!; echo "nohup $?")
