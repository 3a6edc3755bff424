"""Changes of scenes and their effects by hand: as of_cpp.py has them."""

STATEMENT = "statement"

CHANGES = {
    "cpp/simulation/effects/gravity_compensation.cpp": [
        ("weights pull down", "(-b.mass) * g_", "b.mass * g_"),
        ("held bodies have the energy of pulled ones", "b.mass * dot(g_, at.pose[b.body].p + at.pose[b.body].R * b.point)", "S(0)"),
        ("shares follow the order of the bodies", "in_order(model, names)", 'bodies_named(model, names, "gravity_compensation")'),
    ],
    "cpp/simulation/effects/fluid_drag.cpp": [
        ("the fluid stands still", "transpose_times(at.pose[box.body].R, wind_)", "Vector3<S>::zero()"),
        ("a wind at rest is no force", "wind[0] == 0 && wind[1] == 0 && wind[2] == 0", "true"),
        ("forces of boxes at the bodies' origins", "cross(box.pose.p, force)", "Vector3<S>::zero()"),
        ("bodies with two boxes count twice", "std::find(d.poses.begin(), d.poses.end(), box.body) == d.poses.end()", "true"),
    ],
    "cpp/simulation/scene_equations.h": [
        ("works are seen by tolerances", "std::ldexp(1.0, 100)", "1.0"),
        ("states within steps are off the loops", "if (settles()) scene_.loops()->bring(q_.data(), v_.data());", ";", STATEMENT),
        ("what is taken onto the loops goes on as it was", "scene_.loops() && scene_.loops()->settles()", "scene_.loops() != nullptr"),
        ("prescribed coordinates drift", "set_prescribed(t, x.data(), x.data() + nq());", ";", STATEMENT),
        ("a step that ends at a knot sees what follows", "ends_ && !(t < to_)", "false"),
        ("a step that begins at a knot sees what was", "begins_ && !(t > from_)", "false"),
        (
            "a controller is not asked at the start",
            "if (stops()) scene_.effects().sample(t, first, x.data(), x.data() + nq(), x.data() + nq() + nv());",
            ";",
            STATEMENT,
        ),
    ],
    "cpp/simulation/scene_forces.cpp": [
        (
            "what comes from outside is not looked at",
            "refuse_unless_finite(effect);\n  for (int j : effect.declared.coordinates) tau_[j] += alone_tau_[j];",
            "for (int j : effect.declared.coordinates) tau_[j] += alone_tau_[j];",
            STATEMENT,
        ),
        ("wrenches do no work", "power += dot(alone_wrench_[k], at_.twist[k])", "power"),
        ("impulses fall on whole multiples", "look(e->declared.impulse_period, 0.5)", "look(e->declared.impulse_period, 0)"),
        ("samples fall a hair late", "(k + phase) * T - t < 1e-9 * T", "false"),
        ("wrenches pile up", "for (int k : wrenched_) wrench_[k] = Vector6<S>::zero();", ";", STATEMENT),
    ],
    "cpp/simulation/compiled_scene.cpp": [
        ("what prescribed motion needs counts other forces twice", "needed_[j] = vdot_[j] - needed_[j]", "needed_[j] = vdot_[j]"),
        ("rotors have no energy", "*kinetic += S(h.inertia) * moving[h.coordinate] * moving[h.coordinate] / S(2);", ";", STATEMENT),
        ("nothing resists an impulse", "terms.inertia[h.coordinate] += h.damping;", ";", STATEMENT),
        ("the work of an impulse is at the velocity before", "(v[j] + change_[j] / S(2))", "v[j]"),
        ("impulses move what is prescribed", "for (int j : prescribed_) work_[j] = S(0);", ";", STATEMENT),
        ("what holds against an impulse does no work", "gained[other->worker] += change_[j] * v[j];", ";", STATEMENT),
        ("at rest everything acts", "(!moving && e->declared.only_in_motion)", "false"),
        ("h² K is h K", "h * (S(term.damping) + h * S(term.stiffness))", "h * (S(term.damping) + S(term.stiffness))"),
        ("a second gravity is the first", "gravity_ = gravity_ + e->declared.gravity", "gravity_ = e->declared.gravity"),
    ],
    "cpp/simulation/effects/langevin.cpp": [
        ("noise is one number for all coordinates", "static_cast<std::uint64_t>(j)", "0"),
        ("noise has half its size", "sqrt(S(2) * S(of.kT) * brake_.back())", "sqrt(S(of.kT) * brake_.back())"),
    ],
    "cpp/simulation/effects/nose_hoover.cpp": [
        ("the second thermostat counts as the others", "(i == 1 ? n_ : S(1))", "S(1)"),
        ("prescribed coordinates are warmed", "if (!terms.is_prescribed(j)) coordinates_", "coordinates_"),
        (
            "the momenta are of the model's own rotors",
            "numbers_ = model_with_rotors<S>(of_.model, terms);",
            "numbers_ = model_with_rotors<S>(of_.model, {});",
        ),
    ],
    "cpp/simulation/effects/fixman.cpp": [
        ("the determinant is of the model's own rotors", "model_with_rotors<S>(of_.model, terms)", "model_with_rotors<S>(of_.model, {})"),
        ("the Fixman potential is twice itself", "half_(S(of.kT) / S(2))", "half_(S(of.kT))"),
    ],
    "cpp/simulation/scene.cpp": [
        ("a coordinate is prescribed twice", "if (on) refuse_conflicts(called, *effect);", ";", STATEMENT),
        ("what is off is in the way", "!other.on || other.name == name", "other.name == name"),
    ],
    "cpp/simulation/selection.cpp": [
        ("a coordinate counts twice", "if (!there[j]) there[j] = 1, found.push_back(j);", "found.push_back(j);", STATEMENT),
        ("a question mark is a letter", "if (pattern[at] == U'?') return ++at, true;", ";", STATEMENT),
        (
            "of a range its ends alone",
            "pattern[i] <= letter && letter <= pattern[i + 2]",
            "pattern[i] == letter || letter == pattern[i + 2]",
        ),
        ("letters that are not to be there may", "return found != none;", "return found;", STATEMENT),
    ],
    "cpp/simulation/function_of_time.cpp": [
        ("tables go on beyond their ends", "before || after ? S(0) : S(1)", "S(1)"),
        ("curvatures are half", "moving * S(2) * half", "moving * half"),
        ("nothing jumps at a knot", "std::abs(sides[1] - sides[0]) > 64 * epsilon<double>() * sizes", "false"),
    ],
    "cpp/simulation/effects/bushing.cpp": [
        ("a is pushed where b is", "moment + cross(x.apart, force)", "moment"),
        ("rotation vectors turn as angular velocities", "moment_along_rotation_vector(x.xi.angular, g.angular)", "g.angular"),
    ],
    "cpp/simulation/effects/drive_limits.h": [
        ("a speed limit brakes", "!(force * v > S(0))", "false"),
    ],
    "cpp/simulation/effects/limits.cpp": [
        ("a stop that is touched is smooth", 'if (d == S(0)) return Edge{"is just at its stop", s.v};', ";", STATEMENT),
        ("stops turn the other way", "*out++ = s.inward * at.v[s.v];", "*out++ = -s.inward * at.v[s.v];", STATEMENT),
        ("stops pull", "factor > S(0) ? factor : S(0)", "factor"),
        ("what a stop stores counts as work", "(pushed(at, s) - S(1))", "pushed(at, s)"),
    ],
    "cpp/simulation/effects/node_damper.cpp": [
        (
            "dampers work across, too",
            "(c_ * dot(along, b_.velocity(at) - a_.velocity(at))) * along",
            "c_ * (b_.velocity(at) - a_.velocity(at))",
        ),
    ],
    "cpp/simulation/effects/prescribed_motion.cpp": [
        ("the length of a quaternion counts", "k * vector_part(x, z) - (k * along) * omega", "k * vector_part(x, z)"),
        ("a position is in the body's axes", "cross(omega, u)", "S(0) * u"),
    ],
    "cpp/simulation/effects/gravity_gradient.cpp": [
        ("a gradient is a couple alone", "(S(1.5) * mu_ / (cube * length))", "S(0)"),
    ],
    "cpp/simulation/effects/motor.cpp": [
        ("a gear does not divide the speed", "n / S(of.numbers.no_load_speed[i])", "S(1) / S(of.numbers.no_load_speed[i])"),
        ("a rotor is felt without its gear", "n * n * numbers.rotor_inertia[i]", "numbers.rotor_inertia[i]"),
    ],
    "cpp/recursions/prescribed_hinges.h": [
        ("prescribed accelerations do not reach other bodies", "points.a[k] = points.a[k] + rates_[j] * rows_[j];", ";", STATEMENT),
        ("a rotor that is driven needs nothing", "whole_->rotor_inertia[j] * rates_[j]", "S(0)"),
    ],
    "cpp/dynamics/hybrid_dynamics.cpp": [
        ("what is all prescribed is solved for", "all_prescribed(model, terms) ? Given::accelerations : Given::both", "Given::both"),
    ],
    "cpp/kernels/prescribed_links.h": [
        ("a screw that is driven does not travel", "slide[Kind::row] = S(link.travel) * x;", ";", STATEMENT),
        ("a rotor that is driven by kernels needs nothing", "w.inverse = S(link.J) * x;", "w.inverse = S(0);", STATEMENT),
        (
            "a free body that is driven is in its own axes",
            "rotation.to_parent(m.sliding + Vector3<S>{given(3), given(4), given(5)})",
            "m.sliding + Vector3<S>{given(3), given(4), given(5)}",
        ),
        ("z⁺ forgets P a'", "P.n = P.n + P.A * m.turning, P.f = P.f + transpose_times(P.B, m.turning);", ";", STATEMENT),
    ],
    "cpp/simulation/scene_curvature.cpp": [
        ("what is prescribed feels forces that bend", "if (known_[j]) weights[size_t(m) * (N + own()) + j] = 0;", ";", STATEMENT),
        ("what is prescribed feels inertias that bend", "known_[j] ? 0.0 : mu[size_t(m) * rows + j]", "mu[size_t(m) * rows + j]"),
        ("gravity bends nothing", "&gravity_", "nullptr"),
        ("second differences are halved", "(h * h)", "(2 * h * h)"),
        ("what commutes is taken once in all", "b.first < a.first && a.first >= N", "b.first < a.first"),
    ],
    "cpp/simulation/scene_statics.h": [
        ("forces that cancel have no size", "size = std::max(size, std::abs(one[j]))", "size = std::max(size, 0.0)"),
    ],
    "cpp/simulation/scene_interbody_forces.h": [
        ("fields pull the other way", "applied.gravity + cast<S>(e->declared.gravity)", "applied.gravity - cast<S>(e->declared.gravity)"),
    ],
}
