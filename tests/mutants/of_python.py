"""Changes of Python by hand: file -> (name, what stands there, what is put there)."""

CHANGES = {
    "pycraft/viewer/live_scene.py": [
        ("every piece begins at t = 0", "continued(self.acting, self.t, self.t + seconds", "continued(self.acting, 0.0, seconds"),
        ("effects' own states are not kept", "self._keep(run.states[-1])", "pass"),
        ("the ghost has all effects", " and called != off)", ")"),
        ("velocities are those of the bodies' origins", " + np.cross(V[:, :3], places)", ""),
    ],
    "pycraft/viewer/hands.py": [
        ("a push has no moment about the body's origin", "np.cross(arm, self.force)", "np.zeros(3)"),
        ("a push is not damped", " - self.damping * velocity", ""),
        ("a push is as stiff for light bodies", ", STIFFEST * mass / seconds**2)", ", np.inf)"),
        ("free hinges are led", 'if kind != "free"', ""),
    ],
    "pycraft/scenes/animated_bodies.py": [
        ("keys may lie on far sides of the sphere", "q[:-1]) < 0", "q[:-1]) < -2"),
        ("the film is as long as the run", "(times - times[0]) / faster", "times - times[0]"),
    ],
    "pycraft/viewer/server.py": [
        ("foreign origins are answered", "if known and not foreign and", "if known and"),
        ("foreign names of this machine are answered", "host.hostname in LOCAL if", "bool(host.hostname) if"),
    ],
    "pycraft/viewer/effect_fields.py": [("a refused parameter stays", "        setattr(changed, field, present)\n", "        pass\n")],
    "pycraft/scenes/run_page.py": [("the end of a run is no frame", "np.append(times, last) if", "times if")],
    "pycraft/view/web_page.py": [("names are markup", '.replace("<", "\\\\u003c")', "")],
    "pycraft/dynamics/second_order.py": [
        ("effects bend twice", "out[..., :n, :n] -= forces / 2", "out[..., :n, :n] -= forces"),
        ("stages are all at the step's beginning", "Stage(at, part * dt,", "Stage(at, 0 * dt,"),
        ("a step leaves prescribed coordinates", "at.placed(displaced(model, at.q, u), after, dt)", "displaced(model, at.q, u), after"),
        ("prescribed coordinates are displaced", "start[:, [j, n + j]] = 0.0", "pass"),
    ],
    "pycraft/scenes/scene_quadratic.py": [
        ("controllers are asked within a step", "*state, between))", "*state, False))"),
        ("pushes move what is prescribed", "given[known_coordinates(one)] = 0.0", "pass"),
    ],
    "pycraft/state.py": [("a run is at t = 0", 'getattr(q, "t", 0.0) if t is None', "0.0 if t is None")],
    "pycraft/kinematics/solution.py": [
        (
            "a batch is true",
            '        if self._batch:\n            raise _core.ModelError(f"a batch',
            '        if False:\n            raise _core.ModelError(f"a batch',
        )
    ],
    "pycraft/dynamics/loop_tangents.py": [
        ("linear models on loops without what bends their forces", "    sides[0][:nv] += bent @ X\n", ""),
        ("velocities on loops do not follow displacements", "(slip @ X)", "(0 * slip @ X)"),
        ("rows of loops have no derivative along velocities", "np.hstack([-(rows_v @ Z), own])", "np.hstack([0 * (rows_v @ Z), own])"),
        ("singular states have derivatives", "if asked > SMOOTH *", "if asked > 1e300 *"),
        ("displacements are those that velocities reach", "j = _first_of(i, N)", "j, P = _first_of(i, N), N"),
    ],
    "pycraft/dynamics/equilibrium_on_loops.py": [
        ("what loops bend is no stiffness", "given.along_q + bent", "given.along_q"),
        (
            "anything balances near singular states",
            "sizes = given._replace(size=size).sizes",
            "sizes = given._replace(size=1e12 + size).sizes",
        ),
        ("an unstable equilibrium on loops is stable", 'if not stable or made.stability != "unstable":', "if True:"),
    ],
    "pycraft/identities/report.py": [
        ("a report counts what fails as passed", 'PASSED = ("holds", ', 'PASSED = ("fails", "holds", '),
        ("a report is always true", "        return self.status == 0\n", "        return True\n"),
        ("undecided reports end with 0", "3 if self.undecided or self.undefined", "3 if self.undefined"),
        ("undefined reports are true", "self.undecided or self.undefined or not", "self.undecided or not"),
        ("reports that show nothing are true", " or self.undefined or not self._held else 0", " or self.undefined else 0"),
        ("what is wrong comes last", '(verdict not in OPEN, verdict == "waiting"', '(verdict in OPEN, verdict == "waiting"'),
    ],
    "pycraft/identities/judge.py": [
        ("three falls to zero hold", "max(wide.residual, SCATTER * wide.epsilon) <= decides", "wide.residual <= decides"),
        ("undecided at a bound of 1", "DECIDES = 1e-12", "DECIDES = 1.0"),
        ("the residual need not fall", " and falls[-1] and (", " and ("),
        ("any bound explains a residual", "explained = wide.residual <= wide.bound", "explained = True"),
        ("the fall of what holds is not its bound", "found.verdict == HOLDS and found.decisive.bound > decides", "False"),
        ("what stays need not stay", "STAYS = 0.5", "STAYS = 0.0"),
        ("two falls running decide", "RUNNING = 3", "RUNNING = 2"),
        ("norms of double are always trusted", 'return made.bound(relative, "double") <= ROUNDING_NORMS', "return True"),
        ("what has terms vanishes", "vanishing = made.terms == 0 and fall", "vanishing = fall"),
        ("sides always fall", "return after <= SCATTER * EPSILON[wide] / EPSILON[narrow] * before", "return True"),
        (
            "undecided beside failing is undecided",
            "FAILS if FAILS in found else HOLDS if found == {HOLDS} else UNDECIDED",
            "UNDECIDED if UNDECIDED in found else FAILS if FAILS in found else HOLDS",
        ),
        ("the narrowest scalar is shown", "(-j.decisive.epsilon, _order", "(j.decisive.epsilon, _order"),
        ("amplification is not counted", "max(SCATTER * seen, CONSTANT * amplified)", "SCATTER * seen"),
        ("a fall may scatter by 64000", "SCATTER = 64.0", "SCATTER = 64000.0"),
    ],
    "pycraft/cli/commands.py": [
        ("check --json without its seed", "states=states, seed=seed, precision=wide, progress", "states=states, precision=wide, progress"),
        ("bench exits with 0", "raise typer.Exit(1 if missed else 0)", "raise typer.Exit(0)"),
        ("--mimic ignored", "load(name, root=root, mimic=mimic)", 'load(name, root=root, mimic="lock")'),
        ("--root ignored", "load(name, root=root, mimic=mimic)", 'load(name, root="fixed", mimic=mimic)'),
        ("stability --no-peers ignored", "cases=chosen, peers=peers", "cases=chosen, peers=True"),
        ("stability --seeds ignored", "hard.run(seeds, steps", "hard.run(1, steps"),
        ("peers --seed ignored", "compare_all(states, seed,", "compare_all(states, 0,"),
        ("accuracy --seed ignored", "                    seed=seed,\n", "                    seed=0,\n"),
    ],
    "pycraft/cli/bench.py": [
        ("bench loses its bounds", "self.bound is None or self.value <= self.bound", "True"),
    ],
    "pycraft/identities/book.py": [
        ("a divisor as a factor", "value / divisor", "value * divisor"),
        ("a fraction read upside down", "return decimal(parts[0]) / decimal(parts[1])", "return decimal(parts[1]) / decimal(parts[0])"),
        ("a star that does not transpose", "return lambda x: x.T", "return lambda x: x"),
    ],
    "pycraft/models/loaders/urdf_loops.py": [
        ("loops placed without their turn", "rotation_from_rpy(*angles) if any(angles) else None", "None"),
    ],
    "pycraft/models/splines.py": [
        ("a spline that stops at its ends", "s, bend = s + slope * (q[0] - x), 0.0", "bend = 0.0"),
    ],
    "pycraft/models/mobility_along.py": [
        ("singular states at samples alone", "else motion.least(low, high)", "else float(i)"),
        ("the greatest distance is sought", "            if at_a < at_b:\n", "            if at_a > at_b:\n"),
    ],
    "pycraft/models/loaders/rotations.py": [
        ("a quaternion's rotation with a sign wrong", "[1 - 2 * (y * y + z * z)", "[1 + 2 * (y * y + z * z)"),
        ("an inertia turned the other way", "rotation @ inertia @ rotation.T", "rotation.T @ inertia @ rotation"),
        ("a sign of zero that is remembered", "_rotation_from_rpy(roll + 0.0, pitch + 0.0,", "_rotation_from_rpy(roll, pitch,"),
        ("roll without its yaw", "math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])", "math.atan2(R[2, 1], R[2, 2])"),
    ],
    "pycraft/identities/checker.py": [
        (
            "what is undefined is expected to fail",
            '"expected to fail" if unmet else UNDEFINED, str(error)',
            '"expected to fail", str(error)',
        ),
        ("double beside double", "if precision not in wide:", "if False:"),
        (
            "theorems are not checked at the present state",
            "[None] if model is None else [_present(model), *(",
            "[None] if model is None else [*(",
        ),
        ("the seed of random trees ignored", "seed=spec.seed + seed", "seed=spec.seed"),
    ],
    "pycraft/identities/residual_bounds.py": [
        (
            "factors of a product are not counted",
            "return len(children) * max(self._step(children, i) for i in range(len(children)))",
            "return max(self._step(children, i) for i in range(len(children)))",
        ),
        ("norms of other vectors", "if vectors != self._vectors:", "if False:"),
    ],
    "pycraft/identities/parse.py": [
        ("of two readings the first", "if len(found) == 2 and not (", "if False and not ("),
        (
            "readings differ by where a number stands",
            "return a == b or _unscaled(a) == _unscaled(b) and _core.equal_by_theorems(a, b)",
            "return a == b",
        ),
    ],
    "pycraft/identities/spelling.py": [
        ("an inverse transpose is an inverse", '" ^-1^* "', '" ^-1 "'),
        ("accents move the caret", "sum(not unicodedata.combining(c) for c in self.typed[begin:origin])", "origin - begin"),
        ("powers of ten upside down", 'r"\\1e\\2"', 'r"\\1e-\\2"'),
    ],
    "pycraft/identities/definitions.py": [
        ("definitions behind in the order of the text", "for d in reversed(made_behind)", "for d in made_behind"),
        ("spaces of LaTeX divide a text", 'if i and text[i - 1] == "\\\\" and c in ",;:{}":', "if False:"),
    ],
    "pycraft/identities/vocabulary.py": [
        ("letters of the book are made of the user's", "dict(definitions=among, own=self._of_the_book())", "{}"),
        ("a letter has its first meaning", "STANDARD[name].meanings[self._choice.get(name, 0)]", "STANDARD[name].meanings[0]"),
    ],
    "pycraft/proofs/lifting.py": [
        ("what leads to the parent and back is no diagonal", 'f"blockdiag({joined})" if up and at == k else joined', "joined"),
        ("rows are blocks", '(kind(name) == "blocks" or last and kind(name) == "vector")', "True"),
    ],
    "pycraft/identities/standard_letters.py": [
        ("forces without rotors", '"H f + J vdot + b_J"', '"H f + b_J"'),
        ("forces without what rotors gyrate", '"H f + J vdot + b_J"', '"H f + J vdot"'),
        ("a Coriolis matrix without its transposed half", "momentum_cross + V_bar M + M V_tilde", "momentum_cross"),
    ],
    "pycraft/identities/truth.py": [
        (
            "hypotheses do not imply each other",
            "any(smaller <= implied(chosen) for smaller in found)",
            "any(smaller <= chosen for smaller in found)",
        ),
        ("saved by what the model meets", "if chosen and not chosen <= met", "if chosen"),
        ("deep models of twelve bodies", "return min(max(12, deepest + 2), 40)", "return 12"),
        ("true where nothing was said", " and any(c.verdict == TRUE for c in self.cells)\n", "\n"),
        ("the counterexample need not meet the hypotheses", "max(false, key=", "min(false, key="),
        ("undecided cells are true", "UNDECIDED if UNDECIDED in self._found else TRUE", "TRUE"),
        ("a map that a budget ended is whole", "partial = True\n", "pass\n"),
    ],
    "pycraft/identities/family.py": [
        ("no welds in the family", 'kinds[-2] = "weld"', "pass"),
        ("no gravity in the family", "model.gravity = rng.uniform(1, 10, 3) * rng.choice([-1, 1], 3)", "pass"),
        ("nodes at the bodies' origins", "position=rng.uniform(-1, 1, 3)", "position=(0, 0, 0)"),
    ],
    "pycraft/identities/edits.py": [
        ("missing and too many exchanged", "star {'too many' if had else 'missing'}", "star {'missing' if had else 'too many'}"),
        ("numbers are not turned over", "product(Number(1 / factor.value), *rest)", "product(Number(factor.value), *rest)"),
        ("changes at several places come first", "cost=slip.cost + 0.25", "cost=slip.cost - 5"),
    ],
    "pycraft/identities/block_relations.py": [
        ("what is above includes itself", "return b[0] != b[1] and b[0] in", "return b[0] in"),
        ("any common ancestor is the closest", "if a in of_j), None) == b[0]", "if a in of_j), None) in ancestors(parents, b[0])"),
    ],
    "pycraft/identities/block_values.py": [
        ("a block's transpose is the block", "Block(x.array.T, _dual(x.domain)", "Block(x.array, _dual(x.domain)"),
        ("children are all bodies", "[k for k, p in enumerate(parents) if p == of]", "[*range(len(parents))]"),
        ("determinants without signs", "pivots.append(work[k, k] if row == k else -work[k, k])", "pivots.append(work[k, k])"),
    ],
    "pycraft/identities/extended_numbers.py": [
        ("extended numbers are doubles", "high.astype(np.longdouble) + low.astype(np.longdouble)", "high.astype(np.longdouble)"),
    ],
    "pycraft/identities/inequalities.py": [
        ("what is zero is positive", "return FAILS if strict else HOLDS", "return HOLDS"),
        (
            "the order of the sides does not matter",
            'if read.relation in (">", "≥") else (read.rhs, read.lhs)',
            "if read.relation else (read.rhs, read.lhs)",
        ),
        ("asymmetric differences are compared", "if _largest(matrix - matrix.T) > max(2 * bound, 1e-9 * scale):", "if False:"),
    ],
    "pycraft/identities/block_check.py": [
        (
            "one choice of bodies is enough",
            "    for state in states:\n        try:",
            "    chosen = chosen[:1]\n    for state in states:\n        try:",
        ),
        ("any relation saves", "if any(relation.holds(parents, bodies) for parents, found in on for bodies in found.bad):", "if False:"),
    ],
    "pycraft/proofs/repair.py": [
        ("close is a tenth", "_CLOSE = 1e-9", "_CLOSE = 1e-1"),
        ("one small model is enough", "all(residual(new, other) < _CLOSE for other in models[1:])", "True"),
        ("hypotheses are not ranked", "r.cost + 0.5 * len(r.where[0])", "r.cost"),
        ("more repairs than asked for", "    del result.found[most:]\n", ""),
        ("repairs in any order", "return sorted(near, key=lambda item: item[1].cost), tried, whole", "return near, tried, whole"),
        ("what is true is repaired", "if _is_close(formula, models) and (own", "if False and (own"),
    ],
    "pycraft/peers/compare.py": [
        ("gravity is not made the same", "        common.gravity = there\n", ""),
        ("rotor inertias are not made the same", "            common.hinges[name].rotor_inertia = theirs\n", ""),
        ("frames of bodies are physical", 'kind != "body frame"', "True"),
        ("bounds without the condition", '(condition if name == "forward dynamics" else 1)', "1"),
        ("geometry at one state", "np.abs(frames[-1] - offset).max()", "np.abs(frames[0] - offset).max()"),
        ("masses to two digits", "1e-9 * max(scale, 1e-300)", "1e-2 * max(scale, 1e-300)"),
        ("as they are is in common", "(model.forward_dynamics(q, v, u), T @", "(common.forward_dynamics(q, v, u), T @"),
        (
            "the last state's difference",
            "result.in_common[name] = max(result.in_common.get(name, 0.0), _relative(ours(), theirs))",
            "result.in_common[name] = _relative(ours(), theirs)",
        ),
    ],
    "pycraft/peers/twins.py": [
        (
            "armature in the other order",
            "self.armature[model.hinges[name].v_slice] = hinge.rotor_inertia",
            "self.armature[other.hinges[name].v_slice] = hinge.rotor_inertia",
        ),
        ("inertia seen from the other side", "R @ self.com + p, R @ self.inertia @ R.T", "R @ self.com + p, R.T @ self.inertia @ R"),
    ],
    "pycraft/proofs/worksheet.py": [
        ("worksheets ignore their seed", 'random.Random(f"{seed} {k}")', 'random.Random(f"{k}")'),
        ("lines in a row are left out", "abs(line - other) == 1", "False"),
        ("graded by the file's own questions", "        if sheet is None:\n", "        if True:\n"),
        ("lines that only name are asked for", "return fit or task.gaps()", "return task.gaps()"),
        ("the same for every student", 'random.Random(f"{seed} {k}")', 'random.Random(f"{seed}")'),
    ],
    "pycraft/identities/paper.py": [
        ("chains of equalities by their ends", "zip(sides, sides[1:], strict=False)", "[(sides[0], sides[-1])]"),
        ("comments are read", 're.sub(r"(?<!\\\\)%.*", "", source)', "source"),
        ("macros of macros are left", "range(1000)", "range(1)"),
        (
            "undecided beside failing",
            "3 if UNDECIDED in self.counts and FAILS not in self.counts else 1",
            "3 if UNDECIDED in self.counts else 1",
        ),
        ("a paper of nothing is true", "bool({HOLDS, TRUE_WHERE} & {*self.counts}) and not", "not"),
        ("lines of the display", 'start = line + body.count("\\n", 0, at + begins)', "start = line"),
        ("rows that begin with a minus stand alone", "[-+=·@]|", "[+=·@]|"),
    ],
    "pycraft/proofs/presuppositions.py": [
        ("semidefinite is definite", 'kind = "definite" if inverted(center[0]) else "semidefinite"', 'kind = "definite"'),
        ("a zero diagonal is regular", "return sum(c for word, c in p.items() if ways[word] <= {unit}) != 0", "return True"),
        ("inverses that exist nowhere", "if found and not any(found):", "if False:"),
        (
            "negative terms are definite",
            "if any(c <= 0 or not signs[word] for word, c in p.items()):",
            "if any(not signs[word] for word, c in p.items()):",
        ),
    ],
    "pycraft/proofs/relations.py": [
        ("compliance along the hinge whatever J", 'for mark in marks if "J = 0" in hypotheses else ():', "for mark in marks:"),
        ("every constant stands at the base", "    if not _is_zero(X, inner):\n        return\n", ""),
        ("nodes on several bodies as on one", " or len(e.letter.arguments) != 2", ""),
    ],
    "pycraft/identities/search.py": [
        ("one state a model", "STATES = 3", "STATES = 1"),
        (
            "children of a body left out",
            "parents=tuple(p - (p > k) for p in parents)",
            "parents=tuple(p - (p >= k and p > 0) for p in parents)",
        ),
    ],
    "pycraft/compiled/graph.py": [
        (
            "a difference the other way round is the same",
            'return self._node("subtract", a, b) if swapped is None else self._negate(swapped)',
            'return self._node("subtract", a, b) if swapped is None else swapped',
        ),
        (
            "a turn is one along any axis",
            "return sine is not None and b == self._multiply",
            "return sine is not None or b == self._multiply",
        ),
        (
            "the root of a product is a magnitude",
            'operation[0] == "multiply" and operation[1] == operation[2]',
            'operation[0] == "multiply"',
        ),
        ("products lose a sign", "return product if None not in negatives else self._negate(product)", "return product"),
        ("any factor is a power of two", " and math.log2(factor) == int(math.log2(factor)):", ":"),
    ],
    "pycraft/compiled/source.py": [
        ("one angle for all", "self.early.index(taken[0])", "0"),
        ("guards are not written", "return {' & '.join(guards) or 'S{} == S{}'};", "return S{{}} == S{{}};"),
        ("checks are not written", "        if not self.checked:\n", "        if True:\n"),
        (
            "a difference without brackets",
            'self._bracketed(second, strength - (name in ("add", "multiply")))',
            "self._bracketed(second, strength - 1)",
        ),
    ],
    "pycraft/compiled/expressions.py": [
        ("velocities are no argument", '*([("v", self.model.nv)] if "v" in read else [])', ""),
    ],
    "pycraft/compiled/tapes.py": [
        ("guards are not kept", "    for truth, holds in guards:\n", "    for truth, holds in []:\n"),
        ("dropped values are forgotten", "    for at in finite:\n", "    for at in []:\n"),
    ],
    "pycraft/compiled/compiled.py": [
        ("edits go unnoticed", "made.model is not None and _numbers_of(made.model) != numbers", "False"),
        ("later edits show", "held = copy.deepcopy(model)", "held = model"),
    ],
    "pycraft/compiled/build.py": [
        ("one library for all sources", "source.encode(), shlex", 'b"", shlex'),
    ],
    "pycraft/dynamics/threads.py": [
        ("parts of no whole packs", "_PACK = 16", "_PACK = 1"),
        ("parts read what others wrote", "if out is not None and any(np.shares_memory(out, a) for a in arrays.values()):", "if False:"),
        ("errors count states by parts", "        pool.shutdown(cancel_futures=True)\n        return whole()\n", "        raise\n"),
    ],
    "pycraft/models/writers/toml_writer.py": [
        ("paths of meshes are written as they came", "[os.path.abspath(os.fsdecode(place)) for", "[os.fsdecode(place) for"),
        ("strict models are saved as others", '        data["strict"] = True\n', "        pass\n"),
    ],
    "pycraft/models/writers/toml_text.py": [
        ("rows of a matrix on one line", "if of_parts and len(line) > _LINE else line", "if False else line"),
    ],
    "pycraft/models/writers/save.py": [
        ("what fails leaves its half", "for left in (beside, path) if new else (beside,):", "for left in ():"),
    ],
    "pycraft/models/writers/urdf_writer.py": [
        ("a root link is added at each round", 'in ("root", f"root of {name}")', 'in ("root",)'),
        ("a root link off the origin", '_is_origin(hinge["placement"])', "True"),
        ("bounds of joints without limits are dropped", 'or (kind == "continuous" and {', 'or (kind == "fixed" and {'),
    ],
    "pycraft/models/loaders/left_aside.py": [
        ("numbers of other coordinates are saved", "if len(values) != sizes.get(quantity, model.nv)]", "if False]"),
        ("where springs are slack goes by velocities", '"spring rest": model.nq', '"spring rest": model.nv'),
        ("actuators of coordinates that are gone are saved", 'if actuator["coordinate"] in names]', "if True]"),
    ],
    "pycraft/models/loaders/toml_reader.py": [
        (
            "quaternions of no length where none is given",
            'model.zero_q() if key == "q" else np.zeros(model.nv)',
            "np.zeros(model.nq if key == 'q' else model.nv)",
        ),
    ],
    "pycraft/models/loaders/toml_lines.py": [
        ("strings end at the first three quotes", '\\"{3,5}|', '\\"{3}|'),
    ],
    "pycraft/models/tree_diagram.py": [
        ("no lines beside branches", "(along if last is False else blank)", "blank"),
    ],
    "pycraft/view/skeleton.py": [
        ("what is beside a plane is in it", "if widths[n] <= _LEVEL * widths.max()", "if True"),
    ],
    "pycraft/view/stick_figure.py": [
        ("markers at other hinges", 'points["joint"][own]', 'points["joint"][: len(own)]'),
        ("a base under what flies", "if not len(ground) and self.skeleton.names:", "if False:"),
    ],
    "pycraft/dynamics/equilibrium.py": [
        ("flutter is stable", "or abs(np.imag(value)) > zero", ""),
        ("an unstable equilibrium is not left", "search.push(found.modes[0].shape)", "search.push(0 * found.modes[0].shape)"),
        ("grains balance under any force", "<= tolerance * now.sizes)", "<= tolerance)"),
        ("balls turn the other way", "-brackets(turning(self.model), whole), np.eye(n)", "brackets(turning(self.model), whole), np.eye(n)"),
    ],
    "pycraft/dynamics/interbody.py": [
        ("accelerations do not follow q", "f_q - by_tau @ T_q[..., None, :, :]", "f_q"),
        ("frames stand where they are now", "model.frame(frame).pose(q, t=t)", "model.frame(frame).pose(q)"),
    ],
    "pycraft/dynamics/hybrid.py": [
        ("prepared calls of an edited model stay slow", "self._ready = self._made()  # for the model as it is now", "pass"),
    ],
    "pycraft/models/structure.py": [
        ("a root moves away from what acts on it", "in scene._acting_on(set(range(free.start, free.stop)))", "in ()"),
    ],
    "pycraft/scenes/effects/meanings.py": [
        ("effects mean what there is", "if of is not effect or changes != effect._changes:", "if True:"),
        ("effects that were changed mean what they did", "or changes != effect._changes:", "or False:"),
        ("numbers by coordinate are of any", "if listed:", "if False:"),
        ("stops hold what has no limit", 'effect.kind() == "limits"', "False"),
    ],
    "pycraft/scenes/simulation.py": [
        ("a state is taken for one of other coordinates", "if were != are:", "if False:"),
    ],
    "pycraft/scenes/checkpoint.py": [
        ("a checkpoint knows of no bodies", "f\"{name} of {moved[name if name in moved else name[: name.rindex('[')]]}\"", "name"),
    ],
    "pycraft/models/multibody.py": [
        ("copies are at no moment", "if moment is not None:", "if False:"),
    ],
    "pycraft/dynamics/prepared.py": [
        ("form=None is a default", 'if name in ("form", "residual", "on_singular"):', 'if name in ("residual", "on_singular"):'),
    ],
}
