"""What imports what, read from the text of modules.

A room is a module or package directly below ``bipot``, or another package of the repository.
"""

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter


def modules(root):
    """Dotted name -> path of every module of the repository's packages below ``root``."""
    found = {}
    for path in sorted(root.glob("*/**/*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        if (root / parts[0] / "__init__.py").is_file():
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def imports(name, path):
    """Dotted names of what the module imports, anywhere in it: of modules or of names in them."""
    return tuple(_imports(name, path))


def _imports(name, path):
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for node in statements(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            yield from (f"{source}.{alias.name}" for alias in node.names)


def statements(within):
    """All statements within a node: expressions, which are most of what there is, have none."""
    for node in ast.iter_child_nodes(within):
        if not isinstance(node, ast.expr):
            yield node
            yield from statements(node)


def graph(root):
    """Module -> modules of the repository that it imports, each the longest one that is named."""
    known = modules(root)
    found = {}
    for name, path in known.items():
        named = [whole.split(".") for whole in imports(name, path)]
        places = [[".".join(parts[:k]) for k in range(len(parts), 0, -1)] for parts in named]
        found[name] = {next(place for place in ways if place in known) for ways in places if ways[-1] in known}
    return found


def room(module):
    """The part of a module's name that the tables know."""
    package, *below = module.split(".")
    return below[0] if package == "bipot" and below else package


def rooms(between):
    """Room -> other rooms that it imports."""
    found = {room(module): set() for module in between}
    for module, others in between.items():
        found[room(module)] |= {room(other) for other in others} - {room(module)}
    return found


def reached(start, links):
    """What ``start`` imports, directly or not."""
    found, ahead = set(), [start]
    while ahead:
        new = links[ahead.pop()] - found
        found |= new
        ahead += new
    return found


def climbing(links, layers):
    """Imports (room, other) from a higher layer."""
    floor = {name: k for k, names in enumerate(layers) for name in names}
    return sorted((own, other) for own, others in links.items() for other in others if floor[other] > floor[own])


def circle(links):
    """A circle of imports, empty where there is none."""
    try:
        TopologicalSorter(links).prepare()
    except CycleError as found:
        return found.args[1]
    return []
