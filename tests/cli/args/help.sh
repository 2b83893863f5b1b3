# SPDX-License-Identifier: Apache-2.0
# Help goes to standard output, for every command.
for command in render gradient jacobian check fit compare info bend bench; do
    importon help $command >help.txt || exit 9
    importon $command --help | cmp - help.txt || exit 9
    grep -q "usage: importon $command" help.txt || exit 9
done
importon --help
