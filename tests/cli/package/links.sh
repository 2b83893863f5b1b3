# SPDX-License-Identifier: Apache-2.0
# tools/check_links.py sees what leads nowhere, and nothing else. (Names are made of
# variables: it reads this file, too.)
there=page gone=absent right=good wrong=bad
mkdir -p docs src
printf '# Page\n\n## 1 First\n\n### 1.2 Second\n\n## A Tables\n' >docs/$there.md
cat >src/$right.c <<C
/* docs/$there.md 1, $there.md 1.2, and docs/$there.md
 * 1.2; docs/$there.md A. src/$right.c */
static const char *text = "src/$gone.c";
C
cat >docs/$right.md <<MD
[a]($there.md#12-second) [b](#top) [c](https://example.org/$gone.md)

    [in code]($gone.html)

# Top
MD
"$ROOT/tools/check_links.py" . || exit 9
cat >src/$wrong.c <<C
/* docs/$there.md 1.3
 * docs/$there.md
 * 2. $there.md 1, 1.4
 * docs/$gone.md src/$gone.c */
C
cat >docs/$wrong.md <<MD
[a]($gone.html) [b]($there.md#third) ![c](images/$gone.gif)
MD
"$ROOT/tools/check_links.py" .
