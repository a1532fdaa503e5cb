"""A progress bar, if tqdm is installed."""

from __future__ import annotations

import sys
import typing


class Bar:
    """Shows what ``--progress json`` says, in a notebook or on a terminal."""

    def __init__(self, bar: typing.Any) -> None:
        self.bar = bar

    def show(self, line: dict[str, typing.Any]) -> None:
        """Shows an event: its fraction, and what else it says."""
        fraction = line.get("fraction")
        if fraction is not None:
            self.bar.n = round(100 * min(fraction, 0.99))
        told = []
        if line.get("samples") is not None:
            told.append(f"{line['samples']:.0f} spp")
        if line.get("relative_error") is not None:
            told.append(f"error {100 * line['relative_error']:.3g} %")
        self.bar.set_postfix_str(", ".join(told))

    def close(self) -> None:
        """Ends the bar as it stands."""
        self.bar.close()


def bar(wanted: bool | None, name: str) -> Bar | None:
    """A bar if it is wanted; by default on terminals and in notebooks where tqdm is installed."""
    if wanted is False:
        return None
    try:
        from tqdm.auto import tqdm
    except ImportError:
        if wanted:
            raise
        return None
    if wanted is None and not (sys.stderr.isatty() or "ipykernel" in sys.modules):
        return None
    form = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}{postfix}"
    return Bar(tqdm(total=100, desc=name, leave=False, bar_format=form))
