# SPDX-License-Identifier: Apache-2.0
# Every kind of value says what it expects.
for words in '--spp 0' '--spp 1e3' '--seed -1' '--time soon' '--mode colour' '--pixel 3' \
    '--threads 99999' '--json=yes' '--spp'; do
    echo "+ $words" >&2
    importon render $words
    echo "exit $?" >&2
done
