"""Docstrings as the library writes them: prose with literals and roles, formulas indented, and nothing else.

What reStructuredText would take for markup in a formula (``|x|``, ``a * b``, ``G_``) is text, and an indented formula
keeps its lines.
"""

import re

from sphinx.ext.napoleon import Config, GoogleDocstring

KEPT = re.compile(r"``.+?``|:\w+(?::\w+)*:`[^`]+`|`[^`]+`_{0,2}")
"""Literals and roles."""

MARKUP = re.compile(r"(?<!\\)[|*]|(?<=\w)_(?!\w)")

ALIAS = re.compile(r"[\w.~]*TypeAliasForwardRef\('(\w+)'\)")


def escaped(line: str) -> str:
    r"""The line with every mark outside literals and roles as text.

    >>> escaped("|x| of ``|y|``")
    '\\|x\\| of ``|y|``'
    """
    parts, end = [], 0
    for kept in KEPT.finditer(line):
        parts += [MARKUP.sub(r"\\\g<0>", line[end : kept.start()]), kept.group()]
        end = kept.end()
    return "".join([*parts, MARKUP.sub(r"\\\g<0>", line[end:])])


def indented(line: str) -> bool:
    """Whether the line is deeper than prose."""
    return line.startswith("    ")


def plain(lines: list[str]) -> list[str]:
    """Docstring lines as reStructuredText of the same words: formulas and examples literally, the rest escaped."""
    out, block, example, before = [], False, False, ""
    for line in lines:
        if not line.strip():
            example = False
            out.append(line)
            continue
        if line.lstrip().startswith((">>>", "...")):
            example = True
        if indented(line) and not block and not example and out and not out[-1].strip() and not before.endswith("::"):
            out += ["::", ""]
            block = True
        block = block and indented(line)
        listed = re.match(r"\s*\* ", line)
        literal = block or example or (indented(line) and before.endswith("::"))
        if literal:
            out.append(line)
        elif listed:
            out.append(listed.group() + escaped(line[listed.end() :]))
        else:
            out.append(escaped(line))
        if not indented(line):
            before = line.rstrip()
    return out


def process(app, what, name, obj, options, lines):
    """Put the lines into place, their ``Raises:`` as a list of fields."""
    lines[:] = GoogleDocstring(plain(lines), Config(napoleon_use_rtype=False)).lines()


def parsable(app, what, name, obj, options, signature, returned):
    """A signature that Sphinx can read: what a dataclass makes anew for each object has no value to show."""
    return shown(signature), shown(returned)


def shown(words: str | None) -> str | None:
    """A part of a signature, names of array types (``autodoc_type_aliases``) as they are.

    >>> shown("(x: tuple[TypeAliasForwardRef('Floats')] = <factory>)")
    '(x: tuple[Floats] = ...)'
    """
    return words and ALIAS.sub(r"\g<1>", words.replace("<factory>", "..."))


def setup(app):
    """Called by Sphinx."""
    app.connect("autodoc-process-signature", parsable)
    app.connect("autodoc-process-docstring", process, priority=100)
    return {"parallel_read_safe": True}
