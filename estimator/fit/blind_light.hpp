#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "estimator/fold/blind_time.hpp"
#include "estimator/fold/near_set.hpp"
#include "estimator/model/pulse_shape.hpp"
#include "estimator/model/pulse_train.hpp"

namespace splid {

struct Exposure;

// The light that came while a frame's detector was blind, as a function of the line that it came
// on: the amplitude of the pulses' parts that the blind times cover,
//   B = sum over blind times [u, w) of sum_p a_p (H(w - x_p) - H(u - x_p)),
// with H the integral of the pulse's shape and x_p the arrival of pulse p. The integral of the
// intensity over the time that the detector was alive is S (amplitude of the frame - B) + b (time
// seen - time blind); the rest of the likelihood is that of an ideal detector.
//
// A pulse whose window holds neither end of a blind time is covered as a whole or not at all. These
// are counted once for each collect(), by looking up how much light the comb has sent up to each
// end. Only the ends near a pulse are integrated over, for each line anew.
//
// Threads: one thread for each object. Errors: none. No allocation in the calls for frames of up to
// max_photons.
class BlindLight {
 public:
  // most_entries: pairs of a photon and a pulse near it that a frame can have.
  BlindLight(const PulseShape& shape, std::size_t max_photons, std::size_t most_entries);

  // frame: with its blind times. photons: collected from it just now, with the arguments that
  // follow.
  void collect(const FoldedFrame& frame, const NearSet& photons,
               std::span<const CombWindow> windows, const PulseTrain& train,
               double gather_width_ns);

  // B and its derivatives by delay (1) and travel (2) of the line, in ns.
  struct Amplitude {
    double value = 0;
    double d1 = 0, d2 = 0;
    double d11 = 0, d12 = 0, d22 = 0;
  };
  // The values of a shape at the entries of the photons' near set, on the line that is asked for.
  struct Values {
    std::span<const double> offset, h, d1;
  };
  // photons, at_photons: as they were collected, and as they are at `line`.
  Amplitude at(const NearSet& photons, const Values& at_photons, const Exposure& exposure,
               DelayLine line);

 private:
  void add(const NearSet& edges, const Values& values, double sign, const Exposure& exposure,
           DelayLine line, Amplitude& sum);
  void evaluate(const NearSet& edges, const Exposure& exposure, DelayLine line);

  const PulseShape& shape_;
  NearSet ends_, begins_;
  double share_ = 1;
  double covered_ = 0;                              // by pulses that are covered as a whole
  std::vector<double> offset_, h_, d1_, d2_, sum_;  // scratch: one value for each entry
};

// The offsets of a near set's entries in their detected pulses, on a line near that of the set.
void offsets_on(const NearSet& near, const Exposure& exposure, DelayLine line,
                std::vector<double>& offsets_ns);

}  // namespace splid
