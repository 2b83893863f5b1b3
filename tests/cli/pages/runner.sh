# SPDX-License-Identifier: Apache-2.0
# tools/run_page.py finds a page that shows something else, and a command that fails.
cat >good <<'MD'
Save this as `numbers.txt`:

```text
1
2
```

```console
$ cat \
    numbers.txt
1
2
$ seq 5
1
...
5
$ echo took 17 s
took ... s
```
MD
sed 's/^took/time/' good >other
sed 's/^\$ seq 5/$ seq 4/' good >shorter
printf '```console\n$ false\n```\n' >failing
for page in good other shorter failing; do
    "$ROOT/tools/run_page.py" "$page" >said
    echo "$page $? $(head -1 said)"
done
