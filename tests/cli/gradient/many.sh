# SPDX-License-Identifier: Apache-2.0
# Printing n parameters takes time in proportion to n: 65536 lamps in less than 8 s of processor time (0.3
# where this was written; 33 when every number was looked for among all parameters).
python3 - >lamps.xml <<'P'
print('<scene version="3.0.0"><integrator type="direct"/><sensor type="perspective"><film type="hdrfilm">'
      '<integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film></sensor>'
      '<shape type="sphere"/>')
for i in range(65536):
    print(f'<emitter type="point"><point name="position" x="{i}" y="0" z="5"/></emitter>')
print('</scene>')
P
(ulimit -t 8; importon gradient lamps.xml --spp 1 -q >table) || exit 9
wc -l <table
tail -n 1 table | cut -d ' ' -f 1
