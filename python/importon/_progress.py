# SPDX-License-Identifier: Apache-2.0
"""Progress bars, by tqdm where that is installed; the words are the command line's."""
from __future__ import annotations

import sys
from typing import Any, Optional

_default: Any = None  # None: in notebooks


def set_progress(progress: Any) -> None:
    """What calls without a `progress` of their own show.

    Parameters
    ----------
    progress : bool or callable or None
        True: bars (`tqdm`, if it is installed); False: nothing; a callable: is given a
        `Progress` a few times a second, and stops the call by returning True; None, the
        default: bars in notebooks.

    Examples
    --------
    >>> importon.set_progress(False)
    """
    global _default
    _default = progress


class Bar:
    """A bar that appears with the first report, so that short calls show none."""

    def __init__(self, tqdm: Any) -> None:
        self.tqdm, self.bar, self.stage = tqdm, None, ""

    def __call__(self, p: Any) -> None:
        if self.bar is None or p.stage != self.stage:
            self.close()
            self.stage = p.stage
            self.bar = self.tqdm(total=100, desc=p.stage, leave=False, unit="%",
                                 bar_format="{desc} {bar} {n:.0f}% {elapsed} ETA {remaining} {postfix}")
        bar: Any = self.bar
        bar.set_postfix_str(p.note or ("%.3g %s/s" % (p.rate, p.rate_unit) if p.rate else ""),
                            refresh=False)
        bar.update(100 * p.fraction - bar.n)

    def close(self) -> None:
        if self.bar is not None:
            self.bar.close()
            self.bar = None


def _in_notebook() -> bool:
    return "ipykernel" in sys.modules and "IPython" in sys.modules


def callback_of(progress: Any) -> Optional[Any]:
    """The callable behind a `progress` argument, or None."""
    if progress is None:
        progress = _in_notebook() if _default is None else _default
    if callable(progress):
        return progress
    if not progress:
        return None
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        return None
    return Bar(tqdm)
