#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "estimator/likelihood/exposure.hpp"
#include "estimator/likelihood/hidden_light.hpp"
#include "estimator/likelihood/likelihood_kernels.hpp"
#include "estimator/likelihood/model.hpp"
#include "estimator/likelihood/near_photons.hpp"
#include "estimator/likelihood/small_matrix.hpp"

namespace splid::likelihood {

// Value, gradient and Hessian of the log-likelihood, in nats, by the parameters in their places
// (model.hpp). Units: ns for the terms of tracks, counts per pulse, the logarithm of the width,
// counts per ns. What belongs to held parameters is 0.
struct Point {
  double value = 0;
  SmallVector gradient;
  SmallMatrix hessian;
};

// What the model of a frame may hold.
struct Scope {
  std::size_t targets = 1;   // at most
  double most_width = 1;     // how many times as wide as configured the pulse may become
  bool may_be_dead = false;  // whether frames may come with their dead time
};

// The log-likelihood of a frame's photons under a model (model.hpp), with its exact first and
// second derivatives. A photon near no track adds log b, so b must be above 0 where there are such
// photons.
//
// Design note: how the target's velocity stretches the pattern is in the value, and not in the
// derivatives of a photon's place: it is 2e-8 of what the walk moves it at the frame's end.
class LogLikelihood {
 public:
  LogLikelihood(const PulseShape& shape, const PulseTrain& train, std::size_t max_photons,
                const Scope& scope);

  // A frame comes, which outlives the calls up to the next begin().
  void begin(const FoldedFrame& frame);
  // Collects the photons near the model's tracks; evaluate() may be called where they serve.
  void collect(const Model& about, std::size_t gather_from);
  [[nodiscard]] bool serves(const Model& at) const { return near_.serves(at); }
  // The log-likelihood at some parameters, and its derivatives by the free ones. at: as many
  // targets as were collected, near the same tracks.
  void evaluate(const Model& at, const FreeSet& free, Point& point);

  [[nodiscard]] const Exposure& exposure() const { return exposure_; }
  // The log-likelihood of the frame without a target: S = 0, b = N / t.
  [[nodiscard]] double no_target_nats() const;
  [[nodiscard]] const NearPhotons& near() const { return near_; }
  [[nodiscard]] const PulseShape& shape() const { return shape_; }
  [[nodiscard]] const PulseTrain& train() const { return train_; }
  [[nodiscard]] std::size_t photons() const { return frame_->size(); }

 private:
  // So many photons are summed up together, so that the sums are over vectors in the nearest cache.
  static constexpr std::size_t batch = 128;
  using Column = std::array<double, batch>;
  // The light of a target at a batch of photons, and its derivatives by the offset and by the
  // logarithm of the width.
  struct Light {
    Column h, d1, d2, dw, dw1, dww;
    LikelihoodKernels::Light itself() { return {h.data(), d1.data(), d2.data()}; }
    LikelihoodKernels::Light by_width() { return {dw.data(), dw1.data(), dww.data()}; }
  };
  struct Batch {
    const NearPhotons::Group& group;
    std::size_t first, count;  // photons, from the group's first on
    [[nodiscard]] std::size_t first_photon() const { return group.first + first; }
  };
  // What is free, in short.
  struct Wanted {
    std::size_t terms = 1;  // of tracks, the most that any target has
    bool width = false;
  };
  // The first derivatives of log lambda of a batch of photons, times the roots of their weights: a
  // column for each parameter, with its place.
  struct Columns {
    std::array<Column, most_parameters> values;
    std::array<std::size_t, most_parameters> place;
    std::size_t count = 0;
    double* next() { return values[count].data(); }
    double* add(std::size_t at) {
      place[count] = at;
      return values[count++].data();
    }
  };
  static constexpr std::size_t most_powers = 6;

  void load(const Model& at);
  [[nodiscard]] bool is_loaded(const Model& at) const;
  void start(const Model& at, Point& point) const;
  void give_back_hidden(const Model& at, Point& point);
  void add_batch(const Batch& of, const Model& at, const Wanted& wanted, Point& point);
  void gather_light(const Batch& of, const Model& at, const Wanted& wanted);
  void add_logs(const Batch& of, Point& point) const;
  void add_target(const Batch& of, std::size_t t, const Model& at, const Wanted& wanted,
                  Point& point);
  void add_width(const Batch& of, std::size_t t, const Model& at, const Wanted& wanted,
                 Point& point);
  [[nodiscard]] std::array<double, most_powers> sums_with_powers(const Column& column,
                                                                 const Wanted& wanted,
                                                                 std::size_t count) const;
  void add_products(std::size_t count, Point& point) const;
  // How much longer the pattern is when it comes back, in the tagger's clock.
  [[nodiscard]] double dilation(const DelayTrack& track) const;

  const PulseShape& shape_;
  const PulseTrain& train_;
  const LikelihoodKernels& kernels_;
  NearPhotons near_;
  std::optional<HiddenLight> hidden_;
  const FoldedFrame* frame_ = nullptr;
  Exposure exposure_;
  std::vector<double> offset_, h_, d1_, d2_;  // of each entry: the configured pulse
  Model loaded_;                              // whose tracks and width these are for
  // Of a batch: scratch.
  std::array<Light, most_targets> light_;
  Column intensity_, inverse_, width_, over_, first_, density_, second_;
  std::array<Column, most_powers> powers_;  // root weight times 1, s, s^2, P_2, s P_2, P_2^2
  Columns columns_;
};

}  // namespace splid::likelihood
