#include "estimator/checks/map_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/likelihood/maximizer.hpp"
#include "estimator/model/units.hpp"

namespace splid::checks {
namespace {

constexpr std::size_t most_paired_pulses = 512;  // whose differences are a quarter of a million
constexpr int most_steps = 8;
constexpr double most_log_step = 0.7;  // of a step of scoring: of a logarithm, a share, or a width
constexpr double uneven_background = 62;  // chi squared of 31 degrees: chance in one of a thousand
constexpr double same_widths = 0.01;      // differences between pulses that are this close are one

constexpr std::size_t index(Shape shape) { return static_cast<std::size_t>(shape); }

}  // namespace

// Each function is u times the one before it, made orthogonal to all before. That is done twice:
// once leaves what rounding makes of it.
MapBasis::MapBasis() {
  Eigen::Map<Eigen::MatrixXd> all(values_.data(), map_parts, map_parts);
  const Eigen::VectorXd u =
      Eigen::VectorXd::LinSpaced(map_parts, 1.0 / map_parts - 1, 1 - 1.0 / map_parts);
  all.col(0).setOnes();
  for (Eigen::Index k = 0; k < all.cols(); ++k) {
    auto mine = all.col(k);
    if (k > 0) mine = u.cwiseProduct(all.col(k - 1));
    const auto before = all.leftCols(k);
    for (int twice = 0; twice < 2; ++twice) {
      mine -= before.lazyProduct(before.transpose().lazyProduct(mine).eval()).eval();
    }
    mine.normalize();
  }
  for (std::size_t k = 0; k < map_parts; ++k) {
    all.col(static_cast<Eigen::Index>(k)) *= std::sqrt(mean_square(k) * map_parts);
  }
}

const MapBasis& map_basis() {
  static const MapBasis basis;
  return basis;
}

MapFit::MapFit(const ResidualMap& map, const PulseTrain& train, const PulseTable& pulse)
    : map_(map), train_(train), pulse_(pulse), others_(map_parts * most_cells) {
  const double width_ns = pulse.width_ns(), from_ns = flat_from_widths * width_ns;
  double flat = 0;
  for (std::size_t i = 0; i < map.cells(); ++i) {
    const double mid_ns = map.edge_ns(i) + map.cell_ns(i) / 2 - pulse.peak_ns();
    early_[i] = mid_ns < -from_ns ? map.cell_ns(i) : 0;
    late_[i] = mid_ns > from_ns ? map.cell_ns(i) : 0;
    flat += late_[i];
  }
  for (auto* cells : {&early_, &late_}) {
    for (double& share : *cells) share = flat > 0 ? share / (flat * map_parts) : 0;
  }
  const Comb& comb = train.segments.front().comb;
  if (!train.single() || comb.times_ns.size() > most_paired_pulses) return;
  std::vector<std::pair<double, double>> pairs;
  for (const double to : comb.times_ns) {
    for (std::size_t q = 0; q < comb.times_ns.size(); ++q) {
      const double apart = comb.times_ns[q] - to;
      pairs.emplace_back(apart < 0 ? apart + comb.period_ns : apart,
                         comb.amplitudes[q] / comb.total_amplitude);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  for (const auto& [apart_ns, light] : pairs) {
    if (differences_.empty() || apart_ns - differences_.back().ns > same_widths * width_ns) {
      differences_.push_back({apart_ns, 0});
    }
    differences_.back().light += light;
  }
}

void MapFit::begin(const FoldedFrame& frame, const likelihood::Model& model, std::size_t target,
                   const SeenLight& seen_light) {
  seen_parts_ = seen_light.of_part;
  seen_cells_ = seen_light.of_cell;
  log_width_ = model.log_width;
  is_placed_ = false;
  dark_parts_.fill(1);
  const auto& parts = seen_light.of_part;
  is_even_ = std::all_of(parts.begin(), parts.end(), [](double seen) { return seen == 1; });
  const double seen_ns = frame.seen_ns / frame.scale;  // in the pattern's clock
  signal_ = model.targets.at(target).signal_per_pulse * train_.amplitude_per_ns * seen_ns;
  // Half a photon of background, where the fit has none.
  const double per_ns = std::max(model.background_per_ns, 0.5 / frame.seen_ns) * frame.scale;
  dark_ = per_ns * train_.pulses_per_ns * seen_ns / map_parts;
  dark_elsewhere_ = seen_light.elsewhere * per_ns * seen_ns *
                    std::max(1e-6, 1 - train_.pulses_per_ns * 2 * map_.reach_ns());
  has_others_ = model.count > 1;
  others_elsewhere_ = 0;
  if (has_others_) add_others(frame, model, target);
}

void MapFit::see_background(const FoldedFrame& frame) {
  SeenParts counts{};
  for (const double time_ns : frame.time_ns) {
    const double part = (time_ns / frame.length_ns + 0.5) * map_parts;
    counts[static_cast<std::size_t>(std::clamp(part, 0.0, map_parts - 1.0))] += 1;
  }
  double all = 0, squares = 0;
  for (std::size_t j = 0; j < map_parts; ++j) {
    for (const double near : map_.part(j)) counts[j] -= near;
    all += counts[j];
  }
  if (!(all > 0)) return;
  SeenParts expected{};
  for (std::size_t j = 0; j < map_parts; ++j) {
    expected[j] = all / map_parts * seen_parts_[j];
    squares += std::pow(counts[j] - expected[j], 2) / std::max(expected[j], 1.0);
  }
  if (squares < uneven_background) return;
  // A part with few photons is taken towards the mean.
  constexpr double few = 4;
  for (std::size_t j = 0; j < map_parts; ++j) {
    dark_parts_[j] = (counts[j] + few) / (expected[j] + few);
  }
  is_placed_ = false;
}

// The light of other targets, some of whose pulses meet others of this target's.
//
// Design note: where they move alike, their light is alike in all parts, and one part is made for
// all. Light of less than half a photon is left out. What they have outside of the map is what was
// counted there beside the background: how much of it a dead time hides need not be known.
void MapFit::add_others(const FoldedFrame& frame, const likelihood::Model& model,
                        std::size_t target) {
  constexpr double alike_widths = 0.5, least_photons = 0.5;
  std::fill(others_.begin(), others_.end(), 0.0);
  const DelayTrack& own = model.targets.at(target).track;
  const double alike_ns = alike_widths * pulse_.width_ns();
  are_others_alike_ = true;
  for (std::size_t l = 0; l < model.count; ++l) {
    const DelayTrack& other = model.targets.at(l).track;
    are_others_alike_ &= std::abs(other.walk_ns - own.walk_ns) < alike_ns &&
                         std::abs(other.quadratic_ns - own.quadratic_ns) < alike_ns;
  }
  const std::size_t parts = are_others_alike_ ? 1 : map_parts;
  const double seen_ns = frame.seen_ns / frame.scale;
  for (std::size_t l = 0; l < model.count; ++l) {
    if (l == target) continue;
    const likelihood::Target& other = model.targets.at(l);
    const double light = other.signal_per_pulse * train_.amplitude_per_ns * seen_ns / map_parts;
    for (std::size_t j = 0; j < parts; ++j) {
      const double share = are_others_alike_ ? 0 : (static_cast<double>(j) + 0.5) / map_parts - 0.5;
      add_other(light, other.track.at(share) - own.at(share), j);
    }
  }
  double photons = 0;
  for (const double light : others_) photons += light;
  if (are_others_alike_) photons *= map_parts;
  has_others_ = photons > least_photons;
  others_elsewhere_ = std::max(0.0, map_.elsewhere() - dark_elsewhere_);
}

void MapFit::add_other(double light, double apart_ns, std::size_t part) {
  if (differences_.empty()) {
    const double flat = light * train_.pulses_per_ns;
    for (std::size_t i = 0; i < map_.cells(); ++i) {
      others_[part * most_cells + i] += flat * map_.cell_ns(i);
    }
    return add_pulse(part, light, std::remainder(apart_ns, train_.circle_ns));
  }
  const double period_ns = train_.segments.front().comb.period_ns;
  const double reach_ns = map_.reach_ns() + 10 * pulse_.width_ns() * std::exp(log_width_);
  const double first_ns = fold_on(-reach_ns - apart_ns, period_ns);
  auto k = std::lower_bound(differences_.begin(), differences_.end(), first_ns,
                            [](const Difference& of, double ns) { return of.ns < ns; });
  for (std::size_t n = 0; n < differences_.size(); ++n, ++k) {
    if (k == differences_.end()) k = differences_.begin();
    const double on_ns = k->ns < first_ns ? k->ns + period_ns : k->ns;
    if (on_ns > first_ns + 2 * reach_ns) break;
    add_pulse(part, light * k->light, on_ns - first_ns - reach_ns);
  }
}

void MapFit::add_pulse(std::size_t part, double light, double at_ns) {
  const double per_width = std::exp(-log_width_);
  double before = pulse_.at((map_.edge_ns(0) - at_ns) * per_width).light;
  for (std::size_t i = 0; i < map_.cells(); ++i) {
    const double after = pulse_.at((map_.edge_ns(i + 1) - at_ns) * per_width).light;
    others_[part * most_cells + i] += light * (after - before);
    before = after;
  }
}

double MapFit::sum(const Member& member, Shape shape, std::size_t part) const {
  const auto& amount = member.amount[index(shape)];
  double all = 0;
  for (std::size_t k = 0; k < map_parts; ++k) {
    if (amount[k] != 0) all += amount[k] * basis_.at(k, part);
  }
  return all;
}

// For a part of which everything was seen.
void MapFit::shape_part(const Member& member, std::size_t part) {
  const Place now = {sum(member, Shape::path, part),  sum(member, Shape::width, part),
                     sum(member, Shape::tail, part),  sum(member, Shape::light, part),
                     sum(member, Shape::early, part), sum(member, Shape::late, part),
                     sum(member, Shape::dark, part),  dark_parts_[part]};
  const bool is_alike = !has_others_ || are_others_alike_;
  if (is_placed_ && now == placed_ && is_alike) return;
  placed_ = now, is_placed_ = true;
  const double per_width = std::exp(-log_width_ - now.log_width);
  const double light = signal_ / map_parts * std::exp(now.log_light);
  const double dark_per_ns = dark_ * now.dark * std::exp(now.log_dark);
  double offset = (map_.edge_ns(0) - now.path_ns) * per_width;
  PulseTable::Values before = pulse_.at(offset);
  double density_before = pulse_.density_with(before, now.tail);
  double wide_before = offset * density_before;
  for (std::size_t i = 0; i < map_.cells(); ++i) {
    offset = (map_.edge_ns(i + 1) - now.path_ns) * per_width;
    const PulseTable::Values after = pulse_.at(offset);
    const double density = pulse_.density_with(after, now.tail);
    const double wide = offset * density;
    const double see = seen_cells_[i], dark = dark_per_ns * map_.cell_ns(i);
    const double pulse = after.light - before.light, late = after.tail - before.tail;
    const double came = light * see * (pulse + now.tail * (late - pulse));
    slope_[i][index(Shape::path)] = -light * see * per_width * (density - density_before);
    slope_[i][index(Shape::width)] = -light * see * (wide - wide_before);
    slope_[i][index(Shape::tail)] = light * see * (late - pulse);
    slope_[i][index(Shape::light)] = came;
    slope_[i][index(Shape::dark)] = dark * see;
    slope_[i][index(Shape::early)] = early_[i] * see;
    slope_[i][index(Shape::late)] = late_[i] * see;
    narrowing_[i] = -light * see * per_width * per_width * (after.slope - before.slope) / 2;
    expected_[i] = came + see * (dark + early_[i] * now.early + late_[i] * now.late) +
                   (has_others_ ? others_at(part, i) * see : 0);
    before = after, density_before = density, wide_before = wide;
  }
  find_gram();
}

// Design note: the shapes are the inner loops, which makes them sums over vectors; a sum over the
// cells waits for each addition before the next one.
void MapFit::find_gram() {
  whole_.fill(0);
  for (auto& row : gram_) row.fill(0);
  for (std::size_t i = 0; i < map_.cells(); ++i) {
    const double inverse = 1 / expected_[i];
    for (std::size_t a = 0; a < lanes; ++a) {
      relative_[i][a] = slope_[i][a] * inverse;
      whole_[a] += slope_[i][a];
    }
    for (std::size_t a = 0; a < shapes; ++a) {
      const double by = relative_[i][a];
      for (std::size_t b = 0; b < lanes; ++b) gram_[a][b] += by * slope_[i][b];
    }
  }
}

void MapFit::expect(const Member& member, std::size_t part, std::span<double> photons) {
  shape_part(member, part);
  for (std::size_t i = 0; i < map_.cells(); ++i) {
    photons[i] = seen_parts_[part] * expected_[i];
  }
}

double MapFit::expected_elsewhere(const Member& member) const {
  return dark_elsewhere_ * std::exp(member.of({Shape::dark, 0})) + others_elsewhere_;
}

double MapFit::value_of_part(std::size_t part) const {
  const std::span<const double> counts = map_.part(part);
  const double seen = seen_parts_[part];
  double value = 0;
  for (std::size_t i = 0; i < map_.cells(); ++i) {
    if (!(expected_[i] > 0)) return -std::numeric_limits<double>::infinity();
    value -= seen * expected_[i];
    if (counts[i] > 0) value += counts[i] * std::log(expected_[i]);
  }
  return value;
}

void MapFit::slopes(const Member& member, std::span<const Term> terms, Slopes& into) {
  const auto size = static_cast<Eigen::Index>(terms.size());
  into.value = 0;
  into.gradient.setZero(size);
  into.information.setZero(size, size);
  for (std::size_t j = 0; j < map_parts; ++j) {
    shape_part(member, j);
    into.value += value_of_part(j);
    add_gradient(terms, j, 0, into);
    add_information(terms, j, into);
  }
  add_elsewhere(member, terms, into);
  into.information.triangularView<Eigen::StrictlyUpper>() = into.information.transpose();
}

// The pulse is alike in all parts, and so are the products of the shapes.
void MapFit::scores(std::span<const Term> terms, std::span<const double> narrowed_ns2,
                    Slopes& into) {
  const auto size = static_cast<Eigen::Index>(terms.size());
  into.gradient.setZero(size);
  into.information.setZero(size, size);
  const Member none;
  const bool is_alike = is_even_ && (!has_others_ || are_others_alike_);
  for (std::size_t j = 0; j < map_parts; ++j) {
    shape_part(none, j);
    add_gradient(terms, j, narrowed_ns2[j], into);
    if (!is_alike) add_information(terms, j, into);
  }
  for (std::size_t t = 0; t < terms.size() && is_alike; ++t) {
    for (std::size_t v = 0; v <= t; ++v) {
      if (terms[t].order != terms[v].order) continue;
      into.information(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(v)) =
          gram_[index(terms[t].shape)][index(terms[v].shape)] * map_parts *
          MapBasis::mean_square(terms[t].order);
    }
  }
  add_elsewhere(none, terms, into);
  into.information.triangularView<Eigen::StrictlyUpper>() = into.information.transpose();
}

void MapFit::add_gradient(std::span<const Term> terms, std::size_t part, double narrowed_ns2,
                          Slopes& into) const {
  const double seen = seen_parts_[part];
  const std::span<const double> counts = map_.part(part);
  Lanes gradient{};
  for (std::size_t i = 0; i < map_.cells(); ++i) {
    const double count = counts[i] - seen * narrowed_ns2 * narrowing_[i];
    for (std::size_t a = 0; a < lanes; ++a) gradient[a] += count * relative_[i][a];
  }
  for (std::size_t a = 0; a < shapes; ++a) gradient[a] -= seen * whole_[a];
  for (std::size_t t = 0; t < terms.size(); ++t) {
    into.gradient[static_cast<Eigen::Index>(t)] +=
        gradient[index(terms[t].shape)] * basis_.at(terms[t].order, part);
  }
}

void MapFit::add_information(std::span<const Term> terms, std::size_t part, Slopes& into) const {
  for (std::size_t t = 0; t < terms.size(); ++t) {
    const double by = seen_parts_[part] * basis_.at(terms[t].order, part);
    const auto& gram = gram_[index(terms[t].shape)];
    for (std::size_t v = 0; v <= t; ++v) {
      into.information(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(v)) +=
          by * basis_.at(terms[v].order, part) * gram[index(terms[v].shape)];
    }
  }
}

void MapFit::add_elsewhere(const Member& member, std::span<const Term> terms, Slopes& into) const {
  const double expected = expected_elsewhere(member);
  const double dark = expected - others_elsewhere_, share = dark / expected;
  into.value += map_.elsewhere() * std::log(expected) - expected;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (terms[t].shape != Shape::dark || terms[t].order != 0) continue;
    const auto row = static_cast<Eigen::Index>(t);
    into.gradient[row] += map_.elsewhere() * share - dark;
    into.information(row, row) += dark * share;
  }
}

double MapFit::limit_of(Shape shape) const {
  if (shape == Shape::path) return most_log_step * pulse_.width_ns() * std::exp(log_width_);
  // The likelihood is concave in flat light.
  const bool is_flat = shape == Shape::early || shape == Shape::late;
  return is_flat ? std::numeric_limits<double>::infinity() : most_log_step;
}

double MapFit::maximize(Member& member, std::span<const Term> terms, Slopes& at) {
  slopes(member, terms, at);
  for (int n = 0; n < most_steps; ++n) {
    const Eigen::LLT<TermMatrix> cholesky(at.information);
    if (cholesky.info() != Eigen::Success) return at.value;
    TermVector step = cholesky.solve(at.gradient);
    if (!(at.gradient.dot(step) > likelihood::Maximizer::compared_nats)) return at.value;
    for (std::size_t t = 0; t < terms.size(); ++t) {
      const double most = limit_of(terms[t].shape);
      double& of_term = step[static_cast<Eigen::Index>(t)];
      of_term = std::clamp(of_term, -most, most);
    }
    const Member from = member;
    const double value = at.value;
    for (int halved = 0;; ++halved) {
      for (std::size_t t = 0; t < terms.size(); ++t) {
        member.of(terms[t]) = from.of(terms[t]) + step[static_cast<Eigen::Index>(t)];
      }
      slopes(member, terms, at);
      if (at.value > value) break;
      if (halved == 5) {
        member = from;
        slopes(member, terms, at);
        return at.value;
      }
      step /= 2;
    }
  }
  return at.value;
}

MapFit::PathSquares MapFit::path_squares(const Member& member, std::size_t part) {
  shape_part(member, part);
  const std::span<const double> counts = map_.part(part);
  constexpr std::size_t path = index(Shape::path);
  double seen = 0;
  for (std::size_t i = 0; i < map_.cells(); ++i) {
    seen += counts[i] * relative_[i][path] * relative_[i][path];
  }
  return {seen, seen_parts_[part] * gram_[path][path]};
}

MapFit::Moments MapFit::moments(Shape shape) const {
  double second = 0, third = 0, fourth = 0;
  for (std::size_t i = 0; i < map_.cells(); ++i) {
    const double q = relative_[i][index(shape)], mq2 = expected_[i] * q * q;
    second += mq2, third += mq2 * q, fourth += mq2 * q * q;
  }
  if (!(second > 0)) return {};
  return {third * third / (second * second * second), fourth / (second * second)};
}

}  // namespace splid::checks
