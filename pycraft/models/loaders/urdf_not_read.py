"""Elements of a URDF file that change the motion in other programs, in words: Gazebo's tags, Drake's, controllers."""

from __future__ import annotations

from collections.abc import Iterable

from lxml import etree

from .xml_file import Element, XmlFile, abbreviated, label, local_name

_SILENT = {
    "material",
    "visual",
    "sensor",
    "provideFeedback",
    "disableFixedJointLumping",
    "preserveFixedJoint",
    "laserRetro",
    "laser_retro",
    "light",
}
"""Elements of <gazebo> that do not affect motion."""
_OFF = {"turnGravityOff": ("false", "0"), "gravity": ("true", "1"), "kinematic": ("false", "0"), "static": ("false", "0")}
"""Values with which elements of <gazebo> have no effect."""
_ROTOR = ("rotor_inertia", "motorInertia", "rotorInertia")


_ASIDE = etree.XPath("/*/*[not(local-name()='link' or local-name()='joint')]")
_WITHIN = etree.XPath(
    "/*/*[local-name()='link' or local-name()='joint']"
    "/*[local-name()='safety_controller' or local-name()='contact' or contains(name(), 'drake:') or contains(namespace-uri(), 'drake')]"
)


def not_read(file: XmlFile) -> list[str]:
    """Return the elements of the file that change the motion elsewhere and are not read, each in words."""
    found: list[str] = []
    for element in _ASIDE(file.root):  # by XPath: a large file has millions of links and joints
        name = _plain(element)
        if name == "gazebo":
            found += _of_gazebo(element)
        elif name == "transmission" and (rotors := [inner for inner in element.iter() if _plain(inner) in _ROTOR]):
            found.append(f"the rotor inertia of transmission {element.get('name', '')!r} (line {rotors[0].sourceline})")
        elif name == "loop_joint" or _is_drakes(element):
            found.append(f"<{_shown(element)}> (line {element.sourceline})")
        elif name == "mujoco":
            found.append(f"settings for MuJoCo (line {element.sourceline})")
    return found + [f"<{_shown(inner)}> of {label(inner.getparent())}" for inner in _WITHIN(file.root)]


def _of_gazebo(element: Element) -> Iterable[str]:
    moving = [
        inner for inner in element if _plain(inner) not in _SILENT and (inner.text or "").strip().lower() not in _OFF.get(_plain(inner), ())
    ]
    names = [
        f"plugin {inner.get('name') or inner.get('filename') or ''!r}" if _plain(inner) == "plugin" else _plain(inner) for inner in moving
    ]
    if names:
        of = f" of {element.get('reference')!r}" if element.get("reference") else ""
        yield f"Gazebo's {abbreviated(names, most=6)}{of} (line {element.sourceline})"


def _plain(element: Element) -> str:
    """Return the name without its prefix, which old files use undeclared."""
    return local_name(element).rpartition(":")[2]


def _is_drakes(element: Element) -> bool:
    return "drake" in (element.prefix or "") or local_name(element).startswith("drake:")


def _shown(element: Element) -> str:
    return f"{element.prefix}:{local_name(element)}" if element.prefix else local_name(element)
