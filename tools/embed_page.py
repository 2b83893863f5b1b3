#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The page of a report as C strings: style and scripts go into the template, which is cut
where its addresses and its data go.

Usage: embed_page.py OUT.c page.html page.css SCRIPT.js...
"""
import sys

out, page, style, *scripts = sys.argv[1:]
read = lambda path: open(path, encoding="utf-8").read()
text = read(page).replace("@STYLE@", read(style)).replace("@SCRIPT@", "\n".join(map(read, scripts)))
head, rest = text.split("@CONNECT@")
body, tail = rest.split("@DATA@")


def array(name, text):
    data = text.encode() + b"\0"
    rows = (",".join(str(b) for b in data[i:i + 24]) for i in range(0, len(data), 24))
    return f"const char {name}[] = {{\n" + ",\n".join(rows) + "};\n"


with open(out, "w", encoding="ascii") as file:
    file.write('#include "report/page_text.h"\n' + "".join(
        array("imp__page_" + name, text) for name, text in (("head", head), ("body", body), ("tail", tail))))
