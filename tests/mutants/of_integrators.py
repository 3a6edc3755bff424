"""Changes of integrators, of what is between their steps, of events and of works by hand: as of_cpp.py has them."""

STATEMENT = "statement"

CHANGES = {
    "cpp/simulation/integrators/integrate.cpp": [
        ("lengths of quaternions walk", "scale_quaternions<S>(equations_.model(), lengths_.data(), x.data());", ";", STATEMENT),
        ("a sample is taken a piece too late", "forwards_ ? std::min({stop, knot, target}) : target", "target"),
        ("a stepper keeps its slope over a sample", "stepper_.forget();\n    watch_.forget();", "watch_.forget();", STATEMENT),
        ("knots are stepped over", "forwards_ ? equations_.next_knot(to_double(t_)) : never", "never"),
        ("a run ends behind a jump", "if (knot < plan_.times.back()) jump();", "jump();", STATEMENT),
        ("what goes on does not begin with a jump", "if (plan_.resumed) jump();", ";", STATEMENT),
        ("a run goes on from where its last step was cut short", "whole_ || !stepper_.cut()", "true"),
        ("a run goes on behind its terminal event", "sample_to(c.t, x_);\n", "sample_to(t_, x_);\n", STATEMENT),
        ("an event knows no state of its own", "t_ = c.t, x_ = c.x;", "t_ = c.t;", STATEMENT),
    ],
    "cpp/simulation/integrators/stepper.h": [
        ("the step after a cut step is the cut one", "last && abs(tried) < abs(h) ? h : tried", "tried"),
        ("a longest step is none", "options_.longest > 0 && abs(h) > S(options_.longest)", "false"),
        ("a step counts from the run's start when it goes on", "if (resumed) pace_ = *resumed;", ";", STATEMENT),
        (
            "a state within a step is its end",
            "method_.do_step(equations_, out, from, t - from);",
            "method_.do_step(equations_, out, from, pace_.size);",
            STATEMENT,
        ),
    ],
    "cpp/simulation/integrators/steps_on_the_group.h": [
        ("stages are all at the step's beginning", "t + part[stage]", "t"),
    ],
    "cpp/simulation/integrators/runge_kutta_steps.cpp": [
        ("dense output begins at the step's end", "t_from_ = t, t_to_ = t + h;", "t_from_ = t + h, t_to_ = t + h;", STATEMENT),
        ("a first rate counts twice", "{1, r(1, 3)}, {2, r(1, 3)}", "{0, r(1, 3)}, {2, r(1, 3)}"),
    ],
    "cpp/simulation/integrators/dormand_prince_8.h": [
        ("an estimate of order 8 is blind", "return five > 0 ? five / std::hypot(1.0, 0.1 * three / five) : 0;", "return 0;", STATEMENT),
        ("dense output takes the stages of a step for its own", "stages_.up_to(judged + 4);", ";", STATEMENT),
        ("the rate at a step's end is forgotten", "if (ended_) stages_.k(0).swap(stages_.k(judged));", ";", STATEMENT),
    ],
    "cpp/simulation/integrators/switching_steps.cpp": [
        ("a stiff motion never ends", "if (calm >= looks) change(t, x, step);", ";", STATEMENT),
        ("every step at the bound is stiff", "holds(std::abs(step))", "holds(std::abs(step)) && false"),
        ("counts are lost in a checkpoint", "steps_[0]->resume_counts(counted_);", ";", STATEMENT),
    ],
    "cpp/simulation/decay.cpp": [
        ("what turns is not turned", "to_u[at + i] += turned[i] / 2;", ";", STATEMENT),
        ("forces do not follow displacements", "right_.noalias() = linear_.along_u * u;", "right_.setZero(z.size());", STATEMENT),
    ],
    "cpp/simulation/integrators/variational.h": [
        ("momenta are not carried along", "for (int i = 0; i < n_; ++i) r_[i] += half * part_[i];", ";", STATEMENT),
        ("forces act half", "part_[i] = P_[i] + h * F_[i]", "part_[i] = P_[i] + h / S(2) * F_[i]"),
        ("no iteration", "if (settled(off, before, size)) return;", "return;", STATEMENT),
        (
            "a composition of plain thirds",
            "parts_ = {part, part, S(1) - S(4) * part, part, part};",
            "parts_ = {S(0.2), S(0.2), S(0.2), S(0.2), S(0.2)};",
            STATEMENT,
        ),
    ],
    "cpp/simulation/scene_linearized.cpp": [
        ("rotors are in no derivative", "out.mass(j, j) += J_[j];", ";", STATEMENT),
        ("time stands still in derivatives", "in_time_ || !scene().prescribed().empty()", "false"),
        ("gravity is in no derivative", "gravity_ = gravity_ + d.gravity;", ";", STATEMENT),
    ],
    "cpp/simulation/scene_steps.h": [
        ("implicit steps are explicit", "this->scene().set_step(h);", ";", STATEMENT),
        ("implicit terms outlive their step", "scene.set_step(S(0));", ";", STATEMENT),
        ("damping of a step does its work at the old velocity", "off += S(term.damping)", "off += S(0)"),
    ],
    "cpp/simulation/dense_output.h": [
        ("velocities between steps are rates of u", "term[i] = -next[i] / S(k + 1), v[at + i] += term[i];", "term[i] = S(0);", STATEMENT),
        ("the second slope is not that of the group", "rate[i] = v[i] + half * uv[i] + twelfth * uuv[i];", "rate[i] = v[i];", STATEMENT),
        ("accelerations at the end do not count", "S(10) * D - S(4) * V + A / S(2)", "S(10) * D - S(4) * V"),
        ("works go straight", "h_ * rest0_[i - nq_ - nv_]", "by"),
    ],
    "cpp/simulation/events.h": [
        ("directions do not matter", "direction == 0 || direction == -signs_[i]", "true"),
        ("events of a step come in the order of their functions", "return a.t < b.t;", "return false;", STATEMENT),
        (
            "a zero at the start is an event",
            "if (signs_[i] == 0) signs_[i] = sign(g1);",
            "if (signs_[i] == 0) signs_[i] = -sign(g1);",
            STATEMENT,
        ),
        ("a zero is found by halving once", "i < 300", "i < 1"),
        ("what turned within a step has not been beyond", "if (!(gc > S(0))) return true;", "if (!(gc > S(0))) return false;", STATEMENT),
        ("tangents keep away from zero at once", "std::min(ga, gb) / S(2)", "S(-1e300)"),
        ("what is due at the end of a run is not found", "-last * due", "S(0)"),
    ],
}
