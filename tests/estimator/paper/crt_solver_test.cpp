// The robust remainder theorem's mixed-integer program, [P] Eq. 16 to 18, given to a solver of such
// programs: Bonmin's branch and bound.

#include <gtest/gtest.h>

#include <BonBonminSetup.hpp>
#include <BonCbc.hpp>
#include <BonTMINLP.hpp>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "estimator/paper/crt.hpp"

namespace splid::paper {
namespace {

using Ipopt::Index;
using Ipopt::Number;

// Variables: tau in units of the largest modulus, then the turns n_k. Cost: sum of w_k (tau - n_k
// t_k - tau_k)^2.
class RemainderProgram final : public Bonmin::TMINLP {
 public:
  RemainderProgram(std::vector<Remainder> remainders, double limit_ns)
      : remainders_(std::move(remainders)), limit_ns_(limit_ns) {}

  double value_ns = 0;
  double cost = 0;

  bool get_variables_types(Index count, VariableType* types) override {
    types[0] = CONTINUOUS;
    std::fill(types + 1, types + count, INTEGER);
    return true;
  }
  bool get_variables_linearity(Index count, Ipopt::TNLP::LinearityType* types) override {
    std::fill(types, types + count, Ipopt::TNLP::NON_LINEAR);
    return true;
  }
  bool get_constraints_linearity(Index /*count*/, Ipopt::TNLP::LinearityType* /*types*/) override {
    return true;
  }
  bool get_nlp_info(Index& variables, Index& constraints, Index& jacobian, Index& hessian,
                    Ipopt::TNLP::IndexStyleEnum& style) override {
    variables = size();
    constraints = jacobian = 0;
    hessian = 2 * size() - 1;  // the diagonal, and tau with each n_k
    style = Ipopt::TNLP::C_STYLE;
    return true;
  }
  bool get_bounds_info(Index count, Number* low, Number* high, Index, Number*, Number*) override {
    low[0] = 0;
    high[0] = limit_ns_;
    for (Index k = 1; k < count; ++k) {
      low[k] = -1;
      high[k] = std::floor(limit_ns_ / at(k).modulus_ns) + 1;
    }
    return true;
  }
  bool get_starting_point(Index count, bool, Number* x, bool, Number*, Number*, Index, bool,
                          Number*) override {
    x[0] = limit_ns_ / 2;
    for (Index k = 1; k < count; ++k) x[k] = std::round(x[0] / at(k).modulus_ns);
    return true;
  }
  bool eval_f(Index count, const Number* x, bool, Number& f) override {
    f = 0;
    for (Index k = 1; k < count; ++k) f += at(k).weight * off(x, k) * off(x, k);
    return true;
  }
  bool eval_grad_f(Index count, const Number* x, bool, Number* gradient) override {
    gradient[0] = 0;
    for (Index k = 1; k < count; ++k) {
      const double by_tau = 2 * at(k).weight * off(x, k);
      gradient[0] += by_tau;
      gradient[k] = -by_tau * at(k).modulus_ns;
    }
    return true;
  }
  bool eval_g(Index, const Number*, bool, Index, Number*) override { return true; }
  bool eval_jac_g(Index, const Number*, bool, Index, Index, Index*, Index*, Number*) override {
    return true;
  }
  bool eval_h(Index count, const Number*, bool, Number factor, Index, const Number*, bool, Index,
              Index* row, Index* column, Number* values) override {
    for (Index k = 0; k < count; ++k) {
      const Index below = count + k - 1;  // (k, tau)
      if (values == nullptr) {
        row[k] = column[k] = k;
        if (k > 0) {
          row[below] = k;
          column[below] = 0;
        }
      } else if (k == 0) {
        values[0] = 0;
        for (Index j = 1; j < count; ++j) values[0] += 2 * factor * at(j).weight;
      } else {
        values[k] = 2 * factor * at(k).weight * at(k).modulus_ns * at(k).modulus_ns;
        values[below] = -2 * factor * at(k).weight * at(k).modulus_ns;
      }
    }
    return true;
  }
  void finalize_solution(SolverReturn, Index, const Number* x, Number f) override {
    if (x == nullptr) return;
    value_ns = x[0];
    cost = f;
  }
  [[nodiscard]] const SosInfo* sosConstraints() const override { return nullptr; }
  [[nodiscard]] const BranchingInfo* branchingInfo() const override { return nullptr; }

 private:
  [[nodiscard]] Index size() const { return static_cast<Index>(remainders_.size()) + 1; }
  [[nodiscard]] const Remainder& at(Index k) const {
    return remainders_[static_cast<std::size_t>(k) - 1];
  }
  [[nodiscard]] double off(const Number* x, Index k) const {
    return x[0] - x[k] * at(k).modulus_ns - at(k).value_ns;
  }

  std::vector<Remainder> remainders_;
  double limit_ns_;
};

TEST(CrtMixedInteger, AgreesWithASolverOfMixedIntegerPrograms) {
  std::mt19937_64 random(4);
  const std::vector<std::vector<double>> all_moduli_ns = {
      {180, 189}, {99.9, 104.1}, {99.937, 104.083}, {70.3, 81.1, 94.7}, {50.1, 61.7, 72.9, 83.3}};
  for (const std::vector<double>& moduli_ns : all_moduli_ns) {
    const double limit_ns = 2000;
    std::uniform_real_distribution<double> delay(0, limit_ns);
    std::normal_distribution<double> error(0, 0.05);
    std::vector<Remainder> remainders;
    const double truth_ns = delay(random);
    for (const double modulus : moduli_ns) {
      const double read = truth_ns + error(random);
      remainders.push_back({read - modulus * std::floor(read / modulus), modulus, 400});
    }
    const Ipopt::SmartPtr<RemainderProgram> program =
        new RemainderProgram(remainders, limit_ns);  // NOLINT: counted by Ipopt
    Bonmin::BonminSetup setup;
    setup.initializeOptionsAndJournalist();
    setup.readOptionsString(
        "bonmin.algorithm B-BB\nbonmin.allowable_gap 0\nbonmin.allowable_fraction_gap 0\n"
        "bonmin.bb_log_level 0\nbonmin.nlp_log_level 0\nbonmin.integer_tolerance 1e-9\n");
    setup.initialize(Ipopt::GetRawPtr(program));
    Bonmin::Bab branch_and_bound;
    branch_and_bound(setup);

    const CrtSolution swept = crt_mixed_integer(remainders, limit_ns);
    ASSERT_TRUE(swept.found);
    EXPECT_NEAR(swept.value_ns, program->value_ns, 1e-4) << moduli_ns.front();
    EXPECT_NEAR(swept.cost, program->cost, 1e-4 * (1 + swept.cost)) << moduli_ns.front();
  }
}

}  // namespace
}  // namespace splid::paper
