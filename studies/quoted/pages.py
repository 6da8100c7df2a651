"""The pages whose text quotes numbers, by their names in the repository."""

from __future__ import annotations

from studies.quoted import benchmarks, comparison, conic_set, coulomb, elements, robustness, scenes, theory
from studies.quoted.filling import Quoted

PAGES: dict[str, Quoted] = {
    "README.md": theory.README,
    "docs/benchmarks.md": benchmarks.QUOTED,
    "docs/comparison.md": comparison.QUOTED,
    "docs/conic_set.md": conic_set.QUOTED,
    "docs/coulomb.md": coulomb.QUOTED,
    "docs/elements.md": elements.QUOTED,
    "docs/robustness.md": robustness.QUOTED,
    "docs/scenes.md": scenes.QUOTED,
    "docs/theory.md": theory.QUOTED,
}
