// The plan as a table: what runs, in which tier, what it costs.
#include <cstdio>
#include <sstream>
#include <vector>

#include "algebra/planning/explain.h"
#include "algebra/planning/plan.h"

namespace pycraft {

namespace {

// Columns are padded by characters, not bytes: the text is UTF-8 and has combining marks (φ̃, τ̄).
size_t display_width(const std::string& text) {
  size_t width = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    const unsigned char c = text[i];
    if ((c & 0xC0) == 0x80) continue;                                            // continuation byte
    if (c == 0xCC || (c == 0xCD && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xB0)) continue;  // combining mark
    ++width;
  }
  return width;
}

std::string padded(const std::string& text, size_t width) {
  const size_t own = display_width(text);
  return own < width ? text + std::string(width - own, ' ') : text;
}

// Broken at spaces into lines of at most this width; a word that is longer has a line of its own.
std::vector<std::string> lines_of(const std::string& text, size_t width) {
  std::vector<std::string> lines(1);
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    std::string& line = lines.back();
    if (line.empty())
      line = word;
    else if (display_width(line) + 1 + display_width(word) <= width)
      line += " " + word;
    else
      lines.push_back(word);
  }
  return lines;
}

std::string quantity(double x, const char* unit) {
  char buffer[40];
  if (x >= 1e9)
    std::snprintf(buffer, sizeof buffer, "%.1f G%s", x / 1e9, unit);
  else if (x >= 1e6)
    std::snprintf(buffer, sizeof buffer, "%.1f M%s", x / 1e6, unit);
  else if (x >= 1e3)
    std::snprintf(buffer, sizeof buffer, "%.1f k%s", x / 1e3, unit);
  else
    std::snprintf(buffer, sizeof buffer, "%.0f %s", x, unit);
  return buffer;
}

}  // namespace

const char* step_kind_name(StepKind kind) {
  switch (kind) {
    case StepKind::values: return "values";
    case StepKind::gather: return "gather";
    case StepKind::scatter: return "scatter";
    case StepKind::apply_symbol: return "apply_symbol";
    case StepKind::apply_blocks: return "apply_blocks";
    case StepKind::apply_constant: return "apply_constant";
    case StepKind::apply_column: return "apply_column";
    case StepKind::apply_external: return "apply_external";
    case StepKind::combine: return "combine";
    case StepKind::vector_symbol: return "vector_symbol";
    case StepKind::zero: return "zero";
    case StepKind::load_blocks: return "load_blocks";
    case StepKind::identity_blocks: return "identity_blocks";
    case StepKind::multiply_blocks: return "multiply_blocks";
    case StepKind::combine_blocks: return "combine_blocks";
    case StepKind::transpose_blocks: return "transpose_blocks";
    case StepKind::invert_blocks: return "invert_blocks";
    case StepKind::root_blocks: return "root_blocks";
    case StepKind::function_blocks: return "function_blocks";
    case StepKind::congruence_blocks: return "congruence_blocks";
    case StepKind::lyapunov_blocks: return "lyapunov_blocks";
    case StepKind::factor: return "factor";
    case StepKind::solve: return "solve";
    case StepKind::selected_blocks: return "selected_blocks";
    case StepKind::mass_matrix: return "mass_matrix";
    case StepKind::mass_matrix_solve: return "mass_matrix_solve";
    case StepKind::mass_matrix_solve_tangent: return "mass_matrix_solve_tangent";
    case StepKind::mass_matrix_dense: return "mass_matrix_dense";
    case StepKind::dense_factor: return "dense_factor";
    case StepKind::dense_solve: return "dense_solve";
    case StepKind::blocks_of_dense: return "blocks_of_dense";
    case StepKind::gather_blocks: return "gather_blocks";
    case StepKind::diagonal_of_blocks: return "diagonal_of_blocks";
    case StepKind::trace_of_blocks: return "trace_of_blocks";
    case StepKind::logdet_of_blocks: return "logdet_of_blocks";
    case StepKind::logdet_of_D: return "logdet_of_D";
    case StepKind::logdet_of_factor: return "logdet_of_factor";
    case StepKind::logdet_of_dense: return "logdet_of_dense";
    case StepKind::norm_of_vector: return "norm_of_vector";
    case StepKind::root_of_trace: return "root_of_trace";
    case StepKind::combine_scalars: return "combine_scalars";
  }
  return "";
}

std::string explain(const Plan& plan) {
  static const char* tiers[] = {"values", "kernel", "sweep", "elimination", "dense"};
  static const char* requests[] = {"applied to a vector", "as a matrix", "its diagonal blocks", "its diagonal", "its trace", "its ln|det|", "its norm"};
  std::ostringstream out;
  out << plan.text << "\n" << requests[static_cast<int>(plan.request)];
  if (plan.domain) out << ", from " << plan.domain.description() << " to " << plan.codomain.description();
  if (plan.batched) out << ", at " << plan.batch << " states";
  if (plan.precision != Precision::double_) out << ", in " << precision_name(plan.precision) << (plan.precision < Precision::digits50 ? " precision" : " digits");
  out << "\n";
  // It fits a terminal of 80 columns, with three to spare for who sets it in.
  for (const std::string& note : plan.notes) {
    const char* before = "  by ";
    for (const std::string& line : lines_of(note, 72)) {
      out << before << line << "\n";
      before = "     ";
    }
  }
  size_t widest = 20;
  for (const Step& s : plan.steps) widest = std::max(widest, std::min<size_t>(display_width(s.text), 36));
  out << "  #  " << padded("step", widest + 2) << padded("tier", 13) << padded("flops", 12) << "memory\n";
  int i = 0;
  for (const Step& s : plan.steps) {
    char number[16];
    std::snprintf(number, sizeof number, "%3d  ", ++i);
    const std::vector<std::string> text = lines_of(s.text, widest);
    out << number << padded(text[0], widest + 2) << padded(tiers[s.tier], 13) << padded(quantity(s.flops, "flop"), 12) << quantity(s.bytes, "B") << "\n";
    for (size_t k = 1; k < text.size(); ++k) out << "       " << text[k] << "\n";
  }
  out << "     " << padded("total" + std::string(plan.columns_of_identity ? " (per column)" : ""), widest + 15) << padded(quantity(plan.flops(), "flop"), 12)
      << quantity(plan.bytes(), "B") << "\n";
  return out.str();
}

}  // namespace pycraft
