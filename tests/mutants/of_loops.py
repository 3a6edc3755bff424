"""Changes by hand of dynamics on loops, as of_cpp.py has them."""

from .of_cpp import STATEMENT

CHANGES = {
    "cpp/dynamics/constrained_dynamics.cpp": [
        (
            "rows of loops without what velocities ask",
            "loop_bias(*model_, *loops, asked.q, asked.v, buffers_, c_.data());",
            ";",
            STATEMENT,
        ),
        (
            "rows of loops that conflict are averaged",
            "if (off_[row] <= certified<S>() * size) off_[row] = S(0);",
            "off_[row] = S(0);",
            STATEMENT,
        ),
        (
            "residuals of loops are measured by what is left",
            "maximum(sizes_[row], S((rows_.product_size(row, x_.data()) + bias_[row]) / unit_[row]))",
            "S((rows_.product_size(row, x_.data()) + bias_[row]) / unit_[row])",
        ),
        ("in quad the rounding of states is a direction", "S(64 * epsilon<double>())", "S(0)"),
    ],
    "cpp/numerics/rank_factors.h": [
        ("multipliers are the least in units of rounding", "unit_[V_.order[i]] * V_.upper(j, i)", "V_.upper(j, i)"),
    ],
}
