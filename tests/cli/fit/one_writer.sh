# SPDX-License-Identifier: Apache-2.0
# A checkpoint has one writer: a second fit is refused at once, whatever else is said; a fit that is
# killed leaves no lock that counts; a file of somebody else's is not taken for a lock.
cp "$ROOT/scenes/furnace.xml" scene.xml
importon render scene.xml -D res=8 --spp 8 --seed 3 -q -o target.exr --no-preview
fit() { importon fit scene.xml -D res=8 -T target.exr -p 'ball.*' --spp 8 -q "$@" >out 2>err; echo "exit $?"; sed 's/process [0-9]* on [^)]*/process N on HOST/' err >&2; }
importon fit scene.xml -D res=8 -T target.exr -p 'ball.*' --spp 4096 -n 1000000 --checkpoint state -q >first 2>&1 &
first=$!
for ((k = 0; k < 600; k++)); do [[ -s state && -s state.lock ]] && break; sleep 0.1; done
fit -n 1 --checkpoint state
fit -n 1 --checkpoint state --overwrite
fit -n 1 --checkpoint state --resume
ln -s state other
fit -n 1 --checkpoint other --overwrite
fit -n 1 --checkpoint elsewhere
kill -9 $first
wait $first 2>/dev/null
echo "left by the one that was killed: $(ls state.lock)"
fit -n 1 --checkpoint state --overwrite
ls state*
echo "the user's own" >mine.lock
fit -n 1 --checkpoint mine
cat mine.lock
