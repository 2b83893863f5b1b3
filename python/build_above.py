# SPDX-License-Identifier: Apache-2.0
"""The build backend of this folder: meson-python in the folder above, where the library's
sources are."""
import functools
import os

import mesonpy


def _above(hook):
    @functools.wraps(hook)
    def call(*args, **kwargs):
        here = os.getcwd()
        os.chdir(os.path.dirname(here))
        try:
            return hook(*args, **kwargs)
        finally:
            os.chdir(here)

    return call


build_wheel = _above(mesonpy.build_wheel)
build_sdist = _above(mesonpy.build_sdist)
get_requires_for_build_wheel = _above(mesonpy.get_requires_for_build_wheel)
get_requires_for_build_sdist = _above(mesonpy.get_requires_for_build_sdist)
