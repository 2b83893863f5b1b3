# SPDX-License-Identifier: Apache-2.0
# The nearest option is suggested; nothing is read.
echo "+ long" >&2
importon render --sspp 4 no_such_scene.xml
echo "+ short" >&2
importon render -Z no_such_scene.xml
