"""References to names that no page describes: they must exist all the same, and are then shown without a link.

A name that a page describes under another one (``bipot.forms.Newton`` is ``bipot.Newton``) is linked there.
"""

import importlib
import re
import sys
from typing import Any

from sphinx.util.nodes import make_refnode

WITHIN = ("", "bipot.", "bipot.typing.", "typing.", "collections.abc.", "builtins.", "numpy.", "numpy.typing.")
"""Where a name without its module is looked for."""

UNIMPORTED = {
    *("T", "Axes", "LineCollection", "Line2D", "PolyCollection", "Quiver", "TriMesh", "SuperLU", "TypeAliasForwardRef"),
    *("cp.Problem", "cp.Expression", "cp.Constraint"),
}
"""Type variables, and types that are imported for type checkers alone or by another name."""


def found(name: str) -> Any:
    """What a dotted name is; None where it names nothing."""
    parts = name.split(".")
    if not all(part.isidentifier() for part in parts):
        return None
    for k in range(len(parts), 0, -1):
        try:
            value: Any = importlib.import_module(".".join(parts[:k]))
        except ImportError:
            continue
        for part in parts[k:]:
            fields = getattr(value, "__dataclass_fields__", {})
            value = getattr(value, part, fields.get(part))
        return value
    return None


def resolve(app, env, node, contnode):
    """The link of a name described elsewhere, the name alone where it exists, else nothing: Sphinx warns."""
    if node.get("refdomain") != "py":
        return None
    # Of an annotation that Sphinx cut at a comma (``dict[str, X]``) the last name is what can be asked for.
    target = re.split(r"[\[\]~]", node["reftarget"])[-1]
    module, owner = node.get("py:module") or "", node.get("py:class") or ""
    if target in UNIMPORTED:
        return contnode
    domain = env.get_domain("py")
    inside = f"{module}.{owner}".strip(".")
    home = getattr(found(inside), "__module__", "") or ""
    for before in (*WITHIN, f"{module}.", f"{inside}.", f"{home}.", f"{home}.{owner}."):
        value = found(before + target)
        if value is None:
            continue
        home, own = getattr(value, "__module__", None), getattr(value, "__qualname__", None)
        for name in (f"{home}.{own}", f"bipot.{own}"):
            if home and own and name in domain.objects and found(name) is value:
                entry = domain.objects[name]
                return make_refnode(app.builder, node["refdoc"], entry.docname, entry.node_id, contnode, name)
        return contnode
    # An annotation of a function that a package shows as its own: the name is one of the module behind it.
    loaded = [module for name, module in sys.modules.items() if name.partition(".")[0] == "bipot"]
    return contnode if any(hasattr(module, target) for module in loaded) else None


def setup(app):
    """Called by Sphinx."""
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True}
