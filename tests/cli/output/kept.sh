# SPDX-License-Identifier: Apache-2.0
# A run that fails leaves the file of an earlier one; one that succeeds replaces it, through a
# link, with the permissions it had.
furnace=$ROOT/scenes/furnace.xml
echo '{"importon":"before"}' >answer
chmod 640 answer
ln -s answer link
importon info nothere.xml -o answer 2>/dev/null
echo "exit $?"
importon gradient "$furnace" --set nosuch=1 -o answer 2>/dev/null
echo "exit $?"
cat answer
importon info "$furnace" --json -o link
echo "exit $?"
head -c 11 answer
echo
stat -c %a answer
[[ -L link ]] && ls
