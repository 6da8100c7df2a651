"""The pages whose text quotes numbers, by their names in the repository."""

from __future__ import annotations

from studies.quoted import comparison, elements, robustness
from studies.quoted.filling import Quoted

PAGES: dict[str, Quoted] = {
    "docs/comparison.md": comparison.QUOTED,
    "docs/elements.md": elements.QUOTED,
    "docs/robustness.md": robustness.QUOTED,
}
