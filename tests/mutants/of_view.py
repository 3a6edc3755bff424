"""Changes of the pages that teach, and of shapes, by hand: file -> (name, what stands there, what is put there)."""

CHANGES = {
    "pycraft/view/shares.py": [
        ("shares without the bodies' inertias", "(soa.Upsilon @ soa.M).at(q)", "(soa.Upsilon @ soa.M @ soa.M).at(q)"),
        ("rotors have no share", "if not model.has_rotor_inertia:", "if True:"),
    ],
    "pycraft/view/rerooting_page.py": [
        ("shares in the order of the tree", "share_values(model, q)[order]", "share_values(model, q)"),
        ("all of P is felt", "np.trace(np.linalg.inv(blocks[name, name])[3:, 3:])", "np.trace(inertias[name, name][3:, 3:])"),
    ],
    "pycraft/view/kalman_page.py": [
        ("time runs from the base", "self.track.steps - 1 - a.body", "a.body"),
        ("another recursion beside the filter's", "(H @ phi @ M @ phi.T @ H.T + J).inv()", "(H @ phi @ M @ phi.T @ H.T + J + J).inv()"),
        ("the deviation of the first measurement is that of all", "axis1=1, axis2=2))),", "axis1=1, axis2=2)[:, [0, 0]])),"),
    ],
    "pycraft/models/loaders/toml_shapes.py": [
        ("meshes are looked for from the working folder", "[table.file.path] if", '["model.toml"] if'),
        ("a reflection is a rotation", "or np.linalg.det(placement[:3, :3]) < 0", ""),
    ],
    "pycraft/identities/statement_text.py": [
        ("numbers near 1 are not told apart", "found = {Fraction(0), Fraction(1)}", "found = {Fraction(0)}"),
        ("a statement is its text alone", "telling(statement_text(read), *(", "telling(statement_text(read), *() and ("),
    ],
    "pycraft/view/hypothesis_page.py": [
        ("an inverse that is not there is a residual", '"breaks" if finding.states else "undefined"', '"breaks"'),
        ("branches are chains", "(-1, 0, *(max(0, k - 2) for k in range(2, count)))", "tuple(range(-1, count - 1))"),
    ],
    "pycraft/view/solids.py": [
        ("shapes of lumped bodies are at their carrier's origin", "X @ shape.placement", "shape.placement"),
        (
            "meshes have no scale",
            "return vertices * np.array(shape.size), faces\n\n\ndef _turned",
            "return vertices, faces\n\n\ndef _turned",
        ),
    ],
}
