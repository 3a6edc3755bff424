// Theorems that need mechanics: velocities and forces, innovations, Coriolis matrices, gravity, hybrid dynamics, the world frame, subgraphs, other roots.
// Those that need flexible bodies are listed as waiting; the calculus is in calculus_theorems.cpp, loops are in loop_theorems.cpp.
#include "operators/derived_operators.h"
#include "operators/directions.h"
#include "operators/rerooted_tree.h"

namespace pycraft {

using enum SymbolId;

namespace {

struct MechanicsTheorems : Statements {
  using enum Hypothesis;
  explicit MechanicsTheorems(const std::shared_ptr<MultibodyOperators>& of) : Statements(of), robot(of) {}

  Expression mechanics(SymbolId id) const { return mechanics_operator(id, robot); }
  void state(const std::string& name, Side lhs, Side rhs, Hypothesis hypotheses = no_hypothesis, const std::string& from = "Jain 2011") {
    list.push_back({name, group, std::move(lhs), std::move(rhs), hypotheses, from, Use::check});
  }
  void wait(const std::string& name, const std::string& what, const std::string& from) {
    list.push_back({name, group, number(0), number(0), no_hypothesis, from, Use::check});
    list.back().waiting = what;
  }

  void equations_of_motion() {
    group = "Equations of motion";
    state("velocities", V, phi.T() * H.T() * qd);
    state("Coriolis acceleration", a, mechanics(V_tilde) * H.T() * qd + mechanics(H_dot).T() * qd);
    state("gyroscopic force", b, mechanics(V_bar) * M * V);
    state("momentum_cross acts as V̄M", mechanics(momentum_cross) * V, mechanics(V_bar) * M * V);
    state("equations of motion", torque, (MM + J) * qdd + bias);
    shown("T = (ℳ+J) θ̈ + 𝒞", "T = (\\mathcal{M}+J)\\ddot\\theta + \\mathcal{C}");
    const Expression z = psi * (K * torque + P * a + b), epsilon = torque - H * z, nu = D.inv() * epsilon;
    state("forward dynamics", S.T() * nu - K.T() * psi.T() * a, qdd);
    shown("[I-HψK]* ν - K*ψ* a = θ̈,  ν = D⁻¹(T - b_J - Hz),  z = ψ(K(T - b_J) + Pa + b)",
          "[I-H\\psi\\mathcal{K}]^*\\nu - \\mathcal{K}^*\\psi^*\\mathfrak{a} = \\ddot\\theta,\\quad \\nu = \\mathcal{D}^{-1}(T-\\mathfrak{b}_J-Hz),\\quad z = \\psi(\\mathcal{K}(T-\\mathfrak{b}_J)+P\\mathfrak{a}+\\mathfrak{b})");
    state("accelerations by innovations", psi.T() * (H.T() * nu + a), alpha);
    shown("ψ*(H*ν + a) = φ*(H*θ̈ + a)", "\\psi^*(H^*\\nu+\\mathfrak{a}) = \\phi^*(H^*\\ddot\\theta+\\mathfrak{a})");
    state("interbody forces by innovations", P * (alpha - a) + z, f);
    shown("P(α - a) + z = φ(Mα + b)", "P(\\alpha-\\mathfrak{a})+z = \\phi(M\\alpha+\\mathfrak{b})");
    state("forces without hinge quantities", P_plus * E.T() * alpha + z + G * epsilon, f, no_hypothesis, "soa.md #13");
    shown("P⁺E*α + z + Gε = f", "P^{+}\\mathcal{E}^*\\alpha + z + \\mathcal{G}\\epsilon = f");
    state("accelerations by Ω", phi.T() * H.T() * (MM + J).inv() * torque + (I - Omega * M) * phi.T() * a - Omega * b, alpha, no_hypothesis, "soa.md #14");
    shown("φ*H*(ℳ+J)⁻¹(T - b_J) + (I-ΩM)φ*a - Ωb = α", "\\phi^*H^*(\\mathcal{M}+J)^{-1}(T-\\mathfrak{b}_J) + (I-\\Omega M)\\phi^*\\mathfrak{a} - \\Omega\\mathfrak{b} = \\alpha");
  }

  void innovations() {
    group = "Innovations";
    const Expression xi = A.T() * qd;
    state("innovations velocity", xi, G.T() * V, no_hinge_diagonal, "soa.md #8");
    state("kinetic energy", V.T() * M * V + qd.T() * J * qd, xi.T() * D * xi, no_hypothesis, "soa.md #9");
    shown("V*MV + θ̇*Jθ̇ = ξ*Dξ", "\\mathcal{V}^*M\\mathcal{V} + \\dot\\theta^*J\\dot\\theta = \\xi^*\\mathcal{D}\\xi");
    state("innovations form", T.T() * (MM + J).inv() * T, (S * T).T() * D.inv() * S * T, no_hypothesis, "soa.md #10");
    shown("T*(ℳ+J)⁻¹T = ε*D⁻¹ε,  ε = [I-HψK]T", "T^*(\\mathcal{M}+J)^{-1}T = \\epsilon^*\\mathcal{D}^{-1}\\epsilon,\\quad \\epsilon=[I-H\\psi\\mathcal{K}]T");
    state("composite momentum", H * phi * M * V, MM * qd, no_hypothesis, "soa.md #15");
    if (robot->traits().free_root || std::count(robot->structure().parent.begin(), robot->structure().parent.end(), -1) == 1) {
      std::vector<double> pick(size_t(6) * robot->structure().dimension(), 0.0);
      for (int i = 0; i < 6; ++i) pick[size_t(i) * robot->structure().dimension() + i] = 1;
      const Expression root = constant(std::move(pick), robot->forces(), Space::euclidean(6), "root");
      state("momentum matrix about the root", root * phi * R * H.T(), root * phi * M * phi.T() * H.T(), no_hypothesis, "soa.md #19");
      shown("[φRH*](r,k) = [φMφ*H*](r,k), r a root", "[\\phi\\mathcal{R}H^*]\\,(r,k) = [\\phi M\\phi^*H^*]\\,(r,k),\\quad r\\text{ a root}");
    }
  }

  void coriolis_matrices() {
    group = "Coriolis matrices";
    const Expression J_dot = phi.T() * (mechanics(Delta_theta_dot).T() * phi_tilde.T() * H.T() + mechanics(H_dot).T());
    const Expression jacobian = phi.T() * H.T();
    const Expression C_skew = H * phi * (M * J_dot + mechanics(momentum_cross) * jacobian);
    const Expression C_christoffel = H * phi * (M * J_dot + 0.5 * (mechanics(momentum_cross) + mechanics(V_bar) * M + M * mechanics(V_tilde)) * jacobian);
    const Expression half = (mechanics(H_dot) * phi + H * phi_tilde * mechanics(Delta_theta_dot) * phi) * M * phi.T() * H.T();
    const Expression rate = half + half.T();  // ℳ̇
    state("C θ̇ is the Coriolis force", C_skew * qd, bias);
    shown("Cθ̇ = Hφ(Mφ*a + b),  C = Hφ(M d(φ*H*)/dt + 𝓑φ*H*)",
          "C\\dot\\theta = H\\phi(M\\phi^*\\mathfrak{a}+\\mathfrak{b}),\\quad C = H\\phi(M\\tfrac{d}{dt}(\\phi^*H^*)+\\mathscr{B}\\phi^*H^*)");
    state("ℳ̇ - 2C is skew", rate - 2 * C_skew, -(rate - 2 * C_skew).T());
    shown("ℳ̇ - 2C = -(ℳ̇ - 2C)*,  C = Hφ(M d(φ*H*)/dt + 𝓑φ*H*)",
          "\\dot{\\mathcal{M}} - 2C = -(\\dot{\\mathcal{M}} - 2C)^*,\\quad C = H\\phi(M\\tfrac{d}{dt}(\\phi^*H^*)+\\mathscr{B}\\phi^*H^*)");
    state("the Christoffel-consistent C gives the same force", C_christoffel * qd, bias, no_hypothesis, "soa.md #20");
    shown("Cθ̇ = Hφ(Mφ*a + b),  C = Hφ(M d(φ*H*)/dt + ½(𝓑 + V̄M + MṼ)φ*H*)",
          "C\\dot\\theta = H\\phi(M\\phi^*\\mathfrak{a}+\\mathfrak{b}),\\quad C = H\\phi(M\\tfrac{d}{dt}(\\phi^*H^*)+\\tfrac12(\\mathscr{B}+\\bar{\\mathcal{V}}M+M\\tilde{\\mathcal{V}})\\phi^*H^*)");
    state("ℳ̇ - 2C is skew for the Christoffel-consistent C", rate - 2 * C_christoffel, -(rate - 2 * C_christoffel).T(), no_hypothesis, "soa.md #21");
    shown("ℳ̇ - 2C = -(ℳ̇ - 2C)*,  C = Hφ(M d(φ*H*)/dt + ½(𝓑 + V̄M + MṼ)φ*H*)",
          "\\dot{\\mathcal{M}} - 2C = -(\\dot{\\mathcal{M}} - 2C)^*,\\quad C = H\\phi(M\\tfrac{d}{dt}(\\phi^*H^*)+\\tfrac12(\\mathscr{B}+\\bar{\\mathcal{V}}M+M\\tilde{\\mathcal{V}})\\phi^*H^*)");
  }

  void gravity() {
    group = "Gravity";
    state("gravity as the base's acceleration", phi.T() * mechanics(gravity_base), -mechanics(gravity_field), no_hypothesis, "soa.md #55");
  }

  void world_frame() {
    group = "World frame";
    const auto world = std::make_shared<WorldFrame>(robot);
    const Letters w(world);
    const Expression X = mechanics(X_world);
    state("X E X⁻¹ is constant", X * E * X.inv(), w.E, no_hypothesis, "soa.md #51");
    shown("X E X⁻¹ = E_w", "X\\mathcal{E}_\\phi X^{-1} = \\mathcal{E}_w");
    state("P_w = XPX*", w.P, X * P * X.T(), no_hypothesis, "soa.md #52");
    shown("P_w = XPX*", "P_w = XPX^*");
    state("D_w = D", w.D, D, no_hypothesis, "soa.md #52");
    shown("D_w = D", "\\mathcal{D}_w = \\mathcal{D}");
    state("G_w = XG", w.G, X * G, no_hypothesis, "soa.md #52");
    shown("G_w = XG", "\\mathcal{G}_w = X\\mathcal{G}");
    state("ψ_w = XψX⁻¹", w.psi, X * psi * X.inv(), no_hypothesis, "soa.md #52");
    shown("ψ_w = XψX⁻¹", "\\psi_w = X\\psi X^{-1}");
  }

  void hybrid_dynamics() {
    group = "Hybrid dynamics (every third hinge prescribed)";
    const SkoStructure& tree = robot->structure();
    std::vector<char> free(tree.coordinates()), prescribed(tree.coordinates());
    for (int k = 0; k < tree.bodies(); ++k)
      for (int j = tree.dof_offset[k]; j < tree.dof_offset[k + 1]; ++j) {
        prescribed[j] = k % 3 == 1;
        free[j] = !prescribed[j];
      }
    const auto free_hinges = std::make_shared<SomeCoordinates>(robot, free), prescribed_hinges = std::make_shared<SomeCoordinates>(robot, prescribed);
    const Letters F(free_hinges), Q(prescribed_hinges);
    const Expression qdd_f = make_vector("vdot_f", free_hinges->theta()), qdd_p = make_vector("vdot_p", prescribed_hinges->theta());
    const Expression a_p = a + Q.H.T() * qdd_p, alpha_h = phi.T() * (F.H.T() * qdd_f + a_p), f_h = phi * (M * alpha_h + b);
    const Expression T_f = F.H * f_h + F.J * qdd_f, T_p = Q.H * f_h;
    const Expression S_f = I - F.H * F.psi * F.K;
    const Expression z_f = F.psi * (F.K * T_f + F.P * a_p + b), nu_f = F.D.inv() * (T_f - F.H * z_f);
    state("hybrid forward dynamics", S_f.T() * nu_f - F.K.T() * F.psi.T() * a_p, qdd_f, no_hypothesis, "soa.md #38");
    shown("[I-H_fψ_fK_f]*ν_f - K_f*ψ_f*a_f = θ̈_f,  a_f = a + H_p*θ̈_p", "[I-H_f\\psi_f\\mathcal{K}_f]^*\\nu_f - \\mathcal{K}_f^*\\psi_f^*\\mathfrak{a}_f = \\ddot\\theta_f,\\quad \\mathfrak{a}_f=\\mathfrak{a}+H_p^*\\ddot\\theta_p");
    state("prescribed hinges' forces", Q.H * (F.P * (F.psi.T() * (F.H.T() * nu_f + a_p) - a_p) + z_f), T_p, no_hypothesis, "soa.md #39");
    shown("T_p = H_p(P_f(β - a_f) + z_f),  β = ψ_f*(H_f*ν_f + a_f),  a_f = a + H_p*θ̈_p",
          "T_p = H_p(P_f(\\beta-\\mathfrak{a}_f)+z_f),\\quad \\beta=\\psi_f^*(H_f^*\\nu_f+\\mathfrak{a}_f),\\quad \\mathfrak{a}_f=\\mathfrak{a}+H_p^*\\ddot\\theta_p");
    const Expression MM_ff = F.H * phi * M * phi.T() * F.H.T(), MM_fp = F.H * phi * M * phi.T() * Q.H.T(), MM_pp = Q.H * phi * M * phi.T() * Q.H.T();
    const Expression Y = F.psi.T() - F.Omega * F.P;
    const Expression schur = MM_pp - MM_fp.T() * (MM_ff + F.J).inv() * MM_fp;
    state("Schur complement", schur, Q.H * Y.T() * M * Y * Q.H.T(), no_hinge_diagonal, "soa.md #40");
    shown("ℳ_pp - ℳ_pf(ℳ_ff)⁻¹ℳ_fp = H_pY*MYH_p*,  Y = ψ_f* - Ω_fP_f", "\\mathcal{M}_{pp}-\\mathcal{M}_{pf}\\mathcal{M}_{ff}^{-1}\\mathcal{M}_{fp} = H_pY^*MYH_p^*,\\quad Y=\\psi_f^*-\\Omega_fP_f");
    state("generalized Jacobian", phi.T() * Q.H.T() - phi.T() * F.H.T() * (MM_ff + F.J).inv() * MM_fp, Y * Q.H.T(), no_hypothesis, "soa.md #41");
    shown("𝒥_p - 𝒥_f(ℳ_ff+J_f)⁻¹ℳ_fp = (ψ_f* - Ω_fP_f)H_p*", "\\mathcal{J}_p-\\mathcal{J}_f(\\mathcal{M}_{ff}+J_f)^{-1}\\mathcal{M}_{fp} = (\\psi_f^*-\\Omega_fP_f)H_p^*");
    state("ℳ_ff⁻¹ℳ_fp by the factors", (MM_ff + F.J).inv() * MM_fp, (F.K.T() * F.psi.T() + S_f.T() * F.D.inv() * F.H * F.psi * F.P) * Q.H.T(), no_hypothesis,
          "soa.md #42");
    shown("(ℳ_ff+J_f)⁻¹ℳ_fp = (K_f*ψ_f* + [I-H_fψ_fK_f]*D_f⁻¹H_fψ_fP_f)H_p*", "(\\mathcal{M}_{ff}+J_f)^{-1}\\mathcal{M}_{fp} = (\\mathcal{K}_f^*\\psi_f^* + [I-H_f\\psi_f\\mathcal{K}_f]^*\\mathcal{D}_f^{-1}H_f\\psi_fP_f)H_p^*");
    state("determinants of the partition", logdet(MM), logdet(MM_ff) + logdet(MM_pp - MM_fp.T() * MM_ff.inv() * MM_fp), no_hypothesis, "soa.md #43");
    shown("ln det ℳ = ln det ℳ_ff + ln det(ℳ_pp - ℳ_pf(ℳ_ff)⁻¹ℳ_fp)", "\\ln\\det\\mathcal{M} = \\ln\\det\\mathcal{M}_{ff}+\\ln\\det(\\mathcal{M}_{pp}-\\mathcal{M}_{pf}\\mathcal{M}_{ff}^{-1}\\mathcal{M}_{fp})");
  }

  // Halfway on the way from the base to the last body the tree is cut: X = E - E_c is the one block that joins the two parts. What has X before
  // it is read at the cut body and outboard of it alone.
  void subgraphs() {
    group = "Subgraphs (all outboard of a body, and the rest: cut at its hinge)";
    std::vector<int> way;
    for (int k = robot->structure().bodies() - 1; k >= 0; k = robot->structure().parent[k]) way.push_back(k);
    if (way.empty()) return;
    const Letters C(std::make_shared<CutTree>(robot, way[(way.size() - 1) / 2]));
    const Expression X = E - C.E;
    state("the whole by its parts", C.phi + C.phi * X * phi, phi, no_hypothesis, "resolvents of E and E_c");
    shown("φ_c + φ_c(E - E_c)φ = φ", "\\phi_c + \\phi_c(\\mathcal{E}-\\mathcal{E}_c)\\phi = \\phi");
    state("φ of a subgraph is a block of φ", C.phi + C.phi * X * C.phi, phi, no_hypothesis, "a way leads over the cut once");
    shown("φ_c + φ_c(E - E_c)φ_c = φ", "\\phi_c + \\phi_c(\\mathcal{E}-\\mathcal{E}_c)\\phi_c = \\phi");
    state("ψ of the whole by its parts", C.psi + C.psi * (E_psi - C.E_psi) * psi, psi, no_hypothesis, "resolvents of E_ψ and E_ψc");
    shown("ψ_c + ψ_c(E_ψ - E_ψ_c)ψ = ψ", "\\psi_c + \\psi_c(\\mathcal{E}_\\psi-\\mathcal{E}_{\\psi_c})\\psi = \\psi");
    state("mass matrix of the whole by its parts", H * (I + C.phi * X) * C.phi * M * C.phi.T() * (I + X.T() * C.phi.T()) * H.T(), MM, no_hypothesis,
          "a way leads over the cut once");
    shown("H(I + φ_cX)φ_cMφ_c*(I + X*φ_c*)H* = ℳ,  X = E - E_c", "H(I+\\phi_cX)\\phi_cM\\phi_c^*(I+X^*\\phi_c^*)H^* = \\mathcal{M},\\quad X=\\mathcal{E}-\\mathcal{E}_c");
    state("composite inertia of all outboard of a body", X * C.R, X * R, no_hypothesis, "the recursion of R goes tip to base");
    shown("(E - E_c)R_c = (E - E_c)R", "(\\mathcal{E}-\\mathcal{E}_c)\\mathcal{R}_c = (\\mathcal{E}-\\mathcal{E}_c)\\mathcal{R}");
    state("articulated inertia of all outboard of a body", X * C.P, X * P, no_hypothesis, "the recursion of P goes tip to base");
    shown("(E - E_c)P_c = (E - E_c)P", "(\\mathcal{E}-\\mathcal{E}_c)\\mathcal{P}_c = (\\mathcal{E}-\\mathcal{E}_c)\\mathcal{P}");
  }

  // The last body is made the root: what of the two models is about the same bodies. Υ(k)⁻¹ has all bodies outboard of k as P(k) has them, and
  // all others through the hinges between; with k for root there are no others.
  void another_root() {
    group = "Another root (the last body first)";
    if (!robot->traits().free_root) return;
    const int last = robot->structure().bodies() - 1;
    const auto turned = std::make_shared<RerootedTree>(robot, last);
    const int first = static_cast<int>(std::find(turned->order().begin(), turned->order().end(), 0) - turned->order().begin());
    const Letters W(turned);
    const auto rows = [](const SkoSource& of, const Space& space, int body) {
      std::vector<double> pick(size_t(6) * of.structure().dimension(), 0.0);
      for (int i = 0; i < 6; ++i) pick[size_t(i) * of.structure().dimension() + of.structure().offset[body] + i] = 1;
      return constant(std::move(pick), space, Space::euclidean(6), of.structure().body_names[body]);
    };
    const Expression root = rows(*turned, turned->forces(), 0), here = rows(*robot, robot->motions(), last), old = rows(*robot, robot->motions(), 0);
    const Expression root_there = rows(*turned, turned->motions(), 0), old_there = rows(*turned, turned->motions(), first);
    state("articulated inertia with a body for root", root * W.P * root.T() * here * Upsilon * here.T(), I, free_root | no_hinge_diagonal, "soa.md #58");
    shown("P_n(k)Υ(k) = I, k the last body", "\\mathcal{P}_n(k)\\,\\Upsilon(k) = I,\\quad k\\text{ the last body}");
    state("compliance between two bodies knows no root", root_there * W.Omega * old_there.T(), here * Omega * old.T(), free_root | no_hinge_diagonal, "Ω = φ*H*ℳ⁻¹Hφ");
    shown("Ω_n(k,r) = Ω(k,r), k the last body, r a root", "\\Omega_n(k,r) = \\Omega(k,r),\\quad k\\text{ the last body},\\ r\\text{ a root}");
    state("ln det ℳ knows no root", logdet(W.H * W.phi * W.M * W.phi.T() * W.H.T()), logdet(MM), free_root | no_hinge_diagonal, "the map of velocities has determinant 1");
    shown("ln det ℳ_n = ln det ℳ", "\\ln\\det\\mathcal{M}_n = \\ln\\det\\mathcal{M}");
  }

  void waiting() {
    group = "Waiting";
    wait("modal blocks and their calculus", "flexible bodies", "soa.md, One algebra, three kinds of body");
  }

  const std::shared_ptr<MultibodyOperators> robot;
  const Expression S = I - H * psi * K, A = I + H * phi * K, MM = H * phi * M * phi.T() * H.T();
  const Expression qd = mechanics(theta_dot), V = mechanics(velocity), a = mechanics(coriolis_acceleration), b = mechanics(gyroscopic_force);
  const Expression qdd = make_vector("vdot", robot->theta()), T = make_vector("T", robot->theta());
  const Expression alpha = phi.T() * (H.T() * qdd + a), f = phi * (M * alpha + b), torque = H * f + J * qdd;
  const Expression bias = H * phi * (M * phi.T() * a + b);
};

}  // namespace

std::vector<Theorem> mechanics_theorems(const std::shared_ptr<MultibodyOperators>& source) {
  MechanicsTheorems all(source);
  all.equations_of_motion();
  all.innovations();
  all.coriolis_matrices();
  all.gravity();
  all.world_frame();
  all.hybrid_dynamics();
  all.subgraphs();
  all.another_root();
  for (Theorem& t : calculus_theorems(source)) all.list.push_back(std::move(t));
  all.waiting();
  return std::move(all.list);
}

}  // namespace pycraft
