"""Changes by hand of what reads and writes files of models: as of_python.py has them."""

CHANGES = {
    "pycraft/models/loaders/urdf.py": [
        ("a heavy root link flies off another", "or self.links[self.root].mass or", "or"),
        ("a root with mass is silent", "if free or not (root.mass or np.any(root.inertia)):", "if True:"),
    ],
    "pycraft/models/loaders/xml_file.py": [
        ("undeclared entities are dropped", 'if "UNDECLARED_ENTITY" in entry.type_name:', "if False:"),
        ("entities are expanded", "resolve_entities=False", "resolve_entities=True"),
        ("lines after a removed head are others", 'after = b"\\n" * before.count(b"\\n") + after', "pass"),
        ("elements that differ count once", "if same_elements(first, child):", "if True:"),
    ],
    "pycraft/models/loaders/mjcf_effects.py": [
        ("gear is not squared", "gear**2 * own[a]", "gear * own[a]"),
        ("disabled dampers damp", 'none if disabled(m, "damper") else m.dof_damping', "m.dof_damping"),
        ("gravity that is disabled acts", 'np.zeros(3) if disabled(m, "gravity") else', ""),
        ("a negative share alone is held", "np.any(m.body_gravcomp > 0)) or", "np.any(m.body_gravcomp)) or"),
        ("boxes at the bodies' origins", ", m.body_ipos[k]\n        size", ", 0.0\n        size"),
        ("parents touch their children", "meet &= ~(related | related.T)", "pass"),
    ],
    "pycraft/models/loaders/mjcf_actuators.py": [
        ("control zero is not clamped", "not m.actuator_ctrllimited[first] or", "True or"),
        ("a joint's limit of force is ignored", "own = np.clip(own, *sorted(m.jnt_actfrcrange[joint] / gear))", "pass"),
        ("disabled groups act", "disabled_groups >> group & 1", "False"),
    ],
    "pycraft/models/loaders/mjcf_equalities.py": [
        ("disabled equalities are loops", "if off or not m.eq_active0[e]:", "if not m.eq_active0[e]:"),
    ],
    "pycraft/scenes/effects/from_model.py": [
        ("several weights on a body: the last counts", "mass = sum(part for part, _ in parts)", "mass = parts[-1][0]"),
    ],
    "pycraft/peers/effects_apart.py": [
        (
            "what is not read decides nothing",
            "Apart(\"not read\", f\"{text}{'; none acts at these states' if free else ''}\", not free)",
            'Apart("not read", text, False)',
        ),
        ("damping that differs decides nothing", "_named(ours, differs, own, other), True)", "_named(ours, differs, own, other), False)"),
    ],
    "pycraft/models/loaders/sdf_elements.py": [
        (
            "old axes are in the joint",
            'truth(file, axis, "use_parent_model_frame", version_of(file) < (1, 5))',
            'truth(file, axis, "use_parent_model_frame", False)',
        ),
        ("thread_pitch is right-handed", "else -1 / value", "else 1 / value"),
        ("placement_frame is ignored", "self.frames[own].pose = pose @ np.linalg.inv(inner)", "pass"),
        ("degrees are radians", "np.radians(values[3:]) if in_degrees else values[3:]", "values[3:]"),
    ],
    "pycraft/models/loaders/sdf.py": [
        (
            "the reference of a follower is ignored",
            'numbers["multiplier"] * numbers["reference"] - numbers["offset"]',
            '-numbers["offset"]',
        ),
        ("links without gravity fall", "if not link.has_gravity and", "if False and"),
        ("static models move", "if link in self.scope.static:", "if False:"),
    ],
    "pycraft/models/writers/shape_elements.py": [
        ("boxes of MuJoCo are whole", "[x / 2 for x in shape.size]", "[x for x in shape.size]"),
        ("collision shapes are seen", '"1" if seen else str(HIDDEN_GROUP)', '"1"'),
        (
            "meshes are referred to from the old folder",
            "PurePosixPath(*Path(os.path.relpath(found, folder)).parts).as_posix()",
            "shape.file",
        ),
    ],
    "pycraft/models/writers/mjcf_writer.py": [
        (
            "shapes of nodes are on their bodies",
            "made.add(shape, element, X @ shape.placement)",
            "made.add(shape, element, shape.placement)",
        ),
    ],
    "pycraft/models/loaders/named_robots.py": [
        ("a file's name is a robot's", "and not Path(path).exists()", ""),
    ],
    "pycraft/models/loaders/mjcf_missing.py": [
        ("a mesh that gives mass is left out", "needed.setdefault(name, body.name)", "pass"),
    ],
}
