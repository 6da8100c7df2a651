"""The same case with the element that may be trusted: Q4/P0 between lines, at the node spacing of what was asked."""

from __future__ import annotations

from dataclasses import replace

from bipot.errors import SceneError
from bipot.meshes.layout import Layout
from studies.element_types import ElementType
from studies.upsetting_case import Case

TRUSTED = ElementType.Q4P0
BESIDE = TRUSTED.value
"""Its runs are in a folder of this name, beside those that were asked for."""


def trustworthy(case: Case) -> Case:
    """The case with :data:`TRUSTED`, its own rule, and as many edges between nodes along a side.

    Raises:
        SceneError: that is the case itself.
    """
    spacing = case.elements * (2 if case.element.element.quadratic else 1)
    own = TRUSTED.quadrature
    found = replace(case, elements=spacing, element=TRUSTED, quadrature=own, layout=Layout.TENSOR)
    if found == case:
        raise SceneError(f"--beside has no effect on --element-type {TRUSTED.value}: that is what it runs")
    return found
