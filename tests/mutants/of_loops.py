"""Changes by hand of loops, as of_cpp.py has them."""

from .of_cpp import STATEMENT

CHANGES = {
    "cpp/dynamics/constrained_dynamics.cpp": [
        (
            "rows of loops without what velocities ask",
            "loop_bias(*model_, *loops_, asked.q, asked.v, buffers_, c_.data());",
            ";",
            STATEMENT,
        ),
        (
            "rows of loops that conflict are averaged",
            "if (off_[row] <= certified() * size) off_[row] = S(0);",
            "off_[row] = S(0);",
            STATEMENT,
        ),
        (
            "residuals of loops are measured by what is left",
            "  size = maximum(size, S(sizes_[row] / unit(row)));",
            ";",
            STATEMENT,
        ),
        (
            "squares of recorded motion that are no numbers are trusted",
            "energy_of_hinges(load_.data()) <= bound * size && size <= most",
            "energy_of_hinges(load_.data()) <= bound * size",
        ),
        ("what implicit steps add is not in the residual", "generalized_[j] += added_[j] * x[j];", "static_cast<void>(x);", STATEMENT),
    ],
    "cpp/dynamics/constrained_dynamics.h": [
        ("in quad the rounding of states is a direction", "S(64 * epsilon<double>())", "S(0)"),
        ("velocities that stopped break rows", "double stopped = 1e-13;", "double stopped = 1e-300;"),
    ],
    "cpp/dynamics/loop_calls.cpp": [
        ("Q̇v of functions does not change with q", "S(third[(i * n + j) * n + k])", "S(0)"),
        ("Q̇v of functions does not change with v", "S(2) * S(second[i * n + j])", "S(0)"),
        ("Q̇v is the same beside a state", "along_q[row * nv + j] += bias[row].d[0];", ";", STATEMENT),
    ],
    "cpp/simulation/scene_interbody_forces.h": [
        ("the base of a loop is a body", "loop.is_coupling() || node.body < 0", "loop.is_coupling() || node.body < 1"),
        ("what effects push with is forgotten on loops", "applied.wrenches ? applied.wrenches[k] + pushed[k] : pushed[k]", "pushed[k]"),
    ],
    "cpp/dynamics/states_on_loops.cpp": [
        ("positions are left where steps have brought them", "std::copy_n(moved_.data(), model_->nq, q);", ";", STATEMENT),
        ("velocities are left where steps have brought them", "std::copy_n(x_.data(), nv, v);", ";", STATEMENT),
        ("prescribed velocities are brought to rest", "target_[r] = -rates[r];", ";", STATEMENT),
        ("a state that is far off is on its loops", "!(off <= S(reach_of_steps))", "!(off <= S(1e300))"),
        (
            "rows that no coordinate moves are closed",
            "abs(positions[r]) / (size > S(0) ? size : S(1))",
            "(size > S(0) ? abs(positions[r]) / size : S(0))",
        ),
    ],
    "cpp/simulation/scene_loops.h": [
        (
            "Baumgarte's gains of one effect are all effects'",
            "gains_.resize(to.rows, {kept.alpha, kept.beta});",
            "gains_.assign(to.rows, {kept.alpha, kept.beta});",
            STATEMENT,
        ),
        (
            "loops are not asked for what prescribed motion says",
            "driven_[first_.back() + i] = motion[held_[i]];",
            "driven_[first_.back() + i] = S(0);",
        ),
        ("what differences leave of rest is a motion", "held_.empty() ? S(stopped / far) : S(slow)", "S(stopped / far)"),
        ("a start off the loops is taken", "to_double(off[r]) <= far", "to_double(off[r]) <= 1e300"),
    ],
    "cpp/recursions/curve_rows.cpp": [
        ("a place on a curve is that of doubles", "at = at - dot(p - c[0], c[1]) / slope;", ";", STATEMENT),
        ("normals of a curve do not turn", "along(u, n[0], n[1], n[2])", "along(MotionFunction<S>(at), n[0], n[1], n[2])"),
        ("points do not bend along a curve", "second[i] * u.dot * u.dot", "S(0)"),
        ("curves have no centres of curvature", "dot(p - c[0], c[2]) - square", "-square"),
    ],
    "cpp/model/curve.cpp": [
        ("pieces of a curve are passed over that are near", "norm(p - piece.centre) - piece.radius", "norm(p - piece.centre)"),
        ("an open curve ends", "if (closed) return;", "return;", STATEMENT),
        ("the nearest place is between two samples", "u - slope / bend", "u - 0 * slope / bend"),
    ],
    "cpp/recursions/custom_rows.cpp": [
        ("a custom hinge permits nothing", "g = g - (basis[b][i] * basis[b][k]) * off.G[k];", ";", STATEMENT),
        ("a custom hinge's place is that of doubles", "s = moved(hinge, s, times(slope, off.slopes()));", ";", STATEMENT),
    ],
    "cpp/dynamics/embedded_choice.cpp": [
        ("given independent coordinates are eliminated", "!given || !wanted_[at.coordinates[j]]", "true"),
        ("rows that hold what is given as independent pass", "given && i < m", "false"),
        ("embedded coordinates are chosen by their units", "e.value / weights_[e.coordinate]", "e.value"),
        (
            "rows that are rounding are directions of embedded loops",
            "S(e.size / weights_[e.coordinate])",
            "S(abs(e.value) / weights_[e.coordinate])",
        ),
    ],
    "cpp/dynamics/embedded_dynamics.cpp": [
        (
            "embedded rows without what velocities ask",
            "loop_bias(*model_, *loops, asked.q, asked.v, buffers_, c_.data());",
            ";",
            STATEMENT,
        ),
        (
            "embedded rows are not told what drives them",
            "c_[r] -= asked.driven[r], bias_[r] += abs(asked.driven[r]);",
            "bias_[r] += abs(asked.driven[r]);",
            STATEMENT,
        ),
        (
            "what implicit steps add is not felt by embedded loops",
            "generalized_[j] += added_[j] * x[j];",
            "static_cast<void>(x);",
            STATEMENT,
        ),
        ("what implicit steps add is not in J of embedded loops", "blocks_.J[j] += added_[j];", ";", STATEMENT),
        ("rows that embedding leaves out may conflict", "if (left <= certified() * most) continue;", "continue;", STATEMENT),
        ("dependent velocities forget what drives them", "(rates ? rates[row] : S(0))", "S(0)"),
        ("dependent positions stay where they are", "if (!(S(2) * now < left)) break;", "break;", STATEMENT),
        ("a state that is far off embedded loops is on them", "!(left <= S(reach_of_steps))", "!(left <= S(1e300))"),
        (
            "multipliers of embedding have the wrong sign",
            "= generalized_[nodes_[n].coordinates[place]] - asked.tau",
            "= -generalized_[nodes_[n].coordinates[place]] + asked.tau",
        ),
    ],
    "cpp/operators/independent_direction.cpp": [
        (
            "velocities of the tree stay along independent coordinates",
            "return times({map_tangent(embedded_, l), l.bound(make_symbol(definition_of(theta_dot), embedded_))});",
            "return zero(Space::euclidean(1), embedded_->grouped()->theta());",
            STATEMENT,
        ),
    ],
    "cpp/recursions/loop_pairs.cpp": [
        ("rows of H inboard of a twist stay", "hinge.rows[j] = hinge.rows[j] - cross_motion(xi, hinge.rows[j]);", ";", STATEMENT),
    ],
    "cpp/recursions/loop_tangents.h": [
        ("∂Q of functions without their second derivatives", "of_function(loop, put);", ";", STATEMENT),
        ("∂∂Q of functions without their third derivatives", "third[(i * n + j) * n + k] * rates[k]", "0.0"),
    ],
    "cpp/numerics/weighted_gram_schmidt.h": [
        ("columns made orthogonal stay as they are", "at(k, j) -= u * at(k, i);", ";", STATEMENT),
    ],
    "cpp/numerics/rank_factors.h": [
        ("multipliers are the least in units of rounding", "unit_[V_.order[i]] * V_.upper(j, i)", "V_.upper(j, i)"),
    ],
    "cpp/operators/embedded_values.h": [
        ("∂₂∂₁X without what moves X beside ∂₁Q", "add_product(g, row, i, entry.x, of_second, moved);", ";", STATEMENT),
        ("the sign of dependent velocities", "map[place * r + j] = -sum;", "map[place * r + j] = sum;"),
        ("states off the loops have numbers", "std::max(off_the_loops, 64 * to_double(epsilon<S>()))", "1e300"),
        (
            "rotors around a loop are not felt",
            "transposed_multiply_add(maps_[g].data(), JX.data(), to.hinge_diagonal(g), r, n, r);",
            "static_cast<void>(JX);",
            STATEMENT,
        ),
    ],
    "cpp/simulation/effects/loop_penalty.cpp": [
        ("springs of loops push one body alone", "push(of_.a[l].body, a_[l], S(-1) * force_to_parent(motion_.X, F), out);", ";", STATEMENT),
        (
            "prescribed coordinates give way to springs",
            "std::abs(e.value) > asks_nothing * e.size && !terms.is_prescribed(e.coordinate)",
            "std::abs(e.value) > asks_nothing * e.size",
        ),
        ("springs in radians are those in metres", "(turns ? 1 : 0)", "0"),
        ("a loop's last row has its spring", "most = std::max(most, C);", "most = C;", STATEMENT),
        ("rows that ask nothing at a state have no spring", "here[at] > 0 ? here[at] : beside[at]", "here[at]"),
        (
            "rows of velocities have springs",
            "if (loops.of_positions[row]) found.stiffness[row] = frequency_ * frequency_ / C;",
            "found.stiffness[row] = frequency_ * frequency_ / C;",
            STATEMENT,
        ),
        ("springs of loops hold no energy", "return k_[row] * r * r / S(2);", "return S(0);", STATEMENT),
        ("dampers of loops take no work", "return -(c_[row] * rate * rate);", "return S(0);", STATEMENT),
    ],
}
