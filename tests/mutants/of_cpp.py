"""Changes of C++ by hand: file -> (name, what stands there, what is put there), and STATEMENT where they are statements."""

STATEMENT = "statement"

CHANGES = {
    "cpp/numerics/pack.h": [
        (
            "a comparison of packs holds where any lane holds",
            "all &= f(a.v[i], b.v[i]);",
            "{ if (i == 0) all = false; all |= f(a.v[i], b.v[i]); }",
            STATEMENT,
        ),
    ],
    "cpp/algebra/language/source.cpp": [
        ("stale numbers of the present state", "c.parameters != version", "false"),
        ("stale numbers of a bound state", "entry->parameters != source->parameters()", "false"),
    ],
    "cpp/dynamics/workspace_pool.h": [
        ("stale workspaces of direct calls", "own->version != model.parameters()", "own->version == 0"),
    ],
    "cpp/model/multibody.cpp": [
        ("compiled models outlive a parameter", "kept->parameters == parameters_", "true"),
        ("a mass is no new version", "bodies_[k].inertia = inertia;\n  body_changed(k);", "bodies_[k].inertia = inertia;", STATEMENT),
        (
            "a placement is no new version",
            "bodies_[k].hinge.placement = checked;\n  body_changed(k);",
            "bodies_[k].hinge.placement = checked;",
            STATEMENT,
        ),
        (
            "a rotor inertia is no new version",
            "bodies_[k].hinge.rotor_inertia = std::move(checked);\n  body_changed(k);",
            "bodies_[k].hinge.rotor_inertia = std::move(checked);",
            STATEMENT,
        ),
        ("limits are not checked when set", "check_limits(body(k).hinge, lower, upper);", ";", STATEMENT),
    ],
    "cpp/model/multibody_state.cpp": [
        ("lengths of quaternions walk as a state is moved", "scale_quaternions<double>(*model, lengths.data(), out);", ";", STATEMENT),
        ("a state set on a part stays there", "if (part_) return set_in_whole(q, true);", ";", STATEMENT),
    ],
    "cpp/model/part.cpp": [
        ("gravity is no new version", "gravity_ = g;\n  ++parameters_;", "gravity_ = g;", STATEMENT),
        ("parts follow no gravity", "part.gravity_changed(g);", ";", STATEMENT),
        ("parts follow no edit of a body", "part.body_changed(own);", ";", STATEMENT),
        ("bodies need not hang together", "if (!missing.empty())", "if (false)"),
        ("a path leaves out the common ancestor", "if (a >= 0) found.push_back(a);", ";", STATEMENT),
        ("a part has the state that the whole had first", "whole_state_ == of_whole && whole_version_ == version", "whole_state_"),
        ("a moving base stays where a placement was", "whole_version_ == version", "true"),
    ],
    "cpp/recursions/mass_centre.h": [
        ("the centre of mass stands still in Ȧ", "cross(speed_of_all_ - travel, own.linear)", "cross(S(0) * speed_of_all_, own.linear)"),
        (
            "a displacement leaves the centre of mass where it is",
            "cross(column.linear, speed_of_all_)",
            "cross(S(0) * speed_of_all_, own.linear)",
        ),
        ("roots travel alike", "changed.angular = changed.angular + cross(own.linear, travel);", ";", STATEMENT),
    ],
    "cpp/algebra/engine/engine.cpp": [
        ("plans for J = 0 kept", "source.traits().hinge_diagonal != plan_->hinge_diagonal[c]", "false"),
        ("a plan is for J = 0 once and for all", "impl_->seen[c] == parameters", "impl_->seen[c] != ~std::uint64_t(0)"),
        ("only the first model of a plan is looked at", "source.check_current();", "if (c > 0) return true;", STATEMENT),
        ("packs name no shape", "if (!done.shaped) run.shape(taped.rows, taped.columns);", ";", STATEMENT),
        ("states after packs begin elsewhere", "from + i - static_cast<int>(left.size())", "from + i"),
    ],
    "cpp/algebra/engine/run.h": [
        (
            "blocks of a batch are those of its first state",
            "fresh |= w_.generations[c] != w_.values[c]->generation();",
            "fresh |= b == 0;",
            STATEMENT,
        ),
        ("a workspace keeps the number of its first state", "w_.state = b;", ";", STATEMENT),
        ("what is out of range is returned in double", "in_range_ &= all_finite(y, size);", ";", STATEMENT),
        ("what is out of range is returned in its place", "in_range_ &= all_finite(out_ + size_t(b) * size, size);", ";", STATEMENT),
        ("what is out of range is returned", "in_range_ &= std::isfinite(out_[at]);", ";", STATEMENT),
    ],
    "cpp/algebra/engine/packs.cpp": [
        ("programs outlive a parameter", "c.source->parameters()", "std::uint64_t(0)"),
        ("programs outlive the model's state", "c.binding ? nullptr : c.source->state()", "nullptr"),
        ("x of each state is that of the first", "inputs.batched ? size_t(plan.domain.dimension()) * inputs.columns : 0", "0"),
        ("velocities are those of the first state", "batch ? size_t(c.binding->nv) : 0", "0"),
        ("programs of all models are kept", "if (all_.size() == most_kept) all_.pop_back();", ";", STATEMENT),
    ],
    "cpp/lanes/replayed.cpp": [
        ("no state is left to itself", "if (!sound[b]) left.push_back(states.from + b);", ";", STATEMENT),
    ],
    "cpp/lanes/program.cpp": [
        ("places are given away before they are read", "last_[read] == k", "last_[read] <= k + 1"),
    ],
    "cpp/numerics/recorded.cpp": [
        ("comparisons leave no guard", "now().require(by(what, value, a, b).id, value);", ";", STATEMENT),
        ("what zero multiplies need not be finite", "tape_.finite.push_back(x.id);", ";", STATEMENT),
    ],
    "cpp/algebra/engine/plan_cache.cpp": [
        ("a plan in double serves in quad", "how.precision", "Precision::double_"),
        ("a plan for one state serves for a batch", "binding.batch >= 0", "true"),
        (
            "plans at states for J = 0 once and for all",
            "plan.contexts[c].source->traits().hinge_diagonal != plan.hinge_diagonal[c]",
            "false",
        ),
    ],
    "cpp/algebra/engine/in_place.h": [
        ("what an operator from outside writes to is read", "plan.input >= 0 && !plan.calls_outside()", "plan.input >= 0"),
    ],
    "cpp/kernels/mass_matrix_of_columns.h": [
        ("a body that branches counts twice", "if (!added) at = at + M * alpha[c];", "at = at + M * alpha[c];", STATEMENT),
        ("no rotors", "if (with_J) yc +=", "if (with_J && false) yc +=", STATEMENT),
    ],
    "cpp/algebra/trees/mixed_blocks.h": [
        ("an edge from a rigid body to a group is rigid", "is_structured_[k] && is_structured_[tree_.parent[k]]", "is_structured_[k]"),
        ("across kinds ψ is φ", "for (int i = 0; i < s * m; ++i) left[i] -= gained[i];", ";", STATEMENT),
        ("across kinds ψ* is φ*", "structured.hinge_transposed_add(k, along.data(), seen.data(), m);", ";", STATEMENT),
        ("mixed trees trust what rigid ones do", "found == Pivots::sound && tree_.dof[k] > 0 ? Pivots::doubtful : found", "found"),
        ("columns across kinds are not carried", "sum += dense.edge(k)[i * s + a] * u(a);", "sum += a == i ? u(a) : S(0);", STATEMENT),
        ("P⁺ across kinds is R", "carry(Carried::articulated, k)", "carry(Carried::composite, k)"),
    ],
    "cpp/algebra/trees/reordered_values.h": [
        ("coordinates stay in the order of groups", "std::is_sorted(place_.begin(), place_.end())", "true"),
    ],
    "cpp/algebra/trees/grouping.h": [
        (
            "an inner body is carried to its parent alone",
            "phi[size_t(i) * s + at + j] += phi[size_t(i) * s + grouping.row_of[p] + a] * E[size_t(a) * tree.size[k] + j];",
            "phi[size_t(i) * s + at + j] += i >= grouping.row_of[p] ? E[size_t(a) * tree.size[k] + j] : S(0);",
            STATEMENT,
        ),
    ],
    "cpp/operators/grouped_values.h": [
        (
            "a of a group is that of its bodies",
            "std::fill_n(to, s, S(0));\n        transposed_multiply_add(phi_[g].data(), stacked.data(), to, s, s, 1);",
            "std::copy(stacked.begin(), stacked.end(), to);",
            STATEMENT,
        ),
        (
            "Ḣ of a group is that of its bodies",
            "for (size_t i = 0; i < whole.size(); ++i) whole[i] -= H_[g][i];",
            "for (size_t i = 0; i < whole.size(); ++i) whole[i] = S(0);",
            STATEMENT,
        ),
    ],
    "cpp/algebra/language/properties.cpp": [
        ("blocks over two cuts add up to blocks", "cut_alike(e, c) ? triangles(c) : 0u", "triangles(c)"),
    ],
    "cpp/algebra/theorems/differentiate.cpp": [
        ("∂P without G ∂J G*", "times({o.G, run(o.J), o.G.T()})", "zero(o.M.domain(), o.M.codomain())"),
        ("∂ blockdiag(AXA*) as if X were symmetric", "times({bar, e, star(F)})", "star(times({F, e, star(bar)}))"),
    ],
    "cpp/operators/directions.cpp": [
        ("a coordinate moves its own twist", "own.slot < at.slot) terms", "own.slot <= at.slot) terms"),
    ],
    "cpp/operators/loop_values.h": [
        (
            "an end's row without its way to the other end",
            "S(-1) * force_to_parent(renormalised<S>(loop.loop->pair.end_a), force_to_parent(X, g))",
            "S(-1) * force_to_parent(renormalised<S>(loop.loop->pair.end_a), g)",
        ),
    ],
    "cpp/dynamics/rigid_dynamics.cpp": [
        ("minimum norm refined without the added inertia", "r[j] += inertia * x[j];", "(void)inertia;", STATEMENT),
        (
            "the wider residual rounded first",
            "wider_->residual(tau, wide_x_.data(), wide_r_.data());",
            "residual(tau, x, r); for (int i = 0; i < n; ++i) wide_r_[i] = Wider<S>(r[i]);",
            STATEMENT,
        ),
        (
            "the triangles of an inverse are left as they are",
            "out[size_t(i) * N + j] = out[size_t(j) * N + i] = S(0.5) * (out[size_t(i) * N + j] + out[size_t(j) * N + i]);",
            ";",
            STATEMENT,
        ),
        ("a mass is carried without its place", "moment + carried[k].mass * X.p;", "moment;"),
    ],
    "cpp/model/rotor_forces.h": [
        ("rotors push a hinge the other way", "out[j + c] = -force[c];", "out[j + c] = force[c];", STATEMENT),
        (
            "rotors on travels do not gyrate",
            "K[c] = c < 3 ? S(J[j + c] - J[j]) : J[j + c];",
            "K[c] = c < 3 ? S(J[j + c] - J[j]) : S(0);",
            STATEMENT,
        ),
        ("the rate of a rotor's force is of its momentum alone", "S(turned[c] + K[c] * bracket[c])", "turned[c]"),
        (
            "rotors have the bracket alone in Christoffel's matrix",
            "(J[j + a] * along[b][a] - along[a][b] * J[j + b] + turned[b]) / S(2)",
            "turned[b] / S(2)",
        ),
    ],
    "cpp/recursions/point_accelerations.h": [
        ("a hinge's own terms are never absorbed", "own == OwnTerms::absorbed && t[0] >= 0", "own != own && t[0] >= 0"),
    ],
    "cpp/algebra/trees/sweeps/singular_pivot.h": [
        ("pivot bound without its (j + 1)", "return S(j + 1) * sum;", "return sum;", STATEMENT),
    ],
    "cpp/numerics/refinement.h": [
        ("refinement refuses at 0.9", "S(0.3)", "S(0.9)"),
        ("refinement goes on while corrections shrink", "length < work.last[c] / S(2)", "length < work.last[c]"),
        ("what cancelled is not counted", "S(S(1e3) * epsilon<S>() * largest)", "S(0)"),
        ("corrections of rounding are applied", "length > work.rounding[c]", "true"),
        ("corrections of rounding are applied", "length > work.rounding[c]", "true"),
    ],
    "cpp/algebra/engine/elimination/elimination_solve.h": [
        ("elimination with one refinement", "step < std::max(asked, 4)", "step < 1"),
        ("a refinement of an elimination need only shrink", "correction < last / S(2)", "correction < last"),
    ],
    "cpp/numerics/small_lu.h": [
        ("rows are not exchanged", "Soft<S>(0.1) * largest", "Soft<S>(0) * largest"),
        ("no pivot of an elimination is noise", "Soft<S>(4 * n) * epsilon<Soft<S>>() * column_[k]", "Soft<S>(0)"),
        ("noise is judged by what is left", "sizes ? sizes[i] : Soft<S>(0)", "Soft<S>(0)"),
    ],
    "cpp/numerics/equilibration.cpp": [
        ("rows have no scale of their own", "row_[k] = -by_column_[f].exponent - column_[j];", "row_[k] = 0;", STATEMENT),
        ("a longer path leaves the scales as they are", "v_[j] -= base - distance_[j];", ";", STATEMENT),
    ],
    "cpp/numerics/gram_factors.h": [
        ("rows heaviest last", "return largest[a] > largest[b];", "return largest[a] < largest[b];", STATEMENT),
        ("a dependent column is taken", "norm > S(16 * rows) * epsilon<S>() * S(sqrt(S(whole + below)))", "norm > S(0)"),
        ("the factors' diagonal keeps its sign", "head < S(0) ? norm : S(-norm)", "norm"),
    ],
    "cpp/algebra/planning/plan_diagonals.cpp": [
        ("ln det of HφMφ*H* is that of D whatever J", "!model->source->traits().hinge_diagonal", "true"),
        (
            "ln det of a multiple of n dimensions as of one",
            "e.domain().dimension() * Coefficient::log_of_size(e.node().coefficient)",
            "Coefficient::log_of_size(e.node().coefficient)",
        ),
    ],
    "cpp/algebra/planning/recognise.cpp": [
        ("a multiple of J is J", "rotors.coefficient != product.coefficient", "false"),
    ],
    "cpp/algebra/planning/plan_vectors.cpp": [
        ("a solve that is refined is gathered by ψ", "h->binding && h->binding->arithmetic.refinement.steps != 0", "false"),
    ],
    "cpp/dynamics/methods.cpp": [
        ("conjugate gradients never refuse", "gradients_.residual < sqrt(epsilon<S>()) && gradients_.condition < widest", "true"),
    ],
    "cpp/kernels/forward_dynamics.h": [
        ("a rotor keeps all of its row", "S(J * w.inverse)", "S(1)"),
        (
            "a heavy rotor's rate is a difference",
            "(left - w.angular[K] * alpha[K]) * w.inverse",
            "(left + S(link.J) * alpha[K]) * w.inverse - alpha[K]",
        ),
        ("a faint pivot of one coordinate is sound", "greater(D, S(links.plain.faint) * most)", "S::all()"),
        ("branches are lost", "add(w.branch[link.parent], P);", ";", STATEMENT),
    ],
    "cpp/kernels/pivots.h": [
        ("what pivots outboard are unsure of is forgotten", "greater(D, S(4) * most * P.error)", "S::all()"),
    ],
    "cpp/kernels/factored_dynamics.h": [
        ("a rotor's link takes the whole force along", "S(tau - S(link.J) * rate)", "tau"),
        ("what columns accelerate by themselves counts twice", "innovation + L.products[n]", "innovation"),
        ("a factored root is sure of everything", "sure(P.error, P.growth, links.factored.growth)", "S::all()"),
    ],
    "cpp/kernels/factored_columns.h": [
        ("columns of turns forget what the hinge turns by", "L.lower[r][n] - m.turning[of.turn[p]]", "L.lower[r][n]"),
    ],
    "cpp/kernels/factored_pivots.h": [
        ("what a load turns by leaks into no plane", "leaking[link.parent] = S(1);", ";", STATEMENT),
        ("what leaks into a plane stops at the next pin", "greater(L.weight[1], least) & greater(L.weight[2], least)", "S::all()"),
    ],
    "cpp/kernels/reflected_rows.h": [
        (
            "a column that is through stays",
            "V::choose(gone, V(typename V::Scalar(0)), V(loaded<V>(x + row) - wide_f[s] * a))",
            "V(loaded<V>(x + row) - wide_f[s] * a)",
        ),
    ],
    "cpp/kernels/link_factors.cpp": [
        ("a rotor takes the place of a column", "full ? 12 : 5", "5"),
    ],
    "cpp/dynamics/batch_dynamics.cpp": [
        ("refinement of wide numbers starts from a double", "precision != Precision::single && precision != Precision::double_", "false"),
    ],
    "cpp/kernels/mass_matrix_of_links.h": [
        ("lengths along an axis are felt", "S(2) * (l[j] * g[j] + l[k] * g[k])", "S(2) * (dot(l, g) - l[i] * g[i])"),
        ("two pins branch between", "!parent.branches && pin(link)", "pin(link)"),
        ("of two pins the inner one has no rotor", "double(dot(g, n).v) + parent->J", "double(dot(g, n).v)"),
    ],
    "cpp/kernels/mirror.h": [
        ("what is no number is mirrored", "odd += a - a, odd += b - b, odd += c - c, odd += d - d;", ";", STATEMENT),
    ],
    "cpp/kernels/articulated_links.h": [
        ("what a subtree in another thread carries is lost", "P = w.branch[last];", "P = no_inertia<S>();", STATEMENT),
    ],
    "cpp/dynamics/subtrees.h": [
        ("subtrees in threads are sound", "all &= one != 0;", ";", STATEMENT),
        ("subtrees do not begin with zero branches", "before(apart_[i]), clear(apart_[i])", "before(apart_[i])"),
    ],
    "cpp/kernels/steps.h": [
        ("hinges against an axis turn with it", "S(link.sign) * of.sine", "of.sine"),
    ],
    "cpp/kernels/motions.h": [
        ("sliders feel no Coriolis acceleration", "S(2) * S(link.travel) * turn", "S(0)"),
    ],
    "cpp/lanes/sine_cosine.h": [
        ("angles beyond the reduction are reduced", "greater(magnitude(x), S(R::limit))", "greater(S(0), S(1))"),
    ],
    "cpp/kernels/link_model.cpp": [
        ("an axis a millionth off a coordinate axis is that", "E(8) * rounding", "E(1e-6)"),
        ("no state of a tree is too faint", "own.carried_mass = static_cast<double>(M.mass);", "own.carried_mass = 0;", STATEMENT),
    ],
    "cpp/dynamics/link_dynamics.h": [
        ("a last state in doubt is given", "if (doubted > 0) again(count - doubted, count);", ";", STATEMENT),
    ],
    "cpp/dynamics/packed_dynamics.cpp": [
        ("a batch returns its first state's rows", "from[b * stride + i]", "from[i]"),
    ],
    "cpp/model/checks.cpp": [
        ("a rotation of two digits is taken", "off <= given_digits", "off <= 1e-2"),
        ("a reflection is a rotation", "determinant(pose.R) < 0", "false"),
        ("a rotation of seven digits is left so", "off <= rounding", "off <= given_digits"),
        ("limits the wrong way round", "lower[i] > upper[i]", "false"),
        ("a negative rotor inertia", "!(j >= 0) || !std::isfinite(j)", "!std::isfinite(j)"),
        ("a triangle inequality of three digits", "violation <= 1e-9 * largest + printed", "violation <= 1e-3 * largest + printed"),
    ],
    "cpp/bindings/conversions.cpp": [
        ("an inertia of three digits' symmetry", "1e-9 * largest", "1e-3 * largest"),
        ("complex entries of lists lose their imaginary part", "if (PyComplex_Check(item.ptr())) return complex_numbers;", ";", STATEMENT),
        ("a masked entry is read", 'why = "has masked entries";\n    return Array();', ";", STATEMENT),
    ],
    "cpp/bindings/direct_calls.h": [
        ("only what begins where the result begins is copied", "from >= to + out.size() || to >= from + a.array.size()", "from != to"),
    ],
    "cpp/runtime/interrupt.cpp": [
        ("signals are looked at once a minute", "now - last < pause", "now - last < 1000 * pause"),
        ("of several errors the last one", "if (i < end) end = i, error", "end = std::min(end.load(), i), error"),
    ],
    "cpp/algebra/engine/refined_solves.h": [
        ("wider values of the state before", "if (now == followed_) return;", "if (!followed_.empty()) return;", STATEMENT),
    ],
    "cpp/algebra/engine/block_steps.h": [
        ("indefinite blocks have a root", "pivot < -bound", "false"),
    ],
    "cpp/dynamics/singular_hinges.h": [
        ("projected once", "pass < 2", "pass < 1"),
    ],
    "cpp/rigid/rigid_elimination.h": [
        ("pivot bound without its J", "dot(H[j], X_[k] * H[j]) + J[j]", "dot(H[j], X_[k] * H[j])"),
    ],
    "cpp/rigid/rigid_residuals.h": [
        ("rounding of a rotor's forces not counted", "u.force * J[j] * S(abs(x[at]))", "S(0)"),
    ],
    "cpp/algebra/engine/elimination/elimination_factor.h": [
        ("digits lost by the elimination ignored", "growth_ <= tolerated && solved", "true"),
        (
            "what the last state merged stays merged",
            "std::fill(merged_with_parent_.begin(), merged_with_parent_.end(), 0);",
            ";",
            STATEMENT,
        ),
    ],
    "cpp/algebra/engine/elimination/elimination_accuracy.h": [
        (
            "fronts are not brought to one scale",
            "shift_[part] = a != none && o != none ? (o - a) >> 1 : o != none ? o : a != none ? -a : 0;",
            "shift_[part] = 0;",
        ),
        ("units are not those of the solution", "unit_[i] += size;", ";", STATEMENT),
    ],
    "cpp/model/subhinge_kinds.h": [
        ("a move makes unit quaternions", "out[0] = to.w", "out[0] = to.w / sqrt(to.w * to.w + to.x * to.x + to.y * to.y + to.z * to.z)"),
        (
            "rows of a ball turn about its frame's origin",
            "out[j] = {e, cross(h.point, e)};",
            "out[j] = {e, Vector3<S>::zero()};",
            STATEMENT,
        ),
        (
            "the bracket of twists has no linear part",
            "for (int i = 0; i < 6; ++i) out[i] = w[i];",
            "for (int i = 0; i < 6; ++i) out[i] = i < 3 ? w[i] : S(0);",
            STATEMENT,
        ),
        (
            "what lies between two poses is seen from the base",
            "transpose_times(R, Vector3<S>{q[4] - p[4], q[5] - p[5], q[6] - p[6]})",
            "Vector3<S>{q[4] - p[4], q[5] - p[5], q[6] - p[6]}",
        ),
        ("a screw does not travel", "turned.p + (h.pitch * q[0]) * h.axis", "turned.p"),
    ],
    "cpp/model/hinge.cpp": [
        ("a pin keeps a pitch", "record_of(kind).pitch ? pitch : 0", "pitch"),
        (
            "a gimbal's axes are all its first",
            '{"gimbal", 3, {{pin, 0}, {pin, 1}, {pin, 2}}}',
            '{"gimbal", 3, {{pin, 0}, {pin, 0}, {pin, 0}}}',
        ),
    ],
    "cpp/model/compiled_model.cpp": [
        ("rows of inboard subhinges stay along axes", "last ? axis_along(r) : -1", "axis_along(r)"),
        ("two sliders move a body along any line", "found.size() != 3 || driven", "found.empty() || driven"),
    ],
    "cpp/dynamics/batches.h": [
        ("a batch has its first state's numbers", "batch < 0 ? 0 : size_t(b) * width", "0"),
    ],
    "cpp/dynamics/batches.cpp": [
        ("only the first state of a batch is checked", "g.batch < 0 ? 1 : g.batch", "1"),
    ],
    "cpp/dynamics/frame_cache.cpp": [
        ("an edited frame leaves what goes over it", "step.edited > pair.edits", "false"),
        ("a moved hinge leaves what goes over it", "s.changed[i] > pair.made", "false"),
    ],
    "cpp/recursions/frame_motions.h": [
        ("the frame that columns are seen in stands still", "- cross_motion(m.V, J)", "- cross_motion(m.V, Vector6<S>::zero())"),
    ],
    "cpp/operators/rigid_letters.h": [
        ("a selection is of the whole hinge", "s >= of.from && s < of.to", "s >= of.from"),
    ],
    "cpp/dynamics/interbody_forces.cpp": [
        ("a direction that depends on others counts", "length > dependent<S>()", "length > S(0)"),
    ],
}
