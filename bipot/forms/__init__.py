"""The forms an increment can take: small frozen objects that take one pass after another."""

from bipot.forms.base import Cache, Form, FormName, Step
from bipot.forms.delassus import Delassus
from bipot.forms.dissipation import Dissipation
from bipot.forms.newton import Newton
from bipot.forms.penalty import Optimiser, Penalty, Uzawa, contact_penalty
from bipot.forms.tangent import Tangent

OWN = (Tangent, Dissipation, Newton, Delassus, Penalty, Uzawa)
"""The forms of this library: their iterates are the increment's."""

__all__ = [
    "OWN",
    "Cache",
    "Delassus",
    "Dissipation",
    "Form",
    "FormName",
    "Newton",
    "Optimiser",
    "Penalty",
    "Step",
    "Tangent",
    "Uzawa",
    "contact_penalty",
]
