# SPDX-License-Identifier: Apache-2.0
importon rendr scene.xml
