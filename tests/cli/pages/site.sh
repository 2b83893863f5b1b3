# SPDX-License-Identifier: Apache-2.0
# The navigation of the site (mkdocs.yml) names every page once and no other; docs/index.md leads to each
# page, and a page says for whom it is before its first section. With mkdocs, the site is built.
cd "$ROOT" || exit 9
find docs -name '*.md' | sed 's|^docs/||' | LC_ALL=C sort >"$OUT/pages"
sed -n '/^nav:/,$s/^ *- .*: \(.*\.md\)$/\1/p' mkdocs.yml | LC_ALL=C sort >"$OUT/named"
(($(wc -l <"$OUT/pages") > 25)) || echo "few pages: the folder has moved"
diff "$OUT/pages" "$OUT/named"
while read -r page; do
    [[ $page == index.md || $page == notes/* ]] && continue
    grep -qF "]($page)" docs/index.md || echo "docs/index.md does not lead to $page"
done <"$OUT/pages"
while read -r page; do
    sed -n '1,/^## /p' "docs/$page" | tr '\n' ' ' | grep -qE '(^|[ .*])For (anyone|a |every|those|packagers)' ||
        echo "$page does not say for whom it is"
done <"$OUT/pages"
if command -v mkdocs >/dev/null; then
    mkdocs build --quiet --site-dir "$OUT/site" >"$OUT/log" 2>&1 || cat "$OUT/log"
    [[ -s $OUT/site/search/search_index.json ]] || echo "the site has no search"
fi
