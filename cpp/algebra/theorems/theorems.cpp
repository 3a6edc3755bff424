// Every theorem of the algebra that holds on any SKO tree (blocks E, H, M, J of any size), with its hypotheses.
// Sources: "Jain 2011" is A. Jain, Robot and Multibody Dynamics: Analysis and Algorithms, Springer 2011; "general J" marks the
// statement with a hinge-diagonal term (rotor inertia, implicit damping) that reduces to the book's for J = 0.
#include "algebra/theorems/theorems.h"

#include "algebra/trees/aggregated_tree.h"
#include "runtime/errors.h"

namespace pycraft {

std::vector<std::string> hypothesis_names(Hypothesis hypotheses) {
  using enum Hypothesis;
  std::vector<std::string> names;
  const auto name = [&](Hypothesis one, const char* words) {
    if (contains(hypotheses, one)) names.push_back(words);
  };
  name(chain, "serial chain");
  name(no_hinge_diagonal, "J = 0");
  name(single_dof, "single-DOF hinges");
  name(constant_hinges, "constant H");
  name(free_root, "free root");
  name(equal_blocks, "blocks of one size");
  return names;
}

Hypothesis unmet(Hypothesis hypotheses, const Traits& t) {
  using enum Hypothesis;
  Hypothesis missing = no_hypothesis;
  const auto ask = [&](Hypothesis one, bool met) {
    if (contains(hypotheses, one) && !met) missing = missing | one;
  };
  ask(chain, t.chain);
  ask(no_hinge_diagonal, !t.hinge_diagonal);
  ask(single_dof, t.single_dof);
  ask(constant_hinges, t.constant_hinges);
  ask(free_root, t.free_root);
  ask(equal_blocks, t.equal_blocks);
  return missing;
}

Letters::Letters(std::shared_ptr<SkoSource> s, const std::shared_ptr<const Binding>& binding) : source(std::move(s)), I(identity()) {
  const auto letter = [&](SymbolId id) { return make_symbol(id, source, binding); };
  E = letter(SymbolId::E), phi = letter(SymbolId::phi), phi_tilde = letter(SymbolId::phi_tilde), H = letter(SymbolId::H), M = letter(SymbolId::M);
  J = letter(SymbolId::J), P = letter(SymbolId::P), P_plus = letter(SymbolId::P_plus), D = letter(SymbolId::D), G = letter(SymbolId::G);
  K = letter(SymbolId::K), tau = letter(SymbolId::tau), tau_bar = letter(SymbolId::tau_bar), E_psi = letter(SymbolId::E_psi);
  psi = letter(SymbolId::psi), psi_tilde = letter(SymbolId::psi_tilde), R = letter(SymbolId::R), Upsilon = letter(SymbolId::Upsilon);
  Omega = letter(SymbolId::Omega);
}

namespace {

struct TreeTheorems : Statements {
  using enum Hypothesis;
  using enum Use;
  explicit TreeTheorems(const std::shared_ptr<SkoSource>& of) : Statements(of) {}

  void state(const char* name, Side lhs, Side rhs, Hypothesis hypotheses = no_hypothesis, Use use = check, std::string from = "Jain 2011") {
    if (use == inverse) lhs = std::get<Expression>(lhs).inv();
    list.push_back({name, group, std::move(lhs), std::move(rhs), hypotheses, std::move(from), use});
  }

  void spatial_operators() {
    group = "Spatial operators";
    state("φ is the resolvent of E", phi, I + E * phi);
    state("Eφ = φ-I", E * phi, phi - I, no_hypothesis, rewrite);
    state("φE = φ-I", phi * E, phi - I, no_hypothesis, rewrite);
    state("φ̃ is φ-I", phi_tilde, phi - I, no_hypothesis, rewrite);
    state("φ inverts I-E", I - E, phi, no_hypothesis, inverse);
    state("gain shifted to the parent", E * G, K, no_hypothesis, rewrite);
  }

  void composite_inertia() {
    group = "Composite-body inertia";
    state("Lyapunov equation of R", M, R - block_diagonal(E * R * E.T()));
    state("ERE* = R-M", E * R * E.T(), R - M, no_hypothesis, rewrite);
    state("ERφ* by R", E * R * phi.T(), E * R + R * phi.T() - M * phi.T(), no_hypothesis, rewrite);
    state("φR by φMφ*", phi * R, phi * M * phi.T() + R - R * phi.T(), no_hypothesis, rewrite);
    list.back().one_way = true;
    state("φMφ* decomposed by R", phi * M * phi.T(), R + phi_tilde * R + R * phi_tilde.T());
    state("mass matrix by composite bodies", MM, H * (R + phi_tilde * R + R * phi_tilde.T()) * H.T());
    state("diagonal blocks of φMφ*", block_diagonal(phi * M * phi.T()), R);
  }

  void articulated_inertia() {
    group = "Articulated-body inertia";
    state("Riccati equation of P", M, P - E_psi * P * E_psi.T(), no_hinge_diagonal);
    state("Riccati equation, mixed form", M, P - E_psi * P * E.T());
    state("Riccati equation with J", M, P - E_psi * P * E_psi.T() - K * J * K.T(), no_hypothesis, check, extended);
    state("Riccati equation in E and K", M, P - E * P * E.T() + K * D * K.T(), no_hypothesis, rewrite);
    state("D is the hinge's share of P", D, H * P * H.T() + J);
    state("gain equation", P * H.T(), G * D, no_hypothesis, rewrite);
    state("HG with J", H * G, I - J * D.inv(), no_hypothesis, rewrite, extended);
    state("H is a left inverse of G", H * G, I, no_hinge_diagonal);
    state("τ = GH", tau, G * H, no_hypothesis, rewrite);
    state("τ̄ = I-GH", tau_bar, I - G * H, no_hypothesis, rewrite);
    state("τ is a projection", power(tau, 2), tau, no_hinge_diagonal);
    state("τP is symmetric", tau * P, P * tau.T());
    state("τ̄ projects P", tau_bar * P * tau_bar.T(), tau_bar * P, no_hinge_diagonal);
    state("Joseph form with J", tau_bar * P * tau_bar.T() + G * J * G.T(), tau_bar * P, no_hypothesis, check, extended);
    state("P⁺ is τ̄P", P_plus, P - G * D * G.T(), no_hypothesis, rewrite);
    state("array form, Gram identity", P, P_plus + G * D * G.T());
    state("τ̄ leaves nothing along the hinge", H * tau_bar, zero(H.domain(), H.codomain()), no_hinge_diagonal);
    state("E_ψ = E-KH", E_psi, E - K * H, no_hypothesis, rewrite);
  }

  void resolvents() {
    group = "φ, ψ, K, H";
    state("ψ̃ is ψ-I", psi_tilde, psi - I, no_hypothesis, rewrite);
    state("ψ inverts I-E_ψ", I - E_psi, psi, no_hypothesis, inverse);
    state("ψE = ψ-I+ψKH", psi * E, psi - I + psi * K * H, no_hypothesis, rewrite);
    state("Eψ = ψ-I+KHψ", E * psi, psi - I + K * H * psi, no_hypothesis, rewrite);
    state("φKHψ = φ-ψ", phi * K * H * psi, phi - psi, no_hypothesis, rewrite);
    state("ψKHφ = φ-ψ", psi * K * H * phi, phi - psi, no_hypothesis, rewrite);
    state("φG = G+φK", phi * G, G + phi * K, no_hypothesis, rewrite);
    state("ψG with J", psi * G, G + psi * K * J * D.inv(), no_hypothesis, rewrite, extended);
    state("ψ⁻¹ = φ⁻¹+KH", psi.inv(), phi.inv() + K * H);
    state("ψ⁻¹φ = I+KHφ", psi.inv() * phi, I + K * H * phi);
    state("φψ⁻¹ = I+φKH", phi * psi.inv(), I + phi * K * H);
    state("φ⁻¹ψ = I-KHψ", phi.inv() * psi, I - K * H * psi);
    state("ψφ⁻¹ = I-ψKH", psi * phi.inv(), I - psi * K * H);
    state("I+KHφ inverted", I + K * H * phi, I - K * H * psi, no_hypothesis, inverse);
    state("I+φKH inverted", I + phi * K * H, I - psi * K * H, no_hypothesis, inverse);
    state("[I-HψK]Hφ = Hψ", S * H * phi, H * psi);
    state("φK[I-HψK] = ψK", phi * K * S, psi * K);
    state("[I+HφK]Hψ = Hφ", A * H * psi, H * phi);
    state("ψK[I+HφK] = φK", psi * K * A, phi * K);
    state("innovations factor inverted", A, S, no_hypothesis, inverse);
    state("innovations factor by gains", A, H * phi * G, no_hinge_diagonal);
    state("HψG = I", H * psi * G, I, no_hinge_diagonal);
    state("det of the innovations factor is 1", logdet(A), number(0));
  }

  void mass_matrix() {
    group = "Mass matrix";
    state("ψMψ* decomposed by P", psi * M * psi.T(), P + psi_tilde * P + P * psi_tilde.T(), no_hinge_diagonal);
    state("ψMψ* decomposed, with J", psi * M * psi.T() + psi * K * J * K.T() * psi.T(), P + psi_tilde * P + P * psi_tilde.T(), no_hypothesis, check, extended);
    state("φMψ* decomposed by P", phi * M * psi.T(), P + phi_tilde * P + P * psi_tilde.T());
    state("innovations covariance", H * psi * M * psi.T() * H.T(), D, no_hinge_diagonal);
    state("innovations covariance with J", H * psi * M * psi.T() * H.T() + S * J * S.T(), D, no_hypothesis, check, extended);
    state("HφMψ*H* = [I+HφK]D", H * phi * M * psi.T() * H.T(), A * D, no_hinge_diagonal);
    state("innovations factorization", MM, A * D * A.T(), no_hinge_diagonal);
    state("innovations factorization with J", MM + J, A * D * A.T(), no_hypothesis, check, extended);
    state("mass matrix inverse", MM.inv(), S.T() * D.inv() * S, no_hinge_diagonal);
    state("inverse by the innovations factors", MM + J, S.T() * D.inv() * S, no_hypothesis, inverse, extended);
    state("ln det ℳ = Σ ln det D(k)", logdet(MM), logdet(D), no_hinge_diagonal);
    state("ln det (ℳ+J) = Σ ln det D(k)", logdet(MM + J), logdet(D), no_hypothesis, check, extended);
    const Expression W = square_root_of(D).inv() * H * psi * square_root_of(M);
    state("D^-½HψM^½ is a co-isometry", W * W.T(), I, no_hinge_diagonal, check, "soa.md #1");
    state("Newton-Euler to innovations is a QR", H * phi * square_root_of(M), A * square_root_of(D) * W, no_hypothesis, check, "soa.md #2");
    state("φ*H*ℳ⁻¹ by the factors", phi.T() * H.T() * (MM + J).inv(), psi.T() * H.T() * D.inv() * S, no_hypothesis, check, "soa.md #6");
    state("ℳ⁻¹HφMφ* by the factors", (MM + J).inv() * H * phi * M * phi.T(), K.T() * psi.T() + S.T() * D.inv() * H * psi * P, no_hypothesis, check, "soa.md #7");
  }

  void operational_space() {
    group = "Operational space";
    state("Ω is ψ*H*D⁻¹Hψ", Omega, psi.T() * H.T() * D.inv() * H * psi, no_hypothesis, rewrite);
    state("Ω by the mass matrix", Omega, phi.T() * H.T() * (MM + J).inv() * H * phi);
    state("diagonal blocks of Ω", block_diagonal(Omega), Upsilon);
    state("Lyapunov equation of Υ", Upsilon, block_diagonal(E_psi.T() * Upsilon * E_psi) + H.T() * D.inv() * H);
    state("Ω decomposed by Υ", Omega, Upsilon + psi_tilde.T() * Upsilon + Upsilon * psi_tilde, chain);
    state("Ω decomposed by Υ, blocks on one path", Omega, Upsilon + psi_tilde.T() * Upsilon + Upsilon * psi_tilde);
    list.back().on_one_path = true;
    shown("Ω(i,j) = [Υ + ψ̃*Υ + Υψ̃](i,j), i and j on one path to the base",
          "\\Omega(i,j) = [\\Upsilon + \\tilde\\psi^*\\Upsilon + \\Upsilon\\tilde\\psi]\\,(i,j),\\quad i\\text{ and }j\\text{ on one path to the base}");
    const Expression siblings = E_psi.T() * Upsilon * E_psi - block_diagonal(E_psi.T() * Upsilon * E_psi);
    state("Ω decomposed with siblings", Omega, Upsilon + psi_tilde.T() * Upsilon + Upsilon * psi_tilde + psi.T() * siblings * psi, no_hypothesis, check,
          "soa.md #28");
    shown("Ω = Υ + ψ̃*Υ + Υψ̃ + ψ*Sψ,  S = E_ψ*ΥE_ψ - blockdiag(E_ψ*ΥE_ψ)",
          "\\Omega = \\Upsilon + \\tilde\\psi^*\\Upsilon + \\Upsilon\\tilde\\psi + \\psi^*S\\psi,\\quad S = \\mathcal{E}_\\psi^*\\Upsilon \\mathcal{E}_\\psi - \\operatorname{blockdiag}(\\mathcal{E}_\\psi^*\\Upsilon \\mathcal{E}_\\psi)");
    state("Lyapunov equation with siblings", Upsilon - E_psi.T() * Upsilon * E_psi + siblings, H.T() * D.inv() * H, no_hypothesis, check, "soa.md #29");
    shown("Υ - E_ψ*ΥE_ψ + S = H*D⁻¹H,  S = E_ψ*ΥE_ψ - blockdiag(E_ψ*ΥE_ψ)",
          "\\Upsilon - \\mathcal{E}_\\psi^*\\Upsilon \\mathcal{E}_\\psi + S = H^*\\mathcal{D}^{-1}H,\\quad S = \\mathcal{E}_\\psi^*\\Upsilon \\mathcal{E}_\\psi - \\operatorname{blockdiag}(\\mathcal{E}_\\psi^*\\Upsilon \\mathcal{E}_\\psi)");
    state("ΩMΩ = Ω", Omega * M * Omega, Omega, no_hinge_diagonal, check, "soa.md #3");
    state("the bodies' shares add up to N", trace(Upsilon * M), number(source->structure().coordinates()), no_hinge_diagonal, check, "soa.md #4");
    state("(I-ΩM)φ* = ψ*-ΩP", (I - Omega * M) * phi.T(), psi.T() - Omega * P, no_hypothesis, check, "soa.md #5");
  }

  void perturbed_inertias() {
    // #57: an error of the inertias, however the masses are graded: ‖x'-x‖_ℳ <= max_k ‖M^-½ δM M^-½‖ ‖x'‖_ℳ, x = ℳ⁻¹T, x' = ℳ'⁻¹T.
    std::vector<std::vector<double>> spread;
    constexpr double largest = 0.125;
    for (int k = 0; k < source->structure().bodies(); ++k) {
      const int s = source->structure().size[k];
      spread.emplace_back(size_t(s) * s, 0.0);
      for (int i = 0; i < s; ++i) spread.back()[size_t(i) * s + i] = largest * ((k * s + i) % 5 - 2) / 2.0;
    }
    const Expression root = square_root_of(M), C = constant_blocks(std::move(spread), root.domain(), root.domain(), "C");
    const Expression MM_prime = H * phi * (M + root * C * root.T()) * phi.T() * H.T(), T = make_vector("T", source->theta());
    const Expression error = (MM_prime.inv() - MM.inv()) * T, moved = MM_prime.inv() * T;
    state("perturbed inertias, relative error in the ℳ norm", error.T() * MM * error, (largest * largest) * moved.T() * MM * moved, no_hypothesis, check, "soa.md #57");
    list.back().at_most = true;
    shown("tr[(L - ℳ⁻¹)*ℳ(L - ℳ⁻¹)] ≤ ‖C‖² tr[L*ℳL],  L = (Hφ(M + M^½CM^½*)φ*H*)⁻¹,  C : W → W",
          "\\operatorname{tr}[(L-\\mathcal{M}^{-1})^*\\mathcal{M}(L-\\mathcal{M}^{-1})] \\le \\Vert C\\Vert^2\\operatorname{tr}[L^*\\mathcal{M}L],\\quad L = (H\\phi(M+M^{1/2}C(M^{1/2})^*)\\phi^*H^*)^{-1},\\quad C : W \\to W");
  }

  void rerooting_and_aggregation() {
    group = "Re-rooting and aggregation";
    // Υ⁻¹ = P + S⁺: the articulated inertia of everything re-rooted at body k. The root's block of E*ΥE is empty; any regular one serves there.
    std::vector<std::vector<double>> at_root;
    for (int k = 0; k < source->structure().bodies(); ++k) {
      const int s = source->structure().size[k];
      at_root.emplace_back(size_t(s) * s, 0.0);
      for (int i = 0; i < s && source->structure().parent[k] < 0; ++i) at_root.back()[size_t(i) * s + i] = 1;
    }
    const Expression seen = block_diagonal(E.T() * Upsilon * E) + constant_blocks(std::move(at_root), source->forces(), source->motions(), "I_r");
    const Expression other = seen.inv() - P_plus;
    state("two-filter form", Upsilon.inv(), P + other - other * H.T() * (H * other * H.T()).inv() * H * other, free_root | equal_blocks | no_hinge_diagonal, check, "soa.md #58");
    shown("Υ⁻¹(k) = P(k) + S(k) - S(k)H*(k)(H(k)S(k)H*(k))⁻¹H(k)S(k),  S(k) = (φ*(℘(k),k)Υ(℘(k))φ(℘(k),k))⁻¹ - P⁺(k)",
          "\\Upsilon^{-1}(k) = P(k) + S(k) - S(k)H^*(k)(H(k)S(k)H^*(k))^{-1}H(k)S(k),\\quad S(k) = (\\phi^*(\\wp(k),k)\\Upsilon(\\wp(k))\\phi(\\wp(k),k))^{-1} - P^{+}(k)");
    const Letters grouped(std::make_shared<AggregatedTree>(source));
    state("bodies grouped in pairs: the same mass matrix", grouped.H * grouped.phi * grouped.M * grouped.phi.T() * grouped.H.T(), MM, no_hypothesis, check,
          "soa.md #64");
    shown("ℳ_2 = ℳ", "\\mathcal{M}_2 = \\mathcal{M}");
  }

  const Expression A = I + H * phi * K;  // the innovations factor
  const Expression S = I - H * psi * K;  // its inverse
  const Expression MM = H * phi * M * phi.T() * H.T();
  const std::string extended = "general J";
};

}  // namespace

std::vector<Theorem> sko_theorems(const std::shared_ptr<SkoSource>& source) {
  TreeTheorems all(source);
  all.spatial_operators();
  all.composite_inertia();
  all.articulated_inertia();
  all.resolvents();
  all.mass_matrix();
  all.operational_space();
  all.perturbed_inertias();
  all.rerooting_and_aggregation();
  return std::move(all.list);
}

}  // namespace pycraft
