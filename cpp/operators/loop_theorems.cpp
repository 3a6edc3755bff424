#include "operators/loop_theorems.h"

#include <algorithm>

#include "algebra/theorems/differentiate.h"
#include "algebra/theorems/theorems.h"
#include "numerics/rank_factors.h"
#include "operators/alphabet.h"
#include "operators/directions.h"
#include "recursions/loop_rows.h"

namespace pycraft {

using enum SymbolId;

namespace {

constexpr double rank_of_rows = 1e-8;  // of the longest row, as mobility has it (pycraft/models/mobility.py)

// A row of ones for each number: what picks these out of a stack.
Expression picked(const std::vector<int>& rows, int of, const std::string& name) {
  std::vector<double> ones(rows.size() * of, 0.0);
  for (size_t i = 0; i < rows.size(); ++i) ones[i * of + rows[i]] = 1;
  return constant(std::move(ones), Space::euclidean(of), Space::euclidean(static_cast<int>(rows.size())), name);
}

// Rows that are independent where the model is, by a factor of Q* with column pivoting.
std::vector<int> independent_rows(const LoopOperators& loops) {
  const auto resolved = loops.loops().resolved();
  const auto compiled = loops.model().compiled<double>();
  const auto state = loops.state();
  LoopBuffers<double> buffers;
  Reflections<double> columns;
  columns.resize(loops.nv(), resolved->rows);
  loop_jacobian(*compiled, *resolved, state->q.data(), buffers, [&](int row, int i, double number) { columns.at(i, row) = number; });
  double longest = 0;
  for (int row = 0; row < resolved->rows; ++row) {
    double square = 0;
    for (int i = 0; i < loops.nv(); ++i) square += columns.at(i, row) * columns.at(i, row);
    longest = std::max(longest, square);
  }
  columns.factor(true, rank_of_rows * std::sqrt(longest));
  std::vector<int> rows(columns.order.begin(), columns.order.begin() + columns.rank);
  std::sort(rows.begin(), rows.end());
  return rows;
}

struct LoopStatements : Statements {
  LoopStatements(const std::shared_ptr<SkoSource>& of, const std::shared_ptr<LoopOperators>& rows)
      : Statements(of), robot(rows->base()), loops(rows), tree(robot), Q(rows->whole("Q")) {}

  Expression mechanics(SymbolId id) const { return mechanics_operator(id, robot); }
  void state(const std::string& name, Side lhs, Side rhs, const std::string& text, const std::string& latex, const std::string& from) {
    list.push_back({name, group, std::move(lhs), std::move(rhs), Hypothesis::no_hypothesis, from, Use::check});
    shown(text, latex);
  }
  // θ̈ of the tree under T and λ: θ̈_f + (ℳ+J)⁻¹q*λ such that qθ̈ + c = 0, the first by the innovations recursion.
  Expression on_loops(const Expression& q, const Expression& c) const {
    const Letters& l = tree;
    const Expression z = l.psi * (l.K * T + l.P * a + b), nu = l.D.inv() * (T - l.H * z);
    const Expression free = (l.I - l.H * l.psi * l.K).T() * nu - l.K.T() * l.psi.T() * a;
    const Expression response = (MM + l.J).inv() * q.T();
    return free - response * (q * response).inv() * (q * free + c);
  }
  Expression dot(const Expression& e) const { return differentiate(e, *along_time); }

  const std::shared_ptr<MultibodyOperators> robot;
  const std::shared_ptr<LoopOperators> loops;
  const Letters tree;
  const Expression Q;
  const std::unique_ptr<Direction> along_time = time_direction(robot, make_vector("vdot", robot->theta()));
  const Expression MM = tree.H * tree.phi * tree.M * tree.phi.T() * tree.H.T();
  const Expression qd = mechanics(theta_dot), a = mechanics(coriolis_acceleration), b = mechanics(gyroscopic_force), T = make_vector("T", robot->theta());
  const Expression bias = tree.H * tree.phi * (tree.M * tree.phi.T() * a + b);
};

struct AugmentationTheorems : LoopStatements {
  explicit AugmentationTheorems(const std::shared_ptr<LoopOperators>& rows) : LoopStatements(rows->base(), rows) {}

  void by_ends() {
    const std::optional<Expression> reach = loops->by_ends();
    if (!reach) return;
    const Expression A = loops->whole("A"), B = node_operator(SymbolId::B, robot, loops->end_names());
    state("rows of loops by their ends", Q, *reach, "Q = A B_e*φ*H*", "Q = A\\,B_e^*\\phi^*H^*", "Jain 2011");
    state("compliance of the rows", Q * (MM + J).inv() * Q.T(), A * B.T() * Omega * B * A.T(), "Q(ℳ+J)⁻¹Q* = A B_e*ΩB_e A*",
          "Q(\\mathcal{M}+J)^{-1}Q^* = A\\,B_e^*\\Omega B_e\\,A^*", "soa.md #63");
    state("rate of the rows", dot(Q), dot(*reach), "Q̇ = d(A B_e*φ*H*)/dt", "\\dot Q = \\tfrac{d}{dt}(A\\,B_e^*\\phi^*H^*)", "the product rule");
  }

  void multipliers() {
    const std::vector<int> rows = independent_rows(*loops);
    if (rows.empty()) return;
    const Expression q = picked(rows, Q.codomain().dimension(), "S") * Q;
    const Expression inverse = (MM + J).inv(), compliance = q * inverse * q.T();
    const Expression free = inverse * (T - bias), lambda = -(compliance.inv() * (q * free + dot(q) * qd)), accelerations = on_loops(q, dot(q) * qd);
    state("tree augmentation: the rows are kept", q * accelerations, -(dot(q) * qd), "Q_sδ = -Q̇_sθ̇,  δ = β + (ℳ+J)⁻¹Q_s*λ,  λ = -(Q_s(ℳ+J)⁻¹Q_s*)⁻¹(Q_sβ + Q̇_sθ̇),  β = (ℳ+J)⁻¹(T - Hφ(Mφ*a + b))",
          "Q_s\\delta = -\\dot Q_s\\dot\\theta,\\quad \\delta=\\beta+(\\mathcal{M}+J)^{-1}Q_s^*\\lambda,\\quad \\lambda = -(Q_s(\\mathcal{M}+J)^{-1}Q_s^*)^{-1}(Q_s\\beta+\\dot Q_s\\dot\\theta),\\quad \\beta = (\\mathcal{M}+J)^{-1}(T-H\\phi(M\\phi^*\\mathfrak{a}+\\mathfrak{b}))", "soa.md #63");
    state("tree augmentation: the equations of motion", (MM + J) * accelerations + bias, T + q.T() * lambda, "(ℳ+J)δ + Hφ(Mφ*a + b) = T + Q_s*λ,  δ = β + (ℳ+J)⁻¹Q_s*λ,  λ = -(Q_s(ℳ+J)⁻¹Q_s*)⁻¹(Q_sβ + Q̇_sθ̇),  β = (ℳ+J)⁻¹(T - Hφ(Mφ*a + b))",
          "(\\mathcal{M}+J)\\delta+H\\phi(M\\phi^*\\mathfrak{a}+\\mathfrak{b}) = T + Q_s^*\\lambda,\\quad \\delta=\\beta+(\\mathcal{M}+J)^{-1}Q_s^*\\lambda,\\quad \\lambda = -(Q_s(\\mathcal{M}+J)^{-1}Q_s^*)^{-1}(Q_s\\beta+\\dot Q_s\\dot\\theta),\\quad \\beta = (\\mathcal{M}+J)^{-1}(T-H\\phi(M\\phi^*\\mathfrak{a}+\\mathfrak{b}))", "soa.md #63");
    const Expression left_free = I - inverse * q.T() * compliance.inv() * q;
    state("what loops leave free", left_free * left_free, left_free, "N² = N,  N = I - (ℳ+J)⁻¹Q_s*(Q_s(ℳ+J)⁻¹Q_s*)⁻¹Q_s",
          "N^2=N,\\quad N = I-(\\mathcal{M}+J)^{-1}Q_s^*(Q_s(\\mathcal{M}+J)^{-1}Q_s^*)^{-1}Q_s", "a projection");
    state("loops' impulses do no work on what is left free", left_free.T() * (MM + J) * left_free, (MM + J) * left_free, "N*(ℳ+J)N = (ℳ+J)N,  N = I - (ℳ+J)⁻¹Q_s*(Q_s(ℳ+J)⁻¹Q_s*)⁻¹Q_s",
          "N^*(\\mathcal{M}+J)N = (\\mathcal{M}+J)N,\\quad N = I-(\\mathcal{M}+J)^{-1}Q_s^*(Q_s(\\mathcal{M}+J)^{-1}Q_s^*)^{-1}Q_s", "Gauss's principle");
  }
};

struct EmbeddingTheorems : LoopStatements {
  EmbeddingTheorems(const std::shared_ptr<EmbeddedOperators>& of, const std::shared_ptr<LoopOperators>& rows) : LoopStatements(of, rows), embedded(of) {}

  Expression own(SymbolId id) const { return make_symbol(definition_of(id), embedded); }
  Expression of_groups(SymbolId id) const { return make_symbol(definition_of(id), groups.source); }

  void blocks() {
    group = "Loops embedded";
    state("compound hinge map", H, X.T() * groups.H, "H_r = X_r*H_g", "H_r = X_r^*H_g", "soa.md #60");
    if (embedded->traits().hinge_diagonal) state("compound hinge-diagonal term", J, X.T() * groups.J * X, "J_r = X_r*J_gX_r", "J_r = X_r^*J_gX_r", "soa.md #60");
    state("compound mass matrix, by groups", own_MM, X.T() * groups.H * groups.phi * groups.M * groups.phi.T() * groups.H.T() * X, "ℳ_r = X_r*ℳ_gX_r",
          "\\mathcal{M}_r = X_r^*\\mathcal{M}_gX_r", "soa.md #60");
    state("compound mass matrix", own_MM, X.T() * MM * X, "ℳ_r = X_r*ℳX_r", "\\mathcal{M}_r = X_r^*\\mathcal{M}X_r", "soa.md #60");
    state("velocities of embedded loops", phi.T() * H.T() * thetad_r, groups.phi.T() * groups.H.T() * X * thetad_r, "φ_r*H_r*θ̇_r = φ_g*H_g*X_rθ̇_r",
          "\\phi_r^*H_r^*\\dot\\theta_r = \\phi_g^*H_g^*X_r\\dot\\theta_r", "soa.md #60");
    state("Coriolis acceleration of embedded loops", own_a, a_g + groups.H.T() * X_dot * thetad_r, "a_r = a_g + H_g*Ẋ_rθ̇_r",
          "\\mathfrak{a}_r = \\mathfrak{a}_g + H_g^*\\dot X_r\\dot\\theta_r", "soa.md #62");
  }

  // Of the rows that are solved: the others hang on them where the loops are closed, which numbers are to their last digit only.
  void rows() {
    const int nv = embedded->nv();
    std::vector<double> ones(size_t(nv) * nv, 0.0);
    for (const EmbeddedLoops& set : embedded->sets())
      for (int i : set.dependent) ones[size_t(i) * nv + i] = 1;
    const Expression dependent = constant(std::move(ones), robot->theta(), robot->theta(), "I_d");
    state("rows are kept by independent velocities", q * dependent * X, -(q * (tree.I - dependent) * X), "Q_sX_r = 0", "Q_sX_r = 0", "soa.md #60");
    state("rate of the map", q * X_dot, -(dot(q) * X), "Q_sẊ_r = -Q̇_sX_r", "Q_s\\dot X_r = -\\dot Q_sX_r", "soa.md #62");
    state("rows are kept by accelerations", q * (X * thetadd_r + X_dot * thetad_r), -(dot(q) * X * thetad_r), "Q_s(X_rθ̈_r + Ẋ_rθ̇_r) = -Q̇_sX_rθ̇_r",
          "Q_s(X_r\\ddot\\theta_r+\\dot X_r\\dot\\theta_r) = -\\dot Q_sX_r\\dot\\theta_r", "soa.md #62");
  }

  void equations_of_motion() {
    const Expression all = X * thetadd_r + X_dot * thetad_r;
    state("accelerations of embedded loops", phi.T() * (H.T() * thetadd_r + own_a), groups.phi.T() * (groups.H.T() * all + a_g),
          "φ_r*(H_r*θ̈_r + a_r) = φ_g*(H_g*δ + a_g),  δ = X_rθ̈_r + Ẋ_rθ̇_r", "\\phi_r^*(H_r^*\\ddot\\theta_r+\\mathfrak{a}_r) = \\phi_g^*(H_g^*\\delta+\\mathfrak{a}_g),\\quad \\delta = X_r\\ddot\\theta_r+\\dot X_r\\dot\\theta_r", "soa.md #62");
    const Expression b_g = of_groups(gyroscopic_force), more = X.T() * groups.J * X_dot * thetad_r;
    const Expression own_bias = H * phi * (M * phi.T() * own_a + b_g) + more;
    state("equations of motion of embedded loops", (own_MM + J) * thetadd_r + own_bias,
          X.T() * (groups.H * groups.phi * (groups.M * groups.phi.T() * (groups.H.T() * all + a_g) + b_g) + groups.J * all), "(ℳ_r+J_r)θ̈_r + 𝒞_r = X_r*((ℳ_g+J_g)δ + 𝒞_g),  δ = X_rθ̈_r + Ẋ_rθ̇_r",
          "(\\mathcal{M}_r+J_r)\\ddot\\theta_r+\\mathcal{C}_r = X_r^*((\\mathcal{M}_g+J_g)\\delta+\\mathcal{C}_g),\\quad \\delta = X_r\\ddot\\theta_r+\\dot X_r\\dot\\theta_r", "soa.md #62");
    if (q.codomain().dimension() == 0) return;  // couplings of nothing
    const Expression by_tree = on_loops(q, dot(q) * X * thetad_r);
    const Expression S = I - H * psi * K, independent = S.T() * D.inv() * S * (X.T() * T - own_bias);
    state("both ways lead to the same accelerations", X * independent + X_dot * thetad_r, by_tree, "X_r(ℳ_r+J_r)⁻¹(X_r*T - 𝒞_r) + Ẋ_rθ̇_r = β + (ℳ+J)⁻¹Q_s*λ,  λ = -(Q_s(ℳ+J)⁻¹Q_s*)⁻¹(Q_sβ + Q̇_sX_rθ̇_r),  β = (ℳ+J)⁻¹(T - Hφ(Mφ*a + b))",
          "X_r(\\mathcal{M}_r+J_r)^{-1}(X_r^*T-\\mathcal{C}_r)+\\dot X_r\\dot\\theta_r = \\beta+(\\mathcal{M}+J)^{-1}Q_s^*\\lambda,\\quad \\lambda = -(Q_s(\\mathcal{M}+J)^{-1}Q_s^*)^{-1}(Q_s\\beta+\\dot Q_sX_r\\dot\\theta_r),\\quad \\beta = (\\mathcal{M}+J)^{-1}(T-H\\phi(M\\phi^*\\mathfrak{a}+\\mathfrak{b}))", "soa.md #60, #63");
  }

  void calculus() {
    group = "Loops embedded, calculus along an independent coordinate";
    int i = 0;
    for (int g = embedded->structure().bodies() - 1; g >= 0; --g)
      if (embedded->loops_of(g) && embedded->structure().dof[g]) i = embedded->structure().dof_offset[g];
    const auto along_i = independent_direction(embedded, i);
    const auto d = [&](const Expression& e) { return differentiate(e, *along_i); };
    const Expression dX = d(X);
    if (robot->traits().constant_hinges) {
      std::vector<double> unit(embedded->theta().dimension(), 0.0);
      unit[i] = 1;
      const Expression e = constant(std::move(unit), Space::euclidean(1), embedded->theta(), "e" + std::to_string(i));
      const Expression H_S = of_groups(inner_H), phi_S = of_groups(inner_phi), Delta = block_function(definition_of(force_cross), groups.source, nullptr, H_S.T() * X * e);
      state("derivative of the compound hinge map", d(H), dX.T() * groups.H + X.T() * H_S * (phi_S - I) * Delta * phi_S, "∂H_r = ∂X_r*H_Sφ_S + X_r*H_Sφ̃_SΔ_Xφ_S",
            "\\partial H_r = \\partial X_r^*H_S\\phi_S + X_r^*H_S\\tilde\\phi_S\\Delta_X\\phi_S", "soa.md #61");
    }
    state("derivative of the compound mass matrix", d(own_MM), dX.T() * MM * X + X.T() * d(MM) * X + X.T() * MM * dX, "∂ℳ_r = ∂X_r*ℳX_r + X_r*∂ℳX_r + X_r*ℳ∂X_r",
          "\\partial\\mathcal{M}_r = \\partial X_r^*\\mathcal{M}X_r + X_r^*\\partial\\mathcal{M}X_r + X_r^*\\mathcal{M}\\partial X_r", "soa.md #61");
    state("derivative of the compound articulated inertia", d(P), d(M + E_psi * P * E.T()), "∂P_r = ∂(M_r + E_ψ_rP_rE_r*)", "\\partial P_r = \\partial(M_r + \\mathcal{E}_{\\psi_r} P_r\\mathcal{E}_r^*)",
          "soa.md #61");
  }

  static std::vector<int> solved(const EmbeddedOperators& of) {
    std::vector<int> rows;
    for (const EmbeddedLoops& set : of.sets()) rows.insert(rows.end(), set.rows.begin(), set.rows.end());
    std::sort(rows.begin(), rows.end());
    return rows;
  }

  const std::shared_ptr<EmbeddedOperators> embedded;
  const Expression q = picked(solved(*embedded), Q.codomain().dimension(), "S") * Q;
  const Letters groups = Letters(embedded->grouped());
  const Expression X = own(coordinate_map), X_dot = own(coordinate_map_rate), thetad_r = own(theta_dot), own_a = own(coriolis_acceleration);
  const Expression a_g = of_groups(coriolis_acceleration), own_MM = H * phi * M * phi.T() * H.T(), thetadd_r = make_vector("vdot_r", embedded->theta());
};

}  // namespace

std::vector<Theorem> augmentation_theorems(const std::shared_ptr<LoopOperators>& loops) {
  AugmentationTheorems all(loops);
  all.group = "Loops beside the tree";
  all.by_ends();
  all.multipliers();
  return std::move(all.list);
}

std::vector<Theorem> embedding_theorems(const std::shared_ptr<EmbeddedOperators>& source) {
  EmbeddingTheorems all(source, std::make_shared<LoopOperators>(source->base(), source->loops()));
  all.blocks();
  if (all.q.codomain().dimension() > 0) all.rows();
  all.equations_of_motion();
  if (source->theta().dimension() > 0) all.calculus();
  return std::move(all.list);
}

}  // namespace pycraft
