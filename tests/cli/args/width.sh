# SPDX-License-Identifier: Apache-2.0
# Help fits a terminal of 80 columns.
for command in $(importon help | sed -n 's/^  \([a-z]*\) .*/\1/p'); do
    importon help "$command" | awk -v name="$command" 'length > 79 { print name ": " $0 }'
done
importon help | awk 'length > 79'
