r"""Where a block whose sides roll onto the platen folds in space, and the layout that does not.

Under the platen a pyramid of material moves with it, and below that the side flows up past it: the edges of elements
across the band between them shorten, one below another along the block's diagonal. The corner that an element between
planes has on the pyramid opens until its three faces lie in one plane, as that of the block's corner did on the platen
before; but what it lies on is material, and the next instant it is folded. Elements of the fanned layout are not along
the band's diagonal.
"""

import re

import numpy as np
import pytest

from bipot.errors import IncrementFailed
from bipot.fem.elements import tabulated_at
from bipot.fem.orientation import scaled_jacobians
from bipot.forms import FormName, Newton
from bipot.marching import Control, march
from bipot.meshes.elements import Element
from studies import block


def marched(elements, reduction, increments, layout):
    """The scene at mu = 0.3, the accepted increments by Newton's method alone, and how the march ended."""
    asked = ["--mu", "0.3", "--elements", str(elements), "--layout", layout]
    asked += ["--reduction", f"{reduction:g}", "--increments", str(increments)]
    (one,) = block.cases(block.parser().parse_args(asked))
    scene, accepted = one.scene(), []
    try:
        for step in march(scene, one.schedule(), Control(Newton(), (), cuts=2)):
            accepted.append(step)  # noqa: PERF402 what came before a failure is kept
    except IncrementFailed as failed:
        return scene, accepted, str(failed)
    return scene, accepted, "at the end of the path"


def check(accepted):
    """Every certificate within the bounds, by Newton's method."""
    bounds = Control().limits.bounds
    assert all(max(step.solved.certificate.ratios(bounds).values()) <= 1 for step in accepted)
    assert all(step.form is FormName.NEWTON for step in accepted)


@pytest.mark.slow
def test_between_planes_it_folds_inside_the_block_however_short_increments_are():
    """At a node inside, where nothing is in contact: no landing and no straight corner is asked about."""
    scene, accepted, words = marched(4, 0.48, 8, "tensor")
    assert re.search(r"element 42 at .*, at the end of the increment: Jacobian determinant -", words), words
    assert words.endswith("Remesh there: shorter increments fold the element too.")
    assert 0.44 < 0.48 * accepted[-1].state.tau < 0.46
    (cell,) = scene.mesh.elements[[42]]
    slopes = tabulated_at(Element.H8, Element.H8.places).gradients
    at_corners = np.linalg.det(np.einsum("qka,ki->qia", slopes, accepted[-1].state.nodes[cell]))
    assert 0 < at_corners.min() < 0.1 * at_corners.mean()
    np.testing.assert_allclose(scene.mesh.nodes[cell[at_corners.argmin()]], 3 * 5.0 / 4)
    assert at_corners.max() > 2 * at_corners.mean()


def test_fanned_out_it_does_not():
    scene, accepted, words = marched(4, 0.47, 10, "fanned")
    assert words == "at the end of the path"
    check(accepted)
    assert not any(step.cuts for step in accepted)
    assert scaled_jacobians(accepted[-1].state.nodes, scene.mesh.elements).min() > 0.5


@pytest.mark.slow
def test_twelve_a_side_come_to_thirty_per_cent():
    """Between planes they fold at 25 %."""
    scene, accepted, words = marched(12, 0.3, 30, "fanned")
    assert words == "at the end of the path"
    check(accepted)
    assert not any(step.cuts for step in accepted)
    assert scaled_jacobians(accepted[-1].state.nodes, scene.mesh.elements).min() > 0.45
