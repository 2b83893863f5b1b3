# SPDX-License-Identifier: Apache-2.0
# The verdict and the numbers of a result stand in the page's HTML, for who runs no script: they are
# those of the command's own files. Texts of others stay texts, and the policy allows one script.
mkdir r
cat >read.py <<'P'
import base64, hashlib, html.parser, re, sys
class Reader(html.parser.HTMLParser):
    inside, text, rows, cell, scripts, json = 0, "", [], None, [], True
    def handle_starttag(self, tag, attrs):
        if tag == "main": self.inside = 1
        if tag == "script" and ("type", "application/json") not in attrs: self.scripts.append("")
        if tag == "script": self.json = ("type", "application/json") in attrs
        if tag == "tr": self.rows.append([])
        if tag in ("td", "th"): self.rows[-1].append("")
        self.cell = tag in ("td", "th")
        if any(k.startswith("on") for k, _ in attrs): print("an attribute that runs:", attrs)
    def handle_endtag(self, tag):
        if tag == "main": self.inside = 0
        if tag == "script": self.json = True
        if tag in ("p", "h1", "h2", "tr"): self.text += "\n"
    def handle_data(self, data):
        if not self.json: self.scripts[-1] += data
        if self.inside: self.text += data
        if self.inside and self.cell: self.rows[-1][-1] += data
page = open("r/report.html", encoding="utf-8").read()
r = Reader()
r.feed(page)
hashes = ["'sha256-%s'" % base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in r.scripts]
print("scripts:", len(hashes), "the policy's:", re.search("script-src ([^;]*);", page)[1] == hashes[0])
P
cat >r/parameters.json <<'J'
{"importon":"0.2.0","command":"fit","loss":"l2","iterations":7,"value":0.25,"se":0.031,"residual":0.0933,"residual_hi":0.1041,
"chi2_per_freedom":1.25,"chi2_se":0.05,"reason":"the gradient is within \"its\" noise <img src=x onerror=alert(1)>","warning":"\u003cscript>a\ud83d\ude00\u0001\ud800","complete":true,
"params":[{"name":"a<b>.value","unit":"1","start":0.8,"value":0.498813,"se":0.0045,"lo95":0.4898,"hi95":0.5077,"truth":0.5,"at_bound":0,"determined":true},
{"name":"b","unit":"W","start":1e9,"value":-2.5e-7,"se":null,"lo95":null,"hi95":null,"at_bound":1,"determined":false},
{"name":"field","count":9,"file":"x.exr"}],"history":{"loss":[3,2,1]}}
J
importon report r -q --title '<script>alert(2)</script>' || exit 9
python3 - <<'P'
exec(open("read.py").read())
print(r.text)
P
# Of a real fit: every number of its file.
rm -r r
importon render "$ROOT/scenes/furnace.xml" -D res=8 --spp 8 --seed 3 -q --se -o target.exr --no-preview
importon fit "$ROOT/scenes/furnace.xml" -D res=8 -T target.exr -p 'ball.*' --set ball.reflectance.value=0.8 --spp 8 -n 3 --optimizer lm -q -o r >/dev/null
importon check --draws-time 0.1 "$ROOT/scenes/furnace.xml" -D res=8 --spp 4 -p 'ball.*' --json -o r/check.json -q
importon report r -q || exit 9
python3 - <<'P'
exec(open("read.py").read())
import json
fit = json.load(open("r/parameters.json"))
row = next(c for c in r.rows if c[0] == "ball.reflectance.value")
p = fit["params"][0]
print("as in the file:", row[1:5] == ["%.6g" % p["start"], "%.6g" % p["value"], "%.6g" % p["se"], "%.6g to %.6g" % (p["lo95"], p["hi95"])],
    "after %d iterations: %s" % (fit["iterations"], fit["reason"]) in r.text, "%.6g" % fit["value"] in r.text)
print("explained:", "Is the picture explained?" in r.text, "check:", "check" in r.text)
P
# What is true, from a file of settings.
printf '# importon\nball.reflectance.value=0.5\nother=1,2e-3\n' >truth.txt
importon report r -q --truth truth.txt || exit 9
python3 - <<'P'
exec(open("read.py").read())
print("truth:", next(c for c in r.rows if c[0] == "ball.reflectance.value")[5:])
P
grep -o '"kind":"truth"[^}]*}' r/report.html
for line in 'x' '=1' 'x=' 'x=1,' 'x=1 2'; do
    echo "$line" >truth.txt
    importon report r -q --truth truth.txt 2>&1
done
echo "exit $?"
