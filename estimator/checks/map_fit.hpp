#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "estimator/checks/finding.hpp"
#include "estimator/checks/pulse_table.hpp"
#include "estimator/checks/residual_map.hpp"
#include "estimator/checks/seen_light.hpp"

namespace splid::checks {

// Legendre's polynomials of the time over a frame, of all orders that its parts tell apart:
// orthogonal where all parts are seen alike, with the mean square 1 / (2 order + 1) of P_order.
class MapBasis {
 public:
  MapBasis();
  [[nodiscard]] double at(std::size_t order, std::size_t part) const {
    return values_[order * map_parts + part];
  }
  [[nodiscard]] std::span<const double> of(std::size_t order) const {  // by part
    return std::span(values_).subspan(order * map_parts, map_parts);
  }
  [[nodiscard]] static double mean_square(std::size_t order) {
    return 1 / (2.0 * static_cast<double>(order) + 1);
  }

 private:
  std::array<double, map_parts * map_parts> values_{};
};
const MapBasis& map_basis();  // made once

struct Term {
  Shape shape;
  std::size_t order;
};
inline constexpr std::size_t most_terms = 48;
// From so many widths on light beside a pulse is flat, and none of its own.
inline constexpr double flat_from_widths = 4;
using TermVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, most_terms, 1>;
using TermMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, most_terms, most_terms>;

// A member of the family that all findings are of: the fitted model with these amounts added, for
// each shape and order.
struct Member {
  std::array<std::array<double, map_parts>, shapes> amount{};
  [[nodiscard]] double& of(Term term) {
    return amount[static_cast<std::size_t>(term.shape)][term.order];
  }
  [[nodiscard]] double of(Term term) const {
    return amount[static_cast<std::size_t>(term.shape)][term.order];
  }
};

// The photons that a residual map is expected to have under a fitted model and under the members of
// its family, with the slopes of the log-likelihood of a map (counts of Poisson in each cell and
// elsewhere) in any of their terms.
class MapFit {
 public:
  MapFit(const ResidualMap& map, const PulseTrain& train, const PulseTable& pulse);
  // The fitted model, about whose track `target` the map was filled.
  void begin(const FoldedFrame& frame, const likelihood::Model& model, std::size_t target,
             const SeenLight& seen_light);
  // Background that varies over the frame, as the photons outside of the map show it, is no fading
  // of the target: from here on it is expected as they show it.
  void see_background(const FoldedFrame& frame);
  // The expected photons of one part of the frame, by cell.
  void expect(const Member& member, std::size_t part, std::span<double> photons);
  [[nodiscard]] double expected_elsewhere(const Member& member) const;
  [[nodiscard]] double signal() const { return signal_; }     // photons of the frame
  [[nodiscard]] double dark_per_ns() const { return dark_; }  // of a part
  // A member's amount of a shape in a part, by all orders.
  [[nodiscard]] double sum(const Member& member, Shape shape, std::size_t part) const;

  struct Slopes {
    double value = 0;  // of the log-likelihood, less what does not depend on the member
    TermVector gradient;
    TermMatrix information;  // expected
  };
  void slopes(const Member& member, std::span<const Term> terms, Slopes& into);
  // The same without the value, at the fitted model itself. narrowed_ns2: for each part the
  // variance of the fitted track, by which the light about it is narrower than the pulse; the
  // gradient is corrected for it, to first order.
  void scores(std::span<const Term> terms, std::span<const double> narrowed_ns2, Slopes& into);
  // Scores by Fisher from `member` to the maximum in the terms. Returns the value there. at:
  // scratch.
  double maximize(Member& member, std::span<const Term> terms, Slopes& at);
  // Of the part that was looked at last, with q = d log m / d shape and s(k) = sum of m q^k over
  // its cells: s(3)^2 / s(2)^3 and s(4) / s(2)^2.
  struct Moments {
    double third = 0, fourth = 0;
  };
  [[nodiscard]] Moments moments(Shape shape) const;
  // Sums over a part's photons, and over those expected, of the squared slope of log m in the path.
  struct PathSquares {
    double seen = 0, expected = 0;
  };
  [[nodiscard]] PathSquares path_squares(const Member& member, std::size_t part);

 private:
  static constexpr std::size_t lanes = 8;  // the shapes, in whole vectors
  using Lanes = std::array<double, lanes>;
  struct Place {  // sums of a member's amounts in a part
    double path_ns = 0, log_width = 0, tail = 0, log_light = 0, early = 0, late = 0, log_dark = 0,
           dark = 1;
    bool operator==(const Place&) const = default;
  };
  struct Difference {  // between pulses of the train
    double ns, light;
  };
  void shape_part(const Member& member, std::size_t part);
  void find_gram();
  void add_others(const FoldedFrame& frame, const likelihood::Model& model, std::size_t target);
  void add_other(double light, double apart_ns, std::size_t part);
  [[nodiscard]] double others_at(std::size_t part, std::size_t cell) const {
    return others_[(are_others_alike_ ? 0 : part) * most_cells + cell];
  }
  void add_pulse(std::size_t part, double light, double at_ns);
  void add_gradient(std::span<const Term> terms, std::size_t part, double narrowed_ns2,
                    Slopes& into) const;
  void add_information(std::span<const Term> terms, std::size_t part, Slopes& into) const;
  void add_elsewhere(const Member& member, std::span<const Term> terms, Slopes& into) const;
  [[nodiscard]] double value_of_part(std::size_t part) const;
  [[nodiscard]] double limit_of(Shape shape) const;

  const ResidualMap& map_;
  const PulseTrain& train_;
  const PulseTable& pulse_;
  const MapBasis& basis_ = map_basis();
  SeenParts seen_parts_{};
  std::array<double, most_cells> seen_cells_{};
  SeenParts dark_parts_{};  // the background of each part over its mean
  double signal_ = 0, dark_ = 0, log_width_ = 0;
  double dark_elsewhere_ = 0, others_elsewhere_ = 0;  // photons outside of the map
  bool has_others_ = false, are_others_alike_ = true, is_even_ = true;
  std::vector<double> others_;  // photons of other targets, by part and cell
  std::vector<Difference> differences_;
  // Of the part that was looked at last: slopes of the expected photons in each shape, and of their
  // logarithms, by cell; with their sums and the sums of their products.
  std::array<Lanes, most_cells> slope_{}, relative_{};
  std::array<Lanes, shapes> gram_{};
  Lanes whole_{};
  std::array<double, most_cells> expected_{}, narrowing_{};
  std::array<double, most_cells> early_{}, late_{};  // shares of the flat light in each cell
  Place placed_;
  bool is_placed_ = false;
};

}  // namespace splid::checks
