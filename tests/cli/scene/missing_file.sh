# SPDX-License-Identifier: Apache-2.0
importon info no_such_scene.xml
