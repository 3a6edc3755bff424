// Theorems of the calculus, stated along one coordinate i and along time: each side is differentiated by rule from a
// different form, so that equality says something of the rules.
#include <algorithm>

#include "algebra/planning/square_root.h"
#include "operators/derived_operators.h"
#include "operators/alphabet.h"
#include "operators/directions.h"

namespace pycraft {

namespace {

using enum SymbolId;

// A coordinate along which much changes: of a hinge with few of them that carries many bodies, and whose parent is no root: where the
// root is free, P⁺ and G of the root are 0 and I at every state.
int telling_coordinate(const MultibodyOperators& source) {
  const SkoStructure& tree = source.structure();
  std::vector<int> carried(tree.bodies(), 1);
  for (int k = tree.bodies() - 1; k > 0; --k)
    if (tree.parent[k] >= 0) carried[tree.parent[k]] += carried[k];
  int best = -1, best_score = 0;
  for (int k = 0; k < tree.bodies(); ++k) {
    if (tree.dof[k] == 0) continue;
    const int parent = tree.parent[k];
    const int place = parent < 0 ? 0 : tree.parent[parent] < 0 ? 100 : 125;
    const int score = carried[k] + tree.bodies() * (place + (carried[k] > 1 ? 50 : 0) + 7 - std::min(tree.dof[k], 6));
    if (score > best_score) best = k, best_score = score;
  }
  return tree.dof_offset[best];
}

// One along which a theorem fails if its hypothesis does: the last of a hinge of several coordinates (several subhinges), no root's.
int failing_coordinate(const MultibodyOperators& source, bool subhinges, int otherwise) {
  const SkoStructure& tree = source.structure();
  for (int k = 0; k < tree.bodies(); ++k)
    if (tree.parent[k] >= 0 && (subhinges ? source.model()->body(k).hinge.subhinges.size() > 1 : tree.dof[k] > 1)) return tree.dof_offset[k + 1] - 1;
  return otherwise;
}

struct CalculusTheorems : Statements {
  using enum Hypothesis;
  explicit CalculusTheorems(const std::shared_ptr<MultibodyOperators>& of) : Statements(of), robot(of) {}

  Expression mechanics(SymbolId id) const { return mechanics_operator(id, robot); }
  Expression function(SymbolId id, const Expression& x) const { return block_function(definition_of(id), robot, nullptr, x); }
  Expression unit(int coordinate) const {
    std::vector<double> e(robot->nv(), 0.0);
    e[coordinate] = 1;
    return constant(std::move(e), Space::euclidean(1), robot->theta(), std::string("e").append(std::to_string(coordinate)));
  }
  Expression d(const Expression& e) const { return differentiate(e, *along_i); }
  Expression dot(const Expression& e) const { return differentiate(e, *along_time); }
  void state(const std::string& name, Side lhs, Side rhs, const std::string& text, const std::string& latex, Hypothesis hypotheses = no_hypothesis,
             const std::string& from = "soa.md, Calculus") {
    list.push_back({name, group, std::move(lhs), std::move(rhs), hypotheses, from, Use::check});
    shown(text, latex);
  }

  void mass_matrix_along_a_coordinate() {
    group = "Calculus along a coordinate";
    const Expression Delta_several = delta_operator(robot, several), Delta_many = delta_operator(robot, many);
    const Expression half = H * phi_tilde * Delta_several * phi * M * phi.T() * H.T();
    state("∂ℳ", differentiate(MM, *along_several), half + half.T(), "∂_iℳ = Hφ̃Δ_iφMφ*H* + HφMφ*Δ_i*φ̃*H*", "\\partial_i\\mathcal{M} = H\\tilde\\phi\\Delta_i\\phi M\\phi^*H^* + H\\phi M\\phi^*\\Delta_i^*\\tilde\\phi^*H^*", constant_hinges);
    const Expression book = H * phi * (Delta_many * phi * M + M * phi.T() * Delta_many.T()) * phi.T() * H.T();
    state("∂ℳ, single-DOF form", differentiate(MM, *along_many), book, "∂_iℳ = Hφ[Δ_iφM + Mφ*Δ_i*]φ*H*", "\\partial_i\\mathcal{M} = H\\phi[\\Delta_i\\phi M + M\\phi^*\\Delta_i^*]\\phi^*H^*", single_dof,
          "Jain 2011");
  }

  void operators_along_a_coordinate() {
    const Expression inverse = (MM + J).inv();
    state("∂ℳ by the innovations factors", d(MM + J), d(A * D * A.T()), "∂ℳ = ∂([I+HφK]D[I+HφK]*)",
          "\\partial\\mathcal{M} = \\partial([I+H\\phi\\mathcal{K}]\\mathcal{D}[I+H\\phi\\mathcal{K}]^*)");
    state("∂(ℳ⁻¹)", d(S.T() * D.inv() * S), -(inverse * d(MM) * inverse), "∂([I-HψK]*D⁻¹[I-HψK]) = -(ℳ+J)⁻¹∂ℳ(ℳ+J)⁻¹",
          "\\partial([I-H\\psi\\mathcal{K}]^*\\mathcal{D}^{-1}[I-H\\psi\\mathcal{K}]) = -(\\mathcal{M}+J)^{-1}\\partial\\mathcal{M}(\\mathcal{M}+J)^{-1}");
    state("∂P by the Riccati equation", d(P), d(M + E_psi * P * E.T()), "∂P = ∂(M + E_ψPE_φ*)", "\\partial P = \\partial(M + \\mathcal{E}_\\psi P\\mathcal{E}_\\phi^*)");
    state("∂P⁺", d(P_plus), d(tau_bar * P), "∂P⁺ = ∂(τ̄P)", "\\partial P^+ = \\partial(\\bar\\tau P)");
    state("∂G", d(G), d(P * H.T() * D.inv()), "∂G = ∂(PH*D⁻¹)", "\\partial\\mathcal{G} = \\partial(PH^*\\mathcal{D}^{-1})");
    state("∂ψ", d(psi), -(psi * d(phi.inv() + K * H) * psi), "∂ψ = -ψ ∂(φ⁻¹ + KH) ψ", "\\partial\\psi = -\\psi\\,\\partial(\\phi^{-1}+\\mathcal{K}H)\\,\\psi");
    state("∂(I-HψK)", d(S), -(S * d(A) * S), "∂[I-HψK] = -[I-HψK] ∂[I+HφK] [I-HψK]", "\\partial[I-H\\psi\\mathcal{K}] = -[I-H\\psi\\mathcal{K}]\\,\\partial[I+H\\phi\\mathcal{K}]\\,[I-H\\psi\\mathcal{K}]");
    state("∂R", d(R), d(M + E * R * E.T()), "∂R = ∂(M + E_φRE_φ*)", "\\partial\\mathcal{R} = \\partial(M+\\mathcal{E}_\\phi\\mathcal{R}\\mathcal{E}_\\phi^*)");
    state("∂Υ", d(Upsilon), block_diagonal(d(Omega)), "∂Υ = blockdiag(∂Ω)", "\\partial\\Upsilon = \\operatorname{blockdiag}(\\partial\\Omega)");
  }

  void log_determinant() {
    const Expression dH = d(H), Delta_i = delta_operator(robot, i);
    const Expression W = block_diagonal(E.T() * Upsilon * E);
    Scalar gradient = 2.0 * trace(P_plus * W * Delta_i);
    if (dH.kind() != NodeKind::zero) gradient = gradient + 2.0 * trace(dH * (I - P_plus * W) * G);
    state("gradient of ln det ℳ", differentiate(logdet(MM + J), *along_i), gradient, "∂_i ln det(ℳ+J) = 2 tr(P⁺WΔ_i) + 2 tr(∂_iH(I-P⁺W)G),  W = blockdiag(E*ΥE)",
          "\\partial_i\\ln\\det(\\mathcal{M}+J) = 2\\operatorname{tr}(P^+W\\Delta_i) + 2\\operatorname{tr}(\\partial_i H(I-P^+W)\\mathcal{G}),\\quad W = \\operatorname{blockdiag}(\\mathcal{E}_\\phi^*\\Upsilon\\mathcal{E}_\\phi)", no_hypothesis, "soa.md #35");
    const Parameter mass{robot, "mass", {}, robot->structure().bodies() - 1, InertiaParameter::mass, -1};
    const auto by_mass = parameter_direction(mass);
    state("gradient of ln det ℳ by a mass", differentiate(logdet(MM + J), *by_mass), trace(Upsilon * differentiate(M, *by_mass)), "∂_mass ln det(ℳ+J) = tr(Υ ∂_massM)",
          "\\partial_{\\mathrm{mass}}\\ln\\det(\\mathcal{M}+J) = \\operatorname{tr}(\\Upsilon\\,\\partial_{\\mathrm{mass}} M)", no_hypothesis, "soa.md #32");
  }

  void motion_along_a_coordinate() {
    const Expression e = unit(several);
    const Expression outboard = function(force_cross, E.T() * V);
    const Expression h = make_symbol(definition_of(direction_twist), source, OfCoordinate{several}, robot->structure().coordinate_names[several]);
    // -h*crf(E*V)p = (E*V)*crf(h)p, and crf(h) is Δ_i
    state("slope of the kinetic energy", 0.5 * differentiate(V.T() * M * V, *along_several), -(h.T() * outboard * p),
          "½ ∂_i(V*MV) = V*EΔ_i p,  p = φMV", "\\tfrac12\\partial_i(\\mathcal{V}^*M\\mathcal{V}) = \\mathcal{V}^*\\mathcal{E}_\\phi\\Delta_i p,\\quad p = \\phi M\\mathcal{V}", constant_hinges, "soa.md #18");
    const Expression dV = phi.T() * function(motion_cross, E.T() * V) * H.T() * e;
    const Expression dalpha = phi.T() * (function(motion_cross, E.T() * alpha) * H.T() * e - function(motion_cross, H.T() * qd) * dV);
    state("derivative of inverse dynamics", differentiate(H * f, *along_several),
          H * phi_tilde * function(momentum_cross_of, f) * H.T() * e +
              H * phi * (M * dalpha + (mechanics(momentum_cross) + mechanics(V_bar) * M) * dV),
          "∂_i(Hf) = Hφ̃Δ_i f + Hφ(M∂_iα + (𝓑+V̄M)∂_iV)", "\\partial_i(Hf) = H\\tilde\\phi\\Delta_i f + H\\phi(M\\partial_i\\alpha+(\\mathscr{B}+\\bar{\\mathcal{V}}M)\\partial_i\\mathcal{V})",
          constant_hinges, "soa.md #25");
  }

  void quasi_derivatives() {
    for (int k = 0; k < robot->model()->bodies(); ++k) {
      const auto& subhinges = robot->model()->body(k).hinge.subhinges;
      if (robot->structure().parent[k] < 0 || subhinges.size() != 1 || subhinges[0].nv() < 3) continue;  // a root's turn changes no ℳ
      const int first = robot->structure().dof_offset[k];
      const auto x = coordinate_direction(robot, first), y = coordinate_direction(robot, first + 1), z = coordinate_direction(robot, first + 2);
      state("quasi-derivatives do not commute", differentiate(differentiate(MM, *y), *x) - differentiate(differentiate(MM, *x), *y), differentiate(MM, *z),
            "∂_x∂_yℳ - ∂_y∂_xℳ = ∂_zℳ", "\\partial_x\\partial_y\\mathcal{M} - \\partial_y\\partial_x\\mathcal{M} = \\partial_z\\mathcal{M}", no_hypothesis, "soa.md #37");
      break;
    }
  }

  void rates() {
    group = "Calculus along time";
    state("accelerations", dot(V), alpha, "dV/dt = φ*(H*θ̈ + a)", "\\dot{\\mathcal{V}} = \\phi^*(H^*\\ddot\\theta+\\mathfrak{a})", no_hypothesis, "soa.md #11");
    state("forces as rates of momentum", dot(p) + mechanics(V_bar) * p, f, "ṗ + V̄p = f,  p = φMV", "\\dot p + \\bar{\\mathcal{V}}p = f,\\quad p = \\phi M\\mathcal{V}", no_hypothesis, "soa.md #16");
    state("Hamiltonian form", dot(MM * qd), H * f + mechanics(H_dot) * p - H * mechanics(V_bar) * p, "d(ℳθ̇)/dt = Hf + Ḣp - HV̄p",
          "\\tfrac{d}{dt}(\\mathcal{M}\\dot\\theta) = Hf + \\dot Hp - H\\bar{\\mathcal{V}}p", no_hypothesis, "soa.md #17");
  }

  void coriolis_matrix() {
    state("rate of the body Jacobian", J_dot, phi.T() * (mechanics(Delta_theta_dot).T() * phi_tilde.T() * H.T() + mechanics(H_dot).T()),
          "d(φ*H*)/dt = φ*(Δ_θ̇*φ̃*H* + Ḣ*)", "\\tfrac{d}{dt}(\\phi^*H^*) = \\phi^*(\\Delta_{\\dot\\theta}^*\\tilde\\phi^*H^*+\\dot H^*)");
    state("ℳ̇ - 2C is skew, ℳ̇ by rule", dot(MM) - 2.0 * C, -(dot(MM) - 2.0 * C).T(), "ℳ̇ - 2C = -(ℳ̇ - 2C)*",
          "\\dot{\\mathcal{M}} - 2C = -(\\dot{\\mathcal{M}} - 2C)^*", no_hypothesis, "soa.md #21");
    // a coordinate outboard of `many` where there is one
    int k = many, body = 0;
    while (robot->structure().dof_offset[body + 1] <= many) ++body;
    for (int c = 0; c < robot->structure().bodies(); ++c)
      if (robot->structure().parent[c] == body && robot->structure().dof[c] > 0) k = robot->structure().dof_offset[c];
    const auto along_k = coordinate_direction(robot, k);
    state("C is the Christoffel matrix", unit(k).T() * C * unit(many),
          0.5 * (unit(k).T() * dot(MM) * unit(many) + unit(k).T() * differentiate(MM, *along_many) * qd - unit(many).T() * differentiate(MM, *along_k) * qd), "e_j*Ce_i = ½(e_j*ℳ̇e_i + e_j*∂_iℳθ̇ - e_i*∂_jℳθ̇)",
          "e_j^*Ce_i = \\tfrac12(e_j^*\\dot{\\mathcal{M}}e_i + e_j^*\\partial_i\\mathcal{M}\\,\\dot\\theta - e_i^*\\partial_j\\mathcal{M}\\,\\dot\\theta)", single_dof, "soa.md #22");
  }

  void diagonalised_dynamics() {
    const Expression m = A * square_root(D), inverse_m = square_root(D).inv() * S, skew = inverse_m * C * inverse_m.T() - dot(m).T() * inverse_m.T();
    state("diagonalised dynamics: S is skew", skew, -skew.T(), "S = -S*,  S = m⁻¹Cm⁻* - ṁ*m⁻*,  m = [I+HφK]D^½",
          "S = -S^*,\\quad S = m^{-1}Cm^{-*}-\\dot m^*m^{-*},\\quad m = [I+H\\phi\\mathcal{K}]\\mathcal{D}^{1/2}", no_hypothesis, "soa.md #23");
    state("diagonalised dynamics", dot(m.T() * qd) + skew * m.T() * qd, inverse_m * (H * f + J * qdd), "η̇ + Sη = m⁻¹T,  S = m⁻¹Cm⁻* - ṁ*m⁻*", "\\dot\\eta + S\\eta = m^{-1}T,\\quad S = m^{-1}Cm^{-*}-\\dot m^*m^{-*}",
          no_hypothesis, "soa.md #24");
  }

  void world_frame() {
    group = "World frame, calculus";
    const Letters w(std::make_shared<WorldFrame>(robot));
    const Expression X = mechanics(X_world);
    state("∂M_w", d(w.M), d(X * M * X.T()), "∂M_w = ∂(XMX*)", "\\partial M_w = \\partial(XMX^*)", no_hypothesis, "soa.md #53");
    state("∂H_w", d(w.H), d(H * X.inv()), "∂H_w = ∂(HX⁻¹)", "\\partial H_w = \\partial(HX^{-1})", no_hypothesis, "soa.md #53");
    state("∂P_w and ∂P", d(w.P), X * differentiate_in_world(P, *along_i) * X.T(), "∂P_w = X∂PX* + ∂XPX* + XP∂X*", "\\partial P_w = X\\partial P X^* + \\partial X\\,PX^* + XP\\,\\partial X^*",
          no_hypothesis, "soa.md #54");
  }

  const std::shared_ptr<MultibodyOperators> robot;
  const int i = telling_coordinate(*robot), several = failing_coordinate(*robot, true, i), many = failing_coordinate(*robot, false, i);
  const Expression qdd = make_vector("vdot", robot->theta());
  const std::unique_ptr<Direction> along_i = coordinate_direction(robot, i), along_several = coordinate_direction(robot, several);
  const std::unique_ptr<Direction> along_many = coordinate_direction(robot, many), along_time = time_direction(robot, qdd);
  const Expression MM = H * phi * M * phi.T() * H.T(), A = I + H * phi * K, S = I - H * psi * K;
  const Expression qd = mechanics(theta_dot), V = mechanics(velocity), a = mechanics(coriolis_acceleration), b = mechanics(gyroscopic_force);
  const Expression alpha = phi.T() * (H.T() * qdd + a), f = phi * (M * alpha + b), p = phi * M * V;
  const Expression jacobian = phi.T() * H.T(), J_dot = dot(jacobian);
  const Expression C = H * phi * (M * J_dot + 0.5 * (mechanics(momentum_cross) + mechanics(V_bar) * M + M * mechanics(V_tilde)) * jacobian);
};

}  // namespace

std::vector<Theorem> calculus_theorems(const std::shared_ptr<MultibodyOperators>& source) {
  if (source->nv() == 0) return {};
  CalculusTheorems all(source);
  all.mass_matrix_along_a_coordinate();
  all.operators_along_a_coordinate();
  all.log_determinant();
  all.motion_along_a_coordinate();
  all.quasi_derivatives();
  all.rates();
  all.coriolis_matrix();
  all.diagonalised_dynamics();
  all.world_frame();
  return std::move(all.list);
}

}  // namespace pycraft
