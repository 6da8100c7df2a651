"""The forms an increment can take: small frozen objects with one verb, one pass each."""

from bipot.forms.base import Answer, Form, FormName, Pass, Workspace
from bipot.forms.conic import Dissipation, Tangent
from bipot.forms.delassus import Delassus
from bipot.forms.newton import Newton
from bipot.forms.penalty import Optimiser, Penalty, Uzawa, contact_penalty

OWN = (Tangent, Dissipation, Newton, Delassus, Penalty, Uzawa)
"""The forms of this library: their responses are the body's."""

__all__ = [
    "OWN",
    "Answer",
    "Delassus",
    "Dissipation",
    "Form",
    "FormName",
    "Newton",
    "Optimiser",
    "Pass",
    "Penalty",
    "Tangent",
    "Uzawa",
    "Workspace",
    "contact_penalty",
]
