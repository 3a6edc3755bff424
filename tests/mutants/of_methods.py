"""Changes by hand of divide and conquer and of what stands over edits of the structure, as of_cpp.py has them."""

from .of_cpp import STATEMENT

CHANGES = {
    "cpp/dynamics/divided_dynamics.cpp": [
        ("divide and conquer certifies nothing", "certify(call);", ";", STATEMENT),
        ("small corrections are left out", "!(left > rounding * solution)", "!(left > S(1e-7) * solution)"),
        ("corrections are added though they may be rounding", "!(left > rounding_of_correction(call, left))", "false"),
        ("corrections are found and not added", "call.vdot[i] += delta_[i];", ";", STATEMENT),
        (
            "the rounding of residuals is in no certificate",
            "left = maximum(left, most_rounding_of_corrections(call));",
            ";",
            STATEMENT,
        ),
        ("divide and conquer refuses nothing", "faint_limit<S>() * solution >= left", "solution >= left"),
        ("what rests has to have digits", "(solution + natural_acceleration(call, worst))", "solution"),
        ("forces at hinges make no natural acceleration", "most = maximum(most, S(abs(call.tau[j]) / x_[j]));", ";", STATEMENT),
        ("corrections have velocities", "call.correcting ? Vector6<S>::zero() : points_.a[k]", "points_.a[k]"),
        ("corrections feel gravity", "start_at(Vector6<S>::zero());", "start_at(call.applied.base());", STATEMENT),
        ("singular hinges are not named", "if (growth > largest_growth<S>()) name_singular_hinge(call);", ";", STATEMENT),
        ("corrections do not reach what carries branches", "node.first >= 0 ? segments_[node.first].z : zero, zero,", "zero, zero,"),
        (
            "corrections of one of two lots of branches",
            "segments_[i].z = segments_[node.first].z + segments_[node.second].z;",
            "segments_[i].z = segments_[node.first].z;",
            STATEMENT,
        ),
        ("lengths are not of their scale", "return most * S(sqrt(square));", "return S(sqrt(square));", STATEMENT),
    ],
}
