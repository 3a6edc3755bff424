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
