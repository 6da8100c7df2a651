"""The pages of the API reference: a page a subject of the public names, and a page a group of modules behind them."""

import importlib
import inspect
import re
from pathlib import Path

import bipot

SUBJECT = re.compile(r"^\* ([^:]+): (.*)$", re.MULTILINE)

BEHIND = {
    "laws": (
        "Laws of contact and material",
        "bipot.laws",
        "coulomb projections penalised von_mises material flow hardening",
    ),
    "increments": (
        "Increments and their certificate",
        "bipot",
        "increment iterate response certificate energy checks.determinacy "
        "control.carrying control.pacing control.estimate control.landing",
    ),
    "programs": (
        "Programs of an increment",
        "bipot.programs",
        "conic dissipation penalty newton fixed_point limit condensation",
    ),
    "elements": (
        "Kinematics and elements",
        "bipot.fem",
        "kinematics strain reduction projection elements orientation assembly",
    ),
    "conic": (
        "Conic programs and solvers",
        "bipot.conic",
        "problem solver clarabel qoco through_cvxpy stored",
    ),
    "tools": (
        "Surfaces and motions of tools",
        "bipot",
        "tools.tool tools.surfaces tools.profiles tools.poses tools.meeting paths "
        "tools.deformable tools.facing tools.pieces tools.polygons tools.flats tools.seeming control.facing",
    ),
    "scene": (
        "Scenes and contact",
        "bipot",
        "scene.supports scene.holding scene.loads scene.between "
        "contact.sampling contact.candidates contact.shear traction",
    ),
    "results": (
        "Results, columns and plots",
        "bipot",
        "results results.history results.recorder results.columns plot",
    ),
}
"""Of a page: its title, the package, its modules."""

INTRODUCTION = """Public names by subject, as ``bipot`` gives them, and the modules behind them, where
formulas and shapes are. Tables that answer "which": :doc:`forms, elements and solvers </howto/choosing>`,
:doc:`elements against closed answers </elements>`, :doc:`solvers on the same programs </comparison>`,
:doc:`columns and fields </glossary>`.
"""


def title(words: str, mark: str = "=") -> str:
    """A heading."""
    return f"{words}\n{mark * len(words)}\n"


def entry(name: str, value: object) -> str:
    """What describes a public name."""
    kind = "class" if inspect.isclass(value) else "function" if inspect.isroutine(value) else "data"
    kind = "exception" if inspect.isclass(value) and issubclass(value, BaseException) else kind
    return f".. auto{kind}:: {name}\n"


def subjects() -> dict[str, list[str]]:
    """The public names by subject, as the package's own docstring has them."""
    return {found[1]: found[2].split(", ") for found in SUBJECT.finditer(inspect.getdoc(bipot) or "")}


def public() -> dict[str, str]:
    """The pages of the public names, by their own names."""
    made = {}
    for subject, names in subjects().items():
        text = [title(subject.capitalize()), ".. currentmodule:: bipot\n"]
        made[subject.replace(" ", "_")] = "\n".join([*text, *(entry(n, getattr(bipot, n)) for n in names)])
    made["coulomb"] = coulomb()
    return made


def modules() -> dict[str, str]:
    """The pages of the modules behind them."""
    made = {}
    for name, (words, package, names) in BEHIND.items():
        text = [title(words)]
        for module in names.split():
            full = f"{package}.{module}"
            text += [title(full, "-"), *behind(full)]
        made[f"behind_{name}"] = "\n".join(text)
    return made


def index(groups: dict[str, dict[str, str]]) -> str:
    """The first page: the others by group."""
    parts = [title("Reference"), INTRODUCTION]
    for words, made in groups.items():
        listed = "".join(f"   api/{name}\n" for name in made)
        parts.append(f".. toctree::\n   :maxdepth: 1\n   :caption: {words}\n\n{listed}")
    return "\n".join(parts)


def coulomb() -> str:
    """The page of the discrete problem."""
    package = importlib.import_module("bipot.coulomb")
    names = [name for name in package.__all__ if not inspect.ismodule(getattr(package, name))]
    text = [title("The discrete Coulomb problem"), ".. automodule:: bipot.coulomb\n   :no-members:\n"]
    return "\n".join([*text, *(entry(f"bipot.coulomb.{n}", getattr(package, n)) for n in names)])


def behind(name: str) -> list[str]:
    """A module with what is its own and no public name of the package."""
    module = importlib.import_module(name)
    public = {id(getattr(bipot, n)) for n in bipot.__all__}
    own = [
        n
        for n, value in vars(module).items()
        if not n.startswith("_")
        and (inspect.isclass(value) or inspect.isfunction(value))
        and value.__module__.startswith(name)
        and id(value) not in public
    ]
    return [f".. automodule:: {name}\n   :no-members:\n", *(entry(f"{name}.{n}", getattr(module, n)) for n in own)]


def write(app) -> None:
    """Write the pages that changed, those that are asked for."""
    folder = Path(app.srcdir) / "reference"
    groups = {"Public names": public(), "Modules behind them": modules()}
    kept = dict(list(groups.items())[: app.config.reference_groups])
    made = {f"api/{name}": text for group in kept.values() for name, text in group.items()} | {"index": index(kept)}
    (folder / "api").mkdir(parents=True, exist_ok=True)
    for old in folder.rglob("*.rst"):
        if str(old.relative_to(folder).with_suffix("")) not in made:
            old.unlink()
    for name, text in made.items():
        path = folder / f"{name}.rst"
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def setup(app):
    """Called by Sphinx; of ``reference_groups`` 2 is all, 1 the public names, 0 nothing."""
    app.add_config_value("reference_groups", default=2, rebuild="env", types=[int])
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True}
