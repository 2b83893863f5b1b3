#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page of a report as C strings: style and scripts go into the template, which is cut
where its addresses, its answer in HTML and its data go. Its policy allows this script alone, by
its hash.

Usage: embed_page.py OUT.c page.html page.css SCRIPT.js...
"""
import base64
import hashlib
import sys

out, page, style, *scripts = sys.argv[1:]
read = lambda path: open(path, encoding="utf-8").read()
script = "\n" + "\n".join(map(read, scripts)) + "\n"  # the element's text, to the byte
digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
text = read(page).replace("@STYLE@", read(style)).replace("@SHA256@", digest).replace("@SCRIPT@", script)
head, rest = text.split("@CONNECT@")
body, rest = rest.split("@STATIC@")
data, tail = rest.split("@DATA@")


def array(name, text):
    data = text.encode() + b"\0"
    rows = (",".join(str(b) for b in data[i:i + 24]) for i in range(0, len(data), 24))
    return f"const char {name}[] = {{\n" + ",\n".join(rows) + "};\n"


with open(out, "w", encoding="ascii") as file:
    file.write('#include "report/page_text.h"\n' + "".join(
        array("imp__page_" + name, text) for name, text in (("head", head), ("body", body), ("data", data), ("tail", tail))))
