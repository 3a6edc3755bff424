"""The reference of all public names, with their types, generated from the package."""

import inspect
from types import ModuleType
from typing import Any

import pycraft as pc

from .groups import MULTIBODY, PYCRAFT, grouped


def public() -> dict[str, Any]:
    """Return the public objects of `import pycraft as pc` by name."""
    return {name: getattr(pc, name) for name in pc.__all__}


def first_sentence(thing: Any) -> str:
    """Return the first sentence of a docstring as a cell of a table; a leading signature is skipped."""
    lines = [line.strip() for line in (inspect.getdoc(thing) or "").splitlines() if line.strip()]
    lines = lines[1:] if lines and "->" in lines[0] and "(" in lines[0] else lines
    sentence = " ".join(lines).split(". ")[0].rstrip(".") if lines else ""
    return (sentence[:160] + " …" if len(sentence) > 160 else sentence).replace("|", r"\|").replace("``", "`").replace("*", r"\*")


def of_groups(name: str, kind: type, groups: dict[str, str]) -> dict[str, str]:
    """Return the page of a class with a table of its members by heading, and a page for each heading."""
    by_heading = grouped(groups, [member for member in dir(kind) if not member.startswith("_")])
    place = {heading: f"{name}_{heading.lower().replace(' ', '_')}" for heading in by_heading}
    rows, made = [], {}
    for heading, members in by_heading.items():
        links = ", ".join(f"{{py:obj}}`{member} <pycraft.{name}.{member}>`" for member in members)
        rows.append(f"| [{heading}]({place[heading]}.md) | {links} |")
        listed = "\n\n".join(f".. {directive(kind, member)}:: pycraft.{name}.{member}" for member in members)
        made[f"docs/api/{place[heading]}"] = f"# {name}: {heading.lower()}\n\n```{{eval-rst}}\n{listed}\n```\n"
    table = "\n".join(["| | |", "|---|---|", *rows])
    tree = "```{toctree}\n:hidden:\n\n" + "\n".join(place.values()) + "\n```"
    return {f"docs/api/{name}": f"# {name}\n\n```{{eval-rst}}\n.. autoclass:: pycraft.{name}\n```\n\n{table}\n\n{tree}\n", **made}


def directive(kind: type, member: str) -> str:
    found = inspect.getattr_static(kind, member)
    return "autoproperty" if isinstance(found, property) else "automethod" if callable(getattr(kind, member)) else "autoattribute"


def of_class(name: str, kind: type) -> str:
    page = f"# {name}\n\n```{{eval-rst}}\n.. autoclass:: pycraft.{name}\n   :members:\n"
    return page + ("   :inherited-members: pybind11_object, object, Exception, Warning, tuple, dict, str\n```\n")


def of_module(name: str, module: ModuleType) -> str:
    own = [n for n in vars(module) if not n.startswith("_") and getattr(vars(module)[n], "__module__", "").startswith(module.__name__)]
    made = getattr(module, "__all__", own)
    parts = [f"# {name}", first_sentence(module) + "."]
    for member in made:
        thing = getattr(module, member)
        if inspect.isclass(thing):
            parts += [f"```{{eval-rst}}\n.. autoclass:: {module.__name__}.{member}\n```"]
        elif inspect.isroutine(thing):
            parts += [f"```{{eval-rst}}\n.. autofunction:: {module.__name__}.{member}\n```"]
    return "\n\n".join(parts) + "\n"


def pages() -> dict[str, str]:
    """Return a page for every class and module, one for all functions and one for all errors; the index comes first."""
    names = public()
    errors = {n: t for n, t in names.items() if inspect.isclass(t) and issubclass(t, Exception)}
    classes = {n: t for n, t in names.items() if inspect.isclass(t) and n not in errors}
    modules = {n: t for n, t in names.items() if isinstance(t, ModuleType)}
    functions = {n: t for n, t in names.items() if n not in errors and n not in classes and n not in modules}
    made = {f"docs/api/{n}": of_class(n, t) for n, t in classes.items() if n != "Multibody"}
    made |= {f"docs/api/{n}_module": of_module(n, t) for n, t in modules.items()}
    listed = "\n\n".join(f"```{{eval-rst}}\n.. autofunction:: pycraft.{n}\n```" for n in functions)
    made["docs/api/functions"] = f"# Functions\n\nFunctions of `pycraft`.\n\n{listed}\n"
    listed = "\n\n".join(f"```{{eval-rst}}\n.. autoexception:: pycraft.{n}\n   :show-inheritance:\n```" for n in errors)
    made["docs/api/errors"] = f"# Errors and warnings\n\nErrors that `pycraft` raises, and its warnings.\n\n{listed}\n"
    place = (
        {n: n for n in classes} | {n: f"{n}_module" for n in modules} | {n: "functions" for n in functions} | {n: "errors" for n in errors}
    )
    tables = []
    for heading, group in grouped(PYCRAFT, list(names)).items():
        rows = [f"| [`{n}`]({place[n]}.md) | {first_sentence(names[n])} |" for n in group]
        tables.append("\n".join([f"## {heading}\n", "| name | description |", "|---|---|", *rows]))
    table = "\n\n".join(tables)
    tree = "```{toctree}\n:hidden:\n\nMultibody\n" + "\n".join(page.removeprefix("docs/api/") for page in made) + "\n```"
    made |= of_groups("Multibody", pc.Multibody, MULTIBODY)
    return {"docs/api/index": f"# Reference\n\nEvery public name of `import pycraft as pc`, with types.\n\n{table}\n\n{tree}\n", **made}
