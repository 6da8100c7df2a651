"""The forms an increment can take: small frozen objects with one verb, one pass each."""

from bipot.forms.base import Answer, Backend, Form, FormName, Pass, Workspace
from bipot.forms.conic import Dissipation, Tangent

__all__ = ["Answer", "Backend", "Dissipation", "Form", "FormName", "Pass", "Tangent", "Workspace"]
